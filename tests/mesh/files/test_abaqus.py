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
from solver.mesh.files.deck_lines import files_of
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
*SURFACE, TYPE=NODE, NAME=on nodes
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
        ("*HEADING", "*NGEN", "*NGEN: not followed: the deck must be a mesh"),
        ("*HEADING", "*Rigid  Body, REF NODE=1", "*RIGID BODY: not followed"),
        ("*HEADING", "*TIE, NAME=t", "*TIE: not followed"),
        ("*HEADING", "*EQUATION", "*EQUATION: not followed"),
        ("*HEADING", "*MPC", "*MPC: not followed"),
        ("*HEADING", "*IMPERFECTION, FILE=a", "*IMPERFECTION: not followed"),
        ("*STATIC", "*MODEL CHANGE, REMOVE", "*MODEL CHANGE: not followed"),
        ("*HEADING", "*CONTACT PAIR, ADJUST=0.1", "*CONTACT PAIR: option ADJUST would change"),
        ("*Node, nset", "*Node, system=S, nset", "*NODE: SYSTEM S: allowed: R, C"),
        ("*Node, nset", "*Node, input=a, nset", "*NODE: option INPUT is not followed"),
        ("NSET=pins", "NSET=pins, ELSET=both", "*NSET: option ELSET is not followed"),
        ("ELSET=range, GENERATE", "ELSET=range, GENERATE, file=a", "*ELSET: option FILE is not"),
        ("*ELSET, ELSET=both", "*ELSET", "*ELSET: option ELSET is missing"),
        ("200, 202, 2", "200, 202, 0", "set range = 0: the increment must lead"),
        ("200, 202, 2", "202, 200, 1", "set range = 1: the increment must lead"),
        ("200, 202, 2", "200, 203, 2", "set range = 2: the increment must lead"),
        (" 99\n*NSET", " 98\n*NSET", "set pins = 98: no such node"),
        ("lower, UPPER", "lower, 888", "set both = 888: no such cell"),
        (" 2, 1., 0., 0.", " 2, 1., O., 0.", "field 3 = 'O.': must be a number"),
        (" 2, 1., 0., 0.", " 2, 1., inf, 0.", "field 3 = 'inf': must be a number"),
        (" 100, 1, 2, 3", " 100, 1, 2, 3.5", "field 4 = '3.5': must be a whole number"),
        (" 100, 1, 2, 3", " 100, 1, , 3", "field 3 = '': must be a whole number"),
        (" lower, S2", " lower, S7", "surface slave = 'S7': a face of HEXA8 is S1 to S6"),
        (" lower, S2", " lower,", "surface slave = '': a face of HEXA8 is S1 to S6"),
        ("** a comment", "1, 2", "data = '1, 2': stands under no keyword"),
        ("*END STEP", "*END STEP,", "keyword = '*END STEP,': does not end"),
        ("*HEADING", "*INCLUDE, INPUT=deck.inp", "*INCLUDE: "),
        ("*HEADING", "*INCLUDE, INPUT=/dev/zero", "*INCLUDE: /dev/zero: no such file"),
        ("*HEADING", "*INCLUDE", "*INCLUDE: "),
        ("NAME=front", "NAME=slave", "*SURFACE: two surfaces have the name slave"),
        ("*STEP", "*ELEMENT, TYPE=B31\n7, 1, 2\n*STEP", "*ELEMENT: B31: beams beside solids"),
        (
            "*STEP",
            "*ELEMENT, TYPE=T3D2, ELSET=rod\n7, 1, 2\n*SOLID SECTION, ELSET=rod\n*STEP",
            "*SOLID SECTION: cell 7 is a structure beside solids",
        ),
        ("lower, UPPER", "lower, middle", "set both = 'middle': no such set above it"),
        ("*HEADING", "*INSTANCE\n*INSTANCE", "*INSTANCE: allowed: one part and one instance"),
        (" 5, 0., 0., 1.\n", "", "node = 5: cell 100 has it, *NODE has not"),
        ("100, S3", "101, S3", "surface front = 101: no such cell"),
        (" lower, S2", " lowest, S2", "surface slave = 'lowest': no such set"),
        (" 7, 8\n", " 7\n", "*ELEMENT: each C3D8R must have 8 nodes"),
        (" 99, 7., 7., 7.\n", " 5, 7., 7., 7.\n", "*NODE = 5: two nodes have this number"),
        (" 202, 11, 13", " 100, 11, 13", "*ELEMENT = 100: two cells have this number"),
        (" 202, 11, 13", " 201, 11, 13", "*ELEMENT = 201: two cells have this number"),
    ],
)
def test_refusals(old, new, message, tmp_path):
    assert old in DECK
    with pytest.raises(InputError) as caught:
        read(tmp_path, DECK.replace(old, new))
    file, _, line = str(tmp_path / "deck.inp"), *str(caught.value).split(", line ", 1)
    assert str(caught.value).startswith(f"{file}, line ")
    row, _, said = line.partition(": ")
    assert said.startswith(message)
    assert "\n" not in said
    assert 0 < int(row) <= len(DECK.splitlines()) + 3


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("** a comment", "\ufeff*HEADING"),
        (" 2, 1., 0., 0.", " 2, 1.0D+0, 0.d0, -0E1"),
        (" 2, 1., 0., 0.", " 2, 1., ,"),
        (" 4, 0., 1., 0.", " 4, , 1."),
        ("*ELEMENT, TYPE=C3D8R, ELSET=lower", "*ELEMENT, TYPE=C3D8R,\n\n ELSET=lower"),
        ("*NSET, NSET=pins", "*NSET,\n** comment\nNSET=pins"),
        ("200, 202, 2", "202, 200, -2"),
        ("200, 202, 2", "202, 202"),
        ("*SURFACE, TYPE=ELEMENT, NAME=slave\n lower, S2", '*SURFACE, NAME=slave\n "lower", s2'),
        (" pins, 5", ' "PINS" , 5,'),
        ("*ELSET, ELSET=both\n lower, UPPER", '*ELSET, ELSET="both"\n "lower", "UPPER"'),
        ("*STATIC", "*VISCO\n1., 1."),
        ("*HEADING", "*CONTACT PAIR, INTERACTION=i\na, b\n*HEADING"),
    ],
)
def test_the_same_deck_in_other_words(old, new, tmp_path):
    assert old in DECK
    mesh, expected = (read(tmp_path, text) for text in (DECK.replace(old, new), DECK))
    np.testing.assert_array_equal(mesh.points, expected.points)
    for one, other in zip(mesh.cells, expected.cells, strict=True):
        np.testing.assert_array_equal(one.data, other.data)
    assert groups(mesh) == groups(expected)


