"""Points in cells: the inverse of a polynomial map that is known exactly, for every cell type."""

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.shape import shape_functions
from solver.mechanics.fem.locate import locate
from tests.mesh.curved import KINDS, Curved


def inside(kind, count=6):
    """Points (n, dim) in a reference cell: means of its vertices with random weights."""
    weights = np.random.default_rng(1).dirichlet(np.ones(kind.n_vertices), count)
    return weights @ kind.nodes[: kind.n_vertices]


@pytest.mark.parametrize("name", KINDS)
def test_curved_cells_are_inverted(name):
    kind, curved = BY_NAME[name], Curved.of(name)
    points = curved.places(kind.nodes)[:, : kind.dim]
    references = np.concatenate([inside(kind), kind.nodes])
    places = curved.places(references)[:, : kind.dim]
    found = locate(points, [(name, np.arange(kind.n_nodes)[None])], places)
    assert (found.place == np.arange(len(places))).all()
    assert found.distance.max() < 1e-7
    shares = shape_functions(name).values(found.reference)
    np.testing.assert_allclose(shares @ points, places, atol=1e-7)
    np.testing.assert_allclose(found.reference, references, atol=1e-6)


@pytest.mark.parametrize("name", ["SEG3", "TRIA3", "QUAD8"])
def test_the_nearest_place_of_a_face(name):
    """A point straight above a flat face, and one beside it."""
    kind = BY_NAME[name]
    points = np.pad(kind.nodes, ((0, 0), (0, 1)))
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    places = np.array([np.append(middle, 0.3), np.full(kind.dim + 1, -0.5)])
    found = locate(points, [(name, np.arange(kind.n_nodes)[None])], places)
    np.testing.assert_allclose(found.distance, [0.3, 0.5 * np.sqrt(kind.dim + 1)], rtol=1e-12)
    np.testing.assert_allclose(found.reference, [middle, 0 * middle], atol=1e-12)


@pytest.mark.parametrize("part", [4096, 7])
def test_many_places_above_a_grid_of_faces(part, monkeypatch):
    """Squares of all sizes: each place is above one of them, at its own share and height."""
    monkeypatch.setattr("solver.mechanics.fem.locate._PART", part)
    rng = np.random.default_rng(5)
    at = np.concatenate([[0], np.geomspace(0.01, 10, 12)])
    x, y = (v.ravel() for v in np.meshgrid(at, at, indexing="ij"))
    number = np.arange(169).reshape(13, 13)
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    blocks = [("QUAD4", faces[:6].reshape(-1, 4)), ("QUAD4", faces[6:].reshape(-1, 4))]
    face, share = rng.integers(0, 144, 60), rng.uniform(0.1, 0.9, (60, 2))
    first, height = faces.reshape(-1, 4)[face, 0], rng.uniform(-0.005, 0.005, 60)
    last = faces.reshape(-1, 4)[face, 2]
    low, high = (np.stack([x[n], y[n]], axis=1) for n in (first, last))
    places = np.column_stack([low + share * (high - low), height])
    found = locate(np.column_stack([x, y, 0 * x]), blocks, places).nearest
    assert (found.place == np.arange(60)).all()
    assert (72 * found.block + found.number == face).all()
    np.testing.assert_allclose(found.reference, share, atol=1e-13)
    np.testing.assert_allclose(found.distance, np.abs(height), atol=1e-14)
