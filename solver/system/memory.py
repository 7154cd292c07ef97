"""Memory: what the machine has, and what a process has used."""

import ctypes
import resource
from collections.abc import Iterator
from pathlib import Path

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