def groups(mesh: meshio.Mesh) -> dict[str, list]:
    """The members of all groups, by block for cells."""
    of_cells = {name: [ids.tolist() for ids in sets] for name, sets in mesh.cell_sets.items()}
    return of_cells | {name: ids.tolist() for name, ids in mesh.point_sets.items()}


def test_surfaces_of_nodes_are_groups_of_nodes(tmp_path):
    nodes = groups(read(tmp_path, DECK))
    assert nodes["on nodes"] == nodes["pins"] == [0, 1]


def test_cylindrical_coordinates(tmp_path):
    """Radius, angle in degrees, z."""
    text = "*NODE, SYSTEM=C\n1, 1\n2, 2., 360\n3, 2., 90.\n4, 1., -2.7D2\n"
    mesh = read(tmp_path, text + "*ELEMENT, TYPE=CPE4, ELSET=body\n1, 1, 2, 3, 4\n")
    expected = [[1, 0], [2, 0], [0, 2], [0, 1]]
    np.testing.assert_allclose(mesh.points, expected, atol=1e-15)


def test_includes_start_from_the_folder_of_the_job(tmp_path):
    (tmp_path / "sub").mkdir()
    nodes, _, rest = DECK.partition("*ELEMENT")
    (tmp_path / "sub/all.inp").write_text("*INCLUDE, INPUT=sub/nodes.inp\n*include, input=more.inp")
    (tmp_path / "sub/nodes.inp").write_text(nodes)
    (tmp_path / "sub/more.inp").write_text("*ELEMENT" + rest)
    mesh = read(tmp_path, "*INCLUDE, INPUT=sub/all.inp\n")
    assert len(mesh.points) == 16
    names = [str(f.relative_to(tmp_path)) for f in files_of(tmp_path / "deck.inp")]
    assert names == ["deck.inp", "sub/all.inp", "sub/nodes.inp", "sub/more.inp"]


def test_sets_of_sets_stay_as_large_as_the_mesh(tmp_path):
    """Sixty sets, each of them twice the one before."""
    deeper = "".join(f"*NSET, NSET=s{i + 1}\ns{i}, s{i}\n" for i in range(60))
    runs = "*NSET, NSET=run, GENERATE\n1, 900000000000000000, 1\n"
    nodes = groups(read(tmp_path, DECK.replace("*STEP", f"*NSET, NSET=s0\n1\n{deeper}{runs}*STEP")))
    assert nodes["s60"] == [0]
    assert len(nodes["run"]) == 16


# Abaqus input as CalculiX understands it: volumes of curved cells, and the numbers of faces.


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


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
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
