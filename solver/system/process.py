"""A command in a separate process: pinned to cores, stopped at a limit, measured; and memory."""

import ctypes
import os
import resource
import signal
import subprocess
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Timer

from .progress import now, processor_time

# A cgroup without a limit has a number near 2⁶³ for one.
_NO_LIMIT = 1 << 60


def peak_mb(used: resource.struct_rusage) -> float:
    """The largest resident memory of a process, MB; the system reports KiB."""
    return used.ru_maxrss * 1024 / 1e6


def release() -> None:
    """Give freed memory back to the system, which the C library of Linux keeps for later."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim:
        trim(0)


def available() -> float:
    """Memory (bytes) that this process can still get; infinite if unknown.

    The minimum of the free memory (swap included) and the rest of the limits of its cgroups and
    of the process itself.
    """
    return min([float("inf"), *_free(), *_cgroups(), *_own_limit()])


def _free() -> Iterator[float]:
    fields = _fields("/proc/meminfo")
    if "MemAvailable" in fields:
        yield 1024 * (fields["MemAvailable"] + fields.get("SwapFree", 0))


def _cgroups() -> Iterator[float]:
    """The rest of each cgroup limit (version 2 or 1), file cache counted as free."""
    for line in _lines("/proc/self/cgroup"):
        _, controllers, path = line.split(":", 2)
        if controllers == "":
            root, names = Path("/sys/fs/cgroup"), ("memory.max", "memory.current")
        elif "memory" in controllers.split(","):
            root = Path("/sys/fs/cgroup/memory")
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes")
        else:
            continue
        inner = root / path.lstrip("/")
        # In a container the path may be that of the host; its own group is then the root.
        for folder in dict.fromkeys([root, inner, *inner.parents]):
            limit, used = (_number(folder / name) for name in names)
            if folder.is_relative_to(root) and limit is not None and limit < _NO_LIMIT:
                cache = _fields(folder / "memory.stat").get("inactive_file", 0)
                yield limit - (used or 0) + cache


def _own_limit() -> Iterator[float]:
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        yield limit - 1024 * _fields("/proc/self/status").get("VmSize", 0)


def _number(path: Path) -> int | None:
    text = "".join(_lines(path)).strip()
    return int(text) if text.isdigit() else None


def _fields(path: str | Path) -> dict[str, int]:
    """The numbers of lines as `name: 12 kB` or `name 12`."""
    words = [line.replace(":", " ").split() for line in _lines(path)]
    return {w[0]: int(w[1]) for w in words if len(w) > 1 and w[1].isdigit()}


def _lines(path: str | Path) -> list[str]:
    try:
        return Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return []


def fork() -> int:
    """A fork, as `os.fork` makes it, in a process whose threads hold no locks."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads beside a fork
        return os.fork()


THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""The variables that set the number of threads of the libraries."""


@dataclass(frozen=True)
class FinishedProcess:
    """How a process ended: exit status (negative: by that signal), None if stopped after `limit` s.

    `output` and `problem` are its standard output and error; `wall` and `cpu` are seconds,
    children included; `peak_memory_mb` is the largest resident memory of any of them.
    """

    status: int | None
    output: str
    problem: str
    wall: float
    cpu: float
    peak_memory_mb: float
    limit: float

    @property
    def used(self) -> dict[str, float]:
        """Its cost, as returned by `used_since`."""
        return {"wall": self.wall, "cpu": self.cpu, "peak_memory_mb": self.peak_memory_mb}

    @property
    def reason(self) -> str:
        """The exit status with the last line, or the time limit; only for a process that failed.

        The last line is that of standard error, if any: the two streams have no common order.
        """
        if self.status is None:
            return f"no end within {self.limit:g} s"
        lines = (self.problem.strip() or self.output.strip()).splitlines()
        last = lines[-1].strip() if lines else "no word"
        return f"the process died with exit status {self.status}: {last}"


def used_since(started: float) -> dict[str, float]:
    """Cost of this process: wall seconds since `started`, processor seconds, peak memory (MB)."""
    return {
        "wall": now() - started,
        "cpu": processor_time(),
        "peak_memory_mb": peak_mb(resource.getrusage(resource.RUSAGE_SELF)),
    }


def cores_for(threads: int) -> list[int]:
    """The cores to which a process of `threads` threads is pinned: fewer on a smaller machine.

    These are the last cores; other work of the machine starts on the first.
    """
    return sorted(os.sched_getaffinity(0))[-threads:]


def printed_by(program: Path, *arguments: str) -> str:
    """What a program prints; empty where it is not there."""
    if not program.is_file():
        return ""
    return run_in_subprocess([str(program), *arguments], None, 60.0).output.strip()


def run_in_subprocess(
    command: Sequence[str],
    cores: Sequence[int] | None,
    limit: float,
    memory: float = float("inf"),
    folder: Path | None = None,
    environment: Mapping[str, str] = {},
) -> FinishedProcess:
    """Run a command on `cores`, its libraries with as many threads, for `limit` seconds at most.

    Without `cores` it has one thread, on any of them. `memory` (bytes) is the most that it may ask
    for, `folder` where it runs if not here, `environment` has variables beside those of this
    process. Its standard input is empty; its output is kept. What it started ends with it.
    """

    def prepare() -> None:
        if cores is not None:
            os.sched_setaffinity(0, cores)
        if memory < float("inf"):
            resource.setrlimit(resource.RLIMIT_DATA, (int(memory), int(memory)))

    threads = dict.fromkeys(THREADS, str(1 if cores is None else len(cores)))
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as problem:
        started = now()
        process = subprocess.Popen(
            command,
            cwd=folder,
            env={**os.environ, **environment, **threads},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=problem,
            preexec_fn=prepare,  # noqa: PLW1509 -- it calls the system alone
            process_group=0,
        )
        over = Event()

        def stop() -> None:
            over.set()
            _kill_group(process.pid)

        timer = Timer(limit, stop)
        timer.start()
        try:
            _, status, used = os.wait4(process.pid, 0)
        finally:
            timer.cancel()
            _kill_group(process.pid)
        wall = now() - started
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        problem.seek(0)
        said, complained = (s.read().decode(errors="replace") for s in (output, problem))
    cpu = used.ru_utime + used.ru_stime
    ending = None if over.is_set() else process.returncode
    return FinishedProcess(ending, said, complained, wall, cpu, peak_mb(used), limit)


def _kill_group(leader: int) -> None:
    """End what is left of a group of processes."""
    with suppress(ProcessLookupError):
        os.killpg(leader, signal.SIGKILL)
