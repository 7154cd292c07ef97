"""Abaqus input written by hand: sets, surfaces, includes, refusals."""

import re
import shutil
import subprocess
from pathlib import Path

import meshio
import numpy as np
import pytest
import sympy
from sympy.abc import x, y, z

from solver.lac.cells.catalogue import BY_MESHIO, BY_NAME
from solver.lac.cells.shape import gauss_rule, shape_functions
from solver.mesh import read_mesh
from solver.system.errors import InputError
from tests.mesh.curved import Curved

# Two unit cubes on each other, of one HEXA8 and of two PENTA6, with nodes of their own.
DECK = """\
** a comment
*HEADING
two cubes
*Node, nset=AllNodes
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 1., 1., 0.
 4, 0., 1., 0.
 5, 0., 0., 1.
 6, 1., 0., 1.
 7, 1., 1., 1.
 8, 0., 1., 1.
 11, 0., 0., 1.
 12, 1., 0., 1.
 13, 1., 1., 1.
 14, 0., 1., 1.
 15, 0., 0., 2.
 16, 1., 0., 2.
 17, 1., 1., 2.
 18, 0., 1., 2.
 99, 7., 7., 7.
*ELEMENT, TYPE=C3D8R, ELSET=lower
 100, 1, 2, 3, 4, 5, 6,
 7, 8
*ELEMENT, TYPE=C3D6, ELSET=upper
 201, 11, 12, 13, 15, 16, 17
 202, 11, 13, 14, 15, 17, 18
*ELSET, ELSET=both
 lower, UPPER
*ELSET, ELSET=range, GENERATE
 200, 202, 2
*NSET, NSET=pins
 1, 2
 99
*NSET, NSET=more pins
 pins, 5
*SURFACE, TYPE=ELEMENT, NAME=slave
 lower, S2
*SURFACE, NAME=master
 upper, S1
*SURFACE, TYPE=ELEMENT, NAME=front
 100, S3
 201, S3
*SURFACE, TYPE=NODE, NAME=ignored
 pins
*STEP
*STATIC
*END STEP
"""


def read(tmp_path, text: str, **others: str):
    for name, content in others.items():
        (tmp_path / f"{name}.inp").write_text(content)
    (tmp_path / "deck.inp").write_text(text)
    return read_mesh(tmp_path / "deck.inp")


def face_corners(mesh, group: str) -> set[frozenset]:
    return {
        frozenset(map(tuple, mesh.points[row]))
        for block, ids in zip(mesh.cells, mesh.cell_sets[group], strict=True)
        for row in block.data[ids]
    }


def test_sets(tmp_path):
    mesh = read(tmp_path, DECK)
    assert [b.type for b in mesh.cells] == ["hexahedron", "wedge", "triangle", "quad"]
    assert len(mesh.points) == 16, "node 99 belongs to no cell"
    counts = {name: [len(ids) for ids in sets] for name, sets in mesh.cell_sets.items()}
    assert counts == {
        "both": [1, 2, 0, 0],
        "front": [0, 0, 0, 2],
        "lower": [1, 0, 0, 0],
        "master": [0, 0, 2, 0],
        "range": [0, 1, 0, 0],
        "slave": [0, 0, 0, 1],
        "upper": [0, 2, 0, 0],
    }
    assert mesh.cells[1].data[mesh.cell_sets["range"][1]].tolist() == [[8, 10, 11, 12, 14, 15]]
    nodes = {name: mesh.points[ids].tolist() for name, ids in mesh.point_sets.items()}
    assert nodes["pins"] == [[0, 0, 0], [1, 0, 0]]
    assert nodes["more pins"] == [[0, 0, 0], [1, 0, 0], [0, 0, 1]]


