"""States of friction that Newton's method finds by a way of its own."""

from copy import deepcopy
from pathlib import Path

import pytest

from solver.case.reader import parse_case
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.scene.scene import build_scene
from solver.verification.checks import run_checks
from solver.verification.run import mesh_of
from tests.scenes import circle_on_block, solved


@pytest.mark.parametrize("friction", [0.5, 0.1])
def test_a_free_punch_that_is_pressed_in_finds_its_place(friction):
    """A rigid circle presses a block and is free along it: friction alone holds it, evenly."""
    text = circle_on_block(
        [40, 10],
        "{centre: [10.0, 29.6], radius: 20.0}, move: {rz: 0.0}, force: {x: 0.0}",
        f"friction: {friction}",
    )
    (zone,) = solved(text).zones
    pressed = zone.multiplier > 0
    assert pressed.sum() > 3
    force = zone.resultants.force
    assert abs(force[0]) < 1e-9 * abs(force[1])


@pytest.fixture(scope="module")
def between():
    """A block pressed, then pulled by far more than it can stick: the cap goes along."""
    bricks = {
        "low": (0.0, 60.0, "QUAD4"),
        "mid": (10.0, 20.0, "QUAD8"),
        "cap": (20.0, 20.0, "TRIA6"),
    }
    lines = "".join(
        f"    - {{name: {n}, low: [0.0, {y}], high: [{x}, {y + 10}], block: {{cells: {cells}, "
        f"divisions: [{3 if n != 'low' else 12}, 2]}}}}\n"
        for n, (y, x, cells) in bricks.items()
    )
    planes = {"lt": ("low", 10), "mu": ("mid", 10), "mt": ("mid", 20), "cu": ("cap", 20)}
    groups = "".join(
        f"  {n}: {{within: {body}, plane: {{point: [0, {y}], normal: [0, 1]}}}}\n"
        for n, (body, y) in planes.items()
    )
    text = f"""
name: between
mesh:
  recipe: bricks
  bricks:
{lines}plane: strain
materials: {{all: {{young: 2000.0, poisson: 0.3}}}}
groups:
{groups}  base: {{plane: {{point: [0, 0], normal: [0, 1]}}}}
  press: {{plane: {{point: [0, 30], normal: [0, 1]}}}}
  grip: {{of: nodes, within: mid, box: {{low: [-1, 14], high: [1, 16]}}}}
supports:
  - {{group: base, fix: [x, y]}}
  - {{group: grip, fix: {{x: 0.25}}, name: pull}}
loads: [{{group: press, pressure: 2.5, name: press}}]
steps: [{{press: 1, pull: 0}}, {{press: 1, pull: 1}}]
contact:
  - {{name: one, slave: mu, master: lt, friction: 0.2}}
  - {{name: two, slave: cu, master: mt, friction: 0.6}}
"""
    return solved(text)


def test_a_block_between_two_slides_after_it_was_pressed(between):
    one, two = between.zones
    assert (one.friction.status == 2).all()
    assert (two.friction.status == 1).all()
    force = between.steps[-1].resultants["one"].force
    assert abs(force[0]) == pytest.approx(0.2 * 50.0, rel=1e-8)


@pytest.mark.parametrize(("work", "passes"), [(-1e-16, True), (-1e-3, False)])
def test_work_where_nothing_presses_is_judged_by_the_slips_of_all_zones(between, work, passes):
    """Zone `two` has no slip of its own; the work of a step is that of both."""
    left = deepcopy(between)
    for zone in left.zones:
        zone.multiplier[:], zone.friction.friction_traction[:] = 0.0, 0.0
    for step in left.steps:
        step.dissipation = 0.0
    left.steps[-1].dissipation = work
    law = [check for check in run_checks(left) if check.name == "friction_law"]
    assert [check.passed for check in law] == [passes, passes]


def test_a_gap_that_lifts_a_free_body_counts_as_another():
    """One face on a rigid parabola: its gap brings up no force, and is zero all the same."""
    text = """
name: block
mesh:
  recipe: bricks
  bricks: [{name: block, low: [0, 0], high: [1.5, 0.4], block: {cells: TRIA3, divisions: [1, 2]}}]
plane: strain
materials: {all: {young: 1263.0, poisson: 0.45}}
groups:
  base: {plane: {point: [0, 0], normal: [0, 1]}}
  press: {plane: {point: [0, 0.4], normal: [0, 1]}}
  side: {plane: {point: [0, 0], normal: [1, 0]}}
bodies: {floor: {parabola: {point: [0.7, 0], normal: [0, 1], radius: 31}}}
supports: [{group: side, fix: [x]}]
loads: [{group: press, pressure: 3.0}]
contact: [{name: below, slave: base, master: floor, friction: 0.2}]
"""
    case = parse_case(text, Path("block.yaml"))
    stiffness, size = ContactProblem(build_scene(case, mesh_of(case))).contact_stiffness()
    assert abs(stiffness[0, 0]) < 1e-9 * size[0]
    assert size[0] > 1e-4 * size[1]
    (zone,) = solved(text).zones
    assert abs(zone.gap) < 1e-15
    assert zone.friction.status == 2
