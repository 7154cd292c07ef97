"""Points in cells: the inverse of a polynomial map that is known exactly, for every cell type."""

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME
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
    for reference, place in zip(references, curved.places(references)[:, : kind.dim], strict=True):
        (found,) = locate(points, [(name, np.arange(kind.n_nodes)[None])], place)
        assert found.distance < 1e-7
        np.testing.assert_allclose(found.weights @ points, place, atol=1e-7)
        np.testing.assert_allclose(found.reference, reference, atol=1e-6)


@pytest.mark.parametrize("name", ["SEG3", "TRIA3", "QUAD8"])
def test_the_nearest_place_of_a_face(name):
    """A point straight above a flat face, and one beside it."""
    kind = BY_NAME[name]
    points = np.pad(kind.nodes, ((0, 0), (0, 1)))
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    faces = [(name, np.arange(kind.n_nodes)[None])]
    (found,) = locate(points, faces, np.append(middle, 0.3))
    assert found.distance == pytest.approx(0.3)
    np.testing.assert_allclose(found.reference, middle, atol=1e-12)
    (found,) = locate(points, faces, np.full(kind.dim + 1, -0.5))
    assert found.distance == pytest.approx(0.5 * np.sqrt(kind.dim + 1))
    assert (found.reference == 0).all()
