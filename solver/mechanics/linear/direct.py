"""Sparse direct solution of symmetric systems, by the best library that is installed.

The matrix is first scaled symmetrically to a diagonal near one, by powers of two, which rounds
nothing. The rest does not depend on units, and a pivot or an eigenvalue of the scaled matrix can be
compared with the machine precision.

A large positive definite matrix is factored in single precision, which halves memory and time;
conjugate gradients in double precision, preconditioned by that factor, take the solution to
round-off in about three iterations (Carson and Higham, SIAM J. Sci. Comput. 40 (2018) A817, use
iterative refinement in the same way).
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Self

import numpy as np
from scipy.sparse import csr_matrix, sparray, spmatrix

from ...system.errors import SolveError
from .backends import BACKENDS, Backend, BreakdownError, Solve
from .krylov import EPSILON, conjugate_gradients, in_single

LIGHT = 150_000
"""Stored entries up to which CHOLMOD takes least processor time in 3D (in 2D it always does)."""
SINGLE_FROM = 20_000
"""Unknowns in 3D from which a factor in single precision pays for its iterations."""
SINGULAR = 4 * EPSILON
"""A scaled matrix (largest entry 1) whose smallest eigenvalue is not larger counts as singular."""
SINGULAR_INDEFINITE = 1e-12
"""The same for an indefinite matrix: PARDISO replaces pivots below 1e-13."""
TRUSTED_SINGLE = 1e-6
"""The same for a factor in single precision; below it the factor is made in double precision."""
MAX_ITERATIONS = 50
Iterative = Callable[[np.ndarray, float], tuple[np.ndarray, int]]
_auto: ContextVar[str] = ContextVar("auto", default="auto")


@contextmanager
def force_solver(kind: str) -> Iterator[None]:
    """Within the block `auto` means `kind`: the name of a solver, or `multigrid`.

    Raises SolveError there for a solver that is not installed, or not for that kind of matrix.
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
    """A matrix factored by the library `name`; closing or dropping it releases the memory.

    `iterations`: the most of one solution so far, 0 where the factor alone is accurate enough.
    """

    iterative = False

    def __init__(self, name: str, solve: Iterative, scale: np.ndarray):
        """`solve` takes columns (n, k) and an accuracy, and returns the iterations too."""
        self.name = name
        self.iterations = 0
        self._scale = scale
        self._solve: Iterative | None = solve

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:
        """Solve A x = `right`, of shape (n,) or (n, k); the result has the same shape.

        Where that is quicker, to a residual of `accuracy` times the right-hand side only. Raises
        SolveError where the solution is not finite or the iterations do not converge.
        """
        if self._solve is None:
            raise ValueError("the factor is closed")
        right = np.asarray(right, dtype=float)
        columns = right if right.ndim == 2 else right[:, None]
        solution, iterations = self._solve(self._scale[:, None] * columns, accuracy)
        self.iterations = max(self.iterations, iterations)
        solution = self._scale[:, None] * solution
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
    precision: str = "auto",
    dim: int = 3,
    least: float = SINGULAR,
) -> Factor:
    """Factor a symmetric positive definite `matrix` (n, n), of which the upper triangle is read.

    `kind`: auto, pardiso, cholmod or superlu. `precision` of the factor: auto, double or single
    (pardiso alone); solutions have double precision either way. `dim`, the dimension
    of the mesh behind the matrix, guides the choice for auto.

    Raises SolveError where the matrix is not positive definite, or singular to working precision:
    the smallest eigenvalue of the matrix scaled to a diagonal near one is at most `least`.
    """
    upper = _upper_triangle(matrix)
    if upper.shape[0] == 0:
        return Factor("nothing to solve", lambda right, _: (right, 0), np.ones(0))
    diagonal = upper.diagonal()
    if not (diagonal > 0).all():
        worst = int(np.argmin(np.where(np.isnan(diagonal), -np.inf, diagonal)))
        raise SolveError(
            f"the matrix is not positive definite: diagonal entry {worst} is {diagonal[worst]:g}"
        )
    scale = _power_of_two(1 / np.sqrt(diagonal))
    upper = _scaled(upper, scale)
    light = dim == 2 or upper.nnz <= LIGHT
    backend = _choose(kind, ("cholmod", "pardiso") if light else ("pardiso", "cholmod"))
    if precision == "auto":
        precision = "single" if dim == 3 and upper.shape[0] >= SINGLE_FROM else "double"
    if precision == "single" and backend.single:
        factor = _factorise_single(backend, upper, scale)
        if factor is not None:
            return factor
    return _factorise_double(backend, upper, scale, definite=True, limit=least)


