"""The sparse direct solvers behind one interface: a function that factors and returns a solve.

Each takes the upper triangle of a symmetric matrix (csr, int32 indices, sorted, every diagonal
entry stored) and whether it must be positive definite, imports its library only when called, and
raises `BreakdownError` at a pivot that it cannot use. The solve takes and returns columns (n, k);
the factor's memory is released with the last reference to the solve.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags

from . import pardiso

Solve = Callable[[np.ndarray], np.ndarray]


class BreakdownError(Exception):
    """A pivot is zero, or not positive where it must be."""


@dataclass(frozen=True)
class Backend:
    """One library; `single`: a float32 triangle gives a factor in single precision."""

    name: str
    single: bool
    available: Callable[[], bool]
    factor: Callable[[csr_matrix, bool], Solve]


def _pardiso(upper: csr_matrix, definite: bool) -> Solve:
    kind = pardiso.POSITIVE_DEFINITE if definite else pardiso.INDEFINITE
    try:
        return pardiso.Pardiso(upper, kind).solve
    except pardiso.PardisoError as error:
        if error.code in (pardiso.ZERO_PIVOT, pardiso.SINGULAR_DIAGONAL):
            raise BreakdownError from error
        if error.code == pardiso.NO_MEMORY:
            raise MemoryError("no room for the factor of the stiffness matrix") from error
        raise


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


BACKENDS = {
    "pardiso": Backend("PARDISO (MKL)", True, pardiso.available, _pardiso),
    "cholmod": Backend("CHOLMOD", False, lambda: find_spec("cvxopt") is not None, _cholmod),
    "superlu": Backend("SuperLU", False, lambda: True, _superlu),
}


@contextmanager
def free_software_alone() -> Iterator[None]:
    """Within, systems are solved as where MKL is not installed: it is no free software."""
    installed = BACKENDS["pardiso"]
    BACKENDS["pardiso"] = replace(installed, available=lambda: False)
    try:
        yield
    finally:
        BACKENDS["pardiso"] = installed
