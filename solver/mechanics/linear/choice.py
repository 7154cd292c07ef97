"""The linear solver for a positive definite system, chosen by size and dimension."""

import logging
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import diags

from ...lac.errors import SolveError
from .condensed_matrix import Symmetric
from .direct import Factor, factorise, wanted
from .krylov import EPSILON
from .shared import Shared
from .unknowns import Unknowns

if TYPE_CHECKING:
    from .multigrid import Multigrid

_LOG = logging.getLogger(__name__)

MULTIGRID = "multigrid"
# Shares of the diagonal added to a matrix that is singular to working precision: its round-off.
_SHIFTS = 0.0, 1e-15, 1e-14
_SOFT = "displacements along the softest motions are not determined"
_ASKED = "as asked for"
# Unknowns in 3D from which multigrid takes less time than a factor and at most half the memory. In
# graded meshes it takes less from about 100,000.
MULTIGRID_FROM = 20_000


class LinearSolver:
    """A solver of one system for any number of right-hand sides: `name`, and `why` it was chosen.

    Multigrid is replaced by a factor when it does not converge (thin cells, nearly incompressible
    material); `gave_up` then says why and is empty otherwise. Where the matrix is singular to
    working precision, which `warning` then says, the factor is that of a matrix that differs by
    round-off: what it solves is a solution only if refinement converges.
    """

    def __init__(self, matrix: Symmetric, solver: "Factor | Multigrid | None", why: str):
        """Without a `solver` the matrix is factored."""
        self._matrix, self._why = matrix, why
        self.gave_up = self.warning = ""
        self._solver = self._factor() if solver is None else solver

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
        return not isinstance(self._solver, Factor)

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
            if isinstance(self._solver, Factor):
                raise
            self._why = self.gave_up = _fallback_reason(error)
            _LOG.info("%s", self.why)
        self._solver.close()
        self._solver = self._factor()
        return self._solver.solve(right, accuracy)

    def _factor(self) -> Factor:
        matrix = self._matrix.tocsr()
        try:
            return factorise(matrix)
        except SolveError as error:
            self.warning = str(error)
        for shift in _SHIFTS:
            try:
                shifted = matrix + shift * diags(matrix.diagonal())
                return factorise(shifted, least=0.0)
            except SolveError:
                continue
        raise SolveError(self.warning)


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
    if unknowns is None:
        return LinearSolver(matrix, None, "what multigrid asks for is not known")
    size = matrix.shape[0]
    against = gave_up or against_multigrid(size, unknowns)
    _LOG.info("linear system of %d unknowns, by %s", size, "a factor" if against else MULTIGRID)
    if not against:
        from .multigrid import Multigrid  # only where it solves

        why = f"{MULTIGRID_FROM} unknowns or more in 3D: faster and smaller than a factor"
        try:
            solver = Multigrid(matrix, unknowns, shared)
            return LinearSolver(matrix, solver, why if wanted() == "auto" else _ASKED)
        except SolveError as error:
            # A factor decides whether the matrix is to blame.
            against = gave_up = _fallback_reason(error)
            _LOG.info("%s", against)
    chosen = LinearSolver(matrix, None, against)
    chosen.gave_up = gave_up
    return chosen


def against_multigrid(size: int, unknowns: Unknowns) -> str:
    """Why a system of that size is factored; empty where it is not."""
    if wanted() != "auto":
        return "" if wanted() == MULTIGRID else _ASKED
    if unknowns.dim == 2:
        return "a factor is small in 2D"
    if unknowns.mixed:
        return "nearly incompressible cells: multigrid does not converge"
    few = size < MULTIGRID_FROM
    return f"fewer than {MULTIGRID_FROM} unknowns: a factor is faster than multigrid" * few


def _fallback_reason(error: SolveError) -> str:
    return f"multigrid does not serve here: {error}"
