"""While the contact status is sought, an iterative solver solves roughly; the result is exact."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import parse_case
from solver.mechanics.linear.choice import LinearSolver
from solver.mechanics.multigrid import multigrid
from solver.mesh import generate
from solver.simulation.equilibrium import problem
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.equilibrium.state import Equilibrium
from solver.simulation.options import LEAN
from solver.simulation.scene.scene import Scene, build_scene
from solver.system.progress import Clock
from tests.patches import force_solver

SPHERE = Path(__file__).resolve().parents[2] / "cases/hertz/sphere-hexa8.yaml"


def sphere(slave: str, master: str, swapped: bool = False) -> Scene:
    """The sphere with other divisions of its blocks."""
    text = SPHERE.read_text(encoding="utf-8")
    for old, new in (("[16, 16, 12]", slave), ("[14, 14, 12]", master)):
        assert old in text
        text = text.replace(old, new)
    case = parse_case(text, SPHERE)
    return build_scene(case.as_solved(swapped), generate(case.mesh.source, "sphere"), LEAN, Clock())


@pytest.fixture(scope="module")
def scene() -> Scene:
    return sphere("[8, 8, 6]", "[7, 7, 6]")


def solved(scene: Scene, kind: str) -> Equilibrium:
    with force_solver(kind):
        return ContactProblem(scene).solve(scene.case.steps[-1])


def assert_same(found: Equilibrium, exact: Equilibrium) -> None:
    np.testing.assert_array_equal(found.status.closed, exact.status.closed)
    for name in ("pressure", "displacement"):
        wanted = getattr(exact, name)
        limit = 1e-12 * np.abs(wanted).max()
        np.testing.assert_allclose(getattr(found, name), wanted, rtol=0, atol=limit)
    assert found.residual < 1e-12


def test_result_is_that_of_a_factor_in_fewer_iterations(monkeypatch):
    scene, iterations = sphere("[12, 12, 8]", "[10, 10, 8]"), []
    solve = multigrid.conjugate_gradients

    def counted(*arguments):
        solution, count = solve(*arguments)
        iterations[-1] += count
        return solution, count

    monkeypatch.setattr(multigrid, "conjugate_gradients", counted)
    exact = solved(scene, "cholmod")
    assert exact.status.iterations > 1
    for iterative in (True, False):
        iterations.append(0)
        monkeypatch.setattr(LinearSolver, "iterative", iterative)
        assert_same(solved(scene, "multigrid"), exact)
    assert iterations[0] < 0.75 * iterations[1]


def test_rough_solves_that_decide_nothing(scene, monkeypatch):
    monkeypatch.setattr(problem, "_UNDECIDED", 1e9)
    exact = solved(scene, "cholmod")
    found = solved(scene, "multigrid")
    assert_same(found, exact)
    assert found.status.changes == exact.status.changes


def test_rough_solve_that_is_wrong(scene, monkeypatch):
    """An open multiplier is said to overlap: it closes, and a later solve opens it again."""
    true = ContactProblem._roughly

    def astray(self, start, known):
        found, trial = true(self, start, known)
        if known is None:
            far = np.where(start.closed, -np.inf, trial.gap).argmax()
            gap = trial.gap.copy()
            gap[far] = -10 * trial.gap_limit[far]
            trial = replace(trial, gap=gap)
        return found, trial

    monkeypatch.setattr(ContactProblem, "_roughly", astray)
    found, exact = solved(scene, "multigrid"), solved(scene, "cholmod")
    assert found.status.iterations > exact.status.iterations
    assert_same(found, exact)
