"""The levels of multigrid: those of the bodies alone, and what contact changes in each.

Nodes are gathered into aggregates, whose rigid motions are the unknowns of the next level (Vanek,
Mandel, Brezina, Computing 56 (1996) 179). Quadratic cells have a level of linear cells on their
vertices first. Every level is scaled to a diagonal of at most one and kept in single precision; the
smoother is a Chebyshev polynomial of the fourth kind (Lottes, Numer. Linear Algebra Appl. 30 (2023)
e2518): products with the matrix alone.

With pivots p eliminated, a condensed system differs from the stiffness K near the closed contact
alone: on all unknowns it is K + C, with rows and columns of p that are zero. Prolongations P are
those of K. Coarse matrices are PᵀKP + PᵀCP, of which only the second part changes with the contact
status. No prolongation is smoothed across an interface: however many faces meet on it, coarse
levels do not fill in.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix, identity

from ...lac.errors import SolveError
from ..linear.condensed_matrix import CondensedMatrix, Symmetric, in_blocks
from ..linear.factor import factorise_roughly
from ..linear.krylov import eigenvalue_bound
from ..linear.products import InParts, chosen_rows, multiply, pattern, scale_blocks, sums_of_sizes
from ..linear.symmetric_blocks import NodalMatrix, SymmetricBlocks, halved
from ..linear.unknowns import LevelNodes, Unknowns, nodes_at, places
from .aggregation import aggregate, smoothed_along
from .galerkin import coarse, smoothed

# A share of the diagonal: rows with less, those of pivots, are not smoothed.
_NOTHING = 1e-4
# Added to the diagonal of a factored part: its round-off in single precision.
_SHIFT = np.float32(1e-6)


@dataclass(frozen=True)
class Correction:
    """The change C of a level's matrix: `matrix` (r, r) in its `rows` (r,); zero elsewhere."""

    rows: np.ndarray
    matrix: csr_matrix

    @cached_property
    def parts(self) -> InParts:
        """The `matrix`, for products."""
        return InParts(self.matrix)

    def product(self, x: np.ndarray) -> np.ndarray:
        """The entries (r,) of C x in its rows, x (n,)."""
        return self.parts @ x[self.rows]

    def coarser(self, prolongation: bsr_matrix) -> "Correction":
        """PᵀCP."""
        columns, way = _without_empty_columns(chosen_rows(prolongation, self.rows))
        matrix = (way.T @ (self.matrix @ way)).tocsr()
        matrix.sort_indices()
        return Correction(columns, matrix)

    def corrected_rows(self, own: csr_matrix) -> csr_matrix:
        """The rows (r, n) of K + C, given its `own` (r, n) of K."""
        columns = self.rows[self.matrix.indices]
        arrays = self.matrix.data, columns, self.matrix.indptr
        return (own + csr_matrix(arrays, shape=own.shape)).tocsr()

    def weights(self, own: csr_matrix, corrected: csr_matrix) -> np.ndarray:
        """The weight (r,) of its rows in the smoother: 0 at pivots. Other rows have one.

        Elsewhere the inverse of the diagonal of the `corrected` rows (r, n) of K + C; less where
        the entries of a row add up to more than typical of its `own` rows (r, n) of K.
        """
        before = np.asarray(abs(own).sum(axis=1)).ravel()
        diagonal = _own_diagonal(corrected, self.rows)
        there = diagonal > _NOTHING
        weight, on_all = np.zeros(len(there), np.float32), np.ones(own.shape[1], np.float32)
        weight[there] = 1 / np.sqrt(diagonal[there])
        on_all[self.rows] = weight
        sums = weight * (abs(corrected) @ on_all)
        weight /= np.sqrt(np.maximum(1.0, sums / np.median(before)))
        return weight * weight


