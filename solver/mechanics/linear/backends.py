"""The sparse direct solvers behind one interface: a function that factors and returns a solve.

Each takes the upper triangle of a symmetric matrix (csr, int32 indices, sorted, every diagonal
entry stored) and whether it must be positive definite, imports its library only when called, and
raises `BreakdownError` at a pivot that it cannot use. The solve takes and returns columns (n, k);
the factor's memory is released with the last reference to the solve.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags

Solve = Callable[[np.ndarray], np.ndarray]


class BreakdownError(Exception):
    """A pivot is zero, or not positive where it must be."""


@dataclass(frozen=True)
class Backend:
    """One library."""

    name: str
    factor: Callable[[csr_matrix, bool], Solve]


def _cholmod(upper: csr_matrix, definite: bool) -> Solve:
    from cvxopt import cholmod, matrix, spmatrix

    if not definite:
        raise ValueError("CHOLMOD factors positive definite matrices only")
    columns = np.repeat(np.arange(upper.shape[0]), np.diff(upper.indptr))
    rows = upper.indices.astype(np.int64)
    lower = spmatrix(matrix(upper.data), matrix(rows), matrix(columns), upper.shape)
    factor = cholmod.symbolic(lower)
    try:
        cholmod.numeric(lower, factor)
    except ArithmeticError as error:
        raise BreakdownError from error

    def solve(right: np.ndarray) -> np.ndarray:
        solution = matrix(np.asfortranarray(right, dtype=float))
        cholmod.solve(factor, solution)
        return np.array(solution)

    return solve


def _superlu(upper: csr_matrix, definite: bool) -> Solve:
    from scipy.sparse.linalg import splu

    whole = csc_matrix(upper + upper.T - diags(upper.diagonal()))
    try:
        if not definite:
            return splu(whole).solve
        symmetric = {"SymmetricMode": True}
        factor = splu(whole, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
    except RuntimeError as error:
        raise BreakdownError from error
    if not (factor.U.diagonal() > 0).all():
        raise BreakdownError
    return factor.solve


BACKENDS = {"cholmod": Backend("CHOLMOD", _cholmod), "superlu": Backend("SuperLU", _superlu)}