def test_surfaces_are_faces(tmp_path):
    mesh = read(tmp_path, DECK)
    top = [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    assert face_corners(mesh, "slave") == {frozenset(top)}
    assert face_corners(mesh, "master") == {
        frozenset([top[0], top[1], top[2]]), frozenset([top[0], top[2], top[3]]),
    }  # fmt: skip
    for corners in face_corners(mesh, "front"):
        assert {y for _, y, _ in corners} == {0.0}


@pytest.mark.parametrize(
    ("kind", "faces"),
    [
        ("C3D4", ["123", "142", "243", "341"]),
        ("C3D6", ["123", "465", "1452", "2563", "3641"]),
        ("C3D8", ["1234", "5876", "1562", "2673", "3784", "4851"]),
        ("CPE4", ["12", "23", "34", "41"]),
        ("CPE3", ["12", "23", "31"]),
    ],
)
def test_faces_of_every_shape(kind, faces, tmp_path):
    """Faces by their numbers in Abaqus' manual, as corner nodes counted from 1."""
    cube = ["0,0,0", "1,0,0", "1,1,0", "0,1,0", "0,0,1", "1,0,1", "1,1,1", "0,1,1"]
    places = {
        "C3D4": [cube[0], cube[1], cube[3], cube[4]],
        "C3D6": [cube[0], cube[1], cube[3], cube[4], cube[5], cube[7]],
        "C3D8": cube, "CPE4": cube[:4], "CPE3": cube[:3],
    }[kind]  # fmt: skip
    numbers = range(1, len(places) + 1)
    text = "*NODE\n" + "".join(f"{i}, {p}\n" for i, p in zip(numbers, places, strict=True))
    text += f"*ELEMENT, TYPE={kind}, ELSET=body\n1, {', '.join(map(str, numbers))}\n"
    for i in range(1, len(faces) + 1):
        text += f"*SURFACE, NAME=side{i}\nbody, S{i}\n"
    mesh = read(tmp_path, text)
    dim = mesh.points.shape[1]
    for i, corners in enumerate(faces, start=1):
        expected = frozenset(
            tuple(map(float, places[int(c) - 1].split(",")))[:dim] for c in corners
        )
        assert face_corners(mesh, f"side{i}") == {expected}


def test_includes(tmp_path):
    nodes, _, rest = DECK.partition("*ELEMENT")
    mesh = read(tmp_path, "*INCLUDE, INPUT=nodes.inp\n*ELEMENT" + rest, nodes=nodes)
    assert len(mesh.points) == 16


def test_mirrored_cells_are_turned(tmp_path):
    text = DECK.replace(" 100, 1, 2, 3, 4, 5, 6,\n 7, 8", " 100, 5, 6, 7, 8, 1, 2,\n 3, 4")
    mesh = read(tmp_path, text)
    corners = mesh.points[mesh.cells[0].data[0]]
    assert np.linalg.det(corners[[1, 3, 4]] - corners[0]) > 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("C3D8R", "C3D27", "*ELEMENT, TYPE = 'C3D27': allowed: C3D4, C3D5"),
        ("C3D8R", "SPRINGA", "*ELEMENT, TYPE = 'SPRINGA': allowed: C3D4, C3D5"),
        ("*HEADING", "*NGEN", "*NGEN: not followed: write out the mesh"),
        ("lower, UPPER", "lower, middle", "set both = 'middle': no such set above it"),
        ("*HEADING", "*INSTANCE\n*INSTANCE", "*INSTANCE: allowed: one part and one instance"),
        (" 5, 0., 0., 1.\n", "", "node = 5: cell 100 has it, *NODE has not"),
        ("100, S3", "101, S3", "surface front = 101: no such cell"),
        (" lower, S2", " lowest, S2", "surface slave = 'lowest': no such set"),
        (" 7, 8\n", " 7\n", "*ELEMENT: each C3D8R must have 8 nodes"),
        (" 99, 7., 7., 7.\n", " 5, 7., 7., 7.\n", "*NODE = 5: two nodes have this number"),
        (" 202, 11, 13", " 100, 11, 13", "*ELEMENT = 100: two cells have this number"),
        (" 202, 11, 13", " 201, 11, 13", "*ELEMENT = 201: two cells have this number"),
        ("*INCLUDE, INPUT=none.inp", "", ""),
    ],
)
def test_refusals(old, new, message, tmp_path):
    text = DECK.replace(old, new) if message else old
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path / 'deck.inp'}: {message}")
    assert "\n" not in str(caught.value)


# Abaqus input as CalculiX understands it: volumes of curved cells, and the numbers of faces.


pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")

