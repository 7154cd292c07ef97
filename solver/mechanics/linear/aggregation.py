"""Aggregates of nodes, by PyAMG, and the prolongation from their rigid motions."""

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix, diags

from .unknowns import LevelNodes

# The distances of a node's neighbours differ by more than this where cells are slender. There only
# those up to the second number times the nearest one join an aggregate.
_SLENDER, _NEAR = 3.5, 2.5
# A node with no more of these, itself counted, is on a line.
_LINE = 6


def aggregate(matrix: bsr_matrix, nodes: LevelNodes) -> tuple[bsr_matrix, LevelNodes]:
    """Tentative prolongation, whose columns are the orthonormal motions of each aggregate.

    And the aggregates, as the nodes of the next level.
    """
    from pyamg.aggregation import (
        fit_candidates,
        standard_aggregation,
    )

    body, count = nodes.body, len(nodes.body)
    rows = np.repeat(np.arange(count), np.diff(matrix.indptr))
    joined = (body[rows] == body[matrix.indices]) & (body[rows] >= 0)
    if nodes.points is not None:
        joined[joined] = _near(rows[joined], matrix.indices[joined], nodes.points)
    starts = np.zeros(count + 1, dtype=np.int32)
    np.cumsum(np.bincount(rows[joined], minlength=count), out=starts[1:])
    columns = matrix.indices[joined].astype(np.int32)
    graph = csr_matrix((np.ones(len(columns)), columns, starts), shape=(count, count))
    aggregates, _ = standard_aggregation(_along_lines(graph))
    tentative, motions = fit_candidates(aggregates, nodes.motions)
    members, points = aggregates.tocoo(), None
    coarse_body = np.zeros(aggregates.shape[1], dtype=body.dtype)
    coarse_body[members.col] = body[members.row]
    if nodes.points is not None:
        points = (aggregates.T @ nodes.points) / aggregates.sum(axis=0).reshape(-1, 1)
        points = np.asarray(points)
    return bsr_matrix(tentative, dtype=np.float32), LevelNodes(motions, coarse_body, points)


def _along_lines(graph: csr_matrix) -> csr_matrix:
    """The graph with neighbours of neighbours along lines: three nodes are few for six motions."""
    few = diags((np.diff(graph.indptr) <= _LINE).astype(float))
    lines = few @ graph @ few
    return (graph + lines @ lines).tocsr() if lines.nnz else graph


def _near(rows: np.ndarray, columns: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which pairs (k,) of neighbours may share an aggregate: where cells are slender, near ones.

    There a smooth error is smooth along the short edges alone.
    """
    distance = np.linalg.norm(points[rows] - points[columns], axis=1)
    nearest, furthest = np.full(len(points), np.inf), np.zeros(len(points))
    others = rows != columns
    np.minimum.at(nearest, rows[others], distance[others])
    np.maximum.at(furthest, rows, distance)
    limit = np.where(furthest > _SLENDER * nearest, _NEAR * nearest, np.inf)
    return np.asarray(distance <= np.maximum(limit[rows], limit[columns]))
