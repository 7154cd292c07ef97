"""Quadratic cells as linear ones: the means of vertices carry linear fields."""

import numpy as np
import pytest
from scipy import sparse

from solver.lac.cells.catalogue import BY_NAME
from solver.mechanics.fem.block import Block
from solver.mechanics.linear.unknowns import from_vertices, linear_unknowns

QUADRATIC = [name for name, kind in BY_NAME.items() if kind.order == 2 and kind.dim > 1]


def one_cell(name: str) -> tuple[np.ndarray, Block]:
    """Points of a reference cell, and the cell with its nodes numbered backwards."""
    kind = BY_NAME[name]
    cells = np.arange(kind.n_nodes)[::-1][None]
    return kind.nodes[::-1], Block(kind, cells, np.ones(1), np.ones(1))


@pytest.mark.parametrize("name", QUADRATIC)
def test_linear_fields_are_carried_from_the_vertices(name):
    points, block = one_cell(name)
    vertex, means = from_vertices(points, [block])
    assert vertex.sum() == block.type.n_vertices
    field = points @ np.arange(1, points.shape[1] + 1) + 4.0
    np.testing.assert_allclose(means @ np.where(vertex, field, 7.0), field)


@pytest.mark.parametrize("name", ["HEXA20", "HEXA27"])
def test_nodes_in_the_middle_of_long_edges_stay(name):
    """Of a cell ten times flatter than wide only those of the four short edges are interpolated."""
    points, block = one_cell(name)
    points = points * [1.0, 1.0, 0.1]
    stays, means = from_vertices(points, [block])
    middle = np.isclose(points[:, 2], 0.5 * (points[:, 2].min() + points[:, 2].max()))
    on_edge = middle & np.isclose(abs(points[:, :2] - points[:, :2].mean(axis=0)), 0.5).all(axis=1)
    np.testing.assert_array_equal(stays, ~on_edge)
    assert (np.diff(means.indptr) == np.where(stays, 1, 2)).all()
    np.testing.assert_allclose(means @ np.where(stays, points[:, 0], 7.0), points[:, 0])


def test_a_cell_three_times_as_long_as_wide_is_a_linear_one():
    points, block = one_cell("HEXA20")
    assert from_vertices(points * [1.0, 1.0, 3.0], [block])[0].sum() == 8


def test_nodes_that_cells_share_are_counted_once():
    points, block = one_cell("TRIA6")
    twice = Block(block.type, np.vstack([block.cells, block.cells]), np.ones(2), np.ones(2))
    np.testing.assert_array_equal(
        from_vertices(points, [twice])[1].toarray(),
        from_vertices(points, [block])[1].toarray(),
    )


def test_unknowns_of_vertices_where_supports_hold_some():
    """A bar of nodes 0, 1 and 2 in the middle; node 0 is held along x."""
    vertex = np.array([True, True, False])
    means = sparse.csr_matrix([[1.0, 0, 0], [0, 1.0, 0], [0.5, 0.5, 0]])
    basis = sparse.identity(6, format="csr")[:, 1:]
    vertices, linear = linear_unknowns(basis, 2, vertex, means)
    assert vertices.tolist() == [0, 1, 2]  # y of node 0, x and y of node 1
    expected = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0.5, 0], [0.5, 0, 0.5]]
    np.testing.assert_allclose(linear.toarray(), expected)


def test_unknowns_along_tilted_supports():
    """Both ends move along one tilted line, the middle freely."""
    slope = np.array([0.6, 0.8])
    basis = np.zeros((6, 4))
    basis[0:2, 0], basis[2:4, 1], basis[4:6, 2:] = slope, slope, np.eye(2)
    vertex = np.array([True, True, False])
    means = sparse.csr_matrix([[1.0, 0, 0], [0, 1.0, 0], [0.5, 0.5, 0]])
    vertices, linear = linear_unknowns(sparse.csr_matrix(basis), 2, vertex, means)
    assert vertices.tolist() == [0, 1]
    np.testing.assert_allclose(linear.toarray(), [[1, 0], [0, 1], [0.3, 0.3], [0.4, 0.4]])
