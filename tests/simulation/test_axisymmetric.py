"""Axisymmetric bodies: the patch test on discs and rings, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.lac import segments
from solver.mesh import transform
from solver.simulation.results.balance import extent
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from tests.scenes import POISSON, PRESSURE, YOUNG, block_mesh, with_points

CASE = """\
name: patch
mesh: {recipe: blocks, size: 1.0}
plane: axisymmetric
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: base, fix: [y]}
loads: [{group: press, pressure: 25.0}]
contact: [{name: interface, slave: bottom_contact, master: top_contact}]
"""
HELD = "  - {group: symx, fix: [x]}\n  - {group: farx, fix: [x]}\n"


def case(zone="", held=False, **changes):
    text = CASE.replace("top_contact", f"top_contact{zone}")
    text = text.replace("fix: [y]}\n", "fix: [y]}\n" + HELD * held)
    for old, new in changes.items():
        text = text.replace(old, new)
    return parse_case(text, Path("patch.yaml"))


def mesh(bottom, top, radius, bent=False):
    """Two blocks of height 1 between radii `radius` and `radius` + 1, their inner nodes moved."""
    found = block_mesh(bottom, top, (4, 3))
    x = found.points
    move = 0.02 * bent * np.random.default_rng(0).uniform(-1, 1, x.shape)
    for axis, levels in ((0, (0, 1)), (1, (-1, 0, 1))):
        move[np.isin(x[:, axis].round(9), levels), axis] = 0.0
    return transform(with_points(found, x + move), {"translate": [radius, 0.0]}, "test")


def errors(solution, held, poisson=POISSON):
    """Errors of the uniform state: σ_zz = −p, free or held (ε_rr = ε_θθ = 0) across the axis."""
    x, zone = solution.mesh.points, solution.zones[0]
    lateral, axial = poisson * PRESSURE / YOUNG, -PRESSURE / YOUNG
    across = 0.0
    if held:
        across = -PRESSURE * poisson / (1 - poisson)
        lateral, axial = 0.0, axial * (1 - 2 * poisson * poisson / (1 - poisson))
    exact = np.c_[lateral * x[:, 0], axial * (x[:, 1] + 1)]
    stress = np.array([across, -PRESSURE, across, 0, 0, 0])
    return {
        "pressure": np.abs(zone.multiplier / PRESSURE - 1).max(),
        "stress": np.abs(solution.stress - stress).max() / PRESSURE,
        "displacement": np.abs(solution.displacement - exact).max() * YOUNG / PRESSURE,
        "coverage": np.abs(zone.coverage - 1).max(),
        "balance": max(solution.quality.balance.values()),
    }


def test_forces_are_those_of_the_whole_circle():
    """A disc of radius 1 under 25: its contact force is 25 π, its area π."""
    zone = simulate(case(), mesh("QUAD4", "QUAD8", 0.0)).zones[0]
    assert zone.area.sum() == pytest.approx(np.pi)
    assert zone.resultants.area[0] == pytest.approx(np.pi)
    assert zone.resultants.force == pytest.approx([0, -25 * np.pi], abs=1e-12)
    assert not zone.resultants.moment.any()


def test_one_circumference_for_all_of_a_segment_is_no_patch(monkeypatch):
    def mean(x):
        return np.tile(2 * np.pi * x[..., 0].mean(axis=1)[:, None], (1, x.shape[1]))

    monkeypatch.setattr(segments, "circumference", mean)
    found = errors(simulate(case(), mesh("QUAD4", "TRIA3", 0.0)), False)
    assert found["stress"] > 1e-3


def test_points_on_the_axis_stay_there():
    """The upper block is held along the axis alone: its radius is kept by the axis itself."""
    found = simulate(case(), mesh("QUAD4", "TRIA6", 0.0))
    assert not found.displacement[found.mesh.points[:, 0] == 0, 0].any()


def test_a_body_free_along_the_axis_is_refused():
    loose = case(**{"base, fix: [y]": "base, fix: [x]"})
    with pytest.raises(InputError, match=r"free motion \(move along y\)"):
        simulate(loose, mesh("QUAD4", "QUAD4", 0.4))


def test_refusals_on_and_beyond_the_axis():
    given = mesh("QUAD4", "QUAD8", 0.0)
    left = with_points(given, given.points - [0.5, 0.0])
    with pytest.raises(
        InputError, match=r"plane = 'axisymmetric': .* nodes have a negative radius"
    ):
        simulate(case(), left)
    pushed = case(held=True, **{"symx, fix: [x]": "symx, fix: {x: 0.1}"})
    with pytest.raises(InputError, match=r"supports\[1\].*another displacement .*the axis"):
        simulate(pushed, given)
    with pytest.raises(InputError, match="faces lie on the axis: they have no area"):
        simulate(
            case(**{"slave: bottom_contact": "slave: symx", "master: top": "master: bottom"}), given
        )
    with pytest.raises(InputError, match=r"node_to_segment.*faces SEG3 that end on the axis"):
        simulate(case(", treatment: node_to_segment").as_solved(True), given)


@pytest.mark.parametrize(
    ("acting", "key"),
    [
        ("{group: symx, spring: {normal: 9}}", "supports[0].spring.normal"),
        ("{group: symx, spring: {y: 9}}", "supports[0].spring.y"),
        ("{group: symx, pressure: 9}", "loads[0].group"),
        ("{group: symx, traction: [0, 9]}", "loads[0].group"),
        ("{group: symx, force: [0, 9]}", "loads[0].group"),
    ],
)
def test_what_acts_on_faces_of_no_area(acting, key):
    """Refused on the axis alone; beside other faces, those on the axis add nothing."""
    first, then = ("loads: [", ", ") if "loads" in key else ("supports:\n  - ", "\n  - ")

    def acted(group):
        text = {first: f"{first}{acting.replace('symx', group)}{then}"}
        return simulate(case(**text), mesh("QUAD4", "QUAD8", 0.0))

    with pytest.raises(InputError) as refusal:
        acted("symx")
    said = f"{key} = 'symx': all of its faces lie on the axis: they have no area"
    assert said in str(refusal.value)
    one, both = (acted(group).displacement for group in ("farx", "[symx, farx]"))
    np.testing.assert_array_equal(one, both)


def test_a_plane_mesh_needs_to_say_what_it_is():
    with pytest.raises(InputError, match=r"this key is needed \(strain, stress or axisymmetric\)"):
        simulate(case(**{"plane: axisymmetric\n": ""}), mesh("QUAD4", "QUAD8", 0.0))


def test_contact_of_the_macro_element_at_the_axis():
    """An edge is known to the radius h of the only closed disc: π h², between 0 and 4 π h²."""
    scene = build_scene(case(), mesh("QUAD4", "QUAD4", 0.0))
    [zone] = scene.zones
    closed = zone.operator.surface.centre[:, 0] < 0.25
    edges, area = extent(scene, zone, 25.0 * closed, closed)
    assert closed.sum() == 1
    assert edges.lower == pytest.approx(np.array([[0.0, 0.0]]), abs=1e-12)
    assert area == pytest.approx(np.pi * 0.0625 * np.array([1, 0, 4]), abs=1e-12)


@pytest.mark.parametrize(
    ("closed", "units"),
    [([1], (3, 0, 9)), ([0, 2], (6, 0, 16)), ([0, 1, 3], (11, 1, 16)), ([1, 2], (8, 0, 16))],
)
def test_contact_of_single_macro_elements_is_between_none_and_all(closed, units):
    """Rings of 1, 3, 5, 7 times π/16; each edge is known to its ring and to the open one beside."""
    scene = build_scene(case(), mesh("QUAD4", "QUAD4", 0.0))
    [zone] = scene.zones
    order = np.argsort(zone.operator.surface.centre[:, 0])
    status = np.isin(np.arange(4), order[closed])
    _, area = extent(scene, zone, 25.0 * status, status)
    assert area == pytest.approx(np.pi / 16 * np.array(units), abs=1e-12)


def test_r_is_the_radius_in_expressions():
    """A pressure of 25 r² presses with ∫ 25 r² 2πr dr = 12.5 π on the disc of radius 1."""
    uneven = case(**{"pressure: 25.0": "pressure: 25*r**2"})
    found = simulate(uneven, mesh("QUAD4", "QUAD8", 0.0))
    assert found.zones[0].resultants.force == pytest.approx([0, -12.5 * np.pi], abs=1e-11)
