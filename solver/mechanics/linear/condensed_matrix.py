"""The matrix of a condensed system, of which only what differs from the stiffness is stored."""

from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from .symmetric_blocks import NodalMatrix
from .unknowns import Unknowns, places

_ROWS_AT_ONCE = 30_000  # whole nodes


class Symmetric(Protocol):
    """A symmetric matrix as its solvers see it: any `csr_matrix` with both halves stored is one."""

    shape: tuple[int, int]

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """Its product with the columns of x (n, k)."""

    def __getitem__(self, rows: Any) -> csr_matrix:
        """Some of its rows."""

    def diagonal(self) -> np.ndarray:
        """Its diagonal (n,)."""

    def tocsr(self) -> csr_matrix:
        """All of it."""


class CondensedMatrix:
    """The rows and columns `kept` (k,) of a stiffness matrix (n, n), plus `added` (k + s, k + s).

    Unknowns that were eliminated add a little near the interface. The rest would be a second copy
    of the stiffness, which the next contact status needs as it is. The last s unknowns are extra
    ones, which the stiffness does not know: those of compliant constraints.
    """

    def __init__(self, stiffness: csr_matrix | NodalMatrix, kept: np.ndarray, added: csr_matrix):
        self.stiffness, self.kept, self.added = stiffness, kept, added
        self.shape: tuple[int, int] = added.shape

    @cached_property
    def eliminated(self) -> np.ndarray:
        """The other unknowns (n - k,) of the stiffness: at least as many as extra ones."""
        left = np.ones(self.stiffness.shape[0], dtype=bool)
        left[self.kept] = False
        return np.flatnonzero(left)

    @property
    def extra(self) -> int:
        """How many of the unknowns the stiffness does not know."""
        return self.shape[0] - len(self.kept)

    @property
    def places(self) -> np.ndarray:
        """The unknowns (k + s,) of the stiffness; for extra ones the first eliminated ones."""
        return np.concatenate([self.kept, self.eliminated[: self.extra]])

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """See `Symmetric`."""
        whole, k = np.zeros((self.stiffness.shape[0], *x.shape[1:])), len(self.kept)
        whole[self.kept] = x[:k]
        found = self.added @ x
        found[:k] += (self.stiffness @ whole)[self.kept]
        return found

    def __getitem__(self, rows: Any) -> csr_matrix:
        """See `Symmetric`."""
        return self.tocsr()[rows]

    def diagonal(self) -> np.ndarray:
        """See `Symmetric`."""
        found = self.added.diagonal()
        found[: len(self.kept)] += self.stiffness.diagonal()[self.kept]
        return found

    def tocsr(self) -> csr_matrix:
        """See `Symmetric`."""
        found = csr_matrix(self.stiffness[self.kept][:, self.kept])
        found.resize(self.shape)
        return found + self.added


def in_blocks(
    matrix: Symmetric, scale: np.ndarray, unknowns: Unknowns
) -> tuple[bsr_matrix, np.ndarray]:
    """The scaled matrix in single precision and blocks of three, and the row (n,) of each unknown.

    Rows without unknown are zero.
    """
    if isinstance(matrix, NodalMatrix):
        return matrix.scaled(scale), matrix.free
    place, size = places(unknowns)
    return _of_rows(matrix, scale, place, size), place


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
