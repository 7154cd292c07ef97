"""Supports as a change of unknowns: axes, planes of any direction, clashes."""

import numpy as np
import pytest

from solver.mechanics.fem.loads import foundation
from solver.mechanics.fem.supports import Fixed, SupportClashError, free_motion
from solver.system.errors import InputError
from tests.scenes import POISSON, PRESSURE, YOUNG, block_mesh, solved


def fixed(nodes, direction, value=0.0):
    direction = np.array(direction, dtype=float)
    n = len(nodes)
    return Fixed(np.array(nodes), np.tile(direction, (n, 1)), np.full(n, value))


def test_axes_pick_degrees_of_freedom():
    free = free_motion(3, 2, [fixed([0, 2], [1, 0], 0.5), fixed([0], [0, 1])])
    assert free.selection.tolist() == [2, 3, 5]
    assert free.offset.tolist() == [0.5, 0, 0, 0, 0.5, 0]


def test_a_tilted_plane_leaves_what_lies_in_it():
    normal = np.array([0.6, 0.8, 0.0])
    free = free_motion(2, 3, [fixed([1], normal, 2.0)])
    assert free.basis.shape == (6, 5)
    basis = free.basis.toarray()
    assert np.allclose(basis.T @ basis, np.eye(5), atol=1e-15)
    assert np.allclose(normal @ basis[3:], 0, atol=1e-15)
    assert normal @ free.offset[3:] == pytest.approx(2.0)


def test_two_tilted_planes_and_an_axis_hold_a_node_fully():
    parts = [fixed([0], d, v) for d, v in (([0.6, 0.8, 0], 1.0), ([0, 0.6, 0.8], 2.0))]
    parts.append(fixed([0], [0, 0, 1], 3.0))
    free = free_motion(1, 3, parts)
    assert free.basis.shape == (3, 0)
    for part in parts:
        assert part.directions[0] @ free.offset == pytest.approx(part.values[0], rel=1e-13)


def test_the_same_support_twice_is_one_and_another_value_is_refused():
    same = [fixed([0], [1, 0], 0.5), fixed([0, 1], [1, 0], 0.5)]
    assert free_motion(2, 2, same).selection.tolist() == [1, 3]
    clash = [fixed([0], [1, 0], 0.5), fixed([0], [1, 0], 0.25)]
    with pytest.raises(SupportClashError, match="1 nodes are given another displacement") as error:
        free_motion(2, 2, clash)
    assert (error.value.number, error.value.value) == (1, 0.25)


# Springs and elastic foundations: uniform states of two unit squares (cubes) by hand.


STIFF = 40.0
CASE = """\
name: spring
mesh:
  recipe: blocks
  size: 1.0
  bottom: {cells: QUAD8, divisions: 2}
  top: {cells: TRIA3, divisions: 3}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports: [{group: base, spring: {normal: 40.0}}, {group: symx, fix: [x]}]
loads: [{group: press, pressure: 25.0}]
contact: [{slave: bottom_contact, master: top_contact}]
"""


def assert_stands(solution, sunk, lateral=POISSON * (1 + POISSON), axial=1 - POISSON**2):
    """u = (lateral x, −axial (y + 1)) p/E, moved down by `sunk`, and the pressure p."""
    x, size = solution.mesh.points, PRESSURE / YOUNG
    exact = np.stack([lateral * size * x[:, 0], -axial * size * (x[:, 1] + 1) - sunk], axis=1)
    np.testing.assert_allclose(solution.displacement, exact, rtol=0, atol=1e-12 * (sunk + size))
    assert solution.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-11)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("direction", ["normal", "y"])
def test_a_block_sinks_into_its_foundation_by_p_over_k(direction, swapped):
    text = CASE.replace("normal: 40.0", f"{direction}: 40.0")
    assert_stands(solved(text, swapped=swapped), PRESSURE / STIFF)


def test_springs_on_a_slave_surface_act_on_its_cut_faces():
    """They bear the load alone: the lower block moves by -p/k as it is, the upper one shortens."""
    solution = solved(CASE.replace("group: base", "group: bottom_contact"))
    low = solution.mesh.points[:, 1] < -1e-9
    sunk = [0.0, -PRESSURE / STIFF]
    np.testing.assert_allclose(solution.displacement[low] - sunk, 0, atol=1e-12)
    assert solution.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-11)


def test_springs_at_two_nodes_carry_half_the_load_each():
    """The lower block has one linear face below: equal nodal forces are the uniform state."""
    springs = "{at: [0, -1], spring: {y: 20.0}}, {at: [1, -1], spring: {y: 20.0}}"
    text = CASE.replace("{group: base, spring: {normal: 40.0}}", springs)
    assert_stands(solved(text, block_mesh("QUAD4", "QUAD4", (1, 2))), PRESSURE / STIFF)
    # Held across at one node each, the lower block turns about the spring that is left.
    text = text.replace(
        "{group: symx, fix: [x]}", "{at: [0, -1], fix: [x]}, {at: [0, 1], fix: [x]}"
    )
    mesh = block_mesh("QUAD4", "QUAD4", (1, 2))
    assert_stands(solved(text, mesh, swapped=True), PRESSURE / STIFF)
    one = text.replace("{at: [1, -1], spring: {y: 20.0}}, ", "")
    with pytest.raises(InputError, match=r"nothing keeps .* from a free motion"):
        solved(one, mesh, swapped=True)


