"""The linear solver that a positive definite system gets, by its size and dimension."""

from importlib.util import find_spec
from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix

from solver.errors import SolveError
from solver.linear.direct import factorise
from solver.linear.multigrid import Multigrid, Nodes

MULTIGRID_FROM = 80_000
"""Unknowns in 3D from which multigrid takes less time, and a third of the memory, than a factor."""


class Solver(Protocol):
    """What solves one system, as often as wanted; `name` says by what, for the record."""

    @property
    def name(self) -> str:
        """By what."""

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solve for `right` (n,) or (n, k)."""

    def close(self) -> None:
        """Release the memory."""


def choose(matrix: csr_matrix, dim: int) -> str:
    """`multigrid` or `direct`."""
    large = dim == 3 and matrix.shape[0] >= MULTIGRID_FROM
    return "multigrid" if large and find_spec("pyamg") is not None else "direct"


def prepare(matrix: csr_matrix, dim: int, unknowns: Nodes) -> Solver:
    """Make ready to solve with a symmetric positive definite `matrix` (n, n), both halves stored.

    Raises SolveError where the matrix is not positive definite or singular to working precision;
    a singular matrix that multigrid solves for a consistent right-hand side goes unnoticed.
    """
    if choose(matrix, dim) == "multigrid":
        try:
            return _MultigridElseDirect(matrix, dim, Multigrid(matrix, unknowns))
        except SolveError:
            pass  # nothing coarsens: a factor decides whether the matrix is to blame
    return factorise(matrix, dim=dim)


class _MultigridElseDirect:
    """Multigrid, until it does not converge: thin cells or nearly incompressible material."""

    def __init__(self, matrix: csr_matrix, dim: int, multigrid: Multigrid):
        self._matrix, self._dim = matrix, dim
        self._solver: Solver = multigrid

    @property
    def name(self) -> str:
        return self._solver.name

    def solve(self, right: np.ndarray) -> np.ndarray:
        try:
            return self._solver.solve(right)
        except SolveError:
            if not isinstance(self._solver, Multigrid):
                raise
        self._solver.close()
        self._solver = factorise(self._matrix, dim=self._dim)
        return self._solver.solve(right)

    def close(self) -> None:
        self._solver.close()
