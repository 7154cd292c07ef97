"""Load steps in any order, and loads with factors of their own: each state is its own, by hand.

Two unit squares; the uniform state has σ_yy = −p and sinks by (1 − ν²) p/E per unit of height.
"""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.codes.deck import UnsupportedError, deck_of
from solver.simulation import simulate
from solver.simulation.equilibrium.accuracy import Accuracy
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.judge import judge
from solver.verification.results import read_result, write_result
from solver.verification.run import Job, check, solve
from tests import scenes
from tests.scenes import POISSON, YOUNG, block_mesh, replaced

CASE = """\
name: steps
mesh: {recipe: blocks, size: 1.0}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: base, fix: [y]}
  - {group: symx, fix: [x]}
loads:
  - {group: press, pressure: 25.0, name: press}
  - {group: press, traction: [0, -8.0], name: weight}
contact: [{name: zone, slave: bottom_contact, master: top_contact}]
observe: [{zone: zone, nearest: [0, 0]}]
"""
PARTS = """size: 1.0, bottom: {cells: QUAD4, divisions: [3, 3]}, top: {cells: QUAD8, \
divisions: [2, 2]}"""


def solved(text):
    solution = scenes.solved(text, block_mesh("QUAD8", "QUAD4", (3, 2)))
    return solution, [step.observations[0]["pressure"] for step in solution.steps]


def test_each_named_load_has_its_own_factors():
    """The interface bears 25 times the one factor and 8 times the other."""
    steps = "steps: [{press: 1, weight: 0}, {press: 0.2, weight: 3}, {press: 0, weight: 0}, "
    solution, pressure = solved(CASE + steps + "{press: 2, weight: -1}]\n")
    assert pressure == pytest.approx([25, 5 + 24, 0, 50 - 8], abs=1e-10)
    assert [step.factor for step in solution.steps] == [1, 2, 3, 4]
    assert solution.zones[0].multiplier == pytest.approx(42, rel=1e-11)


@pytest.mark.parametrize("moved", [0.0, 7.0])
def test_the_macro_element_that_is_nearest_to_the_place_is_observed(moved):
    mesh = block_mesh("QUAD8", "QUAD4", (3, 2))
    mesh = scenes.with_points(mesh, mesh.points + np.array([moved, 0]))
    for side in (0, 1):
        text = CASE.replace("nearest: [0, 0]", f"nearest: [{moved + side}, 0]")
        solution = scenes.solved(text + "steps: [{press: 1, weight: 1}]\n", mesh)
        seen = solution.steps[0].observations[0]["macro_element"]
        along = np.abs(solution.zones[0].centre[:, 0] - (moved + side))
        assert seen == along.argmin()
        assert along[seen] < 0.25


def test_factors_in_any_order_unload():
    text = CASE.replace(", name: press", "").replace(", name: weight", "")
    solution, pressure = solved(text + "steps: [0.5, 1, 0, 0.25]\n")
    assert pressure == pytest.approx([33 * f for f in (0.5, 1, 0, 0.25)], abs=1e-10)
    assert [step.factor for step in solution.steps] == [0.5, 1, 0, 0.25]


def test_contact_opens_and_closes_again_under_imposed_displacements():
    """The top is pushed down by 0.01, lifted by 0.1, and pushed down by 0.02.

    Pushed down, both squares of height 1 shorten by 0.005: p = 0.005 E/(1 − ν²).
    """
    text = CASE.replace(
        "  - {group: symx, fix: [x]}\n",
        "  - {group: symx, fix: [x]}\n  - {group: press, fix: {y: 0.1}, name: lift}\n",
    )
    a, b = text.index("loads:"), text.index("contact:")
    text = text[:a] + text[b:]
    _, pressure = solved(text + "steps: [{lift: -0.1}, {lift: 1}, {lift: -0.2}]\n")
    exact = 0.005 * YOUNG / (1 - POISSON**2)
    assert pressure == pytest.approx([exact, 0, 2 * exact], rel=1e-11)


def test_a_load_without_a_name_always_acts():
    text = CASE.replace(", name: weight", "")
    _, pressure = solved(text + "steps: [{press: 0}, {press: 1}, {press: 0.5}]\n")
    assert pressure == pytest.approx([8, 33, 20.5], rel=1e-11)


