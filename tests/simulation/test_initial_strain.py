"""Thermal and initial strain: free, clamped, bent and pressed bodies by hand.

E = 2000, ν = 0.3; e = expansion × change of temperature.
"""

from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.codes.deck import UnsupportedError, deck_of
from solver.mesh import generate
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.equilibrium.step import solve_step
from solver.simulation.results.balance import energy_at_nodes
from solver.simulation.scene.parts.strain import InitialStrain
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from tests.scenes import POISSON, YOUNG, block_mesh, moved, replaced

E = 1e-3
HEAT = "{group: all, expansion: 1.0e-5, temperature: 100}"
PLANES = {"strain": 2, "stress": 2, "axisymmetric": 2, "": 3}
# Plane stress has no mixed form.
FORMS = [(plane, form) for plane in PLANES for form in ("", ", form: mixed")]
FORMS.remove(("stress", ", form: mixed"))
# The free body on its axes: nothing but rigid motion is held.
HELD = {
    2: "[{at: [0, 0], fix: [x, y]}, {at: [0, 1], fix: [x]}]",
    3: "[{at: [0, 0, 0], fix: [x, y, z]}, {at: [0, 0, 1], fix: [x, y]}, {at: [1, 0, 0], fix: [y]}]",
}
BRICK = """\
name: brick
mesh: {recipe: bricks, bricks: []}
materials: {all: {young: 2000.0, poisson: 0.3}}
"""


def brick(plane, load, supports="", cells="", material=""):
    """A unit square or cube of one body under a load."""
    dim = PLANES[plane]
    cells = cells or {2: "TRIA6", 3: "HEXA20"}[dim]
    text = BRICK + f"supports: {supports or HELD[dim]}\nloads: [{load}]\n"
    text += f"plane: {plane}\n" if plane else ""
    block = {"cells": cells, "divisions": [2] * dim}
    recipe = {"name": "one", "low": [0] * dim, "high": [1] * dim, "block": block}
    mesh = generate({"recipe": "bricks", "bricks": [recipe]}, "test")
    case = parse_case(text.replace("poisson: 0.3", "poisson: 0.3" + material), Path("b.yaml"))
    found = simulate(case, mesh)
    assert max(found.quality.balance.values()) < 1e-12
    return found


def across(plane):
    """The free expansion in the plane, over e; and the stress zz over e."""
    return (1 + POISSON, -YOUNG) if plane == "strain" else (1.0, 0.0)


@pytest.mark.parametrize(("plane", "form"), FORMS)
def test_a_free_body_expands_without_stress(plane, form):
    found, (grown, zz) = brick(plane, HEAT, material=form), across(plane)
    assert found.displacement == pytest.approx(grown * E * found.mesh.points, abs=1e-15)
    rest = found.stress - zz * E * np.eye(6)[2]
    assert np.abs(rest).max() < 1e-12 * YOUNG * E
    # Where the strain across the plane is held, its stress has the energy.
    assert found.scalars.strain_energy == pytest.approx(-zz * E * E / 2, abs=1e-12 * YOUNG * E**2)


@pytest.mark.parametrize(("plane", "form"), FORMS)
def test_a_clamped_body_is_pressed_all_over(plane, form):
    """σ = −E e/(1 − 2ν) I; in plane stress −E e/(1 − ν) in the plane."""
    axes = "[x, y, z]" if not plane else "[x, y]"
    found = brick(plane, HEAT, f"[{{group: all, fix: {axes}}}]", material=form)
    flat = plane == "stress"
    pressed = YOUNG * E / (1 - POISSON if flat else 1 - 2 * POISSON)
    assert not found.displacement.any()
    exact = -pressed * np.array([1, 1, 0 if flat else 1, 0, 0, 0])
    assert np.abs(found.stress - exact).max() < 1e-12 * pressed
    volume = np.pi if plane == "axisymmetric" else 1.0
    energy = pressed * E * (2 if flat else 3) / 2 * volume
    assert found.scalars.strain_energy == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize(("plane", "form"), FORMS)
