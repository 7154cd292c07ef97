"""A user's own code: a folder with commands; the toy code of the documentation."""

import json
from pathlib import Path

import numpy as np
import pytest

from solver.codes import plain
from solver.codes.deck import UnsupportedError, deck_of
from solver.codes.run import Limits, find, run_case
from solver.commands.cli import main
from solver.system.errors import InputError
from tests.codes.blocks import case_of

TOY = Path(__file__).parents[2] / "docs/examples/toy"
PAGE = Path(__file__).parents[2] / "docs/run-codes.md"
ZONE = {"name": "i", "slave": "bottom_contact", "master": "top_contact"}
FILE = "command: ['true']\nversion: '1'\n"


def write(tmp_path, text, name="mine", file="code.yaml"):
    folder = tmp_path / name
    folder.mkdir()
    (folder / file).write_text(text)
    return folder


def matching(bottom, top):
    """Blocks whose edges coincide on the interface: penalty is exact there."""
    sides = {side: {"cells": c, "divisions": 2} for side, c in (("bottom", bottom), ("top", top))}
    return case_of(bottom, top, mesh={"recipe": "blocks", "size": 50, **sides})


def pressure_error(verdict):
    [check] = [check for check in verdict.checks if check.name == "multiplier"]
    return check.error


def test_the_toy_of_the_documentation(tmp_path):
    verdict = run_case(find(str(TOY)), *matching("QUAD4", "TRIA3"), tmp_path, Limits())
    assert (verdict.verdict, verdict.foreign.code) == ("passed", "toy")
    assert pressure_error(verdict) < 1e-9
    # On edges that do not match: not exact, and not far off.
    verdict = run_case(find(str(TOY)), *case_of("QUAD4", "TRIA3"), tmp_path, Limits())
    assert 1e-9 < pressure_error(verdict) < 1e-2
    assert verdict.foreign.settings["contact"].startswith("penalty")


def test_the_toy_has_no_quadratic_cells(tmp_path):
    verdict = run_case(find(str(TOY)), *case_of("QUAD8", "QUAD8"), tmp_path, Limits())
    assert (verdict.verdict, verdict.reason) == ("refused", "QUAD8: not written for toy")


@pytest.mark.parametrize(
    ("keys", "cells", "more", "reason"),
    [
        ("cells: [QUAD4]", "TRIA3", {}, "TRIA3: not written for mine"),
        ("lacks: {gap: as meshed}", "QUAD4", {"contact": [ZONE | {"clearance": 1}]}, "as meshed"),
        ("lacks: {orders: one}", ("QUAD4", "QUAD8"), {}, "one"),
    ],
)
def test_what_a_code_lacks_is_refused_by_its_own_words(tmp_path, keys, cells, more, reason):
    code = find(str(write(tmp_path, FILE + keys + "\n")))
    one, other = (cells, cells) if isinstance(cells, str) else cells
    with pytest.raises(UnsupportedError, match=reason):
        code.write(deck_of(*case_of(one, other, **more)), tmp_path)
    code.write(deck_of(*case_of("QUAD4", "QUAD4")), tmp_path)


def test_a_command_may_print_the_version(tmp_path):
    text = FILE.replace("'1'", "['{python}', -c, 'print(2)']")
    assert find(str(write(tmp_path, text))).version() == "2"


def test_a_result_by_nodes(tmp_path):
    """Two nodes of the deck, stress in plane strain."""
    code = find(str(write(tmp_path, FILE)))
    deck = deck_of(*case_of("QUAD4", "QUAD4"))
    told = {"stress": [[3, 10.0, 20.0, 3.0]], "pressure": [[2, 25.0]]}
    (tmp_path / "result.json").write_text(json.dumps(told))
    found = code.read(deck, tmp_path)
    assert (found.code, found.displacement) == ("mine", None)
    assert found.stress.values.tolist() == [pytest.approx([10, 20, 9, 3, 0, 0])]
    assert found.stress.places.tolist() == [deck.points[3].tolist()]
    assert (found.pressure.nodes.tolist(), found.pressure.values.tolist()) == ([2], [25.0])


def test_the_file_of_the_page_is_that_of_the_toy():
    shown = [part.split("```")[0] for part in PAGE.read_text().split("```yaml\n")[1:]]
    assert (TOY / "code.yaml").read_text() in shown


def test_another_program_with_the_input_of_calculix(tmp_path):
    text = FILE + "input: calculix\nsettings: {build: mine}\n"
    code = find(str(write(tmp_path, text.replace("['true']", "['{code}/ccx', -i, deck]"))))
    assert code.command(tmp_path) == [f"{tmp_path}/mine/ccx", "-i", "deck"]
    code.write(deck_of(*case_of("HEXA8", "HEXA8"), code.layer), tmp_path)
    assert (tmp_path / "deck.inp").is_file()
    assert (code.layer, code.settings["build"]) == (True, "mine")
    assert (
        code.settings["pressure-overclosure"]
        == "LINEAR, 25000 E / face size, 200 on curved surfaces, 1 of bodies that move far (NLGEOM)"
    )


def test_the_plain_input_balances(tmp_path):
    """Forces of 25 MPa on 50 mm; faces outward; indices from 0."""
    deck = deck_of(*case_of("TRIA6", "QUAD4"))
    plain.Plain().write(deck, tmp_path)
    told = json.loads((tmp_path / plain.FILE).read_text())
    assert sum(value for _, _, value in told["forces"]) == pytest.approx(-1250)
    points = np.array(told["points"])
    [pair] = told["contact"]
    for side, up in (("slave", 1), ("master", -1)):
        [faces] = pair[side].values()
        along = points[np.array(faces)[:, 1]] - points[np.array(faces)[:, 0]]
        # Outward is to the right of the way from the first end to the second.
        assert (np.sign(-along[:, 0]) == up).all()
    assert {axis for _, axis, _ in told["held"]} == {0, 1}


@pytest.mark.parametrize(
    ("text", "file", "message"),
    [
        ("version: '1'\n", "code.yaml", "command"),
        (FILE + "input: abaqus\n", "code.yaml", "input = 'abaqus': must be plain, calculix"),
        (FILE + "lacks: {friction: no}\n", "code.yaml", "lacks.friction"),
        (FILE + "gave_up: '('\n", "code.yaml", "gave_up = '(': must be a regular expression"),
        ("", "other.txt", "code: a folder with code.yaml is needed"),
    ],
)
def test_what_is_refused(tmp_path, text, file, message):
    with pytest.raises(InputError, match=message.replace("(", r"\(").replace(".", r"\.")):
        find(str(write(tmp_path, text, file=file)))


def test_no_results_are_a_failed_run(tmp_path, capsys):
    folder = write(tmp_path, FILE + "results: [displacement.csv]\n")
    verdict = run_case(find(str(folder)), *case_of("QUAD4", "QUAD4"), tmp_path / "out", Limits())
    assert verdict.verdict == "failed"
    assert "displacement.csv: result: no such file" in verdict.reason
    assert main(["codes", str(folder)]) == 0
    assert f"{folder}: 1\n" in capsys.readouterr().out