def test_opposite_histories_do_not_cancel():
    """Of equal and opposite loads only one acts at a time: no body counts as unloaded."""
    text = CASE.replace("traction: [0, -8.0]", "traction: [0, 25.0]")
    _, pressure = solved(text + "steps: [{press: 1, weight: 0}, {press: 1, weight: 0.6}]\n")
    assert pressure == pytest.approx([25, 10], rel=1e-11)


def test_what_no_code_is_given_and_what_is_refused():
    case = parse_case(CASE + "steps: [{press: 1, weight: 1}]\n", Path("steps.yaml"))
    with pytest.raises(UnsupportedError, match="factors of single loads"):
        deck_of(case, block_mesh("QUAD4", "QUAD4", (1, 1)))
    with pytest.raises(InputError, match="only a support with imposed values has a factor"):
        parse_case(
            CASE.replace("fix: [y]}", "fix: [y], name: low}")
            + "steps: [{press: 1, weight: 1, low: 1}]\n",
            Path("steps.yaml"),
        )
    assert np.isfinite(case.factors).all()


@pytest.fixture(scope="module")
def unloaded():
    """Pressures of 25, 75 and none; the reference is the last state, of which the factor is 0."""
    reference = """
reference: {kind: analytical, contact_pressure: 0, normal_stress: 0, displacement: [0, 0],
  reaction: {base: [0, 0]}, force: [0, 0], contact_area: 1}
tolerance: 1.0e-11
"""
    text = CASE.replace(", name: press", "").replace(", name: weight", "")
    text = text.replace("  - {group: press, traction: [0, -8.0]}\n", "")
    return solved(text + "steps: [1, 3, 0]" + reference)[0]


def test_forces_of_every_step_also_stored(unloaded, tmp_path):
    """The base bears the pressure on its length of 1, at x = 1/2: no force in the last step."""
    write_result(tmp_path / "r.vtkhdf", unloaded, [], {})
    for one in (unloaded, read_result(tmp_path / "r.vtkhdf").solution):
        forces = [step.resultants["zone"] for step in one.steps]
        held = [{r.group: r for r in step.reactions}["base"] for step in one.steps]
        for p, contact, base in zip((25, 75, 0), forces, held, strict=True):
            assert contact.force == pytest.approx([0, -p], abs=1e-11)
            assert contact.moment == pytest.approx([0, 0, -p / 2], abs=1e-11)
            assert contact.pressure == pytest.approx([p, p], abs=1e-11)
            assert contact.area[0] == pytest.approx(1)
            assert base.force == pytest.approx([0, p], abs=1e-11)
        assert one.reactions == one.steps[-1].reactions
    rows = judge(unloaded, []).values.forces
    assert [(r.step, r.name) for r in rows[:4]] == [
        (1, "zone zone"), (1, "base"), (1, "symx"), (2, "zone zone")]  # fmt: skip
    assert rows[3].force == pytest.approx([0, -75])


def test_reactions_at_nodes_sum_to_the_resultants():
    solution, _ = solved(CASE + "steps: [{press: 1, weight: 1}]\n")
    assert solution.fields.reaction.sum(axis=0) == pytest.approx([0, 33], abs=1e-10)
    low = solution.mesh.points[:, 1] == -1
    assert solution.fields.reaction[low, 1].sum() == pytest.approx(33)
    assert np.abs(solution.fields.reaction[~low, 1]).max() < 1e-10


def test_what_is_left_after_unloading_is_compared_with_the_largest_step(unloaded):
    """A remaining pressure of 1e-9 is 1.3e-11 of 75, and too much; so is a force."""
    unloaded = deepcopy(unloaded)  # other tests see it too
    assert all(check.passed for check in run_checks(unloaded))
    for left, fails in ((1e-10, False), (1e-9, True)):
        unloaded.zones[0].multiplier[:] = left
        unloaded.steps[-1].reactions[0].force[1] = left
        found = {c.name: c.passed for c in run_checks(unloaded)}
        assert (found["multiplier"], found["reaction"]) == (not fails, not fails)


def test_places_are_observed_against_the_last_factor():
    """The reference of 8.25 belongs to the factor 1/4; at 1/2 it is 16.5."""
    text = CASE.replace(", name: press", "").replace(", name: weight", "")
    text += "steps: [0.5, 0.25]\nreference: {kind: analytical, contact_pressure: 8.25}\n"
    found = {check.name: check for check in run_checks(solved(text)[0])}
    assert found["observation"].error < 1e-12
    assert found["observation"].maximum == pytest.approx(16.5)