def test_a_linear_temperature_bends_a_free_body_without_stress(plane, form):
    """ε = κ h I for the height h: u = κ (r h, (h² − r²)/2), r across the height."""
    height = "y" if plane else "z"
    load = f"{{group: all, expansion: 1.0e-5, temperature: 100*{height}}}"
    # The stress zz of plane strain is linear, and so is s in the mixed form of QUAD9.
    cells = {"strain": "QUAD9", "stress": "QUAD8", "axisymmetric": "TRIA6", "": "TETRA10"}[plane]
    found, (grown, zz) = brick(plane, load, cells=cells, material=form), across(plane)
    x = found.mesh.points
    flat, h = x[:, :-1], x[:, -1]
    exact = np.c_[flat * h[:, None], (h**2 - (flat**2).sum(axis=1)) / 2] * grown * E
    assert np.abs(found.displacement - exact).max() < 1e-12 * E
    left = found.stress - zz * E * np.outer(h, np.eye(6)[2])
    assert np.abs(left).max() < 1e-11 * YOUNG * E


def test_a_given_strain_is_taken_by_component():
    """Free shear xy = e is the angle 2e; zz has no stress but in the plane; two loads add up."""
    found = brick("strain", f"{{group: all, strain: {{xy: {E}}}}}")
    assert found.displacement[:, 1] == pytest.approx(2 * E * found.mesh.points[:, 0], abs=1e-15)
    assert np.abs(found.stress).max() < 1e-12 * YOUNG * E
    strain = f"{{group: all, strain: {{xx: {E}, yy: {E}, zz: 0.5e-3}}}}"
    heat = HEAT.replace("100", "-50")
    found = brick("strain", f"{strain}, {heat}", "[{group: all, fix: [x, y]}]")
    shear, lame = YOUNG / 2 / (1 + POISSON), YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
    plane, zz = -2 * shear * E / 2 - lame * E, -lame * E
    assert found.stress == pytest.approx(
        np.tile([plane, plane, zz, 0, 0, 0], (len(found.stress), 1))
    )
    assert found.scalars.strain_energy == pytest.approx(-plane * E / 2, rel=1e-12)


BLOCKS = """\
name: heated
mesh: {recipe: blocks, size: 1.0}
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: base, fix: [normal]}
  - {group: press, fix: [normal]}
  - {group: symx, fix: [x]}
loads: [{group: top, expansion: 1.0e-5, temperature: 100}]
contact: [{slave: bottom_contact, master: top_contact}]
reference: {kind: analytical, stress: {xx: 0.0}}
"""
WALLS = {
    "strain": YOUNG * E / 2 / (1 - POISSON),
    "stress": YOUNG * E / 2,
    "axisymmetric": YOUNG * E / 2,
    "": YOUNG * E / 2,
}


def between_walls(plane, pair, swapped=False, counts=(3, 2), *changes):
    text = BLOCKS + (f"plane: {plane}\n" if plane else "")
    if not plane:
        text = text.replace("fix: [x]}\n", "fix: [x]}\n  - {group: symy, fix: [y]}\n")
    mesh = moved(block_mesh(*pair, counts), 0.05) if plane else block_mesh(*pair, counts)
    case = parse_case(replaced(text, *changes), Path("heated.yaml"))
    return simulate(case.as_solved(swapped), mesh)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(
    ("plane", "pair", "counts"),
    [
        ("strain", ("QUAD8", "TRIA3"), (3, 2)),
        ("stress", ("QUAD4", "TRIA6"), (3, 2)),
        ("axisymmetric", ("QUAD9", "QUAD4"), (3, 2)),
        ("", ("HEXA8", "TETRA4"), (2, 1)),
        ("", ("TETRA10", "HEXA20"), (2, 1)),
    ],
)
def test_a_heated_block_between_walls_presses_on_the_other(plane, pair, counts, swapped):
    """Both shorten by p/E (p (1 − ν²)/E in plane strain) and take what the upper one expands."""
    found, pressure = between_walls(plane, pair, swapped, counts), WALLS[plane]
    assert np.abs(found.zones[0].multiplier / pressure - 1).max() < 1e-12
    assert np.abs(found.zones[0].estimates.pressure_of_forces / pressure - 1).max() < 1e-12
    assert max(found.quality.balance.values()) < 1e-12
    across = np.delete(found.stress, 1 if plane else 2, axis=1)
    along = found.stress[:, 1 if plane else 2]
    assert np.abs(along / pressure + 1).max() < 1e-11
    upper = found.fields.body == found.fields.body[found.mesh.points[:, -1].argmax()]
    zz = -POISSON * pressure - YOUNG * E * upper if plane == "strain" else np.zeros(len(along))
    across[:, 1] -= zz
    assert np.abs(across).max() < 1e-11 * pressure
    walls = {one.group: one.force[-1] for one in found.steps[-1].reactions}
    area = np.pi if plane == "axisymmetric" else 1.0
    assert walls["base"] == pytest.approx(pressure * area, rel=1e-12)
    assert walls["press"] == pytest.approx(-pressure * area, rel=1e-12)
    [check] = [c for c in run_checks(found) if c.name == "integration_stress"]
    assert check.error < 1e-11


