"""The inf-sup test from its file to its page: ladders, record, what does not hold."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.commands.cli import main
from solver.studies.infsup.description import InfSupLadder, read_ladders
from solver.studies.infsup.figure import draw_constants
from solver.studies.infsup.half_loaded import PressureProfile
from solver.studies.infsup.page import sections, write_page
from solver.studies.infsup.point import run
from solver.studies.infsup.records import failures, read_record, write_record
from solver.system.errors import InputError

FILE = Path(__file__).parents[3] / "cases/stability/infsup/infsup.yaml"
SMALL = """\
levels: {plane: [4, 8, 16, 32], space: [2, 4]}
quick: {plane: [4, 8], space: [2, 4]}
coarser: {plane: [4], space: [1]}
cells: [{cells: QUAD4}, {cells: QUAD9, cut: false}, {cells: HEXA8, hexahedra: hexahedra}]
"""


def ladder(constants, cut=True, levels=(4, 8, 16)):
    constants = list(constants)
    return InfSupLadder(
        "QUAD4",
        cut,
        clamped=True,
        coarser=1,
        levels=list(levels[: len(constants)]),
        constants=constants,
        macro_elements=[1] * len(constants),
        unknowns=[1] * len(constants),
    )


def profile(pressure, cut=True):
    return PressureProfile("QUAD4", cut, True, list(range(len(pressure))), pressure)


def test_the_file_asks_for_every_cell_type_that_is_cut():
    asked = read_ladders(FILE)
    assert {(each.cells, each.cut) for each in asked} >= {
        (cells, cut)
        for cells in ("TRIA3", "QUAD4", "TETRA4", "TETRA10", "HEXA8", "HEXA20")
        for cut in (True, False)
    }
    assert {each.hexahedra for each in asked if each.cells == "HEXA20"} == {
        "pyramids",
        "hexahedra",
    }
    assert all(len(each.levels) >= 4 for each in asked)
    assert {(each.clamped, each.coarser) for each in asked if each.cells == "TRIA3"} == {
        (clamped, coarser) for clamped in (True, False) for coarser in (1, 4)
    }


def test_each_ladder_of_a_chart_has_its_own_line_and_look():
    """PENTA6 has ladders on either kind of face, HEXA8 two cuts: each is a line of its own."""
    asked = [each for each in read_ladders(FILE) if each.dim == 3 and each.clamped]
    asked = [replace(each, constants=[0.1] * len(each.levels)) for each in asked]
    asked = [each for each in asked if each.coarser == asked[0].coarser]
    spec = draw_constants("3D", asked).spec
    records = spec["data"]["values"]
    assert len({(r["series"], r["faces"]) for r in records}) == len(records)
    marks = spec["layer"][-1]["layer"]
    channels = spec["layer"][-1]["encoding"]["color"], marks[1]["encoding"]["shape"]
    dashes = marks[0]["encoding"]["strokeDash"]
    looks = list(zip(*(c["scale"]["range"] for c in (*channels, dashes)), strict=True))
    assert len({json.dumps(look) for look in looks}) == len(looks) == len(asked)


def test_what_the_file_may_not_say(tmp_path):
    path = tmp_path / "infsup.yaml"
    path.write_text(SMALL.replace("QUAD9", "QUAD5"))
    with pytest.raises(InputError, match=r"cells\[1\].cells"):
        read_ladders(path)


def test_the_order_is_the_power_of_the_face_size():
    assert ladder([0.8, 0.4, 0.1]).order == pytest.approx(2.0)
    assert not ladder([0.8, 0.4, 0.1]).levels_off
    assert ladder([0.8, 0.6, 0.55]).levels_off
    assert np.isnan(ladder([0.5, 0.0, 0.0]).order)
    assert not ladder([0.5, 0.0, 0.0]).levels_off


def test_a_small_run_from_file_to_page(tmp_path):
    path, record = tmp_path / "infsup.yaml", tmp_path / "record.json"
    path.write_text(SMALL)
    ladders = [run(each) for each in read_ladders(path) if each.dim == 2]
    kinds = {each.kind: each for each in ladders if each.clamped}
    assert kinds["QUAD4"].levels_off
    assert kinds["QUAD9"].levels_off
    assert kinds["QUAD4, uncut"].order == pytest.approx(1.0, abs=0.05)
    write_record(record, ladders, [profile([1.0, 0.9, 0.8]), profile([1.0, 0.0, 1.0], cut=False)])
    assert read_record(record)[0] == ladders
    assert failures(read_record(record)) == []
    assert main(["infsup-page", str(record), "-o", str(tmp_path)]) == 0
    page = (tmp_path / "infsup.html").read_text()
    assert page.count("levels off") >= 4
    assert page.count("falls</td>") == 2
    assert "2.00" in page
    assert len((tmp_path / "infsup.csv").read_text().splitlines()) == 1 + 4 * len(ladders)
    assert (tmp_path / "infsup-failures.txt").read_text() == ""


def test_solid_cells_run_too(tmp_path):
    path = tmp_path / "infsup.yaml"
    path.write_text(SMALL)
    cut, uncut = (run(each) for each in read_ladders(path, quick=True)[-2:])
    assert (cut.way, uncut.way) == ("hexahedra", "uncut")
    assert cut.constants[-1] > 0.4 > 0.3 > uncut.constants[-1] > 0


def test_what_does_not_hold_is_told(tmp_path):
    broken = ladder([])
    broken.reason = "gmsh cannot make it"
    record = (
        [ladder([0.8, 0.4, 0.2]), ladder([0.8, 0.4, 0.2], cut=False), broken],
        [profile([0.0, 1.0, 0.0]), profile([0.0, 1.0, 0.0], cut=False)],
    )
    lines = failures(record)
    assert len(lines) == 3
    assert "order 1.00" in lines[0]
    assert "gmsh cannot make it" in lines[1]
    assert "oscillates by 2.00" in lines[2]
    write_page(record, tmp_path)
    assert (tmp_path / "infsup-failures.txt").read_text().count("\n") == 3
    assert all(line.split(":")[0] in sections(record) for line in lines)
