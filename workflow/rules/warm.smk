"""The warm process, which forks for each job of a run and ends with it."""

import atexit
import socket
import tempfile

# The process with its folder, once it has started; whether a job uses it.
WARM = []
USED = []


def can_be_warm():
    """Whether this run can have a warm process."""
    # On other systems libraries start threads, and forks may hang.
    linux = sys.platform == "linux"
    here = workflow.is_main_process and workflow.local_exec
    return linux and here and not workflow.output_settings.dryrun


def begin_warm(*folders):
    """Start the warm process; it first lists the jobs of `folders`, as the command `jobs` does.

    It loads its packages while this run is planned.
    """
    from solver.system.process import THREADS

    folder = tempfile.TemporaryDirectory()
    with socket.socket(socket.AF_UNIX) as listener:
        try:
            listener.bind(f"{folder.name}/warm")
        except OSError:
            return  # a file system without sockets, or too long a name
        listener.listen()
        serve = ["-m", "solver", "serve", str(listener.fileno()), *folders]
        server = subprocess.Popen(
            [sys.executable, "-Es", *serve],
            stdin=subprocess.PIPE,  # closed when this run ends
            stdout=subprocess.PIPE,
            pass_fds=[listener.fileno()],
            env={**os.environ, **dict.fromkeys(THREADS, "1")},
        )
    WARM.append((server, folder))
    atexit.register(end_warm)


def listed_warm(folders):
    """The list of jobs from the warm process; empty without one, and where it cannot list them.

    It starts where the last batch has not passed, or there was none: this one has jobs then.
    """
    if can_be_warm() and not os.path.isfile("results/report/passed"):
        begin_warm(*folders)
    return WARM[0][0].stdout.readline().decode().strip() if WARM else ""


def is_warm(job):
    """Whether a job uses the warm process; none is kept beside timed jobs."""
    return "{SOLVER}" in (job.rule.shellcmd or "")


def keep_warm():
    """Have a warm process if a job of this run uses it, else none.

    Jobs wait until it has loaded its packages; without it each loads them itself.
    """
    if can_be_warm() and any(map(is_warm, workflow.dag.needrun_jobs())):
        if not WARM:
            begin_warm()
        for _, folder in WARM:
            os.environ["WARM_SOLVER"] = f"{folder.name}/warm"
            USED.append(folder)
    else:
        end_warm()


def end_warm():
    """Let the warm process end; one that nobody uses, or that hangs, is killed."""
    while WARM:
        server, folder = WARM.pop()
        if not USED:
            server.kill()
        try:
            server.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            server.kill()
        folder.cleanup()
