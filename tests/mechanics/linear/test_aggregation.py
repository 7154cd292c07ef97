"""Which neighbours may share an aggregate: by hand, on any threads."""

import numpy as np
import pytest
from scipy.sparse import kron

from solver.mechanics.linear import products
from solver.mechanics.linear.aggregation import _graph
from solver.mechanics.linear.unknowns import LevelNodes


def graph(near, points, body):
    """Of nodes with blocks of three where `near` (n, n) is not zero."""
    matrix = kron(near, np.ones((3, 3))).tobsr((3, 3)).astype(np.float32)
    return _graph(matrix, LevelNodes(np.zeros((3 * len(body), 6)), body, points))[0]


@pytest.mark.parametrize("threads", [1, 3])
def test_bodies_held_nodes_and_slender_cells_by_hand(threads, monkeypatch):
    """Two pairs of near nodes far apart, 4 of another body, 5 held, 6 and 7 five apart."""
    monkeypatch.setattr(products, "_LEAST", 1)
    monkeypatch.setattr(products, "workers", lambda: threads)
    points = np.zeros((8, 3))
    points[:, 0] = [0, 1, 10, 11, 0, 1, 20, 25]
    body = np.array([0, 0, 0, 0, 1, -1, 0, 0])
    expected = np.zeros((8, 8), dtype=int)
    expected[:2, :2] = expected[2:4, 2:4] = expected[4, 4] = expected[6:, 6:] = 1
    near = np.ones((8, 8))
    near[6:, :6] = near[:6, 6:] = 0
    np.testing.assert_array_equal(graph(near, points, body).toarray(), expected)
    everywhere = np.equal.outer(body, body) & (body >= 0)
    np.testing.assert_array_equal(graph(near, None, body).toarray(), everywhere * near)
