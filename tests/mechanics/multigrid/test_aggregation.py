"""Which neighbours may share an aggregate: by hand, on any threads."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import bsr_matrix, kron

from solver.lac.cells.catalogue import BY_NAME
from solver.mechanics.fem.block import Block
from solver.mechanics.fem.elasticity import lame_parameters, stiffness
from solver.mechanics.linear import products, unknowns
from solver.mechanics.linear.unknowns import LevelNodes
from solver.mechanics.multigrid import aggregation, multigrid
from solver.mechanics.multigrid.aggregation import Near, _graph, filtered, smoothed_along
from solver.mechanics.multigrid.multigrid import Multigrid
from tests.mechanics.multigrid.test_multigrid import held, motions
from tests.patches import force_solver
from tests.scenes import grid, replaced, solved


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


# Slender cells: what is near, the filtered matrix, nodes without near neighbours, iterations.


ROOT = Path(__file__).parents[3]


def graded(count: int) -> tuple[np.ndarray, bsr_matrix]:
    """Points (n, 3) and stiffness of a unit cube: even up to 0.02, then growing like sinh."""
    points, cells = grid(count)
    beyond = np.sinh(6 * np.clip((points - 0.4) / 0.6, 0, None)) / np.sinh(6)
    points = np.where(points < 0.4, points / 20, 0.02 + 0.98 * beyond)
    lame, shear = lame_parameters(np.full(len(cells), 2000.0), np.full(len(cells), 0.3))
    blocks = stiffness(points, [Block(BY_NAME["HEXA8"], cells, lame, shear)])
    blocks.data = blocks.data.astype(np.float32)
    return points, blocks


def nodes_of(points: np.ndarray) -> LevelNodes:
    return LevelNodes(motions(points), np.zeros(len(points), dtype=int), points)


def iterations(count: int) -> int:
    points, matrix = graded(count)
    system, unknowns = held(points, matrix.tocsr(), points > 0, np.zeros(len(points), dtype=int))
    exact = np.random.default_rng(0).standard_normal(system.shape[0])
    solver = Multigrid(system, replace(unknowns, points=points))
    found = solver.solve(system @ exact, 1e-9)
    np.testing.assert_allclose(found, exact, atol=1e-5)
    return solver.iterations


def test_graded_cells_take_few_iterations():
    """Cells up to 100 times longer than wide: without the filter coarse levels filled in here."""
    assert iterations(18) <= 30


def test_a_filter_that_moves_no_force_to_the_diagonal_shows_in_the_iterations(monkeypatch):
    """A planted fault: translations are then not free of force."""
    monkeypatch.setattr(aggregation, "_inverses", lambda moved: 0.0 * moved.transpose(0, 2, 1))
    assert iterations(18) > 30


def iterations_on_a_sphere(cells: str = "HEXA20") -> int:
    """Of the longest solve of a graded Hertz sphere; 150 where multigrid gave up."""
    text = replaced((ROOT / "cases/hertz/sphere-tetra10.yaml").read_text(), ("TETRA10", cells))
    with force_solver("multigrid"):
        solution = solved(text)
    return solution.cost.linear_iterations if "multigrid" in solution.cost.linear_solver else 150


def test_graded_quadratic_cells_take_few_iterations(monkeypatch):
    """And too many where nodes in the middle of long edges follow the vertices, a planted fault."""
    assert iterations_on_a_sphere() < 60
    monkeypatch.setattr(unknowns, "_LONG", np.inf)
    assert iterations_on_a_sphere() == 150


def test_two_steps_on_coarse_levels_where_iterations_are_slow(monkeypatch):
    """And many more iterations where slow ones are not noticed, a planted fault."""
    assert iterations_on_a_sphere("TETRA10") <= 75
    monkeypatch.setattr(multigrid, "_PATIENCE", 0)
    assert iterations_on_a_sphere("TETRA10") > 90


def test_a_flat_cell_is_near_along_its_thickness_alone():
    """Eight corners, 10 by 10 by 0.1, and a node in the middle of the upper face."""
    corners = np.array([[x, y, z] for z in (0, 0.1) for y in (0, 10) for x in (0, 10)], dtype=float)
    points = np.vstack([corners, [5.0, 4.9, 0.1]])
    matrix = bsr_matrix(np.ones((27, 27), dtype=np.float32), blocksize=(3, 3))
    graph, near = _graph(matrix, nodes_of(points))
    assert near is not None
    assert near.alone.tolist() == [8]
    expected = np.eye(9, dtype=bool)
    expected[np.arange(8), (np.arange(8) + 4) % 8] = True
    np.testing.assert_array_equal(near.kept.reshape(9, 9), expected)
    joined = graph.toarray().astype(bool)
    # Beside itself it joins one of the two nearest corners.
    assert joined[8].sum() == 2
    assert joined[8, [4, 5]].any()
    np.testing.assert_array_equal(joined[:8], expected[:8])


def test_even_cells_are_not_filtered():
    points, _ = grid(3)
    lame, shear = lame_parameters(np.full(27, 2000.0), np.full(27, 0.3))
    matrix = stiffness(points, [Block(BY_NAME["HEXA8"], grid(3)[1], lame, shear)])
    assert _graph(matrix, nodes_of(points))[1] is None


def test_translations_stay_free_of_force():
    points, matrix = graded(6)
    near = _graph(matrix, nodes_of(points))[1]
    assert near is not None
    assert 0 < near.kept.mean() < 0.8
    some = filtered(matrix, near.kept, motions(points))
    shifts = motions(points)[:, :3]
    assert abs(some @ shifts).max() < 1e-5 * abs(some.data).max()


@pytest.mark.parametrize("node", [0, 40])
def test_a_node_that_is_alone_is_left_without_force(node):
    points, matrix = graded(4)
    nodes = nodes_of(points)
    tentative, _, near = aggregation.aggregate(matrix, nodes)
    assert near is not None
    near = Near(near.kept, np.array([node]))
    way = smoothed_along(matrix, tentative, near, nodes.motions, 4 / 3, 4.0)
    forces = abs((matrix @ way).tocsr()[3 * node : 3 * node + 3]).max()
    assert forces < 1e-5 * abs(matrix.data).max()
