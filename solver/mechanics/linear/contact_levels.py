"""The levels of multigrid under contact: those of the bodies alone, and a small correction of each.

With pivots p eliminated, a condensed system differs from the stiffness K near the closed contact
alone: on all unknowns it is K + C, with rows and columns of p that are zero. Prolongations P are
those of K. Coarse matrices are PᵀKP + PᵀCP, of which only the second part changes with the contact
status. No prolongation is smoothed across an interface: however many faces meet on it, coarse
levels do not fill in.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix

from .condensed_matrix import CondensedMatrix
from .direct import factorise_roughly

# A share of the diagonal: rows with less, those of pivots, are not smoothed.
_NOTHING = 1e-4


@dataclass(frozen=True)
class Correction:
    """The change C of a level's matrix: `matrix` (r, r) in its `rows` (r,); zero elsewhere."""

    rows: np.ndarray
    matrix: csr_matrix

    def add_product(self, image: np.ndarray, x: np.ndarray) -> None:
        """Add C x to the `image` (n, k) of `x`."""
        image[self.rows] += self.matrix @ x[self.rows]

    def coarser(self, prolongation: bsr_matrix) -> "Correction":
        """PᵀCP."""
        way = _chosen_rows(prolongation, self.rows)
        columns, local = np.unique(way.indices, return_inverse=True)
        way = csr_matrix((way.data, local, way.indptr), shape=(len(self.rows), len(columns)))
        return Correction(columns, (way.T @ (self.matrix @ way)).tocsr())

    def weights(self, matrix: bsr_matrix) -> np.ndarray:
        """The weight (n, 1) of each row in the smoother: one where nothing changed, 0 at pivots.

        Elsewhere the inverse of the diagonal of K + C; less where the entries of a row add up to
        more than typical of K.
        """
        rows = _chosen_rows(matrix, self.rows)
        whole = csr_matrix(
            (self.matrix.data, self.rows[self.matrix.indices], self.matrix.indptr), shape=rows.shape
        )
        before = np.asarray(abs(rows).sum(axis=1)).ravel()
        changed = rows + whole
        diagonal = self.matrix.diagonal() + matrix.diagonal()[self.rows]
        there = diagonal > _NOTHING
        weight = np.ones(matrix.shape[0], dtype=np.float32)
        weight[self.rows] = np.where(there, 1 / np.sqrt(np.where(there, diagonal, 1.0)), 0.0)
        sums = weight[self.rows] * (abs(changed) @ weight)
        weight[self.rows] /= np.sqrt(np.maximum(1.0, sums / np.median(before)))
        return (weight * weight)[:, None]


class Interface:
    """The unknowns `chosen` (r,) beside contact, solved exactly while others are held.

    `rows` (r, n) of the scaled matrix.
    """

    def __init__(self, rows: csr_matrix, chosen: np.ndarray, scale: np.ndarray):
        """Factor the chosen columns of `rows` (r, n), scaled on both sides by `scale` (n,).

        Raises SolveError where that is not positive definite.
        """
        self.chosen = chosen
        values = rows.data * np.repeat(scale[chosen], np.diff(rows.indptr))
        values *= scale[rows.indices]
        arrays = values.astype(np.float32), rows.indices, rows.indptr
        self.rows = csr_matrix(arrays, shape=rows.shape)
        self._solve = factorise_roughly(self.rows[:, chosen])

    def solve(self, residual: np.ndarray) -> np.ndarray:
        """The change (r, k) that removes a `residual`."""
        return self._solve(residual).astype(np.float32)


def correction_of(condensed: CondensedMatrix, scale: np.ndarray, place: np.ndarray) -> Correction:
    """C of a condensed matrix, scaled by `scale` (n,); unknown i is in row `place[i]`."""
    kept, added, stiffness = condensed.kept, condensed.added.tocoo(), condensed.stiffness
    n = stiffness.shape[0]
    eliminated = np.ones(n, dtype=bool)
    eliminated[kept] = False
    pivot = np.flatnonzero(eliminated)
    gone = stiffness[pivot].tocoo()
    rows, columns = pivot[gone.row], gone.col
    once = ~eliminated[columns]
    rows = np.concatenate([kept[added.row], rows, columns[once]])
    columns = np.concatenate([kept[added.col], columns, pivot[gone.row][once]])
    values = np.concatenate([added.data, -gone.data, -gone.data[once]])
    values *= scale[rows] * scale[columns]
    chosen, local = np.unique(place[np.concatenate([rows, columns])], return_inverse=True)
    entries = values.astype(np.float32), (local[: len(rows)], local[len(rows) :])
    return Correction(chosen, coo_matrix(entries, shape=(len(chosen),) * 2).tocsr())


def _chosen_rows(matrix: bsr_matrix, rows: np.ndarray) -> csr_matrix:
    """Some rows (r,) of a matrix in blocks."""
    height, width = matrix.blocksize
    blocks = np.unique(rows // height)
    shape = matrix.shape[0] // height, matrix.shape[1] // width
    number = np.arange(len(matrix.indices))
    some = csr_matrix((number, matrix.indices, matrix.indptr), shape=shape)[blocks]
    arrays = matrix.data[some.data], some.indices, some.indptr
    found = bsr_matrix(arrays, shape=(height * len(blocks), matrix.shape[1])).tocsr()
    return found[height * np.searchsorted(blocks, rows // height) + rows % height]
