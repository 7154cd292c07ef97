"""A factor of a positive definite matrix, by CHOLMOD.

The matrix is first scaled symmetrically to a diagonal near one, by powers of two, which rounds
nothing. The rest does not depend on units, and a pivot or an eigenvalue of the scaled matrix can be
compared with the machine precision.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

import numpy as np
from scipy.sparse import csr_matrix, sparray, spmatrix

from ...lac.errors import SolveError
from .krylov import EPSILON

SINGULAR = 4 * EPSILON
"""A scaled matrix (largest entry 1) whose smallest eigenvalue is not larger counts as singular."""
Solve = Callable[[np.ndarray], np.ndarray]
# Shares of the diagonal added to a matrix that is singular to working precision: its round-off.
_SHIFTS = 1e-15, 1e-14


class Factor:
    """A factored matrix; closing or dropping it releases the memory."""

    name = "CHOLMOD"
    iterative = False
    iterations = 0

    def __init__(self, solve: Solve, scale: np.ndarray, smallest: float = 1.0, warning: str = ""):
        """`solve` takes columns (n, k) of the system scaled by `scale` (n,).

        `smallest`: about the smallest eigenvalue of the scaled matrix, whose largest entry is 1.
        `warning`: the matrix is singular to working precision, and the factor near that.
        """
        self.smallest, self.warning = smallest, warning
        self._scale = scale
        self._solve: Solve | None = solve

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:  # noqa: ARG002
        """Solve A x = `right`, of shape (n,) or (n, k); the result has the same shape.

        A factor has the full `accuracy`. Raises SolveError where the solution is not finite.
        """
        if self._solve is None:
            raise ValueError("the factor is closed")
        right = np.asarray(right, dtype=float)
        columns = right if right.ndim == 2 else right[:, None]
        solution = self._scale[:, None] * self._solve(self._scale[:, None] * columns)
        if not np.isfinite(solution).all():
            raise SolveError(f"the solution by {self.name} is not finite")
        return solution.reshape(right.shape)

    def close(self) -> None:
        """Release the memory; the factor cannot solve afterwards."""
        self._solve = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def factorise(matrix: spmatrix | sparray, least: float = SINGULAR, nearly: bool = False) -> Factor:
    """Factor a symmetric positive definite `matrix` (n, n), of which the upper triangle is read.

    Raises SolveError where the matrix is not positive definite, or singular to working precision:
    the smallest eigenvalue of the matrix scaled to a diagonal near one is at most `least`.
    `nearly`: the factor is then that of a matrix that differs by round-off, with a warning.
    """
    upper = _upper_triangle(matrix)
    if upper.shape[0] == 0:
        return Factor(lambda right: right, np.ones(0))
    diagonal = upper.diagonal()
    if not (diagonal > 0).all():
        worst = int(np.argmin(np.where(np.isnan(diagonal), -np.inf, diagonal)))
        raise SolveError(
            f"the matrix is not positive definite: diagonal entry {worst} is {diagonal[worst]:g}"
        )
    # The nearest power of two.
    scale = np.exp2(np.rint(np.log2(1 / np.sqrt(diagonal))))
    upper.data *= np.repeat(scale, np.diff(upper.indptr)) * scale[upper.indices]
    on_diagonal, diagonal, warning = upper.indptr[:-1], upper.diagonal(), ""
    for shift in (0.0, *_SHIFTS) if nearly else (0.0,):
        upper.data[on_diagonal] = diagonal + shift * diagonal
        try:
            solve = _cholmod(upper)
        except SolveError as error:
            warning = warning or str(error)
            continue
        smallest = _smallest_eigenvalue(solve, upper.shape[0])
        if not smallest > least:
            warning = warning or (
                "the matrix is singular to working precision: scaled to a largest entry of 1, its "
                f"smallest eigenvalue is about {smallest:.0e} (more than {least:.0e} is needed)"
            )
        if not warning or (nearly and smallest > 0):
            return Factor(solve, scale, smallest, warning)
    raise SolveError(warning)


def factorise_roughly(matrix: csr_matrix) -> Solve:
    """Factor a positive definite `matrix` (n, n) with a diagonal near one, for a preconditioner.

    The solve takes columns (n, k). Raises SolveError where a pivot fails.
    """
    return _cholmod(_upper_triangle(matrix))


def _cholmod(upper: csr_matrix) -> Solve:
    """The solve of columns (n, k); raises SolveError at a pivot that is not positive."""
    from cvxopt import cholmod, matrix, spmatrix

    columns = np.repeat(np.arange(upper.shape[0]), np.diff(upper.indptr))
    rows = upper.indices.astype(np.int64)
    lower = spmatrix(matrix(upper.data), matrix(rows), matrix(columns), upper.shape)
    factor = cholmod.symbolic(lower)
    try:
        cholmod.numeric(lower, factor)
    except ArithmeticError:
        raise SolveError("the matrix is not positive definite: a pivot fails in CHOLMOD") from None

    def solve(right: np.ndarray) -> np.ndarray:
        solution = matrix(np.asfortranarray(right, dtype=float))
        cholmod.solve(factor, solution)
        return np.array(solution)

    return solve


def _smallest_eigenvalue(solve: Solve, size: int) -> float:
    """Estimate, from above, of the smallest modulus of an eigenvalue: two inverse iterations.

    The first brings out the near-null vector even where the start hardly contains it.
    """
    vector = np.random.default_rng(0).uniform(-1, 1, (size, 1))
    growth = 1.0
    for _ in range(2):
        vector /= np.linalg.norm(vector)
        with np.errstate(all="ignore"):
            vector = solve(vector)
            growth = float(np.linalg.norm(vector))
        if not 0 < growth < np.inf:
            return 0.0
    return 1 / growth


def _upper_triangle(matrix: spmatrix | sparray) -> csr_matrix:
    """A copy of the upper triangle: rows sorted, every diagonal entry stored, int32 indices."""
    whole = csr_matrix(matrix, dtype=float)
    if not whole.has_canonical_format:
        whole = whole.copy()
        whole.sum_duplicates()
    size = whole.shape[0]
    rows = np.repeat(np.arange(size, dtype=np.int32), np.diff(whole.indptr))
    kept = whole.indices >= rows
    rows, columns, values = rows[kept], whole.indices[kept].astype(np.int32), whole.data[kept]
    if not np.isfinite(values).all():
        raise SolveError("the matrix holds entries that are not finite")
    if np.count_nonzero(rows == columns) < size:
        every = np.arange(size, dtype=np.int32)
        rows, columns = np.append(rows, every), np.append(columns, every)
        values = np.append(values, np.zeros(size))
        return csr_matrix((values, (rows, columns)), shape=whole.shape)
    starts = np.zeros(size + 1, dtype=np.int32)
    np.cumsum(np.bincount(rows, minlength=size), out=starts[1:])
    return csr_matrix((values, columns, starts), shape=whole.shape)
