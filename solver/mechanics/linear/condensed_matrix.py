"""The matrix of a condensed system, of which only what differs from the stiffness is stored."""

from typing import Any, Protocol

import numpy as np
from scipy.sparse import csr_matrix

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
        self.stiffness, self.kept, self.added = stiffness, kept, added
        self.shape: tuple[int, int] = added.shape

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """See `Symmetric`."""
        whole = np.zeros((self.stiffness.shape[0], *x.shape[1:]))
        whole[self.kept] = x
        return (self.stiffness @ whole)[self.kept] + self.added @ x

    def __getitem__(self, rows: Any) -> csr_matrix:
        """See `Symmetric`."""
        return self.stiffness[self.kept[rows]][:, self.kept] + self.added[rows]

    def diagonal(self) -> np.ndarray:
        """See `Symmetric`."""
        return self.stiffness.diagonal()[self.kept] + self.added.diagonal()

    def tocsr(self) -> csr_matrix:
        """See `Symmetric`."""
        return self[:]
