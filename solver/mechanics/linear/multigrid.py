"""Algebraic multigrid for large 3D elasticity: smoothed aggregation within conjugate gradients.

Nodes are gathered into aggregates, whose rigid motions are the unknowns of the next level (Vanek,
Mandel, Brezina, Computing 56 (1996) 179). Quadratic cells have a level of linear cells on their
vertices first. Every level is scaled to a diagonal of at most one and kept in single precision; the
smoother is a Chebyshev polynomial of the fourth kind (Lottes, Numer. Linear Algebra Appl. 30 (2023)
e2518): products with the matrix alone. Conjugate gradients in double precision take the solution to
round-off.

The hierarchy is that of the bodies alone. Contact corrects its levels (`contact_levels`), and a
factor of the unknowns beside it solves there exactly, before and after each cycle.

Where iterations are slow, each coarse level takes two steps of conjugate gradients instead of one
cycle: a K-cycle (Notay and Vassilevski, Numer. Linear Algebra Appl. 15 (2008) 473).
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ...system.errors import SolveError
from ...system.threads import ahead
from .aggregation import aggregate
from .condensed_matrix import CondensedMatrix, Symmetric, in_blocks
from .contact_levels import Correction, Interface, correction_of
from .galerkin import coarse, smoothed
from .krylov import EPSILON, by_columns, conjugate_gradients, eigenvalue_bound, in_single, two_steps
from .nodal_matrix import NodalMatrix
from .products import multiply, multiply_transposed, pattern, scale_blocks, sums_of_sizes
from .scaled_system import ScaledSystem
from .slender import smoothed_along
from .symmetric_blocks import SymmetricBlocks, halved
from .unknowns import LevelNodes, Unknowns, nodes_at, places

_LOG = logging.getLogger(__name__)

COARSEST = 600
"""The hierarchy ends at so many unknowns; that level is inverted as a dense matrix."""
LARGEST_DENSE = 4_000
"""Largest level that is inverted where nothing coarsens further; beyond it multigrid is refused."""
MOST_NEIGHBOURS = 100
"""Largest mean number of neighbouring aggregates (20–35 is typical, 80 where cells are slender)."""
MAX_ITERATIONS = 150
# Two steps on each coarse level where the first so many iterations, continued at the same rate,
# would need more than the second number. An iteration then costs up to twice as much.
_PATIENCE, _SLOW = 30, 60
# A matrix in single precision differs from the true one by more than the first share of a residual;
# who asks for less refines, and each solve goes to the second (it gains 1e-4 at a million).
_LEAST_SINGLE, _SINGLE = 1e-5, 1e-3
# Lottes' optimised weights of the polynomial of degree two.
_FIRST, _SECOND = 1.02387287570313, 1.26408905371085
_SMOOTHED = 4 / 3
# A share of the unknowns: where more are beside contact, a factor of these is one of everything.
_MOST_BESIDE = 1 / 4


@dataclass(frozen=True)
class Level:
    """One level: scaled matrix, bound of its eigenvalues, and the way up from the next.

    `correction` and `weight` (r,): what contact changes in r rows of matrix and smoother;
    `interface`: the exact solve beside it, if these unknowns are not too many.
    """

    matrix: SymmetricBlocks
    bound: np.float32
    prolongation: bsr_matrix
    correction: Correction | None = None
    weight: np.ndarray | None = None
    interface: Interface | None = None

    @property
    def all_beside(self) -> bool:
        """Whether all of its unknowns are beside contact: the exact solve leaves nothing to smooth.

        Levels below still serve motions so soft that the round-off of its factor hides them.
        """
        return self.interface is not None and self.interface.everything

    def smooth(self, residual: np.ndarray, onto: np.ndarray | None = None) -> np.ndarray:
        """`onto` (n,) plus the correction for a residual (n,): the Chebyshev polynomial of it.

        The polynomial is `_SECOND` 12/5 / bound · (1 − A S) + (`_FIRST` + `_SECOND` / 5) S with
        S = 4/3 / bound · W; the weights W are one but beside contact, where they are on both sides.
        """
        first, factor = 4 / 3 / float(self.bound), _SECOND * 12 / 5 / float(self.bound)
        own = (_FIRST + _SECOND / 5) * first
        numbers = -factor * first, 1.0, factor + own
        if self.correction is None:
            return self.matrix.multiply(residual, onto, *numbers)
        rows = self.correction.rows
        given = residual[rows]
        near = self.weight * given
        residual[rows] = near
        found = self.matrix.multiply(residual, onto, *numbers)
        residual[rows] = given
        before = 0 if onto is None else onto[rows]
        left = found[rows] - before - numbers[2] * near + factor * given
        left -= factor * first * (self.correction.parts @ near)
        found[rows] = before + self.weight * left + own * near
        return found

    def remaining(
        self, residual: np.ndarray, change: np.ndarray, out: np.ndarray | None = None
    ) -> np.ndarray:
        """The residual (n,) after a change; into `out` (n,), if given, which is neither."""
        left = self.matrix.multiply(change, residual, -1.0, out=out)
        if self.correction is not None:
            self.correction.subtract_product(left, change)
        return left

    def product(self, x: np.ndarray) -> np.ndarray:
        """The product of its matrix with x (n,), contact included."""
        found = self.matrix.multiply(x)
        if self.correction is not None:
            found[self.correction.rows] += self.correction.parts @ x[self.correction.rows]
        return found

    def corrected(
        self, correction: Correction, most: float, beside: Correction | None = None
    ) -> "Level":
        """The level under contact, with an exact solve of up to `most` unknowns beside it.

        Where there are springs, this solve is the one of the correction `beside`, which has them.
        """
        own = self.matrix.chosen_rows(correction.rows)
        rows = correction.corrected_rows(own)
        weight, interface = correction.weights(own, rows), None
        if beside is not None:
            own = self.matrix.chosen_rows(beside.rows)
            interface = Interface(beside, beside.corrected_rows(own))
        elif len(correction.rows) <= most:
            interface = Interface(correction, rows)
        near, half = rows[:, correction.rows], np.sqrt(weight)

        def symmetric(x: np.ndarray, base: np.ndarray) -> np.ndarray:
            return base + half * (near @ (half * x))

        # A motion with the largest eigenvalue is either within the bodies or beside contact.
        bound = max(self.bound, eigenvalue_bound(symmetric, len(half)))
        return replace(self, bound=bound, correction=correction, weight=weight, interface=interface)


class Hierarchy:
    """The levels of the bodies alone, each free to move.

    `scale` (n,) of the unknowns and their rows `place` (n,) of `size` in the first level; the
    matrix `last` of the last level.
    """

    def __init__(self, matrix: Symmetric, unknowns: Unknowns):
        """Set up for a symmetric `matrix` (n, n); raises SolveError as `Multigrid`."""
        diagonal = matrix.diagonal()
        if not (diagonal > 0).all():
            raise SolveError("the matrix is not positive definite: its diagonal is not positive")
        self.scale = 1 / np.sqrt(diagonal)
        blocks, self.place = in_blocks(matrix, self.scale, unknowns)
        self.size = blocks.shape[0]
        nodes = nodes_at(unknowns, self.place, self.size, self.scale)
        blocks, motions, scale = _scaled(blocks, nodes.motions)
        self.scale = self.scale * scale[self.place]
        if isinstance(matrix, NodalMatrix):
            matrix.now_scaled(self.scale)
        self.levels: list[Level] = []
        nodes = replace(nodes, motions=motions)
        if unknowns.quadratic and self.size > COARSEST:
            blocks, nodes = self._add_linear(blocks, unknowns)
        while blocks.shape[0] > COARSEST:
            bound = _bound_of(blocks)
            tentative, coarse_nodes, near = aggregate(blocks, nodes)
            if tentative.nnz == 0 or 2 * tentative.shape[1] > blocks.shape[0]:
                break
            if near is None:
                way = smoothed(blocks, tentative, _SMOOTHED / float(bound))
            else:
                about = nodes.motions, _SMOOTHED, float(bound)
                way = smoothed_along(blocks, tentative, near, *about)
            _refuse_fill(way)
            blocks, nodes = self._add(blocks, bound, way, coarse_nodes)
        if blocks.shape[0] > LARGEST_DENSE:
            size = blocks.shape[0]
            raise SolveError(f"its levels end at {size} unknowns: nothing coarsens further")
        self.last = blocks
        if isinstance(matrix, NodalMatrix) and self.levels:
            matrix.halve(self.levels[0].matrix)

    def _add_linear(self, matrix: bsr_matrix, unknowns: Unknowns) -> tuple[bsr_matrix, LevelNodes]:
        """Add the level of quadratic cells; return matrix and nodes of the linear ones."""
        assert unknowns.linear is not None
        vertices = unknowns.of_vertices()
        place, size = places(vertices)
        way, nodes = unknowns.linear.tocoo(), nodes_at(vertices, place, size)
        entries = (way.data / self.scale[way.row]).astype(np.float32)
        where = self.place[way.row], place[way.col]
        prolongation = csr_matrix((entries, where), shape=(self.size, size)).tobsr((3, 3))
        return self._add(matrix, _bound_of(matrix), prolongation, nodes)

    def _add(
        self, matrix: bsr_matrix, bound: np.float32, prolongation: bsr_matrix, nodes: LevelNodes
    ) -> tuple[bsr_matrix, LevelNodes]:
        """Add a level; return matrix and nodes of the next."""
        below, motions, scale = _scaled(coarse(matrix, prolongation), nodes.motions)
        left = np.ones(prolongation.shape[0], dtype=np.float32)
        scale_blocks(prolongation, left, scale.astype(np.float32))
        self.levels.append(Level(halved(matrix), bound, prolongation))
        return below, replace(nodes, motions=motions)


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

        Coarse levels hold springs. These, and constraints that were added with a weight, need the
        exact solve beside contact.
        """
        about = condensed, hierarchy.scale, hierarchy.place
        correction, beside = correction_of(*about), None
        needed = condensed.springs or not len(condensed.eliminated)
        self._levels, most = [], np.inf if needed else _MOST_BESIDE * hierarchy.size
        if condensed.springs:
            beside = correction_of(*about, condensed.springs)
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
        first, (others, last) = ahead(lambda task: task(), tasks)
        self._levels = [first, *others]
        return last

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:
        """Solve for `right` (n,) or (n, k), to a residual of `accuracy` times that.

        In 2-norms of the system scaled to a diagonal of at most one; to 10⁻³ where less than 10⁻⁵
        is asked of a matrix in single precision. Raises SolveError where `MAX_ITERATIONS` do not or
        will not suffice, and where the solution is not finite.
        """
        columns = np.asarray(right, dtype=float)
        columns = columns if columns.ndim == 2 else columns[:, None]
        if self._single and accuracy < _LEAST_SINGLE:
            accuracy = _SINGLE
        system = self._system

        def watch(iteration: int, reached: float) -> None:
            if iteration == _PATIENCE and reached > accuracy ** (_PATIENCE / _SLOW):
                _LOG.info("slow iterations: coarse levels take two steps each")
                self._shared.slow = True

        about = self._precondition, system.lifted(columns), accuracy, MAX_ITERATIONS, watch
        solution, iterations = conjugate_gradients(system.multiply, *about)
        if not np.isfinite(solution).all():
            raise SolveError(f"the solution by {self.name} is not finite")
        self.iterations = max(self.iterations, iterations)
        return system.solution(solution).reshape(np.shape(right))

    def close(self) -> None:
        """Release the hierarchy; it solves no more."""
        self._levels = []
        self._shared.close()

    @property
    def scale(self) -> np.ndarray:
        """The scale (n,) of the unknowns."""
        return self._system.scale

    def cycle(self, residual: np.ndarray) -> np.ndarray:
        """The correction for a residual (n,), one cycle; both scaled."""
        return self._precondition(self._system.placed(residual[:, None]))[self._system.place, 0]

    def _precondition(self, residual: np.ndarray) -> np.ndarray:
        """The same for columns (size, k) in the rows of the first level."""
        cycles = partial(by_columns, partial(self._descend, 0))
        return self._system.without_idle(in_single(cycles)(residual))

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


