"""Positions of bodies that move far against a reference: which are compared, and that they are."""

import json
from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import load_case, parse_case
from solver.case.yaml import read_mapping
from solver.simulation.options import LEAN
from solver.simulation.simulate import solved
from solver.system.progress import Clock
from solver.verification.checks import run_checks
from solver.verification.numbers import _as_in_the_last
from solver.verification.run import mesh_of

CASES = Path(__file__).resolve().parents[2] / "cases"


def run(case):
    return solved(case, mesh_of(case), LEAN, Clock())


def test_a_wrong_pressure_at_an_earlier_position_is_noticed():
    solution = run(load_case(CASES / "motion/slide-c-friction.yaml"))
    checks = {check.name: check for check in run_checks(solution)}
    assert checks["position_pressure"].passed
    assert checks["position_friction"].passed
    pressed = np.nanargmax(solution.earlier[2].of_cells["pressure"])
    solution.earlier[2].of_cells["pressure"][pressed] *= 1 + 1e-9
    solution.earlier[4].of_cells["friction_traction"][pressed, 0] += 1e-6
    checks = {check.name: check for check in run_checks(solution)}
    assert not checks["position_pressure"].passed
    assert "step 3" in checks["position_pressure"].where


def sliding(columns, name="slide-c", factor=lambda step: 1.0, **changes):
    """The sliding patch test at these of its columns; `factor` of all that acts, by step."""
    text = read_mapping(CASES / f"motion/{name}.yaml")
    text["steps"] = [
        {key: value * (1 if key == "slide" else factor(step)) for key, value in steps.items()}
        for step, steps in enumerate((text["steps"][k - 1] for k in columns), start=1)
    ]
    wanted = ("kind", "contact_pressure", "friction_traction")
    text["reference"] = {k: v for k, v in text["reference"].items() if k in wanted}
    del text["tolerance"]
    return parse_case(json.dumps(text | changes), Path("sliding.yaml"))


PRESSED = """
name: pressed
mesh:
  recipe: blocks
  size: 10
  bottom: {cells: QUAD4, divisions: [3, 2]}
  top: {cells: QUAD8, divisions: [2, 2]}
plane: strain
motion: large
materials: {all: {young: 2000.0, poisson: 0.3}}
supports: [{group: base, fix: [y]}, {group: symx, fix: [x]}]
loads: [{group: press, pressure: 2.5}]
steps: [0.5, 1.0, 1.2, 1.0]
contact: [{name: interface, slave: bottom_contact, master: top_contact}]
reference: {kind: analytical, contact_pressure: 2.5}
"""
# Pressed by what moves a side, and by what acts on a rigid body: half as far, as far, further.
LOADS = ("[{group: press, pressure: 2.5}]", "[]")
DOWN = f"{{group: press, name: on, fix: {{y: {-2.5 * 20 * 0.91 / 2000}}}}}"
HELD = PRESSED.replace("supports: [", f"supports: [{DOWN}, ").replace(*LOADS)
RIGID = PRESSED.replace("loads:", "bodies: {top: {rigid: true, force: {y: -25}, name: on}}\nloads:")
RIGID = RIGID.replace(*LOADS).replace("{group: symx", "{at: [0, -10]")
BY_NAME = ("[0.5, 1.0, 1.2, 1.0]", "[{on: 0.5}, {on: 1.0}, {on: 1.2}, {on: 1.0}]")
PATHS = {
    "pressed by and by": (sliding([1, 2], substeps=2), [2]),
    "back": (sliding([1, 2, 1]), [1, 2]),
    "pressed harder": (sliding([1, 2, 3], factor=lambda step: step / 3), []),
    "factors": (parse_case(PRESSED, Path("pressed.yaml")), [2]),
    "a side": (parse_case(HELD.replace(*BY_NAME), Path("held.yaml")), [2]),
    "a rigid body": (parse_case(RIGID.replace(*BY_NAME), Path("rigid.yaml")), [2]),
}


@pytest.mark.parametrize("path", PATHS)
def test_positions_are_compared_where_the_loads_of_the_last_step_act(path):
    """A right pressure is right at each of them; one that is wrong there is noticed."""
    case, compared = PATHS[path]
    solution = run(case)
    for step in range(1, len(case.steps)):
        pressure = solution.earlier[step - 1].of_cells["pressure"]
        pressed = np.nanargmax(pressure)
        for change in (1.0, 1.01):
            pressure[pressed] *= change
            check = {c.name: c for c in run_checks(solution)}.get("position_pressure")
            assert (check is None or check.passed) == (change == 1.0 or step not in compared)
        pressure[pressed] /= 1.01


@pytest.mark.parametrize(
    ("columns", "compared"), [([1, 2, 3], [1, 2]), ([1, 2, 3, 2, 1], [4]), ([1, 2, 2], [])]
)
def test_friction_is_compared_where_the_bodies_go_the_same_way(columns, compared):
    case = sliding(columns, "slide-c-friction")
    before = range(1, len(columns))
    found = [
        [step for step in before if _as_in_the_last(case, step, quantity, np.array([0.0, 1.0]))]
        for quantity in ("friction_traction", "pressure")
    ]
    assert found == [compared, list(before)]


def test_a_body_that_is_free_in_a_component_is_not_pressed_by_it():
    free = RIGID.replace("force: {y: -25}", "move: {x: 1}, force: {rz: 0}")
    case = parse_case(free.replace(*BY_NAME), Path("free.yaml"))
    assert _as_in_the_last(case, 1, "pressure", np.array([0.0, 1.0]))


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_what_moves_a_side_is_seen_in_any_unit(unit):
    down = DOWN.replace(str(-2.5 * 20 * 0.91 / 2000), repr(-0.02275 * unit))
    case = parse_case(HELD.replace(DOWN, down).replace(*BY_NAME), Path("held.yaml"))
    found = [_as_in_the_last(case, step, "pressure", np.array([0.0, 1.0])) for step in (1, 2, 3)]
    assert found == [False, True, False]
