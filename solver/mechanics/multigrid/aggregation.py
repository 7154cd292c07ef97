"""Aggregates of nodes, by PyAMG, and the prolongation from their rigid motions.

Where cells are slender, prolongations are smoothed along short edges alone. Only near neighbours
share an aggregate there. A prolongation smoothed by the whole matrix would join each aggregate to
those beside its long edges as well, and coarse levels would fill in. So it is smoothed by a
filtered matrix: couplings along long edges are dropped, and what they make of a translation is
added to the diagonal, so that translations stay free of force (Vanek, Mandel, Brezina, Computing 56
(1996) 179, §5).

A node without near neighbours, as the one that the cut adds in the middle of a flat slave face,
follows all its neighbours: its rows of the prolongation leave no force on it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix, diags

from ...lac.threads import prefetch
from ...system.compiled import compiled, part_of_compiled
from ..linear.products import chosen_rows, ranges, scale_blocks, share_rows
from ..linear.unknowns import LevelNodes
from .galerkin import smoothed

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

    def fill(some: tuple[int, int]) -> None:
        first, last = some
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

    # Ranges of rows so small that the arrays of each stay small.
    for _ in prefetch(fill, ranges(matrix.indptr, matrix.data[:1].size, 1 << 30)):
        pass
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


# The distances of a node's neighbours differ by more than this where cells are slender. There only
# those up to the second number times the nearest one join an aggregate.
_SLENDER, _NEAR = 3.5, 2.5
# A node with no more of these, itself counted, is on a line.
_LINE = 6
# A motion with a smaller part independent of those before it is left out of the aggregate.
_HELD = 1e-10


def aggregate(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[bsr_matrix, LevelNodes, Near | None]:
    """Tentative prolongation, whose columns are the orthonormal motions of each aggregate.

    The aggregates, as the nodes of the next level. What is near where cells are slender.
    """
    from pyamg.aggregation import standard_aggregation

    body = nodes.body
    graph, near = _graph(matrix, nodes)
    aggregates, _ = standard_aggregation(_along_lines(graph))
    tentative, motions = _fitted(aggregates, nodes.motions)
    members, points = aggregates.tocoo(), None
    coarse_body = np.zeros(aggregates.shape[1], dtype=body.dtype)
    coarse_body[members.col] = body[members.row]
    if nodes.points is not None:
        points = (aggregates.T @ nodes.points) / aggregates.sum(axis=0).reshape(-1, 1)
        points = np.asarray(points)
    return tentative, LevelNodes(motions, coarse_body, points), near


def _fitted(aggregates: csr_matrix, motions: np.ndarray) -> tuple[bsr_matrix, np.ndarray]:
    """Orthonormal motions of each aggregate, and what they are to be multiplied by (c, 3 or 6).

    `aggregates` (n, a) has at most one entry in a row, `motions` are (h n, 3 or 6). PyAMG's own
    function for this transposes the blocks in double precision.
    """
    from pyamg import amg_core

    members, count = aggregates.tocsc(), motions.shape[1]
    height = motions.shape[0] // aggregates.shape[0]
    fitted = np.empty((aggregates.nnz, height, count))
    coarse = np.empty((aggregates.shape[1], count, count))
    arrays = members.indptr, members.indices, fitted.ravel(), motions.ravel(), coarse.ravel()
    amg_core.fit_candidates(*aggregates.shape, height, count, *arrays, _HELD)
    blocks = np.empty(fitted.shape, dtype=np.float32)
    blocks[aggregates.indptr[members.indices]] = fitted
    shape = len(motions), coarse.shape[0] * count
    tentative = bsr_matrix((blocks, aggregates.indices, aggregates.indptr), shape=shape)
    return tentative, coarse.reshape(-1, count)


def _along_lines(graph: csr_matrix) -> csr_matrix:
    """The graph with neighbours of neighbours along lines: three nodes are few for six motions."""
    few = diags((np.diff(graph.indptr) <= _LINE).astype(float))
    lines = few @ graph @ few
    return (graph + lines @ lines).tocsr() if lines.nnz else graph


def _graph(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[csr_matrix, Near | None]:
    """Which neighbours may share an aggregate: those of one body, no held node.

    Where cells are slender, near ones only: a smooth error is smooth along the short edges alone.
    A node that has none joins its nearest neighbour.
    """
    joined, slender = _joined(matrix, nodes)
    near = None
    if slender:
        rows = np.repeat(np.arange(len(nodes.body)), np.diff(matrix.indptr))
        alone = np.bincount(rows[joined], minlength=len(nodes.body)) == 1
        nearest = _nearest(matrix, nodes, rows, alone)
        near = Near(joined | (rows == matrix.indices), rows[nearest])
        joined[nearest] = True
    before = np.concatenate([[0], np.cumsum(joined, dtype=np.int32)], dtype=np.int32)
    columns = matrix.indices[joined].astype(np.int32, copy=False)
    ones = np.ones(len(columns), dtype=np.int8)
    shape = len(nodes.body), len(nodes.body)
    return csr_matrix((ones, columns, before[matrix.indptr]), shape=shape), near


def _nearest(
    matrix: bsr_matrix, nodes: LevelNodes, rows: np.ndarray, alone: np.ndarray
) -> np.ndarray:
    """Of each node that is `alone` (n,) the entry of its nearest neighbour, if it has any.

    `rows` (nnz,) of the entries.
    """
    entries = np.flatnonzero(alone[rows] & (rows != matrix.indices))
    entries = entries[nodes.body[matrix.indices[entries]] == nodes.body[rows[entries]]]
    distance = _distance(nodes.points, rows[entries], matrix.indices[entries])
    entries = entries[np.lexsort((distance, rows[entries]))]
    return np.asarray(entries[np.diff(rows[entries], prepend=-1) > 0])


def _joined(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[np.ndarray, bool]:
    """Which pairs of neighbours (nnz,) may share an aggregate, and whether cells are slender."""
    joined, limit = np.empty(len(matrix.indices), dtype=bool), np.full(len(nodes.body), np.inf)
    points = np.zeros((len(limit), 3)) if nodes.points is None else nodes.points
    arrays = matrix.indptr, matrix.indices, nodes.body, np.ascontiguousarray(points), limit
    if nodes.points is not None:
        share_rows(lambda *some: _find_limits(*some, *arrays), matrix.indptr, 9)
    share_rows(lambda *some: _join(*some, *arrays, joined), matrix.indptr, 9)
    return joined, bool((limit < np.inf).any())


@compiled
def _find_limits(first, last, starts, columns, body, points, limit):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        nearest, furthest = np.inf, 0.0
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            if j != i and body[j] == body[i] and body[i] >= 0:
                distance = _between(points, i, j)
                nearest, furthest = min(nearest, distance), max(furthest, distance)
        if furthest > _SLENDER**2 * nearest:
            limit[i] = _NEAR**2 * nearest


@compiled
def _join(first, last, starts, columns, body, points, limit, joined):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            joined[k] = body[i] == body[j] and body[i] >= 0
            within = min(limit[i], limit[j])
            if joined[k] and within < np.inf:
                joined[k] = _between(points, i, j) <= within


@part_of_compiled
def _between(points, i, j):  # type: ignore[no-untyped-def]
    """The squared distance of two points."""
    x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
    return x * x + y * y + z * z


def _distance(points: np.ndarray | None, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    assert points is not None
    return np.asarray(np.linalg.norm(points[rows] - points[columns], axis=1))
