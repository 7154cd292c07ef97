"""Run a command of the solver in the warm process, or in a new one if there is no warm one.

    python -IS solver/commands/warm.py BENCHMARK COMMAND …

Python with all packages takes 0.4 to 0.8 s to start, a small case 0.1 s to solve. This client
imports none of them; `solver.commands.server`, at the socket that the environment names, forks for
each command. Exit status, output and files are those of the command. The file BENCHMARK gets its
wall and processor time (s) and largest resident memory (MB).
"""

import json
import os
import signal
import socket
import sys
import time
from contextlib import suppress

# The package's folder: this file runs as a script, without a package.
PACKAGE = os.path.abspath(__file__).rsplit("/", 3)[1]  # noqa: PTH100 -- pathlib is long to import
SOCKET = "WARM_SOLVER"
LIMIT = 1 << 16  # bytes of a message
# A fork keeps the number of threads with which its libraries were loaded.
THREADS = "OMP_NUM_THREADS"
GREETING = b"ready"
# Seconds to wait for the server's greeting, which comes once all its packages are loaded.
PATIENCE = 30.0


def main(benchmark: str, command: list[str]) -> int:
    """The exit status of the command, as in a shell."""
    # The command handles Ctrl-C; this process waits for its end.
    signal.signal(signal.SIGINT, lambda *_: None)
    started = time.monotonic()
    place = os.environ.get(SOCKET)
    ended = _warm(place, command) if place else None
    if ended is None:
        cold = [sys.executable, "-Es", "-m", PACKAGE, *command]
        ended = outcome(os.spawnv(os.P_NOWAIT, sys.executable, cold))
    _write_benchmark(benchmark, time.monotonic() - started, ended)
    status = os.waitstatus_to_exitcode(ended["status"])
    return status if status >= 0 else 128 - status


def outcome(process: int) -> dict:
    """Wait for a child; its wait status, processor time (s), memory (kB)."""
    _, status, used = os.wait4(process, 0)
    return {
        "status": status,
        "cpu_time": used.ru_utime + used.ru_stime,
        "max_rss": used.ru_maxrss,
    }


def _warm(place: str, command: list[str]) -> dict | None:
    """The outcome of the command in a fork; None without an answer.

    A server that does not greet in time hangs. Its socket is removed, so that no later client asks
    it. It never runs the command, which is sent after the greeting.
    """
    request = {"command": command, "threads": os.environ.get(THREADS)}
    with socket.socket(socket.AF_UNIX) as connection:
        try:
            connection.settimeout(PATIENCE)
            connection.connect(place)
            if connection.recv(len(GREETING)) != GREETING:
                return None
            connection.settimeout(None)
            socket.send_fds(connection, [json.dumps(request).encode()], [1, 2])
            return json.loads(connection.recv(LIMIT) or "null")
        except TimeoutError:
            with suppress(OSError):
                os.unlink(place)  # noqa: PTH108 -- pathlib is long to import
        except OSError:
            pass
    return None


def _write_benchmark(path: str, seconds: float, ended: dict) -> None:
    took = f"{seconds:.4f}\t{ended['cpu_time']:.2f}\t{ended['max_rss'] * 1024 / 1e6:.2f}"
    with open(path, "w", encoding="utf-8") as file:  # noqa: PTH123 -- pathlib is long to import
        print("seconds\tcpu_seconds\tpeak_memory_mb", took, sep="\n", file=file)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
