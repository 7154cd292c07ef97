"""Nearly incompressible material by multigrid: iterations, solutions, and the matrix."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_matrix, diags, random

from solver.case.reader import parse_case
from solver.lac.errors import SolveError
from solver.mechanics.fem.mixed import MeanStress
from solver.mechanics.linear import choice
from solver.mechanics.linear.condensation import condense
from solver.mechanics.linear.direct import force_solver
from solver.mechanics.linear.krylov import conjugate_residuals
from solver.mechanics.linear.stiffened import StiffenedMatrix, part_of
from solver.mechanics.linear.unknowns import Unknowns
from solver.simulation.simulate import simulate
from tests.scenes import block_case, block_mesh, replaced

RUBBER = "all: {young: 2000.0, poisson: 0.3}"
MESHES = {"TETRA10": (5, 4), "HEXA20": (7, 6), "HEXA27": (5, 4)}


def pressed(cells: str, poisson: float, solver: str):
    """A clamped block of rubber below one of steel, under a pressure that varies."""
    text = replaced(
        block_case(3).source,
        (RUBBER, f"bottom: {{young: 6.0, poisson: {poisson}}}, top: {{young: 60.0, poisson: 0.3}}"),
        ("pressure: 25.0", 'pressure: "0.2 + 0.1*cos(3*x)*cos(2*y + 1)"'),
        ("group: base, fix: [z]", "group: base, fix: [x, y, z]"),
    )
    case = parse_case(text, Path("case.yaml")).as_solved(swapped=False)
    with force_solver(solver):
        return simulate(case, block_mesh(cells, cells, MESHES[cells]))


@pytest.mark.parametrize("cells", MESHES)
def test_iterations_do_not_depend_on_poissons_ratio(cells):
    found = [pressed(cells, poisson, "multigrid") for poisson in (0.4992, 0.499999)]
    assert all("conjugate residuals with multigrid" in s.linear_solver for s in found)
    assert max(s.linear_iterations for s in found) <= 80
    assert found[1].linear_iterations <= 1.5 * found[0].linear_iterations


@pytest.mark.parametrize("cells", MESHES)
def test_the_solution_is_that_of_a_factor(cells):
    found, exact = (pressed(cells, 0.4999, kind) for kind in ("multigrid", "cholmod"))
    assert "multigrid" in found.linear_solver
    assert "multigrid" not in exact.linear_solver
    for name in ("displacement", "stress"):
        one, other = getattr(found, name), getattr(exact, name)
        assert np.abs(one - other).max() < 1e-10 * np.abs(other).max(), name
    pressures = [s.zones[0].multiplier for s in (found, exact)]
    assert np.abs(pressures[0] - pressures[1]).max() < 1e-10 * pressures[1].max()


def test_a_wrong_schur_complement_costs_many_more_iterations(monkeypatch):
    """A planted fault: without the volumes of the cells."""
    parted = MeanStress.parted
    right = pressed("HEXA27", 0.4999, "multigrid").linear_iterations

    def without(self):
        beyond, near = parted(self)
        return beyond, 1e-2 * near

    monkeypatch.setattr(MeanStress, "parted", without)
    wrong = pressed("HEXA27", 0.4999, "multigrid")
    assert "multigrid" not in wrong.linear_solver or wrong.linear_iterations > 2 * right


def a_matrix() -> tuple[StiffenedMatrix, np.ndarray]:
    """K tridiagonal, B random, and their sum in full."""
    soft = diags([-1.0, 3.0, -1.0], [-1, 0, 1], shape=(30, 30)).tocsr()
    rng = np.random.default_rng(0)
    divergence = csr_matrix(random(8, 30, 0.3, random_state=rng))
    weight = rng.uniform(10, 20, 8)
    whole = soft.toarray() + divergence.T @ diags(weight) @ divergence.toarray()
    return StiffenedMatrix(soft, divergence, weight, 1 + 1 / weight), whole


def test_the_matrix_is_the_sum():
    matrix, whole = a_matrix()
    x, rows = np.random.default_rng(1).standard_normal((30, 2)), np.array([4, 17])
    np.testing.assert_allclose(matrix @ x, whole @ x, rtol=1e-13)
    np.testing.assert_allclose(matrix @ x[:, 0], whole @ x[:, 0], rtol=1e-13)
    np.testing.assert_allclose(matrix[rows].toarray(), whole[rows], rtol=1e-13)
    np.testing.assert_allclose(matrix.tocsr().toarray(), whole, rtol=1e-13)
    np.testing.assert_allclose(matrix.diagonal(), whole.diagonal(), rtol=1e-13)


def test_condensed_as_the_sum_is():
    matrix, whole = a_matrix()
    rows = csr_matrix(([2.0, -1.0, -1.0], ([0, 0, 0], [3, 9, 20])), shape=(1, 30))
    own = np.arange(30) == 3
    found = condense(matrix, rows, own).correction(np.ones(30), np.ones(1))
    wanted = condense(csr_matrix(whole), rows, own).correction(np.ones(30), np.ones(1))
    np.testing.assert_allclose(found, wanted, rtol=1e-10)
    assert (rows @ found)[0] == pytest.approx(1.0)


def test_a_body_without_such_material_keeps_its_matrix():
    matrix, _ = a_matrix()
    divergence = matrix.divergence @ diags((np.arange(30) < 15).astype(float))
    divergence.eliminate_zeros()
    matrix = matrix.changed(matrix.soft, divergence.tocsr())
    first, second = np.arange(15), np.arange(15, 30)
    assert isinstance(part_of(matrix, second), csr_matrix)
    kept = part_of(matrix, first)
    assert isinstance(kept, StiffenedMatrix)
    np.testing.assert_allclose(kept.tocsr().toarray(), matrix[first].toarray()[:, first])


def test_conjugate_residuals_solve_what_is_not_symmetric():
    rng = np.random.default_rng(2)
    matrix = np.eye(40) + 0.1 * rng.standard_normal((40, 40))
    exact = rng.standard_normal(40)
    found, iterations = conjugate_residuals(
        lambda x: matrix @ x, np.copy, matrix @ exact, np.linalg.norm, 1e-12, 60
    )
    np.testing.assert_allclose(found, exact, atol=1e-10)
    assert 5 < iterations <= 60


def test_conjugate_residuals_break_down_where_a_step_gains_nothing():
    with pytest.raises(SolveError, match="break down after 1 iterations"):
        conjugate_residuals(
            lambda x: np.roll(x, 1), np.copy, np.eye(60)[0], np.linalg.norm, 1e-9, 30
        )


def test_conjugate_residuals_give_up_where_they_gain_little():
    diagonal = np.geomspace(1, 1e8, 200)
    with pytest.raises(SolveError, match=r"conjugate residuals leave a residual of .* in 20 "):
        conjugate_residuals(lambda x: diagonal * x, np.copy, np.ones(200), np.linalg.norm, 1e-9, 60)


def test_small_systems_are_factored(monkeypatch):
    matrix, whole = a_matrix()
    node, body = np.repeat(np.arange(10), 3), np.zeros(30, dtype=int)
    unknowns = Unknowns(3, node, lambda: np.ones((30, 1)), body)
    monkeypatch.setattr(choice, "MULTIGRID_FROM", 10)
    few = choice.prepare(matrix, unknowns)
    assert few.why.startswith("fewer than 100000 unknowns, some of nearly incompressible cells")
    np.testing.assert_allclose(few.solve(whole @ np.ones(30)), 1.0, rtol=1e-10)
    monkeypatch.setattr(choice, "_STIFFENED_FROM", {True: 20, False: 40})
    unstable = replace(matrix, stable=False)
    linear = choice.prepare(unstable, unknowns)
    assert linear.why.startswith("fewer than 40 unknowns, some of nearly incompressible linear")
    monkeypatch.setattr(choice, "_STIFFENED_FROM", {True: 20, False: 20})
    for large in (matrix, unstable):
        chosen = choice.prepare(large, unknowns)
        assert "residuals with multigrid" in chosen.name
        np.testing.assert_allclose(chosen.solve(whole @ np.ones(30)), 1.0, rtol=1e-10)
    locked = choice.prepare(replace(unstable, locks=True), unknowns)
    assert "TETRA4 lock" in locked.why
    assert not locked.iterative
    with force_solver("multigrid"):
        assert choice.prepare(replace(unstable, locks=True), unknowns).iterative


def test_nothing_to_solve():
    zero = np.zeros(3)
    found, iterations = conjugate_residuals(np.copy, np.copy, zero, np.linalg.norm, 1e-9, 30)
    assert not found.any()
    assert iterations == 0
