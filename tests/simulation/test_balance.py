"""Reactions, strain energy and largest displacement, by hand; and the checks that compare them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from solver.case.reader import parse_case
from solver.mesh import generate
from solver.simulation.simulate import refusals_on, simulate
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.results import read_result, write_result
from tests.scenes import POISSON, PRESSURE, YOUNG, block_case, block_mesh, changed_case, with_points

NUMBERS = """\
reference:
  kind: analytical
  force: [0.0, -25.0]
  contact_area: 1.0
  reaction: {base: [0.0, 25.0], symx: [0.0, 0.0]}
  strain_energy: 0.284375
"""


def by_group(solution):
    return {one.group: one for one in solution.reactions}


@pytest.mark.parametrize("swapped", [False, True])
def test_reactions_of_the_patch_test(swapped):
    """A pressure of 25 on blocks of edge 1: the base bears 25 at x = ½, the sides nothing."""
    found = simulate(changed_case(2).as_solved(swapped), block_mesh("QUAD4", "TRIA6", (4, 3)))
    held = by_group(found)
    assert list(held) == ["base", "symx"]
    assert held["base"].force == pytest.approx([0, 25], abs=1e-12)
    assert held["base"].moment == pytest.approx([0, 0, 12.5], abs=1e-12)
    assert held["symx"].force == pytest.approx([0, 0], abs=1e-12)
    energy = (1 - POISSON**2) * PRESSURE**2 / YOUNG / 2 * 2
    assert found.scalars.strain_energy == pytest.approx(energy)
    size, place = found.largest_displacement
    strain = PRESSURE / YOUNG * np.array([POISSON * (1 + POISSON), 2 * (1 - POISSON**2)])
    assert place == pytest.approx([1, 1])
    assert size == pytest.approx(np.linalg.norm(strain))


def test_reactions_in_space_and_along_normals():
    """Supports along normals have the same reactions: 25 on the unit square of the base."""
    held = by_group(simulate(changed_case(3, normal=True), block_mesh("HEXA8", "TETRA4", (2, 2))))
    assert held["base"].force == pytest.approx([0, 0, 25], abs=1e-11)
    assert held["base"].moment == pytest.approx([12.5, -12.5, 0], abs=1e-11)


def test_sides_that_are_held_bear_the_lateral_stress():
    """Held on both sides: σ_xx = ν/(1 − ν) σ_yy over the height of 2."""
    case = changed_case(2, ("supports:\n", "supports:\n  - {group: farx, fix: [x]}\n"))
    found = simulate(case, block_mesh("QUAD8", "QUAD4", (3, 2)))
    held = by_group(found)
    side = 2 * 25 * POISSON / (1 - POISSON)
    assert held["symx"].force == pytest.approx([side, 0], abs=1e-11)
    assert held["farx"].force == pytest.approx([-side, 0], abs=1e-11)


def test_a_rigid_body_reports_the_force_on_it():
    rigid = ("supports:\n  - {group: base, fix: [y]}", "bodies: {bottom: {rigid: true}}\nsupports:")
    case = changed_case(
        2, rigid, ("slave: bottom_contact, master: top", "master: bottom_contact, slave: top")
    )
    held = by_group(simulate(case, block_mesh("QUAD4", "QUAD8", (3, 2))))
    assert held["bottom"].force == pytest.approx([0, 25], abs=1e-11)


def test_mixed_form_has_the_same_energy():
    mixed = ("poisson: 0.3", "poisson: 0.3, form: mixed")
    found = simulate(changed_case(2, mixed), block_mesh("QUAD9", "TRIA6", (3, 2)))
    assert found.scalars.strain_energy == pytest.approx(0.284375)


@pytest.mark.parametrize("swapped", [False, True])
def test_checks_compare_them_also_of_a_stored_result(swapped, tmp_path):
    case = changed_case(2, extra=NUMBERS).as_solved(swapped)
    solution = simulate(case, block_mesh("QUAD4", "QUAD8", (4, 3)))
    write_result(tmp_path / "r.vtkhdf", solution, [], {})
    stored = read_result(tmp_path / "r.vtkhdf").solution
    for one in (solution, stored):
        found = {check.name: check for check in run_checks(one)}
        for name in ("force", "contact_area", "reaction", "strain_energy"):
            assert found[name].error < 1e-12
            assert found[name].passed


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("force", ("-25.0]", "-24.9]")),
        ("contact_area", ("area: 1.0", "area: 1.1")),
        ("reaction", ("symx: [0.0", "symx: [0.1")),
        ("strain_energy", ("0.284375", "0.284")),
    ],
)
def test_another_number_does_not_pass(name, wrong):
    case = changed_case(2, extra=NUMBERS.replace(*wrong))
    found = {c.name: c for c in run_checks(simulate(case, block_mesh("QUAD4", "QUAD8", (4, 3))))}
    assert [check for check, result in found.items() if not result.passed] == [name]


def test_reactions_that_are_refused():
    mesh = block_mesh("QUAD4", "QUAD4", (2, 2))
    other = changed_case(2, extra=NUMBERS.replace("symx:", "farx:"))
    with pytest.raises(InputError, match=r"reference.reaction.farx.*no support holds it; "):
        simulate(other, mesh)
    half = (
        "groups: {half: {of: cells, within: bottom, where: x - 0.4}}\ncounts: {half: {cells: 1}}\n"
    )
    [told] = refusals_on(changed_case(2, extra=half), mesh)
    assert "counts.half = 'half': is not a body; allowed: bottom, top" in str(told)
    with pytest.raises(InputError, match=r"reference.reaction.base.*must have 2 components"):
        changed_case(2, extra=NUMBERS.replace("base: [0.0, 25.0]", "base: [0.0, 25.0, 0.0]"))


def test_springs_have_a_reaction_and_no_strain_energy():
    """An elastic foundation of 40 under the base bears the load; the blocks strain as before."""
    case = changed_case(2, ("{group: base, fix: [y]}", "{group: base, spring: {normal: 40.0}}"))
    mesh = block_mesh("QUAD4", "QUAD8", (3, 2))
    found = simulate(case, mesh)
    held = by_group(found)
    assert list(held) == ["symx", "springs"]
    unloaded = by_group(simulate(replace(case, steps=(1.0, 0.0)), mesh))
    assert unloaded["springs"].force == pytest.approx([0, 0], abs=1e-14)
    assert held["springs"].force == pytest.approx([0, 25], abs=1e-11)
    assert held["springs"].moment == pytest.approx([0, 0, 12.5], abs=1e-11)
    assert found.scalars.strain_energy == pytest.approx(0.284375)


@pytest.mark.parametrize("stiffness", [1e6, 1e8, 1e10])
def test_stiff_springs_are_drawn_by_the_last_digits_of_what_a_body_moves(stiffness):
    change = ("{group: base, fix: [y]}", f"{{group: base, spring: {{normal: {stiffness}}}}}")
    found = simulate(changed_case(2, change), block_mesh("QUAD4", "QUAD8", (3, 2)))
    assert by_group(found)["springs"].force == pytest.approx([0, 25], abs=1e-9)
    assert max(found.quality.balance.values()) < 1e-11


def test_supports_that_are_not_at_right_angles_hold_the_load_together():
    """Sides that lean by 1 : 2; at their foot the base and the normal hold the same nodes."""
    mesh = block_mesh("QUAD4", "QUAD4", (3, 2))
    leaning = with_points(mesh, mesh.points + np.outer(mesh.points[:, 1] / 2, [1, 0]))
    case = changed_case(2, ("symx, fix: [x]", "symx, fix: [normal]"))
    found = simulate(case, leaning)
    total = sum(one.force for one in found.reactions)
    assert total == pytest.approx([0, PRESSURE], abs=1e-11)
    # The pressure acts from x = 1/2 to 3/2 at the height 1.
    assert sum(one.moment for one in found.reactions)[2] == pytest.approx(PRESSURE, abs=1e-11)


def test_a_group_that_is_called_springs_keeps_what_it_holds():
    """A foundation of 40 bears the load; the group `springs` of the sides holds its stress."""
    change = ("{group: base, fix: [y]}", "{group: base, spring: {normal: 40.0}}")
    mesh = block_mesh("QUAD4", "QUAD8", (3, 2))
    mesh.cell_sets["springs"] = mesh.cell_sets.pop("symx")
    sides = ("{group: symx, fix: [x]}", "{group: springs, fix: [x]}\n  - {group: farx, fix: [x]}")
    held = by_group(simulate(changed_case(2, change, sides), mesh))
    side = 2 * 25 * POISSON / (1 - POISSON)
    assert held["springs"].force == pytest.approx([side, 25], abs=1e-11)


# Edges, area, force and moment of contact: Hertz's cylinder and the patch test, and in files.


HERTZ = Path(__file__).parents[2] / "cases/hertz"


def hertz(cells: str, factor: float, recovery: str = "none"):
    """The cylinder of the batch under another load, and its exact half-width."""
    content = yaml.safe_load((HERTZ / f"cylinder-{cells}.yaml").read_text())
    content["loads"][0]["pressure"] *= factor
    content["reference"]["solution"]["force"] *= factor
    content["contact"][0]["recovery"] = recovery
    case = parse_case(yaml.safe_dump(content), HERTZ / "load.yaml")
    return simulate(case, generate(content["mesh"], "load.yaml")), case.reference.exact


@pytest.mark.parametrize(
    ("cells", "recovery", "within"),
    [("quad8", "none", 0.06), ("quad8", "quadratic", 0.08), ("quad4", "none", 0.25)],
)
def test_the_edge_of_hertz(cells, recovery, within):
    """Wherever in its macro-element the edge lies, in closed and in open ones."""
    for factor in (0.643, 0.786, 0.929, 1.0, 1.143):
        solution, exact = hertz(cells, factor, recovery)
        [zone] = solution.zones
        found = zone.resultants
        assert found.edges.better.tolist() == [True]
        size = zone.area[found.edges.macro[0]]
        assert found.edges.position[0, 0] == pytest.approx(exact.half_width, abs=within * size)
        assert found.edges.lower[0, 0] < exact.half_width < found.edges.upper[0, 0]
        assert found.area[0] == pytest.approx(exact.half_width, abs=within * size)
        assert found.force == pytest.approx([0.0, -exact.force / 2], abs=1e-9 * exact.force)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("treatment", ["lac", "nodal"])
def test_the_patch(dim, treatment):
    """A uniform pressure on a unit face at the height 0: p, and p/2 about each axis along it."""
    case = block_case(dim, zone=f", treatment: {treatment}")
    cells = ("TRIA6", "QUAD8") if dim == 2 else ("TETRA10", "HEXA8")
    [zone] = simulate(case, block_mesh(*cells)).zones
    found = zone.resultants
    assert found.area == pytest.approx(1.0)
    assert found.force == pytest.approx([0.0] * (dim - 1) + [-PRESSURE], abs=1e-9)
    moment = [0, 0, -PRESSURE / 2] if dim == 2 else [-PRESSURE / 2, PRESSURE / 2, 0]
    assert found.moment == pytest.approx(moment, abs=1e-9)
    assert (found.edges is None) == (dim == 3)


def test_in_3d_the_area_has_the_bounds_of_whole_macro_elements():
    content = yaml.safe_load((HERTZ / "sphere-hexa8.yaml").read_text())
    case = parse_case(yaml.safe_dump(content), HERTZ / "sphere.yaml")
    [zone] = simulate(case, generate(content["mesh"], "sphere.yaml")).zones
    area, low, high = zone.resultants.area
    assert area == pytest.approx(zone.area[zone.closed].sum())
    assert low < np.pi / 4 * case.reference.exact.half_width**2 < high
