"""Jobs sent elsewhere: what they ask for, and what becomes of those that are ended from outside."""

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
    from solver.mesh.size import Size

    return Size(job.points * refine**job.dim, job.dim)


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


# What was said of each job that failed, by what it should have made.
FAILURES = {}


def note_failure(record):
    """A filter of the log that lets all through."""
    if getattr(record, "event", None) == LogEvent.JOB_ERROR:
        FAILURES.update(dict.fromkeys(record.output, record))
    return True


logger.addFilter(note_failure)


def reason_of(failure):
    """Why a job failed, in one line: what the executor says, and the first error that it, or the log
    it kept of the job, names."""
    said = failure.rule_msg or ""
    logs = [log for log in map(str, failure.log) if not log.startswith("results/")]
    texts = [
        Path(log).read_text("utf-8", errors="replace")
        for log in logs
        if os.path.isfile(log)
    ]
    lines = "\n".join([said, *texts]).splitlines()
    errors = [
        line.partition("error: ")[2].strip(" *'") for line in lines if "error: " in line
    ]
    parts = filter(None, [said.split(". ")[0], *errors[:1]])
    return ": ".join(parts) or "ended from outside"


def give_verdict(job, failure):
    """The verdict `crashed` for a job of the batch that was not left to write one itself."""
    from solver.verification.run import Job as Solve
    from solver.verification.run import record_crash

    folder = Path(results_of(job))
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "log").open("a", encoding="utf-8") as file:
        file.write(f"{reason_of(failure)}\n")
    solve = Solve(Path(job.file), swapped=job.swap, hexahedra=job.hexahedra)
    record_crash(solve, folder / "verdict.json", folder / "log")


def report_failures():
    """Give jobs that were ended from outside their verdict, and write the report that waits for it.

    Snakemake's own rule cannot: what it needs was not made in this run. The next run does these
    jobs again, and finds the list of failures too old to be true.
    """
    lost = 0
    for job in RUN.values():
        made = [results_of(job), *mesh_folder(job)]
        failure = next((FAILURES[file] for file in made if file in FAILURES), None)
        if failure and not Path(verdict_of(job)).exists():
            give_verdict(job, failure)
            lost += 1
    verdicts = [verdict_of(job) for job in RUN.values()]
    if lost and all(map(os.path.exists, verdicts)):
        command = [sys.executable, "-Es", "-m", "solver", "report"]
        command += f"--list {VERDICTS} --older {OLDER_VERDICTS}".split()
        command += ["-o", "results/report"]
        subprocess.run([*command, "--families", *FAMILY_FILES])
        os.utime("results/report/failures.txt", (1, 1))


# Whether somebody has pressed Ctrl-C.
INTERRUPTED = []


onerror:
    if not INTERRUPTED:
        report_failures()
