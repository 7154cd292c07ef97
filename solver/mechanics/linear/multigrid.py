"""Algebraic multigrid for large 3D elasticity: smoothed aggregation within conjugate gradients.

Nodes are gathered into aggregates, whose rigid motions are the unknowns of the next level (Vanek,
Mandel, Brezina, Computing 56 (1996) 179). Every level is scaled to a diagonal of at most one and
kept in single precision; the smoother is a Chebyshev polynomial of the fourth kind (Lottes, Numer.
Linear Algebra Appl. 30 (2023) e2518): products with the matrix alone. Conjugate gradients in double
precision take the solution to round-off.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ...system.errors import SolveError
from .condensed_matrix import CondensedMatrix, Symmetric
from .galerkin import coarse, pattern, smoothed
from .krylov import EPSILON, conjugate_gradients, in_single
from .nodal_matrix import NodalMatrix
from .products import in_pieces, multiply, multiply_transposed

COARSEST = 600
"""The hierarchy ends at so many unknowns; that level is inverted as a dense matrix."""
LARGEST_DENSE = 4_000
"""Largest level that is inverted where nothing coarsens further; beyond it multigrid is refused."""
MOST_NEIGHBOURS = 50
"""Largest mean number of neighbouring aggregates (20–35 is typical). Contact couples everything on
one face: with hundreds of faces on it, coarse levels fill in."""
MAX_ITERATIONS = 150
_ROWS_AT_ONCE = 30_000  # whole nodes
# Lottes' optimised weights of the polynomial of degree two.
_FIRST, _SECOND = np.float32(1.02387287570313), np.float32(1.26408905371085)
# The iteration approaches the largest eigenvalue from below.
_SAFETY = 1.05
_SMOOTHED = 4 / 3


@dataclass(frozen=True)
class Unknowns:
    """The meaning of the unknowns of a system, in `dim` dimensions.

    `node` (n,): the node of each unknown, at most `dim` per node; `motions` (n, 3 or 6): the rigid
    motions in these unknowns; `body` (n,): the number of the body. Bodies that slide on each other
    share no aggregate. `quadratic`: some cells are quadratic.
    """

    dim: int
    node: np.ndarray
    motions: np.ndarray
    body: np.ndarray
    quadratic: bool = False

    def of(self, chosen: np.ndarray) -> "Unknowns":
        """The same for some of them."""
        arrays = self.node[chosen], self.motions[chosen], self.body[chosen]
        return Unknowns(self.dim, *arrays, self.quadratic)


@dataclass(frozen=True)
class Level:
    """One level: scaled matrix, bound of its eigenvalues, and the way up from the next."""

    matrix: bsr_matrix
    bound: np.float32
    prolongation: bsr_matrix

    def smooth(self, residual: np.ndarray) -> np.ndarray:
        """The correction for a residual (n,): the Chebyshev polynomial applied to it."""
        step = np.float32(4 / 3) / self.bound
        change = multiply(self.matrix, residual, residual, -float(step))
        change *= _SECOND * np.float32(12 / 5) / self.bound
        change += (_FIRST + _SECOND / np.float32(5)) * step * residual
        return change

    def remaining(self, residual: np.ndarray, change: np.ndarray) -> np.ndarray:
        """The residual (n,) after a change."""
        return multiply(self.matrix, change, residual, -1.0)


class Multigrid:
    """A hierarchy for one matrix. `iterations`: the most that a solve has taken so far."""

    def __init__(self, matrix: Symmetric, unknowns: Unknowns):
        """Set up for a symmetric positive definite `matrix` (n, n).

        Raises SolveError where the diagonal is not positive, nothing coarsens, or coarse levels
        would fill in.
        """
        diagonal = matrix.diagonal()
        if not (diagonal > 0).all():
            raise SolveError("the matrix is not positive definite: its diagonal is not positive")
        self.iterations = 0
        self._matrix = matrix
        self._scale = 1 / np.sqrt(diagonal)[:, None]
        blocks, self._place = _in_blocks(matrix, self._scale[:, 0], unknowns)
        # Nodes without unknowns belong to no body.
        body = np.full(blocks.shape[0] // 3, -1)
        body[self._place // 3] = unknowns.body
        motions = np.zeros((blocks.shape[0], unknowns.motions.shape[1]))
        motions[self._place] = unknowns.motions / self._scale
        blocks, motions, scale = _scaled(blocks, motions)
        self._scale *= scale[self._place, None]
        self._levels, self._coarsest = _hierarchy(blocks, motions, body)
        self._padded = blocks.shape[0]
        self.name = f"conjugate gradients with multigrid of {len(self._levels) + 1} levels"

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:
        """Solve for `right` (n,) or (n, k), to a residual of `accuracy` times that.

        In 2-norms of the system scaled to a diagonal of at most one. Raises SolveError where
        `MAX_ITERATIONS` do not or will not suffice, and where the solution is not finite.
        """
        columns = np.asarray(right, dtype=float)
        columns = columns if columns.ndim == 2 else columns[:, None]
        solution, iterations = conjugate_gradients(
            lambda x: self._scale * (self._matrix @ (self._scale * x)),
            in_single(partial(np.apply_along_axis, self._cycle, 0)),
            self._scale * columns,
            accuracy,
            MAX_ITERATIONS,
        )
        if not np.isfinite(solution).all():
            raise SolveError(f"the solution by {self.name} is not finite")
        self.iterations = max(self.iterations, iterations)
        return (self._scale * solution).reshape(np.shape(right))

    def close(self) -> None:
        """Release the hierarchy; it solves no more."""
        self._levels = []

    def _cycle(self, residual: np.ndarray) -> np.ndarray:
        padded = np.zeros(self._padded, dtype=np.float32)
        padded[self._place] = residual
        return self._descend(0, padded)[self._place]

    def _descend(self, depth: int, residual: np.ndarray) -> np.ndarray:
        """One V-cycle from a level down."""
        if depth == len(self._levels):
            return self._coarsest @ residual
        level = self._levels[depth]
        change = level.smooth(residual)
        below = multiply_transposed(level.prolongation, level.remaining(residual, change))
        change = multiply(level.prolongation, self._descend(depth + 1, below), change)
        change += level.smooth(level.remaining(residual, change))
        return change


def _in_blocks(
    matrix: Symmetric, scale: np.ndarray, unknowns: Unknowns
) -> tuple[bsr_matrix, np.ndarray]:
    """The scaled matrix in single precision and blocks of three, and the row (n,) of each unknown.

    Rows without unknown are zero.
    """
    if isinstance(matrix, NodalMatrix):
        return matrix.scaled(scale), matrix.free
    if isinstance(matrix, CondensedMatrix) and (found := matrix.in_blocks(scale)):
        return found
    number, count = np.unique(unknowns.node, return_inverse=True, return_counts=True)[1:]
    order = np.argsort(number, kind="stable")
    rank = np.empty(len(number), dtype=int)
    rank[order] = np.arange(len(number)) - np.repeat(np.cumsum(count) - count, count)
    place = 3 * number + rank
    return _of_rows(matrix, scale, place, 3 * len(count)), place


def _of_rows(matrix: Symmetric, scale: np.ndarray, place: np.ndarray, size: int) -> bsr_matrix:
    """The same, row and column i at `place[i]` (n,) of `size`.

    Rows are copied in parts, so that there is no second matrix in double precision.
    """
    order, place = np.argsort(place), place.astype(np.int32)
    rows, lengths = place[order], [np.zeros(1, dtype=np.int32)]
    blocks, columns = np.empty((0, 3, 3), dtype=np.float32), np.empty(0, dtype=np.int32)
    for first in range(0, size, _ROWS_AT_ONCE):
        last = min(first + _ROWS_AT_ONCE, size)
        low, high = np.searchsorted(rows, (first, last))
        some, counts = matrix[order[low:high]], np.zeros(last - first, dtype=int)
        counts[rows[low:high] - first] = np.diff(some.indptr)
        values = some.data * np.repeat(scale[order[low:high]], np.diff(some.indptr))
        values *= scale[some.indices]
        starts = np.concatenate([[0], np.cumsum(counts)])
        arrays = values.astype(np.float32), place[some.indices], starts
        part = csr_matrix(arrays, shape=(last - first, size)).tobsr((3, 3))
        before, after = len(columns), len(columns) + len(part.indices)
        # An array grows by moved pages: there are never two copies of it.
        blocks.resize((after, 3, 3), refcheck=False)
        columns.resize(after, refcheck=False)
        blocks[before:], columns[before:] = part.data, part.indices
        lengths.append(np.diff(part.indptr))
    return bsr_matrix((blocks, columns, np.cumsum(np.concatenate(lengths))), shape=(size, size))


def _hierarchy(
    matrix: bsr_matrix, motions: np.ndarray, body: np.ndarray
) -> tuple[list[Level], np.ndarray]:
    """The levels below a scaled matrix, and the inverse of the last."""
    levels: list[Level] = []
    while matrix.shape[0] > COARSEST:
        bound = np.float32(_SAFETY * _largest_eigenvalue(matrix))
        tentative, coarse_motions, coarse_body = _aggregate(matrix, motions, body)
        if tentative.nnz == 0 or 2 * tentative.shape[1] > matrix.shape[0]:
            break
        way = smoothed(matrix, tentative, _SMOOTHED / float(bound))
        _refuse_fill(way)
        below, motions, scale = _scaled(coarse(matrix, way), coarse_motions)
        _scale_blocks(way, np.ones(way.shape[0]), scale)
        levels.append(Level(matrix, bound, way))
        matrix, body = below, coarse_body
    if matrix.shape[0] > LARGEST_DENSE:
        raise SolveError(f"its levels end at {matrix.shape[0]} unknowns: nothing coarsens further")
    dense = matrix.toarray().astype(float)
    inverse = np.linalg.pinv((dense + dense.T) / 2, rcond=1e-7, hermitian=True)
    return levels, inverse.astype(np.float32)


def _refuse_fill(prolongation: bsr_matrix) -> None:
    """Raise SolveError where the next level will have too many neighbours, before it is formed."""
    felt = pattern(prolongation)
    near = (felt.T @ felt).nnz / felt.shape[1]
    if near > MOST_NEIGHBOURS:
        raise SolveError(f"its coarse levels would fill in, to {near:.0f} neighbours or more")


def _aggregate(
    matrix: bsr_matrix, motions: np.ndarray, body: np.ndarray
) -> tuple[bsr_matrix, np.ndarray, np.ndarray]:
    """Tentative prolongation, and the motions and body of the aggregates.

    Its columns are the motions of each aggregate, orthonormalised.
    """
    from pyamg.aggregation import (
        fit_candidates,
        standard_aggregation,
    )

    count = len(body)
    rows = np.repeat(np.arange(count), np.diff(matrix.indptr))
    within = (body[rows] == body[matrix.indices]) & (body[rows] >= 0)
    starts = np.zeros(count + 1, dtype=np.int32)
    np.cumsum(np.bincount(rows[within], minlength=count), out=starts[1:])
    columns = matrix.indices[within].astype(np.int32)
    graph = csr_matrix((np.ones(len(columns)), columns, starts), shape=(count, count))
    aggregates, _ = standard_aggregation(graph)
    tentative, coarse = fit_candidates(aggregates, motions)
    members = aggregates.tocoo()
    coarse_body = np.zeros(aggregates.shape[1], dtype=body.dtype)
    coarse_body[members.col] = body[members.row]
    return bsr_matrix(tentative, dtype=np.float32), coarse, coarse_body


def _scaled(matrix: bsr_matrix, motions: np.ndarray) -> tuple[bsr_matrix, np.ndarray, np.ndarray]:
    """Matrix and motions scaled to a diagonal of at most one, and the scale (n,).

    Rows whose entries add up to more than the typical sum are scaled down further: otherwise the
    few at a contact surface would set the eigenvalue bound for all. Zero rows, which have no
    unknown, stay zero.
    """
    size = matrix.blocksize[0]
    diagonal = matrix.diagonal().astype(float)
    there = diagonal > 0
    scale = np.where(there, 1 / np.sqrt(np.where(there, diagonal, 1.0)), 0.0)
    weights = scale.astype(np.float32).reshape(-1, size)
    sums = np.zeros(weights.shape)

    def add_up(first: int, last: int) -> None:
        starts = matrix.indptr[first : last + 1]
        some, filled = slice(starts[0], starts[-1]), np.diff(starts) > 0
        if filled.any():
            columns = weights[matrix.indices[some], :, None]
            inner = np.matmul(np.abs(matrix.data[some]), columns)[:, :, 0]
            starts = starts[:-1][filled] - starts[0]
            sums[first:last][filled] = np.add.reduceat(inner, starts, axis=0)

    in_pieces(add_up, matrix)
    sums = scale * sums.ravel()
    scale /= np.sqrt(np.maximum(1.0, sums / np.median(sums[there])))
    _scale_blocks(matrix, scale, scale)
    return matrix, motions / np.where(there, scale, 1.0)[:, None] * there[:, None], scale


def _scale_blocks(matrix: bsr_matrix, left: np.ndarray, right: np.ndarray) -> None:
    """Multiply rows and columns, in place."""
    height, width = matrix.blocksize
    rows = left.astype(np.float32).reshape(-1, height)
    columns = right.astype(np.float32).reshape(-1, width)

    def multiply_rows(first: int, last: int) -> None:
        starts = matrix.indptr[first : last + 1]
        some = slice(starts[0], starts[-1])
        matrix.data[some] *= np.repeat(rows[first:last], np.diff(starts), axis=0)[:, :, None]
        matrix.data[some] *= columns[matrix.indices[some]][:, None, :]

    in_pieces(multiply_rows, matrix)


def _largest_eigenvalue(matrix: bsr_matrix, steps: int = 10) -> float:
    """Largest eigenvalue by Lanczos' iteration, from below."""
    from scipy.linalg import eigh_tridiagonal

    vector = np.random.default_rng(0).uniform(-1, 1, matrix.shape[0]).astype(np.float32)
    vector /= np.linalg.norm(vector)
    previous = np.zeros_like(vector)
    diagonal, beside = [], [np.float32(0)]
    for _ in range(steps):
        image = multiply(matrix, vector, -beside[-1] * previous)
        diagonal.append(np.float32(vector @ image))
        image -= diagonal[-1] * vector
        beside.append(np.float32(np.linalg.norm(image)))
        if beside[-1] < 1e-5:
            break
        previous, vector = vector, image / beside[-1]
    return float(eigh_tridiagonal(diagonal, beside[1 : len(diagonal)], eigvals_only=True)[-1])
