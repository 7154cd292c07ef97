"""The deck for CalculiX: our own reader finds the mesh and its surfaces in it again."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from solver.mechanics.fem.faces import boundary_faces, volume_cells
from solver.mesh import generate, read_mesh
from solver.studies.benchmark import calculix
from solver.studies.scaling.description import ScalingPoint, SizeSeries
from solver.system.errors import SolveError
from solver.system.process import cores_for

ROOT = Path(__file__).parents[3]
TABLE = """
 contact stress (slave element+face,press,tang1,tang2) for all contact elements and time 0.5

         7          3  1.000000E+00  0.000000E+00  0.000000E+00

 contact stress (slave element+face,press,tang1,tang2) for all contact elements and time 1.0

         7          3  2.500000E+01  0.000000E+00  0.000000E+00
         8          3  2.600000E+01  0.000000E+00  0.000000E+00
"""


def small(cells):
    """Two blocks of few cells: the case and its mesh."""
    template = ROOT / "cases/scaling/templates/space.yaml"
    point = ScalingPoint(
        SizeSeries("few", cells, template, cells, (3, 2), (200,), fit=(100, 1000)), 200
    )
    case = point.parsed(Path("few.yaml"))
    return case, generate(case.mesh, "few")


@pytest.mark.parametrize("cells", calculix.ELEMENTS)
def test_the_deck_holds_the_mesh_and_its_surfaces(cells, tmp_path):
    case, mesh = small(cells)
    deck = tmp_path / "deck.inp"
    deck.write_text("\n".join(calculix.deck_lines(case, mesh)))
    again = read_mesh(deck)
    [(name, found)] = volume_cells(again).items()
    assert name == cells
    corners = again.points[found].mean(axis=1)
    expected = mesh.points[volume_cells(mesh)[cells]].mean(axis=1)
    assert np.allclose(np.sort(corners, axis=0), np.sort(expected, axis=0), atol=1e-11)
    [zone] = case.zones
    for group in (zone.slave, zone.master):
        ours, theirs = (boundary_faces(m, group) for m in (mesh, again))
        assert sum(len(b.nodes) for b in theirs) == sum(len(b.nodes) for b in ours)
        assert all(np.abs(again.points[b.nodes][..., 2]).max() < 1e-12 for b in theirs)


def test_loads_and_supports_stand_in_the_deck():
    case, mesh = small("HEXA8")
    lines = list(calculix.deck_lines(case, mesh))
    loads = [line for line in lines if line.endswith(", 25.0")]
    top = sum(len(block.nodes) for block in boundary_faces(mesh, "press"))
    assert len(loads) == top
    assert len({line.split(",")[0] for line in loads}) == top
    held = lines[lines.index("*BOUNDARY") + 1 : lines.index("*DLOAD")]
    low = np.flatnonzero(mesh.points[:, 2] < -49.9) + 1
    assert {f"{node}, 3" for node in low} == {line for line in held if line.endswith(", 3")}
    # No field is wider than the twenty columns that CalculiX reads.
    assert max(len(field.strip()) for line in lines[1:20] for field in line.split(",")) <= 20


def test_the_last_table_of_pressures_is_read(tmp_path):
    (tmp_path / "deck.dat").write_text(TABLE)
    assert calculix.read_pressure(tmp_path / "deck.dat").tolist() == [25.0, 26.0]
    (tmp_path / "deck.dat").write_text("nothing")
    for name in ("deck.dat", "none.dat"):
        with pytest.raises(SolveError, match="CalculiX: no contact pressure in its output"):
            calculix.read_pressure(tmp_path / name)


def test_what_seven_digits_resolve():
    assert calculix.resolution(25.0) == pytest.approx(2e-7)
    assert calculix.resolution(9.9) == pytest.approx(5e-7 / 9.9)


def fake(tmp_path, monkeypatch, script):
    program = tmp_path / "bin" / calculix.PROGRAM
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")


@pytest.mark.parametrize(
    ("script", "limit", "message"),
    [
        ("echo no licence; exit 3", 60.0, "CalculiX: the process died with exit status 3: no lice"),
        ("exec sleep 60", 0.2, "CalculiX: no end within 0.2 s"),
    ],
)
def test_a_run_without_an_end(tmp_path, monkeypatch, script, limit, message):
    fake(tmp_path, monkeypatch, script)
    with pytest.raises(SolveError, match=message):
        calculix.solve(*small("HEXA8"), tmp_path, cores_for(1), limit)


def test_the_version_is_known_or_there_is_none(tmp_path, monkeypatch):
    fake(tmp_path, monkeypatch, "echo; echo This is Version 2.20")
    assert calculix.version() == "2.20"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert calculix.version() == ""


@pytest.mark.skipif(not shutil.which(calculix.PROGRAM), reason="CalculiX is not installed")
def test_calculix_solves_the_deck(tmp_path):
    found = calculix.solve(*small("HEXA8"), tmp_path, cores_for(1), 60.0)
    assert np.allclose(found.pressure, 25.0, rtol=1e-5)
