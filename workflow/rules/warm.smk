"""The warm process, which forks for each job of a run and ends with it."""

import atexit
import socket
import tempfile


def begin_warm():
    """Start the warm process, for jobs on this machine.

    Jobs wait until it has loaded its packages; without it each loads them itself. On other systems
    than Linux libraries start threads, and forks may hang.
    """
    if sys.platform != "linux" or not workflow.local_exec:
        return
    folder = tempfile.TemporaryDirectory()
    with socket.socket(socket.AF_UNIX) as listener:
        try:
            listener.bind(f"{folder.name}/warm")
        except OSError:
            return  # a file system without sockets, or too long a name
        listener.listen()
        server = subprocess.Popen(
            [sys.executable, "-Es", "-m", PACKAGE, "serve", str(listener.fileno())],
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
