"""The deck for CalculiX, by hand and by CalculiX itself; its result file; runs without an end."""

import shutil

import numpy as np
import pytest

from solver.codes import calculix
from solver.codes.calculix import CalculiX, deck_lines, printed_forces
from solver.codes.deck import UnsupportedError, deck_of, face_size
from solver.codes.run import CrashError, Limits, run_code
from solver.lac.errors import SolveError
from solver.mechanics.fem.faces import boundary_faces
from solver.mesh.files import abaqus
from tests.codes.blocks import CELLS_2D, CELLS_3D, case_of
from tests.codes.results import mesh_and_case

# From the manual of CalculiX 2.20, chapter "Element Types": the two nodes between which each node
# past the corners lies, the corners of the faces S1, S2, …, all counted from 1.
BETWEEN = {
    "C3D4": [],
    "C3D10": ["1 2", "2 3", "1 3", "1 4", "2 4", "3 4"],
    "C3D6": [],
    "C3D15": ["1 2", "2 3", "1 3", "4 5", "5 6", "4 6", "1 4", "2 5", "3 6"],
    "C3D8": [],
    "C3D20": [
        *("1 2", "2 3", "3 4", "1 4", "5 6", "6 7", "7 8", "5 8", "1 5", "2 6", "3 7", "4 8"),
    ],
}
SIDES = {
    "C3D4": ["123", "142", "243", "341"],
    "C3D6": ["123", "456", "1254", "2365", "3146"],
    "C3D8": ["1234", "5876", "1562", "2673", "3784", "4851"],
}
SIDES |= {"C3D10": SIDES["C3D4"], "C3D15": SIDES["C3D6"], "C3D20": SIDES["C3D8"]}
needs_ccx = pytest.mark.skipif(not shutil.which(calculix.PROGRAM), reason="no CalculiX")
ALL = [(cells, 3) for cells in CELLS_3D] + [(cells, 2) for cells in CELLS_2D]


def deck_for(cells, **more):
    return deck_of(*case_of(cells, cells, **more), layer=True)


def blocks_of(lines):
    """The data lines below each keyword line, fields split; an element's lines are joined."""
    found, joined = {}, ""
    for line in lines:
        if line.startswith("*"):
            data = found.setdefault(line, [])
        elif line.endswith(","):
            joined += line
        else:
            data.append([field.strip() for field in (joined + line).split(",")])
            joined = ""
    return found


def cells_of(blocks):
    """Type and places of the nodes of each element."""
    places = {int(n): np.array(p, dtype=float) for n, *p in blocks["*NODE, NSET=NALL"]}
    return {
        number: (head.split("TYPE=")[1].split(",")[0], [places[n] for n in nodes])
        for head, rows in blocks.items()
        if head.startswith("*ELEMENT")
        for number, *nodes in np.array(rows, dtype=int).tolist()
    }


def mistakes(lines, dim):
    """What of a deck contradicts the manual: mid-nodes off, cells inside out, faces elsewhere."""
    blocks, found = blocks_of(lines), []
    cells = cells_of(blocks)
    for number, (kind, at) in cells.items():
        for i, pair in enumerate(BETWEEN[kind], start=len(at) - len(BETWEEN[kind])):
            ends = [at[int(n) - 1] for n in pair.split()]
            if np.abs(at[i] - sum(ends) / 2).max() > 1e-9:
                found.append(f"node {i + 1} of element {number}")
        third, up = (2, 3) if kind in ("C3D4", "C3D10", "C3D6", "C3D15") else (3, 4)
        if np.linalg.det([at[i] - at[0] for i in (1, third, up)]) <= 0:
            found.append(f"element {number} is inside out")
    for head in (head for head in blocks if head.startswith("*SURFACE, NAME=")):
        for number, side in blocks[head]:
            kind, at = cells[int(number)]
            corners = [at[int(c) - 1] for c in SIDES[kind][int(side[1:]) - 1]]
            # The interface is at z = 0 in space, at y = 0 of a layer.
            if max(abs(p[dim - 1]) for p in corners) > 1e-9:
                found.append(f"face {side} of element {number}")
    return found


