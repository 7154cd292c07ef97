"""The catalogue of cell types against geometry worked out here."""

import numpy as np
import pytest

from solver.lac.cells.catalogue import BY_NAME

SOLIDS = [name for name, cell in BY_NAME.items() if cell.dim == 3]


@pytest.mark.parametrize("name", SOLIDS)
def test_faces_are_turned_outward_and_close_the_cell(name):
    """Area vectors by Newell's formula point away from the middle and add up to zero."""
    cell = BY_NAME[name]
    middle = cell.nodes[: cell.n_vertices].mean(axis=0)
    total = np.zeros(3)
    for face in cell.faces:
        rim = cell.nodes[[i for i in face.nodes if i < cell.n_vertices]]
        area = np.cross(rim, np.roll(rim, -1, axis=0)).sum(axis=0) / 2
        assert area @ (rim.mean(axis=0) - middle) > 0
        total += area
    np.testing.assert_allclose(total, 0, atol=1e-15)


@pytest.mark.parametrize("name", SOLIDS)
def test_face_nodes_lie_where_the_face_type_has_them(name):
    """Each face, read as a cell of its type, is an affine image of that type's reference cell."""
    cell = BY_NAME[name]
    for face in cell.faces:
        kind = BY_NAME[face.type]
        assert len(face.nodes) == kind.n_nodes
        design = np.hstack([kind.nodes, np.ones((kind.n_nodes, 1))])
        image = cell.nodes[list(face.nodes)]
        fitted = design @ np.linalg.lstsq(design, image, rcond=None)[0]
        np.testing.assert_allclose(fitted, image, atol=1e-14)


@pytest.mark.parametrize("name", BY_NAME)
def test_the_mirror_image_is_its_own_inverse_and_turns_the_cell_over(name):
    cell = BY_NAME[name]
    mirror = np.array(cell.mirror)
    assert mirror[mirror].tolist() == list(range(cell.n_nodes))
    design = np.hstack([cell.nodes, np.ones((cell.n_nodes, 1))])
    linear, residual, *_ = np.linalg.lstsq(design, cell.nodes[mirror], rcond=None)
    assert (residual < 1e-24).all()
    assert np.linalg.det(linear[: cell.dim]) == pytest.approx(-1)


@pytest.mark.parametrize("name", BY_NAME)
def test_mid_nodes_follow_the_edges(name):
    cell = BY_NAME[name]
    if cell.order == 2:
        mids = cell.nodes[cell.n_vertices : cell.n_vertices + len(cell.edges)]
        ends = np.array([cell.nodes[list(edge)].mean(axis=0) for edge in cell.edges])
        np.testing.assert_array_equal(mids, ends)
