"""Memory: what a solve takes at least, what the machine has, and the refusal where that is less.

Measured as peak resident memory of solves of all cell types, 547 of them with a factor by PARDISO
and 20,000 to 640,000 unknowns: 100 MB for the program, then by unknown (of nodes times dimensions)
1.9 to 7.4 kB in the plane and 4.4 to 16 kB in space, the less the more elongated the bodies are.
With multigrid it is 1.9 (TETRA4) to 4.1 kB (HEXA20), for HEXA8 cubes 2.3 to 2.4 kB from 500,000
to 1,000,000 unknowns. A solve is refused by the least figure, so that none is
refused that fits; the usual one is for a warning, and a cluster is asked for the most, since a
factor may have to take over.
"""

import resource
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from solver.system.errors import MachineError

# Bytes of the program, with what every hierarchy of multigrid takes, and by unknown.
_LEAST = {2: (100e6, 1.8e3), 3: (100e6, 1.6e3)}
_USUAL = {2: (100e6, 3.0e3), 3: (200e6, 2.2e3)}
_MOST = {2: (100e6, 7.4e3), 3: (100e6, 16.0e3)}
# A cgroup without a limit has a number near 2⁶³ for one.
_NO_LIMIT = 1 << 60


@dataclass(frozen=True)
class Need:
    """Memory (bytes) of a solve: at least, usually, and at most."""

    least: float
    usual: float
    most: float


def needed(points: float, dim: int) -> Need:
    """The memory of a solve on a mesh of so many points."""
    kinds = (kind[dim] for kind in (_LEAST, _USUAL, _MOST))
    return Need(*(program + by_unknown * points * dim for program, by_unknown in kinds))


def peak_mb(used: resource.struct_rusage) -> float:
    """The largest resident memory of a process, MB, of what the system tells of it in KiB."""
    return used.ru_maxrss * 1024 / 1e6


def available() -> float:
    """Memory (bytes) that this process can still get; infinite where nothing tells.

    The least of what is free (swap included), what its cgroups and its own limit leave.
    """
    return min([float("inf"), *_free(), *_cgroups(), *_own_limit()])


def check_memory(
    points: int, dim: int, where: object, log: Callable[[str], object], free: float | None = None
) -> None:
    """Raise MachineError where a solve on a mesh of `points` cannot fit; warn where it may not.

    `where` is the file to name, `free` the memory there is, as `available` tells.
    """
    need, free = needed(points, dim), available() if free is None else free
    if need.least > free:
        raise MachineError(
            where,
            "memory",
            f"{points * dim} unknowns",
            f"needs at least {_gigabytes(need.least)}, {_gigabytes(free)} are free; what helps: a "
            "coarser mesh, fewer solves at a time (CORES=1), a larger machine; "
            "to try all the same: --no-memory-check",
        )
    if need.usual > free:
        log(f"memory may run out: about {_gigabytes(need.usual)} of {_gigabytes(free)} free")


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.2g} GB"


def _free() -> Iterator[float]:
    fields = _fields("/proc/meminfo")
    if "MemAvailable" in fields:
        yield 1024 * (fields["MemAvailable"] + fields.get("SwapFree", 0))


def _cgroups() -> Iterator[float]:
    """What each limit of version 2 or 1 leaves, file cache counted as free."""
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
        # In a container the path may be that of the host: then its own group is the root.
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