BAR = """\
name: bar
mesh: {recipe: bricks, bricks: []}
plane: stress
materials: {all: {young: 2000.0, poisson: 0.3}}
groups:
  below: {within: low, box: {low: [0, 1], high: [1, 1]}}
  under: {within: mid, box: {low: [0, 1], high: [1, 1]}}
  over: {within: mid, box: {low: [0, 2], high: [1, 2]}}
  above: {within: top, box: {low: [0, 2], high: [1, 2]}}
  ends: {where: abs(y - 1.5) - 1.499}
  left: {plane: {point: [0, 0], normal: [1, 0]}}
supports: [{group: ends, fix: [y]}, {group: left, fix: [x]}]
loads: [{group: mid, strain: {xx: 1.0e-3, yy: 1.0e-3}, name: heat}]
contact:
  - {name: lower, slave: below, master: under, clearance: 2.0e-4}
  - {name: upper, slave: over, master: above, clearance: 2.0e-4}
steps: [{heat: 0.5}, {heat: 1}]
"""


def bar():
    bricks = [
        {"name": name, "low": [0, y], "high": [1, y + 1], "block": {"cells": cells, "divisions": n}}
        for y, (name, cells, n) in enumerate(
            [("low", "QUAD4", [3, 2]), ("mid", "QUAD8", [2, 2]), ("top", "TRIA3", [3, 2])]
        )
    ]
    return generate({"recipe": "bricks", "bricks": bricks}, "test")


def test_a_heated_bar_closes_the_gaps_at_its_ends():
    """Contact alone holds it: p = E (f e − both gaps)/3 for three unit blocks, f = 0.5, then 1."""
    found = simulate(parse_case(BAR, Path("bar.yaml")), bar())
    for step, share in zip(found.steps, (0.5, 1.0), strict=True):
        pressure = YOUNG * (share * E - 4e-4) / 3
        forces = [abs(result.force[1]) for result in step.resultants.values()]
        assert forces == pytest.approx([pressure, pressure], rel=1e-11)
    assert found.zones[0].multiplier == pytest.approx(pressure, rel=1e-11)


@pytest.mark.parametrize(("plane", "form"), FORMS[:3])
def test_each_body_has_its_own_energy(plane, form):
    """Pressed by p each block closes by p/E', one that is heated too, and has p²/2E'."""
    text = BAR.replace("plane: stress", f"plane: {plane}").replace("0.3}", f"0.3{form}}}")
    problem = ContactProblem(build_scene(parse_case(text, Path("bar.yaml")), bar()))
    state = solve_step(problem, {"heat": 1.0}, None)
    stiff = YOUNG / (1 - POISSON**2 * (plane == "strain"))
    pressure = stiff * (E - 4e-4) / 3
    energy = np.bincount(problem.scene.body, energy_at_nodes(state).astype(float))
    assert energy == pytest.approx([pressure**2 / (2 * stiff)] * 3, rel=1e-10)


