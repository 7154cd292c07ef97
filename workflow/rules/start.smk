"""Before a run: the folder is this run's alone, and what an earlier one was kept from is due again."""

import atexit
import fcntl
import logging
import socket
import subprocess
import tempfile
import time
from glob import glob
from threading import Thread

from snakemake.scheduling.job_scheduler import JobScheduler
from snakemake.settings.enums import Quietness

from workflow.progress import Progress, hides


def take_lock():
    """Keep other runs out of this folder while this one lives; the system frees it with a kill.

    Snakemake's own locks stay behind when a run is killed, so they are off.
    """
    place = Path(".snakemake") / "run.lock"
    place.parent.mkdir(exist_ok=True)
    lock = place.open("a+")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.seek(0)
        raise WorkflowError(
            f"{Path.cwd()}: another run is at work in this folder ({lock.read().strip()}); "
            "wait until it ends, or end it"
        ) from None
    except OSError:
        return lock  # a file system without locks
    lock.truncate(0)
    lock.write(f"process {os.getpid()} on {os.uname().nodename}\n")
    lock.flush()
    return lock


def survive_termination():
    """Let Snakemake end on SIGTERM: its handler takes a lock that the code it interrupts may hold.

    In a thread of its own the handler gets that lock as soon as it is free.
    """
    ending = JobScheduler.exit_gracefully
    JobScheduler.exit_gracefully = lambda *of: Thread(target=ending, args=of).start()


def tell_progress():
    """Say what becomes of the jobs in place of what Snakemake says; where it is quiet, nothing."""
    settings, handlers = workflow.output_settings, logger.handlers
    if settings.dryrun:  # which Snakemake tells well
        return
    shown = [each for each in handlers if each.name == "DefaultStreamHandler"]
    if {Quietness.PROGRESS, Quietness.ALL} & set(settings.quiet or ()):
        for handler in shown:
            handler.setLevel(logging.WARNING)
        return
    progress = Progress(sys.stdout, sys.stderr)
    logger.addFilter(progress)
    atexit.register(progress.close)
    for handler in [] if settings.verbose else shown:
        handler.addFilter(lambda record: not hides(record))


def check_writable():
    """Say in one line what Snakemake would meet in the midst of its work."""
    folders = [Path(verdict_of(job)).parent for job in RUN.values()]
    for folder in (
        Path(".snakemake"),
        Path("results"),
        Path("results/report"),
        *folders,
    ):
        if folder.exists() and not os.access(folder, os.W_OK | os.X_OK):
            raise WorkflowError(
                f"{folder}: nothing can be written into this folder: "
                "give yourself the permission, or work in a copy of the project"
            )


def mesh_made_for(job):
    return Path(f"results/{job.family}/{job.case}/mesh.vtkhdf")


def forget_transient():
    """Remove what the machine was to blame for (memory, disk, a kill), so that it is done again.

    A mesh that was not made goes with the verdicts that say so. With them goes what the gates
    look at: Snakemake misses only files that something to be made is made from.
    """
    unmade = {mesh for mesh in map(mesh_made_for, RUN.values()) if is_reason(mesh)}
    of_batch = {
        Path(verdict_of(job))
        for job in RUN.values()
        if mesh_made_for(job) in unmade or is_transient(Path(verdict_of(job)))
    }
    levels = set(
        filter(is_transient, map(Path, glob("results/orders/*/*/*/verdict.json")))
    )
    reports = Path("results/report")
    gates = {reports / "passed", reports / "failures.txt"} if of_batch else set()
    gates |= {reports / "orders-failures.txt"} if levels else set()
    for file in unmade | of_batch | levels | gates:
        file.unlink(missing_ok=True)


def is_transient(verdict):
    return verdict.is_file() and '"transient": true' in verdict.read_text("utf-8")


def is_reason(mesh):
    """Whether a mesh is none, but the line that says why."""
    return mesh.is_file() and mesh.open("rb").read(8) != b"\x89HDF\r\n\x1a\n"


def date_now():
    """Date files of the future now, after the clock went back: Snakemake goes by their order."""
    now = time.time()
    stamps = {*SOLVER_SOURCES, *REPORT_SOURCES, *MESH_SOURCES}
    files = {*glob("results/**", recursive=True)} | stamps | MESHES
    files |= {job.file for job in BATCH.values()}
    for file in filter(os.path.exists, files):
        if os.stat(file).st_mtime > now and os.access(file, os.W_OK):
            os.utime(file)


def is_warm(job):
    """Whether a job asks the warm process; beside what is timed none is started."""
    return "{SOLVER}" in (job.rule.shellcmd or "")


def keep_warm():
    """Start the process that forks for each job of this run, and ends with it.

    It listens from now on and answers once it is warm; without it jobs start from nothing.
    """
    from solver.system.process import THREADS

    folder = tempfile.TemporaryDirectory()
    with socket.socket(socket.AF_UNIX) as listener:
        try:
            listener.bind(f"{folder.name}/warm")
        except OSError:
            return  # a file system without sockets, or too long a name
        listener.listen()
        server = subprocess.Popen(
            [sys.executable, "-Es", "-m", "solver", "serve", str(listener.fileno())],
            stdin=subprocess.PIPE,  # its end tells that this run has ended
            pass_fds=[listener.fileno()],
            env={**os.environ, **dict.fromkeys(THREADS, "1")},
        )
    os.environ["WARM_SOLVER"] = f"{folder.name}/warm"
    atexit.register(folder.cleanup)
    atexit.register(end_warm, server)


def end_warm(server):
    """Let the warm process end; one that hangs is killed."""
    try:
        server.communicate(timeout=10)
    except subprocess.TimeoutExpired:
        server.kill()


onstart:
    if workflow.is_main_process and workflow.local_exec:
        # Each look for jobs to start sets a timer for another one, so that there are ever more.
        workflow.scheduler.job_rate_limiter = None
        # Elsewhere the system's own libraries start threads, and forks may hang.
        if sys.platform == "linux" and any(
            map(is_warm, workflow.dag.needrun_jobs())
        ):
            keep_warm()


# A dry run as well: else it would not tell what is due again.
if workflow.is_main_process:
    check_writable()
    LOCK = take_lock()
    survive_termination()
    forget_transient()
    date_now()
    tell_progress()
