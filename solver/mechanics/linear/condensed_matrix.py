"""The matrix of a condensed system, of which only what differs from the stiffness is stored."""

from typing import Any, Protocol

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from .nodal_matrix import NodalMatrix


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
    """The rows and columns `kept` (k,) of a stiffness matrix (n, n), plus `added` (k, k).

    Unknowns that were eliminated add a little near the interface. The rest would be a second copy
    of the stiffness, which the next contact status needs as it is.
    """

    def __init__(self, stiffness: csr_matrix | NodalMatrix, kept: np.ndarray, added: csr_matrix):
        self._stiffness, self._kept, self._added = stiffness, kept, added
        self.shape: tuple[int, int] = added.shape

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """See `Symmetric`."""
        whole = np.zeros((self._stiffness.shape[0], *x.shape[1:]))
        whole[self._kept] = x
        return (self._stiffness @ whole)[self._kept] + self._added @ x

    def in_blocks(self, scale: np.ndarray) -> tuple[bsr_matrix, np.ndarray] | None:
        """See `NodalMatrix.scaled`, and the row (k,) of each unknown; None of a csr stiffness."""
        if not isinstance(self._stiffness, NodalMatrix):
            return None
        on_all = np.zeros(self._stiffness.shape[0])
        on_all[self._kept] = scale
        blocks, place = self._stiffness.scaled(on_all), self._stiffness.free[self._kept]
        added = self._added.tocoo()
        values = (scale[added.row] * added.data * scale[added.col]).astype(np.float32)
        where = place[added.row], place[added.col]
        contact = csr_matrix((values, where), shape=blocks.shape)
        return blocks + contact.tobsr(blocks.blocksize), place

    def __getitem__(self, rows: Any) -> csr_matrix:
        """See `Symmetric`."""
        return self._stiffness[self._kept[rows]][:, self._kept] + self._added[rows]

    def diagonal(self) -> np.ndarray:
        """See `Symmetric`."""
        return self._stiffness.diagonal()[self._kept] + self._added.diagonal()

    def tocsr(self) -> csr_matrix:
        """See `Symmetric`."""
        return self[:]
