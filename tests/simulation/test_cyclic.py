"""Sectors and periods: sides that are copies of others, compared with known states by hand."""

from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.codes.deck import UnsupportedError, deck_of
from solver.mechanics.fem.supports import Copies, Fixed, copied, free_motion
from solver.mesh import generate
from solver.simulation.simulate import simulate
from solver.system.errors import InputError

RINGS = {
    "recipe": "rings",
    "radii": [1.0, 2.0, 3.0],
    "bottom": {"cells": "QUAD8", "divisions": [4, 2]},
    "top": {"cells": "QUAD8", "divisions": [3, 2]},
}
SECTOR = """\
name: sector
mesh: {recipe: rings}
plane: strain
materials: {bottom: {young: 2000.0, poisson: 0.3}, top: {young: 1000.0, poisson: 0.2}}
supports: [SIDES]
loads: [{group: base, pressure: 10.0}]
contact: [{slave: bottom_contact, master: top_contact, interference: 0.001}]
"""
MIRRORS = "{group: symx, fix: [x]}, {group: farx, fix: [y]}"
CYCLIC = (
    "{group: symx, cyclic: {of: farx, angle: 90}}, {at: [1, 0], fix: [y]}, {at: [3, 0], fix: [y]}"
)


def sector(sides):
    return simulate(
        parse_case(SECTOR.replace("SIDES", sides), Path("sector.yaml")), generate(RINGS, "test")
    )


def test_a_quarter_of_nested_tubes_as_a_sector_is_that_between_mirrors():
    """The field is symmetric, so that each kind of side has it; a node of each ring stops turns."""
    mirrors, cyclic = sector(MIRRORS), sector(CYCLIC)
    size = np.abs(mirrors.displacement).max()
    np.testing.assert_allclose(cyclic.displacement, mirrors.displacement, rtol=0, atol=1e-11 * size)
    pressure = mirrors.zones[0].multiplier
    np.testing.assert_allclose(cyclic.zones[0].multiplier, pressure, rtol=1e-10)
    assert max(cyclic.quality.balance.values()) < 1e-12
    assert cyclic.reactions[-1].group == "cyclic"
    total, other = (sum(r.force for r in s.reactions) for s in (cyclic, mirrors))
    assert total == pytest.approx(other, abs=1e-10 * abs(other).max())


def test_a_node_on_the_axis_is_its_own_copy():
    """Turned by 90 degrees about z, only a displacement along z is its own copy."""
    free = free_motion(2, 3, [])
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found = copied(free, [Copies(np.array([0]), np.array([0]), turn)])
    assert found.basis.toarray()[:3].any(axis=1).tolist() == [False, False, True]
    assert found.basis.shape == (6, 4)


def test_what_supports_hold_at_one_side_is_held_at_the_other():
    """Node 0 has u_x = 0.3, its copy, turned by 90 degrees, u_y = 0.3; they move along y and x."""
    fixed = Fixed(np.array([0]), np.array([[1.0, 0.0]]), np.array([0.3]))
    copies = Copies(np.array([0]), np.array([1]), np.array([[0.0, -1.0], [1.0, 0.0]]))
    found = copied(free_motion(2, 2, [fixed]), [copies])
    assert found.offset == pytest.approx([0.3, 0, 0, 0.3])
    assert np.abs(found.basis.toarray()).T.tolist() == [pytest.approx([0, 0.5**0.5, 0.5**0.5, 0])]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("angle: 90", "angle: 80", "no copy is at ("),
        ("of: farx", "of: base", "9 nodes have 10 copies"),
        ("of: farx", "of: side", "supports[0].cyclic.of = 'side': no such group"),
        ("angle: 90", "angle: 90, shift: [1, 0]", "exactly one of angle, shift"),
        ("angle: 90", "shift: [1, 0, 0]", "supports[0].cyclic.shift = [1.0, 0.0, 0.0]: must"),
        ("angle: 90", "angle: 90, axis: [0, 0, 0]", "must have a direction"),
        ("{group: symx, cyclic", "{at: [0, 1], cyclic", "cyclic needs a group"),
        ("{at: [1, 0], fix: [y]}", "{group: symx, fix: {x: 1}}, {group: farx, fix: [y]}",
         "supports give its nodes another displacement than the copied ones"),
        ("{at: [1, 0], fix: [y]}", "{group: symx, cyclic: {of: farx, angle: 90}}",
         "its nodes are tied, or copies, by another support"),
        ("{at: [1, 0], fix: [y]}", "{group: base, together: [y]}",
         "of its nodes are held there, or tied"),
    ],
)  # fmt: skip
def test_refusals(old, new, message):
    with pytest.raises(InputError) as refusal:
        sector(CYCLIC.replace(old, new))
    assert message in str(refusal.value)


def test_no_deck_has_cyclic_sides():
    case = parse_case(SECTOR.replace("SIDES", CYCLIC), Path("sector.yaml"))
    with pytest.raises(UnsupportedError):
        deck_of(case, generate(RINGS, "test"))
