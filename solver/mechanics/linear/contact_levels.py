"""The levels of multigrid under contact: those of the bodies alone, and a small correction of each.

With pivots p eliminated, a condensed system differs from the stiffness K near the closed contact
alone: on all unknowns it is K + C, with rows and columns of p that are zero. Prolongations P are
those of K. Coarse matrices are PᵀKP + PᵀCP, of which only the second part changes with the contact
status. No prolongation is smoothed across an interface: however many faces meet on it, coarse
levels do not fill in.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix, identity

from .choice import factorise_roughly
from .condensed_matrix import CondensedMatrix
from .products import InParts, chosen_rows

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
    condensed: CondensedMatrix, scale: np.ndarray, place: np.ndarray, springs: int = 0
) -> Correction:
    """C of a condensed matrix, scaled by `scale` (n,); unknown i is in row `place[i]`.

    So many `springs` are in the rows of eliminated unknowns; the others are held.
    """
    stiffness, pivot = condensed.stiffness, condensed.eliminated
    size = len(condensed.kept) + springs
    own, scales = place[condensed.places[:size]], scales_of(condensed, scale)
    rows = np.flatnonzero(np.diff(condensed.added.indptr[: size + 1]))
    rows = rows[np.argsort(own[rows])]
    added = condensed.added[rows] if springs == condensed.springs else condensed.added[rows, :size]
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
    """The scale (k + s,): of the stiffness (n,), and for springs to a diagonal of one."""
    springs = condensed.added.diagonal()[len(condensed.kept) :]
    return np.concatenate([scale[condensed.kept], 1 / np.sqrt(springs)])


def _own_diagonal(rows: csr_matrix, numbers: np.ndarray) -> np.ndarray:
    """The entries (r,) on the diagonal of a matrix, of which `rows` (r, n) have these `numbers`."""
    return np.asarray(rows[np.arange(len(numbers)), numbers]).ravel()
