"""Algebraic multigrid for large 3D elasticity: smoothed aggregation within conjugate gradients.

Cycles through the levels of `hierarchy` are the preconditioner, in single precision. Conjugate
gradients in double precision take the solution to round-off. Contact corrects the levels, and a
factor of the unknowns beside it solves there exactly, before and after each cycle.

Where iterations are slow, each coarse level takes two steps of conjugate gradients instead of one
cycle: a K-cycle (Notay and Vassilevski, Numer. Linear Algebra Appl. 15 (2008) 473).

The system is scaled, in the rows of the first level: conjugate gradients pass over their vectors
many times, and scales are for the first and the last of these alone.
"""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from ...lac.errors import SolveError
from ...lac.threads import prefetch
from ..linear.condensed_matrix import CondensedMatrix, Symmetric
from ..linear.krylov import EPSILON, conjugate_gradients, in_single, two_steps
from ..linear.products import multiply, multiply_transposed
from ..linear.symmetric_blocks import NodalMatrix
from ..linear.unknowns import Unknowns
from .hierarchy import Correction, Hierarchy, Level, correction_of, scales_of


class ScaledSystem:
    """D A D for a matrix A (n, n) and the `scale` D (n,); row i is `place[i]` of `size`.

    The other rows are idle: they are zero, in vectors (size, k) too.
    """

    def __init__(self, matrix: Symmetric, scale: np.ndarray, place: np.ndarray, size: int):
        """`scale` and `place` of `matrix`, or of the stiffness that it is condensed from.

        Extra unknowns are in the rows of the first eliminated ones.
        """
        self._matrix, self.scale, self.place, self._size = matrix, scale, place, size
        self._added: csr_matrix | None = None
        self._extra = place[:0]
        stiffness = matrix
        if isinstance(matrix, CondensedMatrix):
            stiffness, self.place = matrix.stiffness, place[matrix.places]
            self.scale = scales_of(matrix, scale)
            self._extra = self.place[len(matrix.kept) :]
            self._add(matrix.added)
        idle = np.ones(size, dtype=bool)
        idle[self.place] = False
        self._idle = np.flatnonzero(idle)
        self._blocks = self._around = None
        if isinstance(stiffness, NodalMatrix):
            self._blocks = stiffness.blocks
            if stiffness.scale is not scale:
                self._around = np.zeros(size)
                self._around[place] = scale if stiffness.scale is None else scale / stiffness.scale

    def _add(self, added: csr_matrix) -> None:
        """What is added to the stiffness, scaled, in the rows that have any of it."""
        rows = np.flatnonzero(np.diff(added.indptr))
        scale, some = self.scale[rows], added[rows][:, rows].tocsr()
        some.data *= np.repeat(scale, np.diff(some.indptr)) * scale[some.indices]
        self._rows, self._added = self.place[rows], some

    def placed(self, x: np.ndarray) -> np.ndarray:
        """A vector (n,) in its rows (size,)."""
        found = np.zeros(self._size)
        found[self.place] = x
        return found

    def lifted(self, right: np.ndarray) -> np.ndarray:
        """The right-hand side (size,) of the scaled system for `right` (n,)."""
        return self.placed(self.scale * right)

    def solution(self, found: np.ndarray) -> np.ndarray:
        """The solution (n,) of the system, from the scaled one (size,)."""
        return np.asarray(self.scale * found[self.place])

    def without_idle(self, x: np.ndarray) -> np.ndarray:
        """The same vector (size,), zero in idle rows from now on."""
        x[self._idle] = 0
        return x

    def multiply(self, x: np.ndarray) -> np.ndarray:
        """The product with a vector (size,), by the blocks of the stiffness where it has some."""
        if self._blocks is None:
            return self.lifted(self._matrix @ self.solution(x))
        bodies = x if self._around is None else self._around * x
        if len(self._extra):
            # The stiffness does not know what is in these rows.
            bodies = bodies.copy() if bodies is x else bodies
            bodies[self._extra] = 0
        found = self._blocks.multiply(bodies)
        if self._around is not None:
            found *= self._around
        found[self._idle] = found[self._extra] = 0
        if self._added is not None:
            found[self._rows] += self._added @ x[self._rows]
        return found


_LOG = logging.getLogger(__name__)

MAX_ITERATIONS = 150
# Two steps on each coarse level where the first so many iterations, continued at the same rate,
# would need more than the second number. An iteration then costs up to twice as much.
_PATIENCE, _SLOW = 30, 60
# A matrix in single precision differs from the true one by more than the first share of a residual;
# who asks for less refines, and each solve goes to the second (it gains 1e-4 at a million).
_LEAST_SINGLE, _SINGLE = 1e-5, 1e-3
# A share of the unknowns: where more are beside contact, a factor of these is one of everything.
_MOST_BESIDE = 1 / 4


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
            self._hierarchy = Hierarchy(matrix, unknowns)
        return self._hierarchy

    def close(self) -> None:
        """Release its memory."""
        self._hierarchy = None


