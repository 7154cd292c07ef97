"""Sparse direct solution of symmetric systems: CHOLMOD, and SuperLU for saddle points.

The matrix is first scaled symmetrically to a diagonal near one, by powers of two, which rounds
nothing. The rest does not depend on units, and a pivot or an eigenvalue of the scaled matrix can be
compared with the machine precision.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Self

import numpy as np
from scipy.sparse import csr_matrix, sparray, spmatrix

from ...lac.errors import SolveError
from .backends import BACKENDS, Backend, BreakdownError, Solve
from .krylov import EPSILON

SINGULAR = 4 * EPSILON
"""A scaled matrix (largest entry 1) whose smallest eigenvalue is not larger counts as singular."""
SINGULAR_INDEFINITE = 1e-12
"""The same for an indefinite matrix."""
_auto: ContextVar[str] = ContextVar("auto", default="auto")


@contextmanager
def force_solver(kind: str) -> Iterator[None]:
    """Within the block `auto` means `kind`: the name of a solver, or `multigrid`.

    Raises SolveError there for a solver that is not for that kind of matrix.
    """
    token = _auto.set(kind)
    try:
        yield
    finally:
        _auto.reset(token)


def wanted() -> str:
    """The present meaning of `auto`: `auto` itself, or the name of a solver."""
    return _auto.get()


class Factor:
    """A matrix factored by the library `name`; closing or dropping it releases the memory."""

    iterative = False
    iterations = 0

    def __init__(self, name: str, solve: Solve, scale: np.ndarray):
        """`solve` takes columns (n, k) of the system scaled by `scale` (n,)."""
        self.name = name
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


def factorise(
    matrix: spmatrix | sparray,
    kind: str = "auto",
    least: float = SINGULAR,
) -> Factor:
    """Factor a symmetric positive definite `matrix` (n, n), of which the upper triangle is read.

    `kind`: auto, cholmod or superlu.

    Raises SolveError where the matrix is not positive definite, or singular to working precision:
    the smallest eigenvalue of the matrix scaled to a diagonal near one is at most `least`.
    """
    upper = _upper_triangle(matrix)
    if upper.shape[0] == 0:
        return Factor("nothing to solve", lambda right: right, np.ones(0))
    diagonal = upper.diagonal()
    if not (diagonal > 0).all():
        worst = int(np.argmin(np.where(np.isnan(diagonal), -np.inf, diagonal)))
        raise SolveError(
            f"the matrix is not positive definite: diagonal entry {worst} is {diagonal[worst]:g}"
        )
    scale = _power_of_two(1 / np.sqrt(diagonal))
    upper = _scaled(upper, scale)
    return _factorise(upper, scale, kind, definite=True, limit=least)


def factorise_indefinite(matrix: spmatrix | sparray, kind: str = "auto") -> Factor:
    """Factor a symmetric indefinite `matrix` (n, n), a saddle point; see `factorise`.

    `kind`: auto or superlu. Here the scaled matrix has its largest entry in each row near one.
    """
    upper = _upper_triangle(matrix)
    scale = np.ones(upper.shape[0])
    for _ in range(3):
        scale *= _power_of_two(1 / np.sqrt(_largest_in_row(_scaled(upper, scale))))
    upper = _scaled(upper, scale)
    return _factorise(upper, scale, kind, definite=False, limit=SINGULAR_INDEFINITE)


def factorise_roughly(matrix: csr_matrix) -> Solve:
    """Factor a positive definite `matrix` (n, n) with a diagonal near one, for a preconditioner.

    The solve takes columns (n, k). Raises SolveError where a pivot fails.
    """
    backend = _choose("auto", definite=True)
    try:
        return backend.factor(_upper_triangle(matrix), True)
    except BreakdownError:
        raise SolveError(
            f"a part of the matrix is not positive definite ({backend.name})"
        ) from None


def _choose(kind: str, definite: bool) -> Backend:
    # Multigrid makes no factor: where one is needed all the same, take the best.
    if kind == "auto" and (kind := wanted()) not in BACKENDS:
        kind = "cholmod" if definite else "superlu"
    if kind == "cholmod" and not definite:
        raise SolveError("CHOLMOD factors positive definite matrices only")
    return BACKENDS[kind]


def _factorise(
    upper: csr_matrix, scale: np.ndarray, kind: str, definite: bool, limit: float
) -> Factor:
    backend = _choose(kind, definite)
    try:
        solve = backend.factor(upper, definite)
    except BreakdownError:
        wanted = "positive definite" if definite else "regular"
        raise SolveError(f"the matrix is not {wanted}: a pivot fails in {backend.name}") from None
    smallest = _smallest_eigenvalue(solve, upper.shape[0])
    if not smallest > limit:
        raise SolveError(
            f"the matrix is singular to working precision: scaled to a largest entry of 1, its "
            f"smallest eigenvalue is about {smallest:.0e} (more than {limit:.0e} is needed)"
        )
    return Factor(backend.name, solve, scale)


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


def _scaled(upper: csr_matrix, scale: np.ndarray) -> csr_matrix:
    values = upper.data * np.repeat(scale, np.diff(upper.indptr))
    values *= scale[upper.indices]
    return csr_matrix((values, upper.indices, upper.indptr), shape=upper.shape)


def _power_of_two(values: np.ndarray) -> np.ndarray:
    return np.exp2(np.rint(np.log2(values)))


def _largest_in_row(upper: csr_matrix) -> np.ndarray:
    """Largest modulus in each row of the symmetric matrix."""
    modulus = abs(upper)
    largest = np.maximum(modulus.max(axis=0).toarray(), modulus.max(axis=1).toarray().T).ravel()
    if not largest.all():
        raise SolveError(f"the matrix is singular: row {int(np.argmin(largest))} is zero")
    return largest
