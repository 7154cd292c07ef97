"""Friction in the decks of other codes: CalculiX has it, the others refuse it by name."""

import json
import shutil
from pathlib import Path

import pytest

from solver.case.reader import load_case
from solver.codes import calculix
from solver.codes.calculix import deck_lines
from solver.codes.code_aster import CodeAster
from solver.codes.deck import UnsupportedError, deck_of
from solver.codes.plain import Plain
from solver.commands.cli import main
from solver.verification.run import mesh_of

CASES = Path(__file__).parents[2] / "cases"


def deck_for(name, layer=True):
    case = load_case(CASES / f"{name}.yaml")
    return deck_of(case, mesh_of(case), layer=layer)


def test_each_coefficient_has_an_interaction_of_its_own():
    lines = list(deck_lines(deck_for("friction-patch/c-slip")))
    at = lines.index("*FRICTION")
    coefficient, slope = map(float, lines[at + 1].split(","))
    assert coefficient == 0.4
    assert slope == float(lines[at - 1])
    assert "*CONTACT PAIR, INTERACTION=FRICTION0, TYPE=SURFACE TO SURFACE" in lines
    without = list(deck_lines(deck_for("ssnp170/c")))
    assert "*FRICTION" not in without
    assert "*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=SURFACE TO SURFACE" in without


@pytest.mark.skipif(not shutil.which(calculix.PROGRAM), reason="no CalculiX")
@pytest.mark.parametrize("name", ["c-slip", "m-stick"])
def test_calculix_finds_the_same_state(name, tmp_path):
    """Its penalty lets surfaces overlap and slip by 1e-5 of the displacement."""
    case = CASES / "friction-patch" / f"{name}.yaml"
    assert main(["run", str(case), "--code", "calculix", "-o", str(tmp_path / "run")]) == 0
    verdict = json.loads((tmp_path / "run" / "verdict.json").read_text(encoding="utf-8"))
    errors = {check["name"]: check["error"] for check in verdict["checks"]}
    assert errors["displacement"] < 5e-5
    assert errors["multiplier"] < 1e-4


@pytest.mark.parametrize("code", [CodeAster(), Plain()])
def test_codes_without_friction_refuse_it(code, tmp_path):
    with pytest.raises(UnsupportedError, match="friction"):
        code.write(deck_for("friction-patch/c-slip", layer=False), tmp_path)


def test_a_path_of_steps_is_refused_for_all_codes():
    with pytest.raises(UnsupportedError, match="a path of steps"):
        deck_for("friction-patch/two-steps")
