"""A refined result in place of an exact solution: fields that its mesh holds exactly come back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from solver.case.solutions.base import ElasticSolution
from solver.simulation.simulate import simulate
from solver.studies.work_precision.description import read_study
from solver.studies.work_precision.reference import RefinedSolution
from solver.verification.run import mesh_of

FILE = Path(__file__).parents[3] / "cases/study/study.yaml"
RANDOM = np.random.default_rng(7)


@pytest.fixture(scope="module")
def solution():
    """The half-loaded block on a coarse regular mesh."""
    study = read_study(FILE)
    point = next(p for p in study.points if p.problem.reference)
    case = point.reference_case(structs.replace(point.problem.reference, divisions=(8, 6)))
    return simulate(case, mesh_of(case))


def test_nodal_values_come_back_at_the_nodes(solution):
    exact = RefinedSolution(solution)
    points, body = solution.mesh.points, solution.body
    part = np.array([exact.body_part(points[body == b]) for b in body])
    assert set(part) == {0, 1}
    np.testing.assert_allclose(exact.displacement(points, part), solution.displacement, atol=1e-15)


def test_a_quadratic_field_and_its_gradient_come_back_anywhere(solution):
    """QUAD9 holds u = (x² − 3 x y, 2 y² + x), whose gradient is known, exactly."""
    x, y = solution.mesh.points.T
    field = np.stack([x**2 - 3 * x * y, 2 * y**2 + x], axis=1)
    exact = RefinedSolution(replace(solution, displacement=field))
    at = RANDOM.uniform([0, -50], [50, 50], (200, 2))
    x, y = at.T
    expected = np.stack([x**2 - 3 * x * y, 2 * y**2 + x], axis=1)
    np.testing.assert_allclose(exact.displacement(at), expected, rtol=1e-12, atol=1e-9)
    rows = [2 * x - 3 * y, -3 * x, np.ones(200), 4 * y]
    gradient = np.stack(rows, axis=1).reshape(200, 2, 2)
    np.testing.assert_allclose(exact.gradient(at), gradient, rtol=1e-11, atol=1e-9)


def test_stress_follows_by_hooke_s_law(solution):
    """u = (a x, b y) in plane strain with E = 2000, ν = 0.3: σ = λ tr ε + 2 μ ε."""
    a, b = 1e-3, -2e-3
    exact = RefinedSolution(replace(solution, displacement=solution.mesh.points * np.array([a, b])))
    shear = 2000 / (2 * 1.3)
    lame = 2 * shear * 0.3 / 0.4
    expected = [lame * (a + b) + 2 * shear * a, lame * (a + b) + 2 * shear * b, lame * (a + b)]
    found = exact.stress(RANDOM.uniform([0, -50], [50, 50], (20, 2)))
    np.testing.assert_allclose(found, [[*expected, 0, 0, 0]] * 20, rtol=1e-11, atol=1e-11)


def test_the_pressure_has_the_means_of_the_macro_elements(solution):
    """A quadratic pressure, given by its means, comes back: its integral is a cubic."""
    [zone] = solution.zones
    centre, half = zone.centre[:, 0], zone.area / 2
    mean = 3 + 0.2 * centre - 0.01 * (centre**2 + half**2 / 3)
    exact = RefinedSolution(replace(solution, zones=[replace(zone, multiplier=mean)]))
    x = np.linspace(0, 50, 33)
    found = exact.contact_pressure(np.stack([x, 0 * x], axis=1))
    np.testing.assert_allclose(found, 3 + 0.2 * x - 0.01 * x**2, rtol=1e-10)


def test_it_is_an_elastic_solution_with_two_parts(solution):
    exact = RefinedSolution(solution)
    assert isinstance(exact, ElasticSolution)
    assert [m.young for m in exact.materials] == [2000.0, 2000.0]
    assert exact.interface == pytest.approx(0, abs=1e-12)