def _bound_of(matrix: bsr_matrix) -> np.float32:
    return eigenvalue_bound(partial(multiply, matrix), matrix.shape[0])


def _refuse_fill(prolongation: bsr_matrix) -> None:
    """Raise SolveError where the next level will have too many neighbours, before it is formed."""
    felt = pattern(prolongation)
    near = (felt.T @ felt).nnz / felt.shape[1]
    if near > MOST_NEIGHBOURS:
        raise SolveError(f"its coarse levels would fill in, to {near:.0f} neighbours or more")


def _scaled(matrix: bsr_matrix, motions: np.ndarray) -> tuple[bsr_matrix, np.ndarray, np.ndarray]:
    """Matrix and motions scaled to a diagonal of at most one, in place, and the scale (n,).

    Rows whose entries add up to more than the typical sum are scaled down further: otherwise the
    few at a contact surface would set the eigenvalue bound for all. Zero rows, which have no
    unknown, stay zero.
    """
    diagonal = matrix.diagonal().astype(float)
    there = diagonal > 0
    scale = np.where(there, 1 / np.sqrt(np.where(there, diagonal, 1.0)), 0.0)
    sums = scale * sums_of_sizes(matrix, scale.astype(np.float32))
    scale /= np.sqrt(np.maximum(1.0, sums / np.median(sums[there])))
    single = scale.astype(np.float32)
    scale_blocks(matrix, single, single)
    scale = single.astype(float)
    motions *= np.where(there, 1 / np.where(there, scale, 1.0), 0.0)[:, None]
    return matrix, motions, scale
