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
    """The rows and columns `kept` (k,) of a stiffness matrix (n, n), plus `added` (k + s, k + s).

    Unknowns that were eliminated add a little near the interface. The rest would be a second copy
    of the stiffness, which the next contact status needs as it is. The last s unknowns are those
    of springs, which the stiffness does not know.
    """

    def __init__(self, stiffness: csr_matrix | NodalMatrix, kept: np.ndarray, added: csr_matrix):
        self.stiffness, self.kept, self.added = stiffness, kept, added
        self.shape: tuple[int, int] = added.shape

    @property
    def eliminated(self) -> np.ndarray:
        """The other unknowns (n - k,) of the stiffness: at least as many as there are springs."""
        left = np.ones(self.stiffness.shape[0], dtype=bool)
        left[self.kept] = False
        return np.flatnonzero(left)

    @property
    def springs(self) -> int:
        """How many of the unknowns are those of springs."""
        return self.shape[0] - len(self.kept)

    @property
    def places(self) -> np.ndarray:
        """The unknowns (k + s,) of the stiffness; for springs the first eliminated ones."""
        return np.concatenate([self.kept, self.eliminated[: self.springs]])

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
