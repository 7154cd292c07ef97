"""Aggregates of nodes, by PyAMG, and the prolongation from their rigid motions."""

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix, diags

from ...system.compiled import compiled, part_of_compiled, worthwhile
from .products import in_pieces, share_rows
from .slender import Near
from .unknowns import LevelNodes

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
    joined, slender = (_joined_by_loops if worthwhile(matrix.data.size) else _joined)(matrix, nodes)
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


def _joined_by_loops(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[np.ndarray, bool]:
    """What `_joined` returns, by compiled loops."""
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


def _joined(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[np.ndarray, bool]:
    """Which pairs of neighbours (nnz,) may share an aggregate, and whether cells are slender."""
    body, count = nodes.body, len(nodes.body)
    joined = np.empty(len(matrix.indices), dtype=bool)
    nearest, furthest = np.full(count, np.inf), np.zeros(count)

    def join(first: int, last: int) -> None:
        some, rows, columns = _pairs(matrix, first, last)
        joined[some] = (body[rows] == body[columns]) & (body[rows] >= 0)
        if nodes.points is not None:
            rows, columns = rows[joined[some]], columns[joined[some]]
            distance, others = _distance(nodes.points, rows, columns), rows != columns
            np.minimum.at(nearest, rows[others], distance[others])
            np.maximum.at(furthest, rows, distance)

    in_pieces(join, matrix)
    slender = furthest > _SLENDER * nearest
    if nodes.points is not None and slender.any():
        limit = np.where(slender, _NEAR * nearest, np.inf)

        def part(first: int, last: int) -> None:
            some, rows, columns = _pairs(matrix, first, last)
            within = np.minimum(limit[rows], limit[columns])
            joined[some] &= _distance(nodes.points, rows, columns) <= within

        in_pieces(part, matrix)
    return joined, bool(slender.any())


def _pairs(matrix: bsr_matrix, first: int, last: int) -> tuple[slice, np.ndarray, np.ndarray]:
    """The entries in some rows of blocks, and the row and column of each."""
    starts = matrix.indptr[first : last + 1]
    some = slice(starts[0], starts[-1])
    return some, np.repeat(np.arange(first, last), np.diff(starts)), matrix.indices[some]


def _distance(points: np.ndarray | None, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    assert points is not None
    return np.asarray(np.linalg.norm(points[rows] - points[columns], axis=1))