@pytest.mark.parametrize(("cells", "dim"), ALL)
def test_nodes_and_faces_as_in_the_manual(cells, dim):
    lines = list(deck_lines(deck_for(cells)))
    assert mistakes(lines, dim) == []
    kinds = {line.split("TYPE=")[1].split(",")[0] for line in lines if line.startswith("*ELEMENT")}
    assert len(kinds) == 1
    # No field is wider than the twenty columns that CalculiX reads.
    assert max(len(field.strip()) for line in lines[1:20] for field in line.split(",")) <= 20


@pytest.mark.parametrize("cells", ["TETRA10", "TRIA6", "HEXA20"])
def test_a_wrong_permutation_is_seen(cells):
    """The order of gmsh, or of VTK's wedges, in place of CalculiX's."""
    wrong = {
        "TETRA10": [*range(8), 9, 8],
        "PENTA15": [*range(9), *range(12, 15), *range(9, 12)],
        "HEXA20": [*range(12), *range(16, 20), *range(12, 16)],
    }
    deck = deck_for(cells)
    for name in deck.cells:
        deck.cells[name] = deck.cells[name][:, wrong[name]]
    assert len(mistakes(deck_lines(deck), 3)) >= 2 * sum(map(len, deck.cells.values()))


def test_faces_counted_from_another_corner_are_seen(monkeypatch):
    deck = deck_for("HEXA8")
    wrong = [*abaqus.FACES["HEXA"][1:], abaqus.FACES["HEXA"][0]]
    monkeypatch.setitem(abaqus.FACES, "HEXA", wrong)
    assert mistakes(deck_lines(deck), 3)


