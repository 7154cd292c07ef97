"""From the mesh of a file to the solver's: one block per type, no loose ends."""

from pathlib import Path

import meshio
import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.mesh.tidy import tidy
from solver.simulation.scene.scene import build_scene
from solver.system.errors import InputError

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def test_blocks_of_one_type_become_one():
    points = [*SQUARE, [2, 0], [2, 1]]
    raw = meshio.Mesh(
        points,
        [
            ("line", [[0, 3]]), ("triangle", [[0, 1, 2]]), ("quad", [[1, 4, 5, 2]]),
            ("triangle", [[0, 2, 3]]), ("line", [[4, 5]]),
        ],
        cell_sets={
            "left": [np.array([0]), [], [], [], []],
            "body": [[], np.array([0]), np.array([0]), np.array([0]), []],
            "right": [[], [], [], [], np.array([0])],
        },
    )  # fmt: skip
    mesh = tidy(raw, "mesh")
    assert [(b.type, len(b.data)) for b in mesh.cells] == [
        ("triangle", 2),
        ("quad", 1),
        ("line", 2),
    ]
    sets = {name: [i.tolist() for i in ids] for name, ids in mesh.cell_sets.items()}
    assert sets == {
        "body": [[0, 1], [0], []],
        "left": [[], [], [0]],
        "right": [[], [], [1]],
    }


def test_cells_written_twice_are_one_in_both_groups():
    cells = [("triangle", [[0, 1, 2]]), ("line", [[0, 1], [1, 2]]), ("line", [[2, 1]])]
    sets = {
        "first": [[], np.array([0, 1]), []],
        "second": [[], [], np.array([0])],
    }
    mesh = tidy(meshio.Mesh(SQUARE[:3], cells, cell_sets=sets), "mesh")
    assert mesh.cells[1].data.tolist() == [[0, 1], [1, 2]]
    assert mesh.cell_sets["first"][1].tolist() == [0, 1]
    assert mesh.cell_sets["second"][1].tolist() == [1]


def test_nodes_of_no_cell_go_from_mesh_and_groups():
    points = [[9, 9], *SQUARE[:3], [8, 8]]
    raw = meshio.Mesh(
        points, [("triangle", [[1, 2, 3]])], point_sets={"some": [0, 2, 4], "none": [0, 4]}
    )
    mesh = tidy(raw, "mesh")
    assert mesh.points.tolist() == SQUARE[:3]
    assert {name: ids.tolist() for name, ids in mesh.point_sets.items()} == {
        "none": [],
        "some": [1],
    }


def test_lower_cells_stay_when_they_are_faces_or_named():
    cube = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    cells = [
        ("hexahedron", [[0, 1, 3, 2, 4, 5, 7, 6]]), ("quad", [[0, 1, 3, 2]]),
        ("line", [[0, 1], [1, 3]]), ("vertex", [[7]]),
    ]  # fmt: skip
    sets = {"edge": [[], [], np.array([1]), []], "corner": [[], [], [], np.array([0])]}
    mesh = tidy(meshio.Mesh(cube, cells, cell_sets=sets), "mesh")
    assert [(b.type, len(b.data)) for b in mesh.cells] == [
        ("hexahedron", 1), ("quad", 1), ("line", 1),
    ]  # fmt: skip
    assert mesh.points[mesh.point_sets["corner"]].tolist() == [[1, 1, 1]]


def test_a_plane_mesh_has_two_columns():
    flat = [[*place, 0.0] for place in SQUARE[:3]]
    assert tidy(meshio.Mesh(flat, [("triangle", [[0, 1, 2]])]), "mesh").points.shape == (3, 2)
    flat[1][2] = 1e-15
    assert tidy(meshio.Mesh(flat, [("triangle", [[0, 1, 2]])]), "mesh").points.shape == (3, 2)


@pytest.mark.parametrize(
    ("points", "cells", "sets", "message"),
    [
        (
            [[0, 0, 0], [1, 0, 0], [0, 1, 1]],
            [("triangle", [[0, 1, 2]])],
            {},
            "must have z = 0; for bodies in 3D",
        ),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 1e-6]], [("triangle", [[0, 1, 2]])], {}, "must have z = 0"),
        (SQUARE, [("triangle", [[0, 1.5, 2]])], {}, "cells triangle: node numbers must be whole"),
        (SQUARE, [("triangle", [[0, 1, 2]])], {"": [[0]]}, "group = '': must have a name of prin"),
        (SQUARE, [("triangle", [[0, 1, 2]])], {"a\n": [[0]]}, r"group = 'a\\n': must have a name"),
        ([[0], [1], [2]], [("triangle", [[0, 1, 2]])], {}, "must be two or three numbers a node"),
        (SQUARE, [("triangle", [[0, 1, 4]])], {}, "TRIA3 1: made of nodes that the file does not"),
        (SQUARE, [("triangle", [[0, 1, 2], [0, 2, -1]])], {}, "TRIA3 2: made of nodes"),
        ([[0, 0], [1, np.nan], [0, 1]], [("triangle", [[0, 1, 2]])], {}, "finite numbers"),
        ([[0, 0], [1, 0]], [("line", [[0, 1]])], {}, "no cells of dimension 2 or 3"),
        (
            [*SQUARE[:3], [5, 5]],
            [("triangle", [[0, 1, 2]]), ("line", [[0, 1], [1, 3]])],
            {"load": [[], np.array([0, 1])]},
            "group load: 1 of its SEG2 touch no cell",
        ),
    ],
)
def test_refusals(points, cells, sets, message):
    with pytest.raises(InputError, match=f"^mesh: .*{message}"):
        tidy(meshio.Mesh(np.array(points, dtype=float), cells, cell_sets=sets), "mesh")


def test_a_group_whose_faces_touch_no_cell_is_empty_unless_it_is_a_rigid_body():
    """A case that names it is told this, not that there is no such group."""
    points = [*SQUARE, [5, 5], [6, 5]]
    cells = [("quad", [[0, 1, 2, 3]]), ("line", [[0, 1], [4, 5]])]
    sets = {"low": [[], np.array([0])], "loose": [[], np.array([1])]}
    mesh = tidy(meshio.Mesh(points, cells, cell_sets=sets), "mesh")
    assert {name: [len(i) for i in ids] for name, ids in mesh.cell_sets.items()} == {
        "loose": [0, 1],
        "low": [0, 1],
    }
    text = (
        "name: a\nmesh: {file: a.msh}\nplane: strain\nmaterials: {all: {young: 1, poisson: 0}}\n"
        "supports: [{group: low, fix: [y]}]\nloads: [{group: loose, pressure: 1.0}]\n"
    )
    with pytest.raises(InputError, match="'loose': is empty, or none of its members touches a vol"):
        build_scene(parse_case(text, Path("a.yaml")), mesh)


@pytest.mark.parametrize("order", [[5, 6, 7, 4], [7, 4, 5, 6], [6, 5, 4, 7]])
def test_mid_nodes_in_the_wrong_order_are_named(order):
    points = [*SQUARE, [0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5]]
    body = {"body": [np.array([0])]}
    right = meshio.Mesh(points, [("quad8", [[0, 1, 2, 3, 4, 5, 6, 7]])], cell_sets=body)
    assert len(tidy(right, "mesh").cells) == 1
    wrong = meshio.Mesh(points, [("quad8", [[0, 1, 2, 3, *order]])], cell_sets=body)
    with pytest.raises(InputError, match="QUAD8 1: mid-nodes in the wrong order"):
        tidy(wrong, "mesh")
