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

from .condensed_matrix import CondensedMatrix
from .direct import factorise_roughly
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

    def subtract_product(self, left: np.ndarray, x: np.ndarray) -> None:
        """Subtract C x from what is `left` (n,)."""
        left[self.rows] -= self.parts @ x[self.rows]

    def coarser(self, prolongation: bsr_matrix) -> "Correction":
        """PᵀCP."""
        way = chosen_rows(prolongation, self.rows)
        columns, local = np.unique(way.indices, return_inverse=True)
        way = csr_matrix((way.data, local, way.indptr), shape=(len(self.rows), len(columns)))
        return Correction(columns, (way.T @ (self.matrix @ way)).tocsr())

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
    """The unknowns `chosen` (r,) of a level beside contact, solved exactly with the others held."""

    def __init__(self, correction: Correction, corrected: csr_matrix):
        """Factor, given the `corrected` rows (r, n) of the level's matrix.

        Raises SolveError where that is not positive definite.
        """
        there = np.flatnonzero(_own_diagonal(corrected, correction.rows) > _NOTHING)
        self.chosen, rows = correction.rows[there], corrected[there]
        own = rows[:, self.chosen] + _SHIFT * identity(len(there), np.float32)
        self._solve = factorise_roughly(own)
        others = np.ones(rows.shape[1], dtype=bool)
        others[self.chosen] = False
        rows = rows.tocoo()
        outer = others[rows.col]
        self._near, local = np.unique(rows.col[outer], return_inverse=True)
        entries = rows.data[outer], (rows.row[outer], local.astype(np.int32))
        outwards = csr_matrix(entries, shape=(len(there), len(self._near)))
        self._outwards, self._inwards = InParts(outwards), InParts(outwards.T.tocsr())

    def before(self, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The change (r,) by a solve, and the residual (n,) left by it."""
        first, left = self._solved(residual[self.chosen]), residual.copy()
        left[self.chosen] = _SHIFT * first
        left[self._near] -= self._inwards @ first
        return first, left

    def after(self, residual: np.ndarray, change: np.ndarray, first: np.ndarray) -> None:
        """Add the `first` solve and another one to the `change` (n,) of a `residual` (n,)."""
        right = residual[self.chosen] - self._outwards @ change[self._near]
        # The factor of A + shift yields the new values, not their change.
        right += _SHIFT * (first + change[self.chosen])
        change[self.chosen] = self._solved(right)

    def _solved(self, right: np.ndarray) -> np.ndarray:
        return self._solve(right[:, None])[:, 0].astype(np.float32)


def correction_of(
    condensed: CondensedMatrix, scale: np.ndarray, place: np.ndarray, springs: int = 0
) -> Correction:
    """C of a condensed matrix, scaled by `scale` (n,); unknown i is in row `place[i]`.

    So many `springs` are in the rows of eliminated unknowns; the others are held.
    """
    stiffness, pivot = condensed.stiffness, condensed.eliminated
    where, scales = condensed.places, scales_of(condensed, scale)
    some = slice(len(condensed.kept) + springs)
    eliminated = np.zeros(stiffness.shape[0], dtype=bool)
    eliminated[pivot] = True
    added, gone = condensed.added[some, some].tocoo(), stiffness[pivot]
    gone.eliminate_zeros()
    gone = gone.tocoo()
    rows, columns = pivot[gone.row], gone.col
    once = ~eliminated[columns]
    removed = -gone.data * scale[rows] * scale[columns]
    rows = np.concatenate([where[added.row], rows, columns[once]])
    columns = np.concatenate([where[added.col], columns, pivot[gone.row][once]])
    given = added.data * scales[added.row] * scales[added.col]
    values = np.concatenate([given, removed, removed[once]])
    chosen, local = np.unique(place[np.concatenate([rows, columns])], return_inverse=True)
    entries = values.astype(np.float32), (local[: len(rows)], local[len(rows) :])
    return Correction(chosen, coo_matrix(entries, shape=(len(chosen),) * 2).tocsr())


def scales_of(condensed: CondensedMatrix, scale: np.ndarray) -> np.ndarray:
    """The scale (k + s,): of the stiffness (n,), and for springs to a diagonal of one."""
    springs = condensed.added.diagonal()[len(condensed.kept) :]
    return np.concatenate([scale[condensed.kept], 1 / np.sqrt(springs)])


def _own_diagonal(rows: csr_matrix, numbers: np.ndarray) -> np.ndarray:
    """The entries (r,) on the diagonal of a matrix, of which `rows` (r, n) have these `numbers`."""
    return np.asarray(rows[np.arange(len(numbers)), numbers]).ravel()
