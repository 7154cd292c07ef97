"""Bytes that the stages of a multigrid solve move, beside the memory bandwidth of the machine.

A product with a matrix in blocks reads its blocks, column numbers and row starts, the vector and
the sum that it adds to, and writes the result: each counts once, by the sizes of the arrays. That
is the least that a product moves. What a small cache reads again is not counted, so a share of the
bandwidth may be higher than shown; what a large cache keeps is counted, so a share may exceed one.
Other stages read their arrays and files once at least, and write their results once; the size of
these is counted. What they move beyond, in temporary arrays, only counters of the hardware show.
Cutting and pairing touch the interface alone, and have no count.

Bandwidth is measured with the triad of STREAM, a = b + s c (McCalpin, IEEE TCCA Newsletter, 1995).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import bsr_matrix

from ..mechanics.linear.symmetric_blocks import SymmetricBlocks
from ..system.clock import processor_time
from ..system.threads import prefetch, workers
from .points import SOLVED, Record

if TYPE_CHECKING:
    from ..simulation.problem import ContactProblem
    from ..simulation.solution import Solution

# What products are for, and what they are part of.
SMOOTHER, TRANSFER, DOUBLE = "smoother and residuals", "transfer between levels", "matrix in double"
SET_UP, ITERATIONS, STAGE = "set-up", "iterations", "solve"
_PARTS = (SET_UP, ITERATIONS, SMOOTHER, TRANSFER, DOUBLE)
_STAGES = ("read", "assembly", STAGE, "recovery", "checks", "write")
# A stage is at a limit that it reaches to this share.
_REACHED = 0.5
_LENGTH = 20_000_000  # doubles: three arrays of 160 MB are more than caches hold
_PIECE = 8_192  # doubles: three pieces stay in the cache of a core
_REPETITIONS = 6

Parts = dict[str, dict[str, float]]


def triad(length: int = _LENGTH) -> float:
    """The bandwidth (bytes/s) of a = b + s c on all threads: two arrays read, one written."""
    a, b, c = np.zeros(length), np.ones(length), np.full(length, 2.0)
    cuts = np.linspace(0, length, workers() + 1).astype(int).tolist()

    def part(ends: tuple[int, int]) -> None:
        for first in range(*ends, _PIECE):
            some = slice(first, min(first + _PIECE, ends[1]))
            np.multiply(c[some], 3.0, out=a[some])
            a[some] += b[some]

    best = np.inf
    for _ in range(_REPETITIONS):
        start = perf_counter()
        list(prefetch(part, pairwise(cuts)))
        best = min(best, perf_counter() - start)
    assert a[0] == a[-1] == 7.0
    return 3 * a.nbytes / best


def moved(
    matrix: bsr_matrix | SymmetricBlocks, x: np.ndarray, result: np.ndarray, adds: bool = True
) -> int:
    """The least bytes of a product: matrix and vector read, result written, if it `adds` read too.

    >>> moved(bsr_matrix(np.eye(6), blocksize=(3, 3)), np.ones(6), np.ones(6))
    308
    """
    return _stored(matrix) + x.nbytes + result.nbytes * (1 + adds)


@contextmanager
def _replaced(owner: Any, name: str, work: Any) -> Iterator[None]:
    """An attribute of a module or a class is another one within."""
    before = getattr(owner, name)
    setattr(owner, name, work)
    try:
        yield
    finally:
        setattr(owner, name, before)


@contextmanager
def counted() -> Iterator[Parts]:
    """Seconds and bytes of the products within, by what they are for."""
    from ..mechanics.linear import hierarchy, multigrid, products
    from ..mechanics.linear.stiffened import Stiffened

    parts: Parts = {}
    within: list[str] = []

    def add(name: str, seconds: float, count: int) -> None:
        part = parts.setdefault(name, {"seconds": 0.0, "bytes": 0.0})
        part["seconds"] += seconds
        part["bytes"] += count

    def product(work: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
        def call(
            matrix: bsr_matrix | SymmetricBlocks,
            x: np.ndarray,
            base: np.ndarray | None = None,
            *more: Any,
            **named: Any,
        ) -> np.ndarray:
            start = perf_counter()
            result = work(matrix, x, base, *more, **named)
            seconds = perf_counter() - start
            count = moved(matrix, x, result, base is not None)
            outer = within[-1] if within else STAGE
            if outer == ITERATIONS:
                kind = DOUBLE if x.dtype == np.float64 else SMOOTHER
                add(kind if isinstance(matrix, SymmetricBlocks) else TRANSFER, seconds, count)
            add(outer, 0.0, count)
            return result

        return call

    def around(work: Callable[..., Any], name: str) -> Callable[..., Any]:
        def call(*given: Any, **more: Any) -> Any:
            within.append(name)
            start, cpu = perf_counter(), processor_time()
            try:
                return work(*given, **more)
            finally:
                within.pop()
                add(name, perf_counter() - start, 0)
                parts[name]["cpu"] = parts[name].get("cpu", 0.0) + processor_time() - cpu

        return call

    solver, outside = multigrid.Multigrid, (STAGE, SET_UP, ITERATIONS)

    def transposed(matrix: bsr_matrix, x: np.ndarray, _: None) -> np.ndarray:
        return products.multiply_transposed(matrix, x)

    with ExitStack() as stack:
        for owner, name, work in (
            (hierarchy, "multiply", product(products.multiply)),
            (multigrid, "multiply", product(products.multiply)),
            (multigrid, "multiply_transposed", product(transposed)),
            (SymmetricBlocks, "multiply", product(SymmetricBlocks.multiply)),
            (solver, "__init__", around(solver.__init__, SET_UP)),
            (solver, "solve", around(solver.solve, ITERATIONS)),
            (Stiffened, "solve", around(Stiffened.solve, ITERATIONS)),
        ):
            stack.enter_context(_replaced(owner, name, work))
        yield parts
    parts[STAGE] = {"bytes": sum(parts[n]["bytes"] for n in outside if n in parts)}


def measure(job: Mapping[str, Any]) -> dict[str, Any]:
    """A case solved by multigrid from mesh file to result file: bytes and times of all stages.

    The keys are `bandwidth` (bytes/s), `threads`, `dofs`, `iterations`, and `parts`: by name
    `seconds` and `bytes`, and `cpu` except of products.
    """
    from ..mechanics.linear.direct import force_solver
    from ..verification.run import Job, solve

    mesh, stiffness, kept = Path(job["mesh"]), [0], []
    before = triad()
    with TemporaryDirectory() as folder:
        result = Path(folder) / "result.vtkhdf"
        with force_solver("multigrid"), counted() as parts, _assembled(stiffness):
            solve(Job(Path(job["case"]), mesh), result, None, lambda s, _: kept.append(s))
        [solution] = kept
        for stage, least in least_bytes(solution, stiffness[0], mesh, result).items():
            seconds, cpu = solution.seconds[stage], solution.stage_cpu_seconds[stage]
            parts.setdefault(stage, {"bytes": least}).update(seconds=seconds, cpu=cpu)
    about = {"dofs": solution.dofs, "iterations": solution.linear_iterations, "parts": parts}
    return {"bandwidth": max(before, triad()), "threads": workers()} | about


@contextmanager
def _assembled(count: list[int]) -> Iterator[None]:
    """The bytes of the stiffness that is assembled within, put into `count`."""
    from ..simulation import simulate

    original = simulate.solve_problem

    def call(problem: "ContactProblem", *more: Any) -> "Solution":
        count[0] = _stored(problem.matrix)
        return original(problem, *more)

    with _replaced(simulate, "solve_problem", call):
        yield


def least_bytes(solution: "Solution", stiffness: int, mesh: Path, result: Path) -> dict[str, int]:
    """The bytes that each stage moves at least: what it reads and writes, once each."""
    cells = _nbytes([solution.mesh.points, *(block.data for block in solution.mesh.cells)])
    moved, stress = solution.displacement.nbytes, solution.stress.nbytes
    return {
        "read": mesh.stat().st_size + cells,
        "assembly": cells + stiffness,
        STAGE: 0,  # its products are counted
        "recovery": cells + moved + stress,
        "checks": solution.mesh.points.nbytes + moved + stress,
        "write": cells + moved + stress + result.stat().st_size,
    }


def _stored(matrix: Any) -> int:
    """The bytes of a sparse matrix, or of a stiffness in any of its forms."""
    if hasattr(matrix, "divergence"):
        return _stored(matrix.soft) + _stored(matrix.divergence) + int(matrix.weight.nbytes)
    matrix = getattr(matrix, "blocks", matrix)
    parts = getattr(matrix, "parts", [matrix])
    return _nbytes(a for part in parts for a in (part.data, part.indices, part.indptr))


def _nbytes(arrays: Iterable[np.ndarray]) -> int:
    return sum(array.nbytes for array in arrays)


@dataclass(frozen=True)
class Moved:
    """A stage of a measured solve, or a part of one; `bandwidth` (bytes/s) is the machine's.

    `busy`: threads at work on the mean; None for products, whose processor time is not measured.
    """

    name: str
    seconds: float
    moved: float
    bandwidth: float
    threads: int
    busy: float | None

    @property
    def depth(self) -> int:
        """0 for a stage, 1 for a part of the linear solve, 2 for products within the iterations."""
        return 0 if self.name in _STAGES else 1 if self.name in (SET_UP, ITERATIONS) else 2

    @property
    def rate(self) -> float:
        """Bytes per second."""
        return self.moved / self.seconds

    @property
    def share(self) -> float:
        """Of the machine's bandwidth; above one where caches keep what is counted."""
        return self.rate / self.bandwidth

    @property
    def limit(self) -> str:
        """Memory from half the bandwidth on, else by how many threads are at work."""
        if self.share > _REACHED:
            return "memory"
        if self.busy is None:
            return ""
        if self.busy < _REACHED:
            return "waiting"
        # Halfway between one thread and all.
        shared = self.threads > 1 and self.busy - 1 > _REACHED * (self.threads - 1)
        return "arithmetic, temporary arrays" if shared or self.threads == 1 else "one thread"


@dataclass(frozen=True)
class MovedBytes:
    """A measured solve: its stages in the order of the work, the parts of the linear solve."""

    record: Record
    parts: list[Moved]


def table(record: Record | None) -> MovedBytes | None:
    """The parts of a record made by `measure`; None if nothing was solved."""
    if not record or record["outcome"] != SOLVED:
        return None
    found, rate, threads = record["parts"], record["bandwidth"], record["threads"]
    order = [part for stage in _STAGES for part in (stage, *(_PARTS if stage == STAGE else ()))]
    parts = [
        Moved(
            name,
            found[name]["seconds"],
            found[name]["bytes"],
            rate,
            threads,
            found[name]["cpu"] / found[name]["seconds"] if "cpu" in found[name] else None,
        )
        for name in order
        if name in found
    ]
    return MovedBytes(record, parts)
