"""Whole solves that take loads, supports and references from an exact solution."""

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.mesh import generate
from solver.simulation.simulate import simulate
from solver.verification.checks import run_checks
from solver.verification.norms import errors
from solver.verification.results import read_result, write_result
from solver.verification.run import check

MANUFACTURED = """\
name: parabola
mesh:
  recipe: parabola
  height: 0.05
  refine: {refine}
  bottom: {{cells: QUAD8, divisions: [5, 3]}}
  top: {{cells: {cells}, divisions: [8, 8]}}
plane: strain
materials: {{all: {{young: 3.0, poisson: 0.0}}}}
supports: [{{group: press, fix: {{x: solution, y: solution}}}}]
bodies: {{bottom: {{rigid: true}}}}
loads:
  - {{group: symx, traction: solution}}
  - {{group: farx, traction: solution}}
  - {{group: top_contact, traction: ["0.15 * (x - 0.5)", 0]}}
  - {{group: top, body_force: solution}}
contact: [{{name: interface, slave: top_contact, master: bottom_contact}}]
reference:
  kind: manufactured
  solution: parabola_2d
  contact_pressure: solution
  displacement: solution
  stress: solution
  normal_stress: solution
  gap: solution
tolerance: {{multiplier: 0.1, element_pressure: 0.1, covered_pressure: 0.1, displacement: 1.0e-3,
  nodal_stress: 0.05, surface_stress_slave: 0.05, stress_components: 0.01, displacement_l2: 1.0e-3}}
"""
RINGS = """\
name: rings
mesh:
  recipe: rings
  radii: [20, 30, 40]
  refine: 2
  bottom: {cells: QUAD8, divisions: [10, 4]}
  top: {cells: QUAD8, divisions: [8, 4]}
plane: strain
materials: {bottom: {young: 2000.0, poisson: 0.3}, top: {young: 8000.0, poisson: 0.2}}
supports:
  - {group: symx, fix: {x: solution}}
  - {group: farx, fix: [y]}
loads: [{group: base, pressure: 25}]
contact: [{name: interface, slave: bottom_contact, master: top_contact, interference: 0.02}]
steps: [0.5, 1.0]
observe: [{zone: interface, nearest: [30, 0]}]
reference:
  kind: analytical
  solution: {name: nested_cylinders, radii: [20, 30, 40], inner: bottom, outer: top}
  contact_pressure: solution
  displacement: solution
  stress: solution
  normal_stress: solution
  gap: solution
tolerance: {surface_stress_slave: 0.02, surface_stress_master: 0.02, nodal_stress: 0.02,
  stress_components: 0.02, pressure_l2: 1.0e-3}
"""
BLOCKS = """\
name: blocks
mesh:
  recipe: blocks
  size: 10
  bottom: {cells: TRIA6, divisions: 3}
  top: {cells: QUAD4, divisions: 2}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: base, fix: {y: solution}}
  - {group: symx, fix: {normal: solution}}
loads: [{group: press, LOAD: solution}, {group: farx, LOAD: solution}]
contact: [{name: interface, slave: bottom_contact, master: top_contact}]
reference:
  kind: analytical
  solution: {name: hydrostatic, pressure: 7, centre: [3, 4]}
  contact_pressure: solution
  displacement: solution
  stress: solution
  normal_stress: solution
  gap: solution
tolerance: 1.0e-9
"""


def solved(text, folder, swapped=False):
    path = folder / "case.yaml"
    path.write_text(text, encoding="utf-8")
    case = parse_case(text, path)
    solution = simulate(case.as_solved(swapped), generate(case.mesh.source, str(path)))
    solution.quality.errors = errors(solution)
    return solution


def failing(solution):
    return [check.reason for check in run_checks(solution) if not check.passed]


def test_the_manufactured_problem_holds_its_checks(tmp_path):
    solution = solved(MANUFACTURED.format(cells="QUAD8", refine=2), tmp_path)
    assert failing(solution) == []
    names = {check.name for check in run_checks(solution)}
    assert {"multiplier", "displacement", "stress_components", "displacement_l2"} <= names
    assert "surface_stress_master" not in names  # the rigid body has no stress


@pytest.mark.parametrize(
    ("cells", "order"), [("TRIA3", 2), ("QUAD4", 2), ("TRIA6", 3), ("QUAD8", 3)]
)
def test_a_small_ladder_shows_the_orders_of_theory(tmp_path, cells, order):
    coarse, fine = (
        solved(MANUFACTURED.format(cells=cells, refine=n), tmp_path).quality.errors for n in (1, 2)
    )
    slopes = {name: np.log2(coarse[name] / fine[name]) for name in fine}
    assert slopes["displacement_l2"] > order - 0.1
    assert slopes["displacement_h1"] > order - 1.1
    assert slopes["pressure_l2"] > 0.95


@pytest.mark.parametrize("swapped", [False, True])
def test_nested_cylinders_of_two_materials_pressed_together(tmp_path, swapped):
    """Each node is compared with the formula of its own body, also on the shared interface."""
    solution = solved(RINGS.replace("steps: [0.5, 1.0]\n", ""), tmp_path, swapped)
    assert failing(solution) == []
    assert max(solution.quality.errors[n] for n in ("pressure_max", "displacement_l2")) < 1e-3


def test_the_exact_solution_is_that_of_the_whole_load(tmp_path):
    """Observed pressures are compared at load factor 1 alone: the interference does not grow."""
    rows = [c for c in run_checks(solved(RINGS, tmp_path)) if c.name == "observation"]
    assert [row.passed for row in rows] == [True]
    assert rows[0].minimum == rows[0].maximum


@pytest.mark.parametrize("load", ["traction", "pressure"])
def test_loads_and_supports_of_the_hydrostatic_state(tmp_path, load):
    """The symmetry plane moves, as the centre lies elsewhere; σ·n = −p n is a pressure, too."""
    solution = solved(BLOCKS.replace("LOAD", load), tmp_path)
    assert failing(solution) == []
    assert max(solution.quality.errors.values()) < 1e-11


def test_an_error_past_its_tolerance_fails(tmp_path):
    text = RINGS.replace("pressure_l2: 1.0e-3", "pressure_l2: 1.0e-9")
    (reason,) = failing(solved(text, tmp_path))
    assert reason.startswith("pressure_l2: ")


def test_the_errors_are_kept_and_can_be_found_again(tmp_path):
    solution = solved(RINGS, tmp_path)
    path = tmp_path / "r.vtkhdf"
    write_result(path, solution, run_checks(solution), {})
    assert read_result(path).solution.quality.errors == solution.quality.errors
    again = check(path)
    assert again.estimates.errors == pytest.approx(solution.quality.errors, rel=1e-12)
    assert again.passed
