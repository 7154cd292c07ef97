"""The linear solver for a positive definite system, chosen by size and dimension.

Multigrid serves large systems in space, a factor all others, and those on which multigrid fails.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from ...lac.errors import SolveError
from .condensed_matrix import Symmetric
from .factor import Factor, factorise
from .krylov import EPSILON
from .unknowns import AUTO, Unknowns

if TYPE_CHECKING:
    from ..multigrid.multigrid import Multigrid, Shared


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


class Solvers:
    """Solvers of one stiffness under one contact status after another.

    Without `unknowns`, which multigrid asks for, they are factors. `gave_up`: why multigrid failed
    on a matrix before; it is then not tried again.
    """

    def __init__(self, unknowns: Unknowns | None = None, gave_up: str = ""):
        """`unknowns` are those of the stiffness."""
        self.unknowns, self.gave_up = unknowns, gave_up
        self._shared: Shared | None = None

    def prepare(self, matrix: Symmetric) -> LinearSolver:
        """Prepare to solve with a symmetric positive definite `matrix` (n, n).

        It is the stiffness, or condensed from it. Raises SolveError where the matrix is not
        positive definite beyond round-off; see `LinearSolver`. A singular matrix that multigrid
        solves for a consistent right-hand side goes unnoticed.
        """
        size, against = matrix.shape[0], "what multigrid asks for is not known"
        if self.unknowns is not None:
            against = self.gave_up or against_multigrid(size, self.unknowns)
        _LOG.info("linear system of %d unknowns, by %s", size, "a factor" if against else MULTIGRID)
        if self.unknowns is not None and not against:
            why = f"{MULTIGRID_FROM} unknowns or more in 3D: faster and smaller than a factor"
            try:
                solver = self._multigrid(matrix, self.unknowns)
                return LinearSolver(matrix, solver, why if self.unknowns.solver == AUTO else _ASKED)
            except SolveError as error:
                # A factor decides whether the matrix is to blame.
                against = self.gave_up = _fallback_reason(error)
                _LOG.info("%s", against)
        factor = factorise(matrix.tocsr(), nearly=True)
        return LinearSolver(matrix, factor, against, self.gave_up)

    def _multigrid(self, matrix: Symmetric, unknowns: Unknowns) -> Multigrid:
        from ..multigrid.multigrid import Multigrid, Shared

        self._shared = self._shared or Shared()
        return Multigrid(matrix, unknowns, self._shared)

    def forget(self) -> None:
        """Release what multigrid keeps of the stiffness."""
        if self._shared:
            self._shared.close()


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
