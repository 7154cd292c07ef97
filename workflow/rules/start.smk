"""Before jobs run: lock the folder, remove results that cannot be kept, start what jobs are forks of."""

import atexit
import ctypes
import fcntl
import logging
import shutil
import signal
import socket
import tempfile

from snakemake.settings.enums import Quietness


def take_lock():
    """Keep other runs out of this folder; the system frees the lock when this one ends or is killed.

    Snakemake's own locks stay behind when a run is killed, so they are off.
    """
    Path(".snakemake").mkdir(exist_ok=True)
    lock = Path(".snakemake/run.lock").open("w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        refuse(f"{Path.cwd()}: another run is at work in this folder; wait until it ends")
    return lock


def report_progress():
    """Report the jobs in place of Snakemake's own lines; nothing in a quiet run."""
    settings, progress = workflow.output_settings, part("commands.progress")
    quiet = {Quietness.PROGRESS, Quietness.ALL} & set(settings.quiet or ())
    for handler in logger.handlers:
        if quiet and handler.name == "DefaultStreamHandler":
            handler.setLevel(logging.WARNING)
        if not settings.verbose and handler.name == "DefaultStreamHandler":
            handler.addFilter(lambda record: not progress.hides(record))
    if not quiet:
        logger.addFilter(progress.Progress(sys.stdout))


def begin_warm():
    """Start the warm process, which forks for each job on this machine and ends with the run.

    Jobs wait until it has loaded its packages; without it each loads them itself. On other systems
    than Linux libraries start threads, and forks may hang.
    """
    if sys.platform != "linux" or not workflow.local_exec:
        return
    folder = tempfile.TemporaryDirectory()
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(f"{folder.name}/warm")
        listener.listen()
        server = subprocess.Popen(
            [sys.executable, "-EsP", ENTRY, "serve", str(listener.fileno())],
            stdin=subprocess.PIPE,  # closed when this run ends
            pass_fds=[listener.fileno()],
            env={**os.environ, **dict.fromkeys(part("system.process").THREADS, "1")},
        )
    os.environ["WARM_SOLVER"] = f"{folder.name}/warm"
    atexit.register(end_warm, server, folder)


def end_warm(server, folder):
    """Let the warm process end; one that hangs is killed."""
    try:
        server.communicate(timeout=10)
    except subprocess.TimeoutExpired:
        server.kill()
    folder.cleanup()


def leave_with_make():
    """End after the jobs at work when the shell of `make` dies: TERM to make ends that alone."""
    if sys.platform == "linux" and os.environ.pop("LEAVE_WITH_MAKE", ""):
        set_death_signal = 1
        ctypes.CDLL(None).prctl(set_death_signal, signal.SIGTERM)


def begin(record):
    """A filter of the log that lets all through: before the first job. A module has no `onstart`."""
    if str(getattr(record, "event", None)) == "run_info":
        Path(RUN_LIST).write_text("".join(f"{job.folder}\n" for job in RUN.values()))
        begin_warm()
    return True


# A dry run changes nothing, and Snakemake reports it well.
if workflow.is_main_process and not workflow.output_settings.dryrun:
    LOCK = take_lock()  # as long as this process lives
    for job in RUN.values():
        if not (job.damaged or job.stale):
            continue
        if job.stale and job.mesh_folder:
            shutil.rmtree(job.mesh_folder, ignore_errors=True)
        shutil.rmtree(job.folder)
        # Whatever the target, the report of what is missing is missing too.
        Path("results/report/summary.json").unlink(missing_ok=True)
    leave_with_make()
    report_progress()
    logger.addFilter(begin)