@pytest.mark.parametrize("lost", ["lower", "upper"])
def test_strain_is_no_load_that_contact_has_to_balance(lost):
    """The bar loses one contact; round-off of its nodal forces is no pull out of the other."""
    [line] = [line for line in BAR.splitlines(keepends=True) if f"name: {lost}" in line]
    problem = ContactProblem(
        build_scene(parse_case(BAR.replace(line, ""), Path("bar.yaml")), bar())
    )
    eligible = problem.constraints.eligible
    found = problem._gap_stiffness({"heat": 1.0}, np.zeros(len(eligible), dtype=bool))
    assert found.shape == (eligible.sum(), eligible.sum())


def test_what_is_taken_off_is_rounded_as_far_as_it_is_there():
    """E e/(1 − ν) in plane stress, times the factor of the step: none where the heat is gone."""
    scene = build_scene(parse_case(BAR, Path("bar.yaml")), bar())
    [heat] = [part for part in scene.parts if isinstance(part, InitialStrain)]
    rounded = [heat.term(None, np.array([factor])).rounded[1] for factor in (0.0, 0.5, -2.0)]
    whole = YOUNG * E / (1 - POISSON)
    assert rounded == pytest.approx([0.0, 0.5 * whole, 2 * whole], rel=1e-12)


def test_steps_scale_the_strain_of_their_name():
    """Heat times 1, 0.5, then gone with a bar of imposed displacement in its place."""
    named = ("temperature: 100", "temperature: 100, name: heat")
    pushed = ("press, fix: [normal]", "press, fix: {y: -1.0e-3}, name: push")
    steps = "steps: [{heat: 1, push: 0}, {heat: 0.5, push: 0}, {heat: 0.5, push: 1}]\nreference:"
    given = (named, pushed, ("reference:", steps))
    found = between_walls("stress", ("QUAD4", "QUAD4"), False, (3, 2), *given)
    forces = [step.resultants["contact"].force[1] for step in found.steps]
    assert np.abs(forces) == pytest.approx(YOUNG * E * np.array([0.5, 0.25, 0.75]), rel=1e-12)
    assert np.abs(found.stress[:, 1] + 0.75 * YOUNG * E).max() < 1e-11
    assert found.scalars.strain_energy == pytest.approx((0.75 * YOUNG * E) ** 2 / YOUNG, rel=1e-12)


@pytest.mark.parametrize(
    ("load", "why"),
    [
        ("{group: all, temperature: 80}", "expansion, temperature}: one needs the other"),
        ("{group: all, expansion: 1e-5}", "exactly one of pressure, traction, body_force, force,"),
        ("{group: all, strain: {xz: 1e-3}}", "across the plane of a plane case"),
        ("{group: all, strain: {xx: solution}}", "it must be a number or an expression"),
        ("{group: all, strain: {}}", "a mapping of xx, yy, zz, xy, yz, xz"),
    ],
)
def test_what_is_refused(load, why):
    with pytest.raises(InputError, match=why):
        brick("strain", load)


def test_a_group_of_faces_is_refused():
    faces = ("top, expansion", "press, expansion")
    with pytest.raises(InputError, match="a group of volume cells is needed"):
        between_walls("strain", ("QUAD4", "QUAD4"), False, (1, 1), faces)


def test_other_codes_refuse_it():
    text = BLOCKS + "plane: strain\n"
    with pytest.raises(UnsupportedError, match="initial strain and change of temperature"):
        deck_of(parse_case(text, Path("heated.yaml")), block_mesh("QUAD4", "QUAD4"))


def test_exact_solutions_of_the_project_have_none():
    solution = "{kind: analytical, stress: solution, solution: {name: uniform_compression, "
    solution += "base: -1.0, lower: all, upper: all}}"
    text = BLOCKS.replace("{kind: analytical, stress: {xx: 0.0}}", solution) + "plane: strain\n"
    with pytest.raises(InputError, match="uniform_compression has no initial strain"):
        parse_case(text.replace("loads: [", "loads: [{group: press, pressure: 1.0}, "), Path("h"))
