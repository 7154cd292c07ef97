"""Bytes that the products of a multigrid solve move, beside the memory bandwidth of the machine.

A product with a matrix in blocks reads its blocks, column numbers and row starts, the vector and
the sum that it adds to, and writes the result: each counts once, by the sizes of the arrays. That
is the least that a product moves. What a small cache reads again is not counted, so a share of the
bandwidth may be higher than shown; what a large cache keeps is counted, so a share may exceed one.
Other work moves bytes in temporary arrays, which only counters of the hardware show.

Bandwidth is measured with the triad of STREAM, a = b + s c (McCalpin, IEEE TCCA Newsletter, 1995).
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.sparse import bsr_matrix

from ..mechanics.linear.symmetric_blocks import SymmetricBlocks
from ..system.clock import Clock
from ..system.threads import ahead, workers
from .points import SOLVED, Record

# What products are for, and what they are part of.
SMOOTHER, TRANSFER, DOUBLE = "smoother and residuals", "transfer between levels", "matrix in double"
SET_UP, ITERATIONS, STAGE = "set-up", "iterations", "stage solve"
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
        list(ahead(part, pairwise(cuts)))
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
    parts = matrix.parts if isinstance(matrix, SymmetricBlocks) else [matrix]
    stored = sum(a.nbytes for part in parts for a in (part.data, part.indices, part.indptr))
    return stored + x.nbytes + result.nbytes * (1 + adds)


@contextmanager
def counted() -> Iterator[Parts]:
    """Seconds and bytes of the products within, by what they are for."""
    from ..mechanics.linear import multigrid, products

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
            start = perf_counter()
            try:
                return work(*given, **more)
            finally:
                within.pop()
                add(name, perf_counter() - start, 0)

        return call

    solver, outside = multigrid.Multigrid, (STAGE, SET_UP, ITERATIONS)

    def transposed(matrix: bsr_matrix, x: np.ndarray, _: None) -> np.ndarray:
        return products.multiply_transposed(matrix, x)

    with ExitStack() as stack:
        for owner, name, work in (
            (multigrid, "multiply", product(products.multiply)),
            (multigrid, "multiply_transposed", product(transposed)),
            (SymmetricBlocks, "multiply", product(SymmetricBlocks.multiply)),
            (solver, "__init__", around(solver.__init__, SET_UP)),
            (solver, "solve", around(solver.solve, ITERATIONS)),
        ):
            stack.enter_context(patch.object(owner, name, work))
        yield parts
    parts[STAGE] = {"seconds": 0.0, "bytes": sum(parts[n]["bytes"] for n in outside if n in parts)}


def measure(job: Mapping[str, Any]) -> dict[str, Any]:
    """A case solved by multigrid on its mesh: the bandwidth, bytes and seconds of the parts."""
    from ..case.reader import load_case
    from ..mechanics.linear.direct import force_solver
    from ..mesh import read_mesh
    from ..simulation.simulate import simulate

    case, mesh, clock = load_case(Path(job["case"])), read_mesh(job["mesh"]), Clock()
    before = triad()
    with force_solver("multigrid"), counted() as parts:
        solution = simulate(case, mesh, clock=clock)
    parts[STAGE]["seconds"] = clock.seconds["solve"]
    about = {"dofs": solution.dofs, "iterations": solution.linear_iterations, "parts": parts}
    return {"bandwidth": max(before, triad()), "threads": workers()} | about


@dataclass(frozen=True)
class Moved:
    """A part of a measured solve; `share` of the bandwidth (bytes/s) that the machine has."""

    name: str
    seconds: float
    moved: float
    bandwidth: float

    @property
    def rate(self) -> float:
        """Bytes per second."""
        return self.moved / self.seconds

    @property
    def share(self) -> float:
        """Of the machine's bandwidth; above one where caches keep what is counted."""
        return self.rate / self.bandwidth


@dataclass(frozen=True)
class MovedBytes:
    """A measured solve: its parts, the stage first."""

    record: Record
    parts: list[Moved]


def table(record: Record | None) -> MovedBytes | None:
    """The parts of a record made by `measure`; None if nothing was solved."""
    if not record or record["outcome"] != SOLVED:
        return None
    found = record["parts"]
    order = (STAGE, SET_UP, ITERATIONS, SMOOTHER, TRANSFER, DOUBLE)
    parts = [
        Moved(name, found[name]["seconds"], found[name]["bytes"], record["bandwidth"])
        for name in order
        if name in found
    ]
    return MovedBytes(record, parts)