class Interface:
    """The unknowns `chosen` (r,) of a level beside contact, solved exactly with the others held.

    `everything`: the correction has all rows of the level. What the round-off of the factor leaves
    in the chosen rows is kept there alone: elsewhere these leave nothing but the shift.
    """

    def __init__(self, correction: Correction, corrected: csr_matrix):
        """Factor, given the `corrected` rows (r, n) of the level's matrix.

        Raises SolveError where that is not positive definite.
        """
        there = np.flatnonzero(_own_diagonal(corrected, correction.rows) > _NOTHING)
        self.chosen, rows = correction.rows[there], corrected[there]
        self.everything = len(correction.rows) == corrected.shape[1]
        own = rows[:, self.chosen] + _SHIFT * identity(len(there), np.float32)
        self._solve = factorise_roughly(own)
        if not self.everything:
            others = np.ones(rows.shape[1], dtype=bool)
            others[self.chosen] = False
            rows.data *= others[rows.indices]
            rows.eliminate_zeros()
        self._near, outwards = _without_empty_columns(rows)
        self._outwards, self._inwards = InParts(outwards), InParts(outwards.T.tocsr())

    def before(self, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The change (r,) by a solve, and the residual (n,) left by it."""
        first, left = self._solved(residual[self.chosen]), residual.copy()
        if not self.everything:
            left[self.chosen] = _SHIFT * first
        left[self._near] -= self._inwards @ first
        return first, left

    def after(self, residual: np.ndarray, change: np.ndarray, first: np.ndarray) -> None:
        """Add the `first` solve and another one to the `change` (n,) of a `residual` (n,)."""
        change[self.chosen] += first
        right = residual[self.chosen] - self._outwards @ change[self._near]
        if self.everything:
            change[self.chosen] += self._solved(right)
        else:
            # The factor of A + shift yields the new values, not their change.
            change[self.chosen] = self._solved(right + _SHIFT * change[self.chosen])

    def _solved(self, right: np.ndarray) -> np.ndarray:
        return self._solve(right[:, None])[:, 0].astype(np.float32)


def correction_of(
    condensed: CondensedMatrix, scale: np.ndarray, place: np.ndarray, extra: int = 0
) -> Correction:
    """C of a condensed matrix, scaled by `scale` (n,); unknown i is in row `place[i]`.

    So many `extra` ones are in the rows of eliminated unknowns; the others are held.
    """
    stiffness, pivot = condensed.stiffness, condensed.eliminated
    size = len(condensed.kept) + extra
    own, scales = place[condensed.places[:size]], scales_of(condensed, scale)
    rows = np.flatnonzero(np.diff(condensed.added.indptr[: size + 1]))
    rows = rows[np.argsort(own[rows])]
    added = condensed.added[rows] if extra == condensed.extra else condensed.added[rows, :size]
    gone = stiffness[pivot]
    gone.eliminate_zeros()
    gone = gone.tocoo()
    one, other = place[pivot[gone.row]], place[gone.col]
    chosen, number = _numbered(np.concatenate([own[rows], one, other]), 1 + int(place.max()))
    added.data *= scales[added.indices]
    added.data *= np.repeat(scales[rows], np.diff(added.indptr))
    shape = (len(chosen),) * 2
    starts = np.zeros(len(chosen) + 1, dtype=np.int32)
    starts[1 + number[own[rows]]] = np.diff(added.indptr)
    entries = added.data.astype(np.float32), number[own][added.indices], np.cumsum(starts)
    # Rows and columns of the eliminated unknowns; between two of these each entry once.
    removed = (-gone.data * scale[pivot[gone.row]] * scale[gone.col]).astype(np.float32)
    eliminated = np.zeros(len(scale), dtype=bool)
    eliminated[pivot] = True
    once = ~eliminated[gone.col]
    rows = number[np.concatenate([one, other[once]])]
    columns = number[np.concatenate([other, one[once]])]
    gone = coo_matrix((np.concatenate([removed, removed[once]]), (rows, columns)), shape=shape)
    matrix = csr_matrix(entries, shape=shape)
    matrix.sort_indices()  # sums and factors take sorted rows faster
    return Correction(chosen, matrix + gone.tocsr())


def _numbered(used: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The numbers `used` (k,) below `size` once each, ascending, and the place of each in these."""
    there = np.zeros(size, dtype=bool)
    there[used] = True
    return np.flatnonzero(there), np.cumsum(there, dtype=np.int32) - 1


def _without_empty_columns(rows: csr_matrix) -> tuple[np.ndarray, csr_matrix]:
    """The columns (c,) that hold an entry of `rows` (r, n), and these columns (r, c) of it."""
    columns, number = _numbered(rows.indices, rows.shape[1])
    arrays = rows.data, number[rows.indices], rows.indptr
    return columns, csr_matrix(arrays, shape=(rows.shape[0], len(columns)))


def scales_of(condensed: CondensedMatrix, scale: np.ndarray) -> np.ndarray:
    """The scale (k + s,): of the stiffness (n,), and for extra unknowns to a diagonal of one."""
    own = condensed.added.diagonal()[len(condensed.kept) :]
    return np.concatenate([scale[condensed.kept], 1 / np.sqrt(own)])


def _own_diagonal(rows: csr_matrix, numbers: np.ndarray) -> np.ndarray:
    """The entries (r,) on the diagonal of a matrix, of which `rows` (r, n) have these `numbers`."""
    return np.asarray(rows[np.arange(len(numbers)), numbers]).ravel()


COARSEST = 600
"""The hierarchy ends at so many unknowns; that level is inverted as a dense matrix."""
LARGEST_DENSE = 4_000
"""Largest level that is inverted where nothing coarsens further; beyond it multigrid is refused."""
MOST_NEIGHBOURS = 100
"""Largest mean number of neighbouring aggregates (20–35 is typical, 80 where cells are slender)."""
# Lottes' optimised weights of the polynomial of degree two.
_FIRST, _SECOND = 1.02387287570313, 1.26408905371085
_SMOOTHED = 4 / 3


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
            left[self.correction.rows] -= self.correction.product(change)
        return left

    def product(self, x: np.ndarray) -> np.ndarray:
        """The product of its matrix with x (n,), contact included."""
        found = self.matrix.multiply(x)
        if self.correction is not None:
            found[self.correction.rows] += self.correction.product(x)
        return found

    def corrected(
        self, correction: Correction, most: float, beside: Correction | None = None
    ) -> "Level":
        """The level under contact, with an exact solve of up to `most` unknowns beside it.

        Where there are extra unknowns, this solve is the one of the correction `beside`, which
        has them.
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
                way = smoothed_along(
                    blocks, tentative, near, nodes.motions, _SMOOTHED, float(bound)
                )
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
