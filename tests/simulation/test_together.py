"""Nodes that move as one: an eccentric force on them is the uniform state."""

import pytest

from solver.system.errors import InputError
from tests.scenes import errors, solved

CASE = """\
name: platen
mesh:
  recipe: blocks
  size: 1.0
  bottom: {cells: QUAD8, divisions: 3}
  top: {cells: TRIA6, divisions: 2}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: base, fix: [y]}
  - {group: symx, fix: [x]}
  - {group: press, together: [y]}
loads: [{at: [1, 1], force: [0, -25.0]}]
contact: [{slave: bottom_contact, master: top_contact}]
"""


@pytest.mark.parametrize("swapped", [False, True])
def test_a_force_at_a_corner_of_a_platen_presses_evenly(swapped):
    """The tie leaves only the sum of the forces: the pressure is 25, as under an even load."""
    assert max(errors(solved(CASE, swapped=swapped)).values()) < 1e-11


def test_the_reaction_of_a_tie_is_a_moment_without_a_force():
    """The force at x = 1 acts on the body as one at x = 1/2: a moment of 25/2 about z."""
    found = {one.group: one for one in solved(CASE).reactions}
    assert found["together"].force == pytest.approx([0, 0], abs=1e-12)
    assert found["together"].moment == pytest.approx([0, 0, 12.5], abs=1e-11)
    assert found["base"].force == pytest.approx([0, 25], abs=1e-11)


def test_without_the_tie_the_force_presses_on_one_side():
    loose = CASE.replace("  - {group: press, together: [y]}\n", "")
    assert errors(solved(loose))["pressure"] > 0.1


def test_a_tie_resists_turning_and_is_refused_where_it_cannot_be():
    """The upper block is held along x at one node; the platen keeps it from turning."""
    text = CASE.replace("symx, fix: [x]", "symx_low, fix: [x]").replace(
        "loads:",
        "groups: {symx_low: {within: bottom, plane: {point: [0, 0], normal: [1, 0]}}}\nloads:",
    )
    text = text.replace("  - {group: press", "  - {at: [0, 1], fix: [x]}\n  - {group: press")
    assert max(errors(solved(text)).values()) < 1e-11


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("press, together: [y]", "symx, together: [y]", "its nodes belong to several bodies"),
        ("press, together: [y]", "press, together: [x]", "together.x: 1 of its nodes are held"),
        ("press, together: [y]", "base, together: [y]", "7 of its nodes are held there, or tied"),
        ("press, together: [y]", "press, together: [z]", "z in a plane case"),
        ("press, together: [y]", "press, together: [y, y]", "must be a list of x, y, z, each once"),
        ("press, together: [y]", "press, together: [w]", "supports[2].together[0] = 'w'"),
        ("press, together: [y]", "top_contact, together: [y]", ""),
        ("press, together: [y]", "bottom_contact, together: [y]",
         "have no free unknown of their own: their nodes move together; name the other"),
        ("group: press", "at: [0, 1]", "together needs a group"),
        ("together: [y]", "fix: [x], together: [y]", "exactly one of fix, spring, together"),
    ],
)  # fmt: skip
def test_refusals(old, new, message):
    text = CASE.replace(old, new)
    if not message:  # a master that moves as one: the solution is another, but balanced
        solved(text)
        return
    with pytest.raises(InputError) as refusal:
        solved(text)
    assert message in str(refusal.value)
