"""Prolongations where cells are slender: smoothed along their short edges alone.

Only near neighbours share an aggregate there (`aggregation`). A prolongation smoothed by the whole
matrix would join each aggregate to those beside its long edges as well, and coarse levels would
fill in. So it is smoothed by a filtered matrix: couplings along long edges are dropped, and what
they make of a translation is added to the diagonal, so that translations stay free of force
(Vanek, Mandel, Brezina, Computing 56 (1996) 179, §5).

A node without near neighbours, as the one that the cut adds in the middle of a flat slave face,
follows all its neighbours: its rows of the prolongation leave no force on it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from .galerkin import smoothed
from .products import chosen_rows, in_pieces, scale_blocks

# A share of the diagonal before: less is left where much is dropped.
_LEAST_DIAGONAL = 0.5
# Of the squares of a node's translations: held ones leave their rounding in single precision.
_TINY = 1e-6


@dataclass(frozen=True)
class Near:
    """Which blocks (nnz,) of a matrix are `kept` as near, and the nodes `alone` (a,) without."""

    kept: np.ndarray
    alone: np.ndarray


def smoothed_along(
    matrix: bsr_matrix,
    tentative: bsr_matrix,
    near: Near,
    motions: np.ndarray,
    weight: float,
    bound: float,
) -> bsr_matrix:
    """T − ω F T for F, the `matrix` (n, n) filtered, and the `tentative` T (n, c).

    `motions` (n, 3 or 6) begin with the translations. ω of a row is `weight` over its sum of sizes
    or over the `bound` of the eigenvalues of the matrix, if that is less. Rows of nodes that are
    alone follow from the others.
    """
    some = filtered(matrix, near.kept, motions)
    before = matrix.diagonal()
    diagonal = np.maximum(some.diagonal(), _LEAST_DIAGONAL * before)
    scale = np.where(before > 0, 1 / np.sqrt(np.where(before > 0, diagonal, 1)), 0)
    scale = scale.astype(np.float32)
    sums = (scale * (abs(some) @ scale)).reshape(-1, matrix.blocksize[0]).max(axis=1)
    size = np.repeat(np.clip(sums, 1, bound), matrix.blocksize[0])
    scale_blocks(some, (weight * scale**2 / size).astype(np.float32), np.ones_like(scale))
    way = smoothed(some, tentative, 1.0)
    return _following(matrix, way, near.alone) if len(near.alone) else way


def filtered(matrix: bsr_matrix, kept: np.ndarray, motions: np.ndarray) -> bsr_matrix:
    """The `kept` blocks (nnz,), the others lumped: translations yield the forces that they did."""
    height, count = matrix.blocksize[0], len(matrix.indptr) - 1
    starts = np.concatenate([[0], np.cumsum(kept)]).astype(np.int32)
    moved = motions.reshape(count, height, -1)[:, :, :3]
    data = np.empty((starts[-1], height, height), dtype=np.float32)

    def fill(first: int, last: int) -> None:
        mine = slice(*matrix.indptr[[first, last]])
        rows = np.repeat(np.arange(last - first), np.diff(matrix.indptr[first : last + 1]))
        columns, blocks, stay = matrix.indices[mine], matrix.data[mine], kept[mine]
        out = data[starts[mine.start] : starts[mine.stop]]
        out[:] = blocks[stay]
        forces = np.matmul(blocks[~stay], moved[columns[~stay]])
        total = np.zeros((last - first, height * 3))
        for part in range(height * 3):
            values = forces.reshape(-1, height * 3)[:, part]
            total[:, part] = np.bincount(rows[~stay], values, minlength=last - first)
        own = np.flatnonzero(columns[stay] == first + rows[stay])
        nodes = rows[stay][own]
        lumped = np.matmul(total.reshape(-1, height, 3)[nodes], _inverses(moved[first + nodes]))
        out[own] += lumped.astype(np.float32)

    in_pieces(fill, matrix)
    arrays = data, matrix.indices[kept], starts[matrix.indptr]
    return bsr_matrix(arrays, shape=matrix.shape)


def _inverses(moved: np.ndarray) -> np.ndarray:
    """The left inverses (n, 3, h) of translations (n, h, 3); zero for those that are held."""
    turned = moved.transpose(0, 2, 1)
    squares = np.matmul(turned, moved)
    size = np.trace(squares, axis1=1, axis2=2)[:, None, None] + 1e-30
    found: np.ndarray = np.linalg.solve(squares + _TINY * size * np.eye(3), turned)
    return found


def _following(matrix: bsr_matrix, way: bsr_matrix, alone: np.ndarray) -> bsr_matrix:
    """The prolongation (n, c) with rows of the nodes `alone` (a,) that leave no force on them."""
    height = matrix.blocksize[0]
    unknowns = (height * alone[:, None] + np.arange(height)).ravel()
    rows = chosen_rows(matrix, unknowns)
    columns, local = np.unique(rows.indices, return_inverse=True)
    near = csr_matrix((rows.data, local, rows.indptr), shape=(len(unknowns), len(columns)))
    forces = near @ chosen_rows(way, columns)
    own = rows[:, unknowns].tobsr((height, height))
    there = np.repeat(np.arange(len(alone)), np.diff(own.indptr)) == own.indices
    inverse = np.linalg.pinv(own.data[there], rcond=1e-6, hermitian=True)
    each = np.arange(len(alone) + 1)
    change = bsr_matrix((inverse, each[:-1], each), shape=own.shape) @ forces
    change = change.tocoo()
    arrays = -change.data.astype(np.float32), (unknowns[change.row], change.col)
    return (way + csr_matrix(arrays, shape=way.shape).tobsr(way.blocksize)).tobsr(way.blocksize)