_LOADS = CASE[CASE.index("loads:") : CASE.index("contact:")]
PRESSED = (
    replaced(CASE, ("0.3", "0.0"), (_LOADS, "  - {group: press, fix: {y: -0.02}}\n"))
    + "steps: [0.5, 1.0]\nreference: {kind: analytical, contact_pressure: 20.0, gap: 0.0}\n"
)
# What changes, the pressure and gap of both steps, and how many of them are compared.
APART = {
    "touching": ((), (10.0, 20.0), (0.0, 0.0), 2),
    "opening": ((("y: -0.02", "y: 0.02"),), (0.0, 0.0), (0.01, 0.02), 2),
    "interference": (
        (("top_contact}", "top_contact, interference: 0.02}"),),
        (30.0, 40.0),
        (0, 0),
        1,
    ),
    "clearance": ((("top_contact}", "top_contact, clearance: 0.01}"),), (0.0, 10.0), (0, 0), 1),
    "back": ((("[0.5, 1.0]", "[1.0, 0.5]"),), (20.0, 10.0), (0.0, 0.0), 2),
    "friction": ((("top_contact}", "top_contact, friction: 0.1}"),), (10.0, 20.0), (0.0, 0.0), 2),
}


@pytest.mark.parametrize("name", APART)
def test_steps_are_compared_where_their_share_of_the_last_one_is_known(name):
    """By E u / 2 and the gap that is left; a wrong value is noticed where it is compared."""
    changes, pressures, gaps, compared = APART[name]
    values = f"contact_pressure: {pressures[1]}, gap: {gaps[1]}"
    text = replaced(PRESSED, *changes, ("contact_pressure: 20.0, gap: 0.0", values))
    solution, found = solved(text)
    assert found == pytest.approx(pressures, abs=1e-11)
    assert [s.observations[0]["gap"] for s in solution.steps] == pytest.approx(gaps, abs=1e-14)
    assert all(check.passed for check in run_checks(solution))
    solution.steps[0].observations[0]["pressure"] += 1.0
    failed = [check.name for check in run_checks(solution) if not check.passed]
    assert failed == ["observation"] * (compared - 1)


def test_the_steps_before_one_without_a_solution_are_kept(tmp_path):
    """Friction alone holds the upper block along x; some of it slips, and then all of it does."""
    path = "steps: [{press: 1, weight: 1}, {press: 2, weight: 1}, {press: 0, weight: 1}]\n"
    given = CASE.replace("  - {group: symx, fix: [x]}\n", "").replace("fix: [y]", "fix: [x, y]")
    given = given.replace("_contact}]", "_contact, friction: 0.4}]").replace("[0, -8", "[9, -8")
    case = tmp_path / "steps.yaml"
    case.write_text(given.replace("size: 1.0", PARTS) + path)
    verdict = solve(Job(case), tmp_path / "result.vtkhdf", tmp_path / "verdict.json")
    assert (verdict.verdict, verdict.passed) == ("failed", False)
    assert verdict.reason.startswith("step 3 (press 0, weight 1): nothing keeps top from a free")
    again = read_result(tmp_path / "result.vtkhdf").solution
    pressures = [step.resultants["zone"].force[1] for step in again.steps]
    assert pressures == pytest.approx([-33, -58])
    assert check(tmp_path / "result.vtkhdf").reason == verdict.reason


def test_the_worst_step_counts_for_digits_and_balance(monkeypatch):
    """The first of two steps has no digits, and half as much pressure again as its loads."""
    right = simulate.solution_of

    def first_step_wrong(problem, states, plan):
        trial = replace(states[0].trial, pressure=1.5 * states[0].pressure)
        wrong = replace(states[0], trial=trial, accuracy=Accuracy({"gap": 0.5}))
        return right(problem, [wrong, *states[1:]], plan)

    monkeypatch.setattr(simulate, "solution_of", first_step_wrong)
    case = parse_case(
        CASE + "steps: [{press: 1, weight: 0}, {press: 0.5, weight: 0}]\n", Path("case.yaml")
    )
    solution = simulate.simulate(case, block_mesh("QUAD8", "QUAD4", (3, 2)))
    assert solution.quality.accuracy["gap"] == 0.5
    assert solution.quality.balance["free nodes: force"] > 0.01
