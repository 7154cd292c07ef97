"""Before jobs run: lock the folder, report progress, keep the warm process."""

import atexit
import fcntl
import logging
import signal

from snakemake.settings.enums import Quietness

from workflow.progress import Progress, hides


def take_lock():
    """Keep other runs out of this folder; the system frees the lock when this one ends or is killed.

    Snakemake's own locks stay behind when a run is killed, so they are off.
    """
    lock = Path(".snakemake/run.lock").open("a+")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.seek(0)
        refuse(
            f"{Path.cwd()}: another run is at work in this folder ({lock.read().strip()}); "
            "wait until it ends, or end it"
        )
    except OSError:
        return lock  # a file system without locks
    lock.truncate(0)
    lock.write(f"process {os.getpid()} on {os.uname().nodename}\n")
    lock.flush()
    return lock


# The lock, as long as this process lives.
HELD = []


def note_interruption(*_):
    """Ctrl-C: what has no verdict then has not failed."""
    INTERRUPTED.append(True)
    raise KeyboardInterrupt


def report_progress():
    """Report the jobs in place of Snakemake's own lines; nothing in a quiet run."""
    settings, handlers = workflow.output_settings, logger.handlers
    if settings.dryrun:  # Snakemake reports it well
        return
    shown = [each for each in handlers if each.name == "DefaultStreamHandler"]
    for handler in [] if settings.verbose else shown:
        handler.addFilter(lambda record: not hides(record))
    if {Quietness.PROGRESS, Quietness.ALL} & set(settings.quiet or ()):
        for handler in shown:
            handler.setLevel(logging.WARNING)
        return
    progress = Progress(sys.stdout, sys.stderr)
    logger.addFilter(progress)
    atexit.register(progress.close)


# Not in a dry run, which changes nothing.
onstart:
    if workflow.is_main_process:
        HELD.append(take_lock())
        list_verdicts()
        signal.signal(signal.SIGINT, note_interruption)
        begin_warm()


def forget_marker():
    """Remove the marker that a failed or killed run has left: it must never exist."""
    if not os.path.isfile(AGAIN):
        return
    with open(".snakemake/run.lock", "a+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return  # another run is at work
        os.unlink(AGAIN)


onerror:
    if workflow.is_main_process and os.path.isfile(AGAIN):
        os.unlink(AGAIN)


if workflow.is_main_process:
    if not workflow.output_settings.dryrun:
        forget_marker()
    report_progress()