class Multigrid:
    """Multigrid for one matrix. `iterations`: the most that a solve has taken so far."""

    iterative = True
    warning = ""

    def __init__(self, matrix: Symmetric, unknowns: Unknowns, shared: Shared | None = None):
        """Set up for a symmetric positive definite `matrix` (n, n).

        `unknowns` are its own, or those of the stiffness that it is condensed from, whose hierarchy
        is `shared`. Raises SolveError where the diagonal is not positive, nothing coarsens, or
        coarse levels would fill in.
        """
        self.iterations = 0
        self._shared = shared or Shared()
        condensed = matrix if isinstance(matrix, CondensedMatrix) else None
        stiffness = condensed.stiffness if condensed else matrix
        self._single = isinstance(stiffness, NodalMatrix) and stiffness.single
        hierarchy = self._shared.hierarchy(stiffness, unknowns)
        self._levels = hierarchy.levels
        last = hierarchy.last.toarray().astype(float)
        if condensed is not None:
            correction = self._correct(condensed, hierarchy)
            last[np.ix_(correction.rows, correction.rows)] += correction.matrix.toarray()
        self._system = ScaledSystem(matrix, hierarchy.scale, hierarchy.place, hierarchy.size)
        inverse = np.linalg.pinv((last + last.T) / 2, rcond=1e-7, hermitian=True)
        self._coarsest = inverse.astype(np.float32)
        self.name = f"conjugate gradients with multigrid of {len(self._levels) + 1} levels"

    def _correct(self, condensed: CondensedMatrix, hierarchy: Hierarchy) -> Correction:
        """The levels under contact; return the correction of the last one.

        Coarse levels hold extra unknowns. These, and constraints that were added with a weight,
        need the exact solve beside contact.
        """
        scale, place = hierarchy.scale, hierarchy.place
        correction, beside = correction_of(condensed, scale, place), None
        needed = condensed.extra or not len(condensed.eliminated)
        self._levels, most = [], np.inf if needed else _MOST_BESIDE * hierarchy.size
        if condensed.extra:
            beside = correction_of(condensed, scale, place, condensed.extra)
        if not hierarchy.levels:
            return beside or correction
        finest, *coarser = hierarchy.levels

        def below() -> tuple[list[Level], Correction]:
            found, change = [], correction.coarser(finest.prolongation)
            for level in coarser:
                found.append(level.corrected(change, most))
                change = change.coarser(level.prolongation)
            return found, change

        # The exact solve of the first level takes about as long to set up as all that is below.
        tasks: list[Callable[[], Any]] = [
            partial(finest.corrected, correction, most, beside),
            below,
        ]
        first, (others, last) = prefetch(lambda task: task(), tasks)
        self._levels = [first, *others]
        return last

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:
        """Solve for `right` (n,) or (n, k), to a residual of `accuracy` times that.

        In 2-norms of the system scaled to a diagonal of at most one; to 10⁻³ where less than 10⁻⁵
        is asked of a matrix in single precision. Raises SolveError where `MAX_ITERATIONS` do not or
        will not suffice, and where the solution is not finite.
        """
        right = np.asarray(right, dtype=float)
        if right.ndim == 2:
            columns = [self.solve(column, accuracy) for column in right.T]
            return np.array(columns).reshape(right.T.shape).T
        if self._single and accuracy < _LEAST_SINGLE:
            accuracy = _SINGLE
        system = self._system

        def watch(iteration: int, reached: float) -> None:
            if iteration == _PATIENCE and reached > accuracy ** (_PATIENCE / _SLOW):
                _LOG.info("slow iterations: coarse levels take two steps each")
                self._shared.slow = True

        lifted = system.lifted(right)
        solution, iterations = conjugate_gradients(
            system.multiply, self._precondition, lifted, accuracy, MAX_ITERATIONS, watch
        )
        if not np.isfinite(solution).all():
            raise SolveError(f"the solution by {self.name} is not finite")
        self.iterations = max(self.iterations, iterations)
        return system.solution(solution)

    def close(self) -> None:
        """Release the hierarchy; it solves no more."""
        self._levels = []
        self._shared.close()

    def _precondition(self, residual: np.ndarray) -> np.ndarray:
        """The correction for a residual (size,), one cycle; both scaled."""
        return self._system.without_idle(in_single(partial(self._descend, 0), residual))

    def _descend(self, depth: int, residual: np.ndarray) -> np.ndarray:
        """One cycle from a level down; where that is slow two steps on each coarse level."""
        if depth == len(self._levels):
            # No BLAS here: its threads keep a core busy for a while, idle as they are.
            return np.asarray(np.einsum("ij,j->i", self._coarsest, residual))
        once = partial(self._once, depth)
        if depth == 0 or not self._shared.slow:
            return once(residual)
        return two_steps(once, self._levels[depth].product, residual)

    def _once(self, depth: int, residual: np.ndarray) -> np.ndarray:
        """One cycle from a level down, exact before and after it beside contact."""
        level = self._levels[depth]
        if level.interface is None:
            return self._through(depth, residual)
        first, left = level.interface.before(residual)
        change = self._through(depth, left)
        level.interface.after(residual, change, first)
        return change

    def _through(self, depth: int, residual: np.ndarray) -> np.ndarray:
        """Smoothing before and after the levels below."""
        level = self._levels[depth]
        if level.all_beside:
            below = multiply_transposed(level.prolongation, residual)
            return multiply(level.prolongation, self._descend(depth + 1, below))
        change = level.smooth(residual)
        left = level.remaining(residual, change)
        below = multiply_transposed(level.prolongation, left)
        multiply(level.prolongation, self._descend(depth + 1, below), change, out=change)
        return level.smooth(level.remaining(residual, change, left), change)
