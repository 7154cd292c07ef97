"""Jobs sent elsewhere: what they ask for, and what becomes of those that are ended from outside."""

import atexit

from snakemake_interface_logger_plugins.common import LogEvent

# In a job Snakemake runs in Snakemake, with its plugins' libraries: memory beside the solve's own.
AROUND_MB = 900
# From a cold shared folder three interpreters start before the solve does.
START_MINUTES = 10
# Contact takes several linear solves, and a node may be slower than where the model was measured.
SLACK = 10
# What asks for more (bytes, seconds) is for the solver to refuse, by its own estimate.
MOST_MEMORY, MOST_SECONDS = 1e15, 1e9


def memory(job, attempt):
    """Megabytes that a job of this case asks for, more each time it has to be run again."""
    return attempt * round(AROUND_MB + min(job.size.memory.most, MOST_MEMORY) / 1e6)


def seconds(job):
    """Estimated seconds of a case, the priority of its jobs: the longest cases start first."""
    return min(job.size.seconds, MOST_SECONDS)


def minutes(job, attempt):
    """Minutes that a job of this case asks for, more each time it has to be run again."""
    return attempt * round(START_MINUTES + SLACK * seconds(job) / 60)


# What the executor said of each job that failed, by what it should have made.
FAILURES = {}


def note_failure(record):
    """A filter of the log that lets all through."""
    if getattr(record, "event", None) == LogEvent.JOB_ERROR:
        FAILURES.update(dict.fromkeys(record.output, record.rule_msg or ""))
    return True


logger.addFilter(note_failure)


def report_failures():
    """Give jobs that were ended from outside the verdict `crashed`, and write the report.

    Snakemake's own rule cannot: what it needs was not made in this run. The next run does these
    jobs again.
    """
    if INTERRUPTED or not FAILURES:
        return
    program = [sys.executable, "-Es", "-m", PACKAGE]
    lost = [
        job
        for job in RUN.values()
        if {job.folder, job.mesh_folder} & FAILURES.keys()
        and not os.path.isfile(job.verdict)
    ]
    for job in lost:
        said = FAILURES.get(job.folder) or FAILURES.get(job.mesh_folder, "")
        log = Path(job.folder, "log")
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(f"{said.split('. ')[0] or 'ended from outside'}\n")
        solve = ["crashed", job.file, *shlex.split(job.options), "--log", log]
        subprocess.run([*program, *solve, "--verdict", job.verdict])
    if lost:
        command = f"report --list {VERDICTS} --older {OLDER_VERDICTS} -o results/report".split()
        subprocess.run([*program, *command, "--families", *FAMILY_FILES])
        # Too old to be true for the next run.
        os.utime("results/report/failures.txt", (1, 1))


# At the end of this process: a module has no handler `onerror`.
if RUNS:
    atexit.register(report_failures)
