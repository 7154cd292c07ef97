"""Which neighbours may share an aggregate: by hand, and the same by compiled loops."""

import numpy as np
import pytest
from scipy.sparse import kron, random_array

from solver.mechanics.linear import aggregation, products
from solver.mechanics.linear.aggregation import _graph
from solver.mechanics.linear.unknowns import LevelNodes
from solver.system import compiled

NUMBA = pytest.param(True, marks=pytest.mark.skipif(not compiled.available(), reason="no Numba"))


def with_loops(yes, monkeypatch):
    monkeypatch.setattr(aggregation, "worthwhile", lambda _: yes)
    monkeypatch.setattr(products, "_LEAST", 1)


def graph(near, points, body):
    """Of nodes with blocks of three where `near` (n, n) is not zero."""
    matrix = kron(near, np.ones((3, 3))).tobsr((3, 3)).astype(np.float32)
    return _graph(matrix, LevelNodes(np.zeros((3 * len(body), 6)), body, points))[0]


@pytest.mark.parametrize("loops", [NUMBA, False])
def test_bodies_held_nodes_and_slender_cells_by_hand(loops, monkeypatch):
    """Two pairs of near nodes far apart, 4 of another body, 5 held, 6 and 7 five apart."""
    with_loops(loops, monkeypatch)
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


@pytest.mark.skipif(not compiled.available(), reason="no Numba")
def test_loops_find_the_same_on_any_threads(monkeypatch):
    rng, n = np.random.default_rng(0), 200
    near = random_array((n, n), density=0.05, rng=rng)
    near = near + near.T + np.eye(n)
    about = near, rng.random((n, 3)) * [9, 1, 1], rng.integers(-1, 3, n)
    with_loops(False, monkeypatch)
    expected = graph(*about)
    assert expected.nnz < graph(near, None, about[2]).nnz
    with_loops(True, monkeypatch)
    for threads in (1, 3):
        monkeypatch.setattr(products, "workers", lambda count=threads: count)
        found = graph(*about)
        np.testing.assert_array_equal(found.indptr, expected.indptr)
        np.testing.assert_array_equal(found.indices, expected.indices)
