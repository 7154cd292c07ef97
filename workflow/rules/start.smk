"""Before jobs run: lock the folder, remove results that cannot be kept, report progress."""

import fcntl
import logging
import shutil
import signal

from snakemake.settings.enums import Quietness

# Whether somebody has pressed Ctrl-C: what has no verdict then has not failed.
INTERRUPTED = []


def take_lock():
    """Keep other runs out of this folder; the system frees the lock when this one ends or is killed.

    Snakemake's own locks stay behind when a run is killed, so they are off.
    """
    Path(".snakemake").mkdir(exist_ok=True)
    lock = Path(".snakemake/run.lock").open("w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        refuse(
            f"{Path.cwd()}: another run is at work in this folder; wait until it ends"
        )
    return lock


def remove_damaged():
    """Remove results that cannot be kept, so that Snakemake finds them missing."""
    for job in RUN.values():
        if is_damaged(job):
            shutil.rmtree(job.folder)
        if is_damaged_mesh(job):
            shutil.rmtree(job.mesh_folder)


def note_interruption(*_):
    INTERRUPTED.append(True)
    raise KeyboardInterrupt


def report_progress():
    """Report the jobs in place of Snakemake's own lines; nothing in a quiet run."""
    settings = workflow.output_settings
    shown = [each for each in logger.handlers if each.name == "DefaultStreamHandler"]
    quiet = {Quietness.PROGRESS, Quietness.ALL} & set(settings.quiet or ())
    for handler in shown:
        if quiet:
            handler.setLevel(logging.WARNING)
        if not settings.verbose:
            handler.addFilter(
                lambda record: not part("commands.progress").hides(record)
            )
    if not quiet:
        logger.addFilter(part("commands.progress").Progress(sys.stdout))


def begin(record):
    """A filter of the log that lets all through: before the first job. A module has no `onstart`."""
    if str(getattr(record, "event", None)) == "run_info":
        signal.signal(signal.SIGINT, note_interruption)
        list_verdicts()
        begin_warm()
    return True


# A dry run changes nothing, and Snakemake reports it well.
RUNS = workflow.is_main_process and not workflow.output_settings.dryrun
if RUNS:
    LOCK = take_lock()  # as long as this process lives
    remove_damaged()
    report_progress()
    logger.addFilter(begin)