def test_loads_and_supports_are_in_the_deck():
    case, mesh = case_of("HEXA8", "HEXA8")
    blocks = blocks_of(deck_lines(deck_of(case, mesh)))
    top = sum(len(block.nodes) for block in boundary_faces(mesh, "press"))
    assert len({element for element, _, value in blocks["*DLOAD"] if value == "25.0"}) == top
    low = np.flatnonzero(mesh.points[:, 2] < -49.9) + 1
    held = [int(node) for node, first, *_ in blocks["*BOUNDARY, OP=NEW"] if first == "3"]
    assert sorted(held) == low.tolist()
    assert blocks["*ELASTIC"] == [["2000.0", "0.3"]]
    [[stiffness]] = blocks["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
    assert float(stiffness) == pytest.approx(2.5e4 * 2000 / face_size(deck_of(case, mesh)))
    assert list(blocks.values())[-1] == []
    pair = "*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=SURFACE TO SURFACE"
    assert blocks[pair] == [["bottom_contact", "top_contact"]]
    swapped = blocks_of(deck_lines(deck_of(case.as_solved(True), mesh)))
    assert swapped[pair] == [["top_contact", "bottom_contact"]]


def test_a_body_force_is_its_consistent_forces():
    """6 N/mm³ along −y on the area of 50 × 50 mm, as deep as the layer."""
    load = {"group": "top", "body_force": [0.0, -6.0]}
    deck = deck_for("QUAD8", loads=[load], steps=[0.5])
    forces = blocks_of(deck_lines(deck))["*CLOAD"]
    assert {axis for _, axis, _ in forces} == {"2"}
    depth = deck.points[:, 2].max()
    total = sum(float(value) for *_, value in forces)
    assert total == pytest.approx(-6.0 * 2500 * depth / 2)


@pytest.mark.parametrize(
    ("cells", "zone", "reason"),
    [
        ("QUAD9", {}, r"HEXA27: CalculiX has no such element \(of one layer"),
    ],
)
def test_what_calculix_has_not_is_refused(cells, zone, reason):
    sides = {"slave": "bottom_contact", "master": "top_contact"}
    with pytest.raises(UnsupportedError, match=reason):
        list(deck_lines(deck_for(cells, contact=[{"name": "i", **sides, **zone}])))


def fake(tmp_path, monkeypatch, script):
    program = tmp_path / "bin" / calculix.PROGRAM
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")


@pytest.mark.parametrize(
    ("script", "kind", "message"),
    [
        ("echo no licence; exit 3", CrashError, "the process died with exit status 3: no licence"),
        ("sleep 60", CrashError, "no end within 0.5 s"),
        (
            "echo '*ERROR: too many iterations needed'; exit 201",
            SolveError,
            "no convergence: .*ERR",
        ),
        ("exit 0", SolveError, "its result file: .*deck.frd: result: no such file"),
    ],
)
def test_a_run_without_a_result(tmp_path, monkeypatch, script, kind, message):
    fake(tmp_path, monkeypatch, script)
    with pytest.raises(kind, match=message):
        run_code(CalculiX(), deck_for("HEXA8"), tmp_path, Limits(seconds=0.5))


def test_the_version_is_known_or_there_is_none(tmp_path, monkeypatch):
    fake(tmp_path, monkeypatch, "echo; echo This is Version 2.20")
    assert CalculiX().version() == "2.20"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert CalculiX().version() == ""


@needs_ccx
@pytest.mark.parametrize(("cells", "dim"), ALL)
def test_calculix_solves_the_deck(cells, dim, tmp_path):
    """Stress 25 along the last axis of the case at every node, and 0.3 · 25 across a layer."""
    deck = deck_for(cells)
    found = run_code(CalculiX(), deck, tmp_path, Limits())
    slave = np.concatenate([block.nodes.ravel() for block in deck.pairs[0].slave])
    assert found.pressure.values[np.isin(found.pressure.nodes, slave)] == pytest.approx(25, 1e-3)
    expected = [0, 0, -25, 0, 0, 0] if dim == 3 else [0, -25, -7.5, 0, 0, 0]
    assert np.abs(found.stress.values - expected).max() < 0.025
    lowest = found.displacement.values[:, dim - 1].min()
    # Two blocks of 50 mm shorten by (1 − ν²) 25/2000 in plane strain, 25/2000 in space.
    assert lowest == pytest.approx(-1.25 * (0.91 if dim == 2 else 1), rel=1e-3)
    assert (
        found.settings["pressure-overclosure"]
        == "LINEAR, 25000 E / face size, 200 on curved surfaces, 1 of bodies that move far (NLGEOM)"
    )
    assert found.cpu_seconds > 0


def test_the_stiffness_of_contact_has_a_unit():
    """Cubes with slave faces of edge 50/n: twice as large a mesh has half the stiffness."""
    case, mesh = case_of("HEXA8", "HEXA8")
    size = face_size(deck_of(case, mesh))
    quads = list(boundary_faces(mesh, case.zones[0].slave))
    assert size == pytest.approx(50 / np.sqrt(sum(len(b.nodes) for b in quads)))
    mesh.points *= 2
    assert face_size(deck_of(case, mesh)) == pytest.approx(2 * size)


@pytest.mark.parametrize("swapped", [False, True])
def test_contact_is_softer_where_either_side_is_curved(swapped):
    mesh, case = mesh_and_case("hertz/cylinder-quad4")
    deck = deck_of(case.as_solved(swapped), mesh, layer=True)
    [[stiffness]] = blocks_of(deck_lines(deck))["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
    assert float(stiffness) == pytest.approx(2e2 * deck.softest / face_size(deck))


def test_printed_forces():
    """The last force of the pair counts, per thickness of the layer in a plane case."""
    case, mesh = case_of("HEXA8", "HEXA8")
    deck = deck_of(case, mesh)
    text = """
 statistics for slave set BOTTOM_CONTACT, master set TOP_CONTACT and time  0.1000000E+01

   total surface force (fx,fy,fz) and moment about the origin (mx,my,mz)

    0.000000E+00 %s  0.000000E+00 -2.635294E+04  0.000000E+00  1.623359E+05
"""
    [found] = printed_forces(deck, text % "1.0E+00" + text % "-6.493436E+03").values()
    assert found.tolist() == [0.0, -6493.436, 0.0]
    assert printed_forces(deck, "nothing") == {}
