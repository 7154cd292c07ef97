"""Aggregates of nodes, by PyAMG, and the prolongation from their rigid motions."""

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix, diags

from .products import in_pieces
from .slender import Near
from .unknowns import LevelNodes

# The distances of a node's neighbours differ by more than this where cells are slender. There only
# those up to the second number times the nearest one join an aggregate.
_SLENDER, _NEAR = 3.5, 2.5
# A node with no more of these, itself counted, is on a line.
_LINE = 6


def aggregate(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[bsr_matrix, LevelNodes, Near | None]:
    """Tentative prolongation, whose columns are the orthonormal motions of each aggregate.

    The aggregates, as the nodes of the next level. What is near where cells are slender.
    """
    from pyamg.aggregation import (
        fit_candidates,
        standard_aggregation,
    )

    body = nodes.body
    graph, near = _graph(matrix, nodes)
    aggregates, _ = standard_aggregation(_along_lines(graph))
    tentative, motions = fit_candidates(aggregates, nodes.motions)
    members, points = aggregates.tocoo(), None
    coarse_body = np.zeros(aggregates.shape[1], dtype=body.dtype)
    coarse_body[members.col] = body[members.row]
    if nodes.points is not None:
        points = (aggregates.T @ nodes.points) / aggregates.sum(axis=0).reshape(-1, 1)
        points = np.asarray(points)
    return bsr_matrix(tentative, dtype=np.float32), LevelNodes(motions, coarse_body, points), near


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
    joined, among = _joined(matrix, nodes)
    near = None
    if np.count_nonzero(joined) < among:
        rows = np.repeat(np.arange(len(nodes.body)), np.diff(matrix.indptr))
        alone = np.bincount(rows[joined], minlength=len(nodes.body)) == 1
        near = Near(joined | (rows == matrix.indices), np.flatnonzero(alone))
        joined = joined | _nearest(matrix, nodes, alone)
    before = np.concatenate([[0], np.cumsum(joined, dtype=np.int32)], dtype=np.int32)
    columns = matrix.indices[joined].astype(np.int32, copy=False)
    ones = np.ones(len(columns), dtype=np.int8)
    shape = len(nodes.body), len(nodes.body)
    return csr_matrix((ones, columns, before[matrix.indptr]), shape=shape), near


def _nearest(matrix: bsr_matrix, nodes: LevelNodes, alone: np.ndarray) -> np.ndarray:
    """The entry (nnz,) of the nearest neighbour in the rows of nodes that are `alone` (n,)."""
    rows = np.repeat(np.arange(len(alone)), np.diff(matrix.indptr))
    entries = np.flatnonzero(alone[rows] & (rows != matrix.indices))
    entries = entries[nodes.body[matrix.indices[entries]] == nodes.body[rows[entries]]]
    distance = _distance(nodes.points, rows[entries], matrix.indices[entries])
    entries = entries[np.lexsort((distance, rows[entries]))]
    found = np.zeros(len(matrix.indices), dtype=bool)
    found[entries[np.flatnonzero(np.diff(rows[entries], prepend=-1))]] = True
    return found


def _joined(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[np.ndarray, int]:
    """Which pairs of neighbours (nnz,) may share an aggregate, and how many are of one body."""
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
    slender, among = furthest > _SLENDER * nearest, int(np.count_nonzero(joined))
    if nodes.points is not None and slender.any():
        limit = np.where(slender, _NEAR * nearest, np.inf)

        def part(first: int, last: int) -> None:
            some, rows, columns = _pairs(matrix, first, last)
            within = np.minimum(limit[rows], limit[columns])
            joined[some] &= _distance(nodes.points, rows, columns) <= within

        in_pieces(part, matrix)
    return joined, among


def _pairs(matrix: bsr_matrix, first: int, last: int) -> tuple[slice, np.ndarray, np.ndarray]:
    """The entries in some rows of blocks, and the row and column of each."""
    starts = matrix.indptr[first : last + 1]
    some = slice(starts[0], starts[-1])
    return some, np.repeat(np.arange(first, last), np.diff(starts)), matrix.indices[some]


def _distance(points: np.ndarray | None, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    assert points is not None
    return np.asarray(np.linalg.norm(points[rows] - points[columns], axis=1))
