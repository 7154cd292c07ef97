"""The linear solver for a positive definite system, chosen by size and dimension.

CHOLMOD solves directly. The matrix is first scaled symmetrically to a diagonal near one, by powers
of two, which rounds nothing. The rest does not depend on units, and a pivot or an eigenvalue of the
scaled matrix can be compared with the machine precision.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Self

import numpy as np
from scipy.sparse import csr_matrix, sparray, spmatrix

from ...lac.errors import SolveError
from .condensed_matrix import Symmetric
from .krylov import EPSILON
from .unknowns import AUTO, Unknowns

if TYPE_CHECKING:
    from ..multigrid.hierarchy import Hierarchy
    from ..multigrid.multigrid import Multigrid


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


class Shared:
    """The hierarchy of one stiffness matrix, set up once for all contact statuses.

    `slow`: whether iterations were so slow that coarse levels take two steps each from then on.
    """

    def __init__(self) -> None:
        """Nothing is set up yet."""
        self._hierarchy: Hierarchy | None = None
        self.slow = False

    def hierarchy(self, matrix: Symmetric, unknowns: Unknowns) -> Hierarchy:
        """The hierarchy of `matrix`, the same at each call until it is closed."""
        if self._hierarchy is None:
            from ..multigrid.hierarchy import Hierarchy

            self._hierarchy = Hierarchy(matrix, unknowns)
        return self._hierarchy

    def close(self) -> None:
        """Release its memory."""
        self._hierarchy = None


_LOG = logging.getLogger(__name__)

MULTIGRID = "multigrid"
_SOFT = "displacements along the softest motions are not determined"
_ASKED = "as asked for"
# Unknowns in 3D from which multigrid takes less time than a factor and at most half the memory. In
# graded meshes it takes less from about 100,000.
MULTIGRID_FROM = 20_000


class LinearSolver:
    """A solver of one system for any number of right-hand sides: `name`, and `why` it was chosen.

    Multigrid is replaced by a factor when it does not converge (thin cells, nearly incompressible
    material); `gave_up` then says why and is empty otherwise. With the `warning` of a factor, what
    it solves is a solution only if refinement converges.
    """

    def __init__(self, matrix: Symmetric, solver: Factor | Multigrid, why: str, gave_up: str = ""):
        """`solver` solves with `matrix`."""
        self._matrix, self._solver, self._why, self.gave_up = matrix, solver, why, gave_up

    @property
    def warning(self) -> str:
        """See `Factor`."""
        return self._solver.warning

    @property
    def why(self) -> str:
        """Why it was chosen, and what to mind."""
        return f"{self._why}; nearly singular: {_SOFT}" if self.warning else self._why

    @property
    def name(self) -> str:
        """Of the library or method."""
        return self._solver.name

    @property
    def iterative(self) -> bool:
        """Whether a less accurate solution takes less time."""
        return self._solver.iterative

    @property
    def iterations(self) -> int:
        """Largest number of iterations of one solution so far; 0 for a factor alone."""
        return self._solver.iterations

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:
        """Solve for `right` (n,) or (n, k), to a residual of `accuracy` times that, or better.

        Raises SolveError where the solution is not finite or the iterations do not converge.
        """
        try:
            return self._solver.solve(right, accuracy)
        except SolveError as error:
            if not self._solver.iterative:
                raise
            self._why = self.gave_up = _fallback_reason(error)
            _LOG.info("%s", self.why)
        self._solver.close()
        self._solver = factorise(self._matrix.tocsr(), nearly=True)
        return self._solver.solve(right, accuracy)


def prepare(
    matrix: Symmetric,
    unknowns: Unknowns | None = None,
    gave_up: str = "",
    shared: Shared | None = None,
) -> LinearSolver:
    """Prepare to solve with a symmetric positive definite `matrix` (n, n).

    Without `unknowns`, which multigrid asks for, the matrix is factored. `shared`: see `Multigrid`.
    `gave_up`: why multigrid failed on a similar matrix; it is then not tried again. Raises
    SolveError where the matrix is not positive definite beyond round-off; see `LinearSolver`.
    A singular matrix that multigrid solves for a consistent right-hand side goes unnoticed.
    """
    size, against = matrix.shape[0], "what multigrid asks for is not known"
    if unknowns is not None:
        against = gave_up or against_multigrid(size, unknowns)
    _LOG.info("linear system of %d unknowns, by %s", size, "a factor" if against else MULTIGRID)
    if unknowns is not None and not against:
        from ..multigrid.multigrid import Multigrid

        why = f"{MULTIGRID_FROM} unknowns or more in 3D: faster and smaller than a factor"
        try:
            solver = Multigrid(matrix, unknowns, shared)
            return LinearSolver(matrix, solver, why if unknowns.solver == AUTO else _ASKED)
        except SolveError as error:
            # A factor decides whether the matrix is to blame.
            against = gave_up = _fallback_reason(error)
            _LOG.info("%s", against)
    return LinearSolver(matrix, factorise(matrix.tocsr(), nearly=True), against, gave_up)


def against_multigrid(size: int, unknowns: Unknowns) -> str:
    """Why a system of that size is factored; empty where it is not."""
    if unknowns.solver != AUTO:
        return "" if unknowns.solver == MULTIGRID else _ASKED
    if unknowns.dim == 2:
        return "a factor is small in 2D"
    if unknowns.factored:
        return unknowns.factored
    few = size < MULTIGRID_FROM
    return f"fewer than {MULTIGRID_FROM} unknowns: a factor is faster than multigrid" * few


def _fallback_reason(error: SolveError) -> str:
    return f"multigrid does not serve here: {error}"