def test_side_walls_of_springs_share_the_lateral_strain():
    """σ_x = −k u at x = 1: u = ν (1 + ν) p/E / (1 + k (1 − ν²)/E)."""
    text = CASE.replace(
        "spring: {normal: 40.0}}", "fix: [y]}, {group: farx, spring: {normal: 900}}"
    )
    solution = solved(text)
    side = solution.mesh.points[:, 0] == 1
    moved = POISSON * (1 + POISSON) * PRESSURE / YOUNG / (1 + 900 * (1 - POISSON**2) / YOUNG)
    assert solution.displacement[side, 0] == pytest.approx(moved, rel=1e-11)
    assert solution.stress[:, 0] == pytest.approx(-900 * moved, rel=1e-10)


def test_a_block_that_a_spring_holds_is_pulled_off():
    """The traction 25 upwards and the springs act on the same face: it moves by 25/40."""
    text = CASE.replace("group: base, spring: {normal: 40.0}", "group: base, fix: [y]")
    text = text.replace("supports: [", "supports: [{group: press, spring: {y: 40.0}}, ")
    solution = solved(text.replace("pressure: 25.0", "traction: [0, 25.0]"))
    zone = solution.zones[0]
    assert not zone.closed.any()
    assert zone.gap == pytest.approx(PRESSURE / STIFF, rel=1e-11)


def test_the_stiffness_of_one_face():
    """∫ N_a N_b dx on a length of 6: 2 on the diagonal, 1 beside it; k = x adds its mean."""
    points = np.array([[0.0, 0.0], [6.0, 0.0]])
    nodes = np.array([[0, 1]])
    found = foundation(points, nodes, "SEG2", lambda x: np.ones(len(x)), None).toarray()
    assert found == pytest.approx(np.kron([[2, 1], [1, 2]], [[0, 0], [0, 1]]), abs=1e-12)
    along = np.array([1.0, 0.0])
    found = foundation(points, nodes, "SEG2", lambda x: x[:, 0], along).toarray()
    # ∫ x N_a N_b dx = L²/12 · [[1, 1], [1, 3]]
    assert found == pytest.approx(3 * np.kron([[1, 1], [1, 3]], [[1, 0], [0, 0]]), abs=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("normal: 40.0", "normal: -1", "spring.normal = -1.0: a stiffness must be positive"),
        ("normal: 40.0", "y: x - 0.5", "a stiffness must be positive everywhere"),
        ("normal: 40.0", "z: 1", "spring = 'z': z in a plane case"),
        ("normal: 40.0", "w: 1", "supports[0].spring.w"),
        ("group: base", "group: bottom", "a group of faces is needed"),
        ("group: base", "at: [0, -1]", "is a group of nodes; a group of faces is needed"),
        ("normal: 40.0}", "normal: 40.0}, fix: [x]", "and exactly one of fix, spring"),
        (", spring: {normal: 40.0}", "", "and exactly one of fix, spring"),
    ],
)
def test_refusals(old, new, message):
    with pytest.raises(InputError) as refusal:
        solved(CASE.replace(old, new, 1))
    assert message in str(refusal.value)


def test_soft_springs_beside_stiff_ones_hold_a_body():
    """The upper block hangs sideways on a spring 10⁹ times softer than the foundation below."""
    text = CASE.replace(
        "{group: symx, fix: [x]}", "{at: [0, -1], fix: [x]}, {at: [0, 1], spring: {x: 4.0e-8}}"
    )
    found = solved(text)
    assert found.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-6)


def test_springs_at_all_nodes_hold_a_body_that_nothing_presses():
    """Under forces that balance, weak springs hold what else would float, and bear nothing."""
    text = CASE.replace(
        "[{group: base, spring: {normal: 40.0}}, {group: symx, fix: [x]}]",
        "[{group: all, spring: {x: 1.0e-6, y: 1.0e-6}}]",
    ).replace("pressure: 25.0}", "pressure: 25.0}, {group: base, pressure: 25.0}")
    solution = solved(text)
    assert solution.zones[0].multiplier == pytest.approx(PRESSURE, rel=1e-6)
    assert solution.stress[:, 1] == pytest.approx(-PRESSURE, rel=1e-6)
    with pytest.raises(InputError, match="normal needs a group of faces; `all` is held along x"):
        solved(text.replace("x: 1.0e-6,", "normal: 1.0e-6,"))
