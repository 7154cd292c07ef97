"""Cells given inside out are turned; cells that are no cells are refused."""

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import solver.lac.cells.faces
import solver.lac.threads
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.faces import right_side_out, vertex_jacobians
from solver.mesh.tidy import tidy
from solver.system.errors import InputError
from tests.mesh.curved import KINDS


def reference_mesh(name: str, places: np.ndarray | None = None) -> meshio.Mesh:
    cell = BY_NAME[name]
    nodes = np.arange(cell.n_nodes)[None]
    points = cell.nodes if places is None else places
    return meshio.Mesh(points, [(cell.meshio, nodes)], cell_sets={"body": [np.array([0])]})


@pytest.mark.parametrize("name", KINDS)
def test_a_mirrored_cell_is_renumbered(name):
    """Mirrored in space, each type gets the mirror image's own numbering."""
    cell = BY_NAME[name]
    mirrored = cell.nodes * ([-1] + [1] * (cell.dim - 1))
    mesh = tidy(reference_mesh(name, mirrored), "mesh.msh")
    nodes = mesh.cells[0].data
    assert (vertex_jacobians(mesh.points, nodes, cell) > 0).all()
    # The permutation is a symmetry of the cell: reference nodes taken in its order are an affine
    # image of the reference nodes.
    ones = np.ones((cell.n_nodes, 1))
    _, residual, *_ = np.linalg.lstsq(
        np.hstack([cell.nodes, ones]), mesh.points[nodes[0]], rcond=None
    )
    assert np.all(residual < 1e-24)


@given(
    name=st.sampled_from(KINDS),
    size=st.floats(1e-9, 1e9),
    stretch=st.floats(1, 1e5),
    seed=st.integers(0, 1000),
)
def test_orientation_does_not_depend_on_size_or_aspect(name, size, stretch, seed):
    cell = BY_NAME[name]
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(cell.dim, cell.dim)))
    points = size * cell.nodes * ([stretch] + [1] * (cell.dim - 1)) @ rotation
    nodes = np.arange(cell.n_nodes)[None]
    turned, bad = right_side_out(points, nodes, cell)
    assert not bad.any()
    is_turned = (turned != nodes).any()
    assert is_turned == (np.linalg.det(rotation) < 0)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("many", [1, 3, 100])
def test_cells_in_parts_are_judged_as_one_by_one(monkeypatch, many, threads):
    """Sound, mirrored and flat triangles in turn."""
    monkeypatch.setattr(solver.lac.cells.faces, "_AT_ONCE", many)
    monkeypatch.setattr(solver.lac.threads, "workers", lambda: threads)
    points = np.array([(0, 0), (1, 0), (0, 1), (2, 0)], dtype=float)
    cells = np.array([(0, 1, 2), (0, 2, 1), (0, 1, 3)] * 4)
    turned, bad = right_side_out(points, cells, BY_NAME["TRIA3"])
    assert bad.tolist() == [False, False, True] * 4
    areas = np.linalg.det(points[turned[:, 1:]] - points[turned[:, :1]])
    assert (areas[~bad] == 1).all()


@pytest.mark.parametrize("name", KINDS)
def test_a_flat_cell_is_refused(name):
    cell = BY_NAME[name]
    places = cell.nodes * ([1] * (cell.dim - 1) + [0])
    with pytest.raises(InputError, match=f"^mesh.msh: {name} 1: flat or folded"):
        tidy(reference_mesh(name, places), "mesh.msh")


@pytest.mark.parametrize("name", ["QUAD4", "QUAD8", "HEXA8", "HEXA27", "PENTA15", "PYRA5"])
def test_a_folded_cell_is_refused(name):
    """A vertex pushed through the cell to its far side turns some corners over, not all."""
    cell = BY_NAME[name]
    places = cell.nodes.copy()
    places[0] += 2.5 * (cell.nodes[: cell.n_vertices].mean(axis=0) - places[0])
    with pytest.raises(InputError, match=f"^mesh.msh: {name} 1: flat or folded"):
        tidy(reference_mesh(name, places), "mesh.msh")


def test_a_mid_node_out_of_place_is_seen():
    """A mid-node beyond the quarter of its edge folds the cell at the vertex it comes near."""
    places = BY_NAME["TRIA6"].nodes.copy()
    places[3] = [0.24, 0]
    with pytest.raises(InputError, match="TRIA6 1: flat or folded"):
        tidy(reference_mesh("TRIA6", places), "mesh.msh")
    places[3] = [0.26, 0]
    tidy(reference_mesh("TRIA6", places), "mesh.msh")


def test_the_message_names_the_cells_by_the_numbers_of_the_file():
    points = np.array([[0, 0], [1, 0], [0, 1], [2, 0], [3, 0]], dtype=float)
    cells = [("triangle", np.array([[0, 1, 2], [0, 1, 3], [1, 3, 4]]))]
    raw = meshio.Mesh(points, cells, cell_data={"number": [np.array([40, 50, 60])]})
    with pytest.raises(InputError) as caught:
        tidy(raw, "mesh.msh")
    assert str(caught.value).startswith("mesh.msh: TRIA3 50, 60: flat or folded")
    assert "(the first lies around 1, 0)" in str(caught.value)
