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


def size_of(job, refine):
    return part("mesh.size").Size(job.points * refine**job.dim, job.dim)


def memory(job, attempt, refine=1):
    """Megabytes that a job of this case asks for, more each time it has to be run again."""
    most = size_of(job, refine).memory.most
    return attempt * round(AROUND_MB + min(most, MOST_MEMORY) / 1e6)


def seconds(job, refine=1):
    """Estimated seconds of a case, the priority of its jobs: the longest cases start first."""
    return min(size_of(job, refine).seconds, MOST_SECONDS)


def minutes(job, attempt, refine=1):
    """Minutes that a job of this case asks for, more each time it has to be run again."""
    return attempt * round(START_MINUTES + SLACK * seconds(job, refine) / 60)


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
    lost, program = 0, [sys.executable, "-Es", "-m", PACKAGE]
    for job in RUN.values():
        made = [results_of(job), *mesh_folder(job)]
        said = next((FAILURES[file] for file in made if file in FAILURES), None)
        if said is not None and not os.path.isfile(verdict_of(job)):
            log = Path(results_of(job), "log")
            log.parent.mkdir(parents=True, exist_ok=True)
            log.write_text(f"{said.split('. ')[0] or 'ended from outside'}\n")
            solve = [job.file, *shlex.split(options_of(job))]
            files = ["--log", log, "--verdict", verdict_of(job)]
            subprocess.run([*program, "crashed", *solve, *files])
            lost += 1
    if lost:
        command = f"report --list {VERDICTS} --older {OLDER_VERDICTS} -o results/report".split()
        subprocess.run([*program, *command, "--families", *FAMILY_FILES])
        # Too old to be true for the next run.
        os.utime("results/report/failures.txt", (1, 1))


# At the end of this process: a module has no handler `onerror`.
if RUNS:
    atexit.register(report_failures)