def factorise_indefinite(matrix: spmatrix | sparray, kind: str = "auto") -> Factor:
    """Factor a symmetric indefinite `matrix` (n, n), a saddle point; see `factorise`.

    `kind`: auto, pardiso or superlu. Here the scaled matrix has its largest entry in each
    row near one.
    """
    upper = _upper_triangle(matrix)
    scale = np.ones(upper.shape[0])
    for _ in range(3):
        scale *= _power_of_two(1 / np.sqrt(_largest_in_row(_scaled(upper, scale))))
    upper = _scaled(upper, scale)
    backend = _choose(kind, ("pardiso",))
    return _factorise_double(backend, upper, scale, definite=False, limit=SINGULAR_INDEFINITE)


def factorise_roughly(matrix: csr_matrix) -> Solve:
    """Factor a positive definite `matrix` (n, n) with a diagonal near one, for a preconditioner.

    The solve takes columns (n, k), in the precision of the library. Raises SolveError where a pivot
    fails.
    """
    backend, upper = _choose("auto", ("pardiso", "cholmod")), _upper_triangle(matrix)
    try:
        return backend.factor(upper.astype(np.float32) if backend.single else upper, True)
    except BreakdownError:
        raise SolveError(
            f"a part of the matrix is not positive definite ({backend.name})"
        ) from None


def _choose(kind: str, order: tuple[str, ...]) -> Backend:
    if kind != "auto":
        return BACKENDS[kind]
    # Multigrid makes no factor: where one is needed all the same, take the best.
    if (asked := wanted()) in BACKENDS:
        if asked not in (*order, "superlu"):
            raise SolveError(f"{BACKENDS[asked].name} factors positive definite matrices only")
        if not BACKENDS[asked].available():
            raise SolveError(f"{BACKENDS[asked].name} is not installed")
        return BACKENDS[asked]
    return next(BACKENDS[name] for name in (*order, "superlu") if BACKENDS[name].available())


def _factorise_double(
    backend: Backend, upper: csr_matrix, scale: np.ndarray, definite: bool, limit: float
) -> Factor:
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
    return Factor(backend.name, lambda right, _: (solve(right), 0), scale)


def _factorise_single(backend: Backend, upper: csr_matrix, scale: np.ndarray) -> Factor | None:
    """The factor in single precision; None where it cannot be trusted."""
    try:
        arrays = upper.data.astype(np.float32), upper.indices, upper.indptr
        rough = backend.factor(csr_matrix(arrays, shape=upper.shape), True)
    except BreakdownError:
        return None

    precondition = in_single(rough)
    if not _smallest_eigenvalue(precondition, upper.shape[0]) > TRUSTED_SINGLE:
        return None

    def solve(right: np.ndarray, accuracy: float) -> tuple[np.ndarray, int]:
        multiply = partial(_multiply, upper)
        return conjugate_gradients(multiply, precondition, right, accuracy, MAX_ITERATIONS)

    return Factor(f"{backend.name}, single precision in conjugate gradients", solve, scale)


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


def _multiply(upper: csr_matrix, columns: np.ndarray) -> np.ndarray:
    return upper @ columns + upper.T @ columns - upper.diagonal()[:, None] * columns


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