TYPES = {
    "TETRA4": "C3D4", "TETRA10": "C3D10", "PENTA6": "C3D6", "PENTA15": "C3D15",
    "HEXA8": "C3D8", "HEXA20": "C3D20",
}  # fmt: skip


class Bulging(Curved):
    """Curved along x alone: the Jacobian is linear, so that the rules of CalculiX are exact."""

    @property
    def expressions(self) -> list[sympy.Expr]:
        along = sympy.expand(super().expressions[0])
        return [along - along.coeff(x * y * z) * x * y * z, x / 9 + y, z - y / 7]


def run(name: str, folder: Path) -> tuple[Path, str]:
    """The deck of one cell, and what CalculiX prints of it: volume, and forces of each face."""
    curved = Bulging.of(name)
    nodes = curved.places(curved.cell.nodes)
    lines = ["*NODE, NSET=all"]
    lines += [f"{i}, " + ", ".join(map(repr, p)) for i, p in enumerate(nodes.tolist(), 1)]
    lines += [f"*ELEMENT, TYPE={TYPES[name]}, ELSET=body", "1,"]
    numbers = list(map(str, range(1, len(nodes) + 1)))
    lines += [", ".join(numbers[i : i + 10]) + "," * (i + 10 < len(nodes)) for i in (0, 10)]
    faces = range(1, len(curved.cell.faces) + 1)
    for face in faces:
        lines += [f"*SURFACE, NAME=face{face}, TYPE=ELEMENT", f"1, S{face}"]
    lines += ["*MATERIAL, NAME=m", "*ELASTIC", "1., 0.3", "*SOLID SECTION, ELSET=body, MATERIAL=m"]
    lines += ["*BOUNDARY", "all, 1, 3", "*STEP", "*STATIC", "*EL PRINT, ELSET=body", "EVOL"]
    for face in faces:
        lines += [f"*SECTION PRINT, SURFACE=face{face}, NAME=print{face}", "SOF, SOM, SOAREA"]
    lines += ["*END STEP"]
    deck = folder / "cell.inp"
    deck.write_text("\n".join(line for line in lines if line) + "\n")
    subprocess.run(["ccx", "cell"], cwd=folder, check=True, capture_output=True, timeout=60)
    return deck, (folder / "cell.dat").read_text()


def told_of_faces(printed: str) -> np.ndarray:
    """Centre, mean normal and area of each face, (faces, 7)."""
    rows = []
    for part in printed.split("statistics for surface set")[1:]:
        lines = [line.split() for line in part.splitlines()]
        numbers = [line for line in lines if line and re.match(r"-?\d", line[0])]
        _, centre_and_normal, _, sizes, *_ = numbers
        rows.append([*centre_and_normal, sizes[0]])
    return np.array(rows, dtype=float)


def own_face(mesh: meshio.Mesh, group: str) -> np.ndarray:
    """The same of the face that a group holds as we read it, (7,)."""
    members = zip(mesh.cells, mesh.cell_sets[group], strict=True)
    [(block, number)] = [(b, i[0]) for b, i in members if i is not None and len(i)]
    kind = BY_MESHIO[block.type]
    at, weights = gauss_rule(kind.name, 4)
    values, gradients = shape_functions(kind.name).both(at)
    points = mesh.points[block.data[number]]
    tangents = np.einsum("pnd,ne->pde", gradients, points)
    normal = np.cross(tangents[:, 0], tangents[:, 1])
    share = weights * np.linalg.norm(normal, axis=1)
    area = share.sum()
    return np.array([*(share @ (values @ points) / area), *(weights @ normal / area), area])


@pytest.mark.parametrize("name", TYPES)
def test_volumes_and_faces(name, tmp_path):
    deck, printed = run(name, tmp_path)
    volume = re.search(r"volume \(element.*\s+1\s+(\S+)", printed)
    assert float(volume[1]) == pytest.approx(Bulging.of(name).volume, rel=1e-6)
    mesh = read_mesh(deck)
    theirs = told_of_faces(printed)
    assert len(theirs) == len(BY_NAME[name].faces)
    for number, face in enumerate(theirs, 1):
        # CalculiX takes one point on the faces of prisms; any other face lies elsewhere by tenths.
        np.testing.assert_allclose(own_face(mesh, f"face{number}"), face, atol=1e-2)
