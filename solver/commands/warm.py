"""Run a command of the solver in the warm process, or in a new one if there is no warm one.

    python -IS solver/commands/warm.py BENCHMARK COMMAND …

Python with all packages takes 0.4 to 0.8 s to start, a small case 0.1 s to solve. This client
imports none of them; `solver.commands.server`, at the socket that the environment names, forks for
each command. Exit status, output and files are those of the command. The file BENCHMARK gets its
wall and processor time (s) and largest resident memory (MB).
"""

# `signal` and `socket` without their enumerations: with these, and with `json`, this process takes
# 26 ms of processor time, without them 12 ms.
import _signal  # type: ignore[import-not-found]
import _socket
import os
import sys
import time

TYPE_CHECKING = False  # `typing` is long to import
if TYPE_CHECKING:
    import resource

# This file runs as a script, without a package.
ENTRY = os.path.abspath(__file__).rsplit("/", 2)[0] + "/__main__.py"  # noqa: PTH100 -- pathlib is long to import
SOCKET = "WARM_SOLVER"
LIMIT = 1 << 16  # bytes of a message; a longer command runs in a new process
# A fork keeps the number of threads with which its libraries were loaded.
THREADS = "OMP_NUM_THREADS"
GREETING = b"ready"
# Seconds to wait for the server's greeting, which comes once all its packages are loaded.
PATIENCE = 30.0


def main(benchmark: str, command: list[str]) -> int:
    """The exit status of the command, as in a shell."""
    started = time.monotonic()
    place = os.environ.get(SOCKET)
    ended = _warm(place, command) if place else b""
    if not ended:
        # The command handles Ctrl-C; this process waits for its end.
        _signal.signal(_signal.SIGINT, lambda *_: None)
        cold = [sys.executable, "-EsP", ENTRY, *command]
        process = os.spawnv(os.P_NOWAIT, sys.executable, cold)
        ended = answer(*os.wait4(process, 0)[1:])
    how, cpu_seconds, peak_memory = ended.decode().split()
    took = f"{time.monotonic() - started:.4f}\t{cpu_seconds}\t{peak_memory}"
    with open(benchmark, "w", encoding="utf-8") as file:  # noqa: PTH123 -- pathlib is long to import
        print("seconds\tcpu_seconds\tpeak_memory_mb", took, sep="\n", file=file)
    status = os.waitstatus_to_exitcode(int(how))
    return status if status >= 0 else 128 - status


def _warm(place: str, command: list[str]) -> bytes:
    """How the command ended in a fork, as `answer` writes it; empty without an answer.

    A server that does not greet in time hangs. Its socket is removed, so that no later client asks
    it. It never runs the command, which is sent after the greeting. Ctrl-C shuts the connection for
    writing; the server passes it on to the fork, also where that did not exist yet.
    """
    connection = _socket.socket(_socket.AF_UNIX)
    try:
        connection.settimeout(PATIENCE)
        connection.connect(place)
        if connection.recv(len(GREETING)) != GREETING:
            return b""
        connection.settimeout(None)
        _signal.signal(_signal.SIGINT, lambda *_: _interrupt(connection))
        streams = b"".join(number.to_bytes(4, sys.byteorder) for number in (1, 2))
        rights = _socket.SOL_SOCKET, _socket.SCM_RIGHTS, streams
        connection.sendmsg([request(os.environ.get(THREADS, ""), command)], [rights])
        return connection.recv(LIMIT)
    except TimeoutError:
        _forget(place)
    except OSError:
        pass
    finally:
        connection.close()
    return b""


def _interrupt(connection: "_socket.socket") -> None:
    try:  # noqa: SIM105 -- contextlib is long to import
        connection.shutdown(_socket.SHUT_WR)
    except OSError:
        pass


def _forget(place: str) -> None:
    try:  # noqa: SIM105 -- contextlib is long to import, and so is pathlib
        os.unlink(place)  # noqa: PTH108
    except OSError:
        pass


def request(threads: str, command: list[str]) -> bytes:
    """The message of a client: how many threads the command has, and its words, counted."""
    return "\0".join([threads, str(len(command)), *command, ""]).encode("utf-8", "surrogateescape")


def words(message: bytes, threads: str) -> list[str]:
    """The command in a client's message; empty where it was cut off, or has other `threads`."""
    asked, *rest = message.decode("utf-8", "surrogateescape").split("\0")
    counted, command = rest[:1], rest[1:-1]
    return command if asked == threads and counted == [str(len(command))] else []


def answer(status: int, used: "resource.struct_rusage") -> bytes:
    """How a process ended: wait status, processor time (s), largest resident memory (MB)."""
    cpu_seconds, peak_memory = used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e6
    return f"{status} {cpu_seconds:.2f} {peak_memory:.2f}".encode()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
