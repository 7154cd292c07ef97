"""Load steps in any order, and loads with factors of their own: each state is its own, by hand.

Two unit squares; the uniform state has σ_yy = −p and sinks by (1 − ν²) p/E per unit of height.
"""

from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.codes.deck import UnsupportedError, deck_of
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from tests.scenes import POISSON, YOUNG, block_mesh

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


def solved(text):
    solution = simulate(parse_case(text, Path("steps.yaml")), block_mesh("QUAD8", "QUAD4", (3, 2)))
    assert max(solution.balance.values()) < 1e-12
    return solution, [step.observations[0]["pressure"] for step in solution.steps]


def test_each_named_load_has_its_own_factors():
    """The interface bears 25 times the one factor and 8 times the other."""
    steps = "steps: [{press: 1, weight: 0}, {press: 0.2, weight: 3}, {press: 0, weight: 0}, "
    solution, pressure = solved(CASE + steps + "{press: 2, weight: -1}]\n")
    assert pressure == pytest.approx([25, 5 + 24, 0, 50 - 8], abs=1e-10)
    assert [step.factor for step in solution.steps] == [1, 2, 3, 4]
    assert solution.zones[0].multiplier == pytest.approx(42, rel=1e-11)


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
