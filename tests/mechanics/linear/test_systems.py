"""Constrained systems: overlapping constraints on a definite factor, against dense elimination."""

import numpy as np
import pytest
from scipy import sparse

from solver.lac.errors import SolveError
from solver.mechanics.linear.choice import Solvers
from solver.mechanics.linear.compliant import Compliance, CompliantSystem, condense_compliant
from solver.mechanics.linear.systems import Part, Systems, augment
from solver.mechanics.multigrid import multigrid
from solver.mechanics.multigrid.hierarchy import Interface, Level
from solver.mechanics.multigrid.multigrid import Multigrid
from tests.mechanics.multigrid.test_hierarchy import pressed
from tests.patches import force_solver

COUNT = 30


def springs(count, stiffness=1.0, held=True):
    line = stiffness * sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(count, count)).tolil()
    line[-1, -1] = stiffness
    line[0, 0] = 2 * stiffness if held else stiffness
    return line.tocsr()


def overlapping(count):
    """Weighted means of neighbours on one chain equal those on the other: unknowns are shared."""
    hats = sparse.diags([1.0, 4.0, 1.0], [-1, 0, 1], shape=(count, count)).tocsr()[::3]
    hats = hats + sparse.diags([1.0], [2], shape=(count, count)).tocsr()[::3]
    return sparse.hstack([hats, -hats]).tocsr()


def exact(matrix, constraints, force, violation):
    k = constraints.shape[0]
    whole = np.block(
        [[matrix.toarray(), -constraints.T.toarray()], [constraints.toarray(), np.zeros((k, k))]]
    )
    found = np.linalg.solve(whole, np.concatenate([force, violation]))
    return found[: len(force)], found[len(force) :]


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("ratio", [1.0, 1e6])
@pytest.mark.parametrize("unit", [1.0, 1e-9])
def test_equilibrium_under_overlapping_constraints(held, ratio, unit):
    """The other chain floats unless held; units of the gap and of stiffness do not matter."""
    blocks = [springs(COUNT), springs(COUNT, ratio, held)]
    matrix, constraints = sparse.block_diag(blocks).tocsr(), unit * overlapping(COUNT)
    rng = np.random.default_rng(0)
    force, violation = rng.standard_normal((60, 2)), unit * rng.standard_normal((10, 2))
    system = augment(matrix, constraints)
    found = system.correction(force, violation)
    true, multiplier = exact(matrix, constraints, force, violation)
    np.testing.assert_allclose(constraints @ found, violation, atol=1e-12 * np.abs(violation).max())
    np.testing.assert_allclose(found, true, atol=1e-8 * np.abs(true).max())
    left = force - matrix @ true
    np.testing.assert_allclose(
        system.multiplier(left), multiplier, atol=1e-8 * np.abs(multiplier).max()
    )
    assert system.imbalance(left, np.zeros(1)) <= 1e-8 * np.abs(force).max()


def test_a_force_that_no_multiplier_balances_is_seen():
    """Unknown 1 lies in no constraint: what acts there stays."""
    matrix = sparse.identity(3, format="csr")
    system = augment(matrix, sparse.csr_matrix([[1.0, 0.0, -1.0]]))
    assert system.imbalance(np.array([2.0, 5.0, -2.0]), np.zeros(1)) == pytest.approx(5.0)
    assert system.multiplier(np.array([2.0, 5.0, -2.0])) == pytest.approx([-2.0])


def test_what_leaves_no_solution_is_refused():
    matrix = springs(4)
    twice = sparse.csr_matrix([[1.0, 1.0, 0.0, 0.0], [1.0, 1.0 + 1e-7, 0.0, 0.0]])
    with pytest.raises(SolveError, match="singular to working precision"):
        augment(matrix, twice)
    with pytest.raises(SolveError, match="a constraint holds no unknown"):
        augment(matrix, 0 * twice)
    floating = sparse.block_diag([springs(2, held=False), springs(2)]).tocsr()
    with pytest.raises(SolveError):
        augment(floating, sparse.csr_matrix([[0.0, 0.0, 1.0, 0.0]]))


def sharing(slave: int, master: int):
    """Two blocks; each constraint is the mean of the gaps at a slave node and beside it."""
    matrix, gaps, _, unknowns = pressed(slave, master)
    line = sparse.diags([1.0, 4.0, 1.0], [-1, 0, 1], shape=(slave + 1,) * 2)
    return matrix, (sparse.kron(line, line) @ gaps).tocsr(), unknowns


def loaded(matrix, constraints):
    """Force, violation, and the displacement that they lead to."""
    rng = np.random.default_rng(1)
    force, violation = (rng.standard_normal(n) for n in constraints.shape[::-1])
    whole = sparse.bmat([[matrix, -constraints.T], [constraints, None]]).tocsc()
    found = sparse.linalg.splu(whole).solve(np.concatenate([force, violation]))
    return force, violation, *np.split(found, [len(force)])


@pytest.mark.parametrize(("slave", "master"), [(8, 6), (6, 8), (8, 2), (2, 1)])
def test_multigrid_of_overlapping_constraints(slave, master, monkeypatch):
    """In few iterations; the exact solve beside contact is needed, however large its share."""
    monkeypatch.setattr(multigrid, "_MOST_BESIDE", 0.0)
    matrix, constraints, unknowns = sharing(slave, master)
    force, violation, exact, multiplier = loaded(matrix, constraints)
    with force_solver("multigrid"):
        system = augment(matrix, constraints, Solvers(unknowns))
    found = system.correction(force, violation)
    assert "multigrid" in system.factor.name
    assert system.factor.iterations <= 50
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10 * np.abs(exact).max())
    left = force - matrix @ found
    largest = np.abs(multiplier).max()
    np.testing.assert_allclose(system.multiplier(left), multiplier, rtol=0, atol=1e-9 * largest)


def test_each_correction_gains_the_digits_asked_for():
    """Forces that multipliers balance do not count: each step leaves 1e-4 of the error before."""
    matrix, constraints, unknowns = sharing(8, 6)
    force, violation, exact, _ = loaded(matrix, constraints)
    with force_solver("multigrid"):
        system = augment(matrix, constraints, Solvers(unknowns))
    found, errors = np.zeros(len(force)), [1.0]
    for _ in range(3):
        left = force - matrix @ found, violation - constraints @ found
        found = found + system.correction(*left, 1e-4)
        errors.append(np.abs(found - exact).max() / np.abs(exact).max())
    assert (np.divide(errors[1:], errors[:-1]) < [1e-2, 1e-2, 1e-2]).all()
    assert errors[-1] < 1e-10


def test_multigrid_that_gave_up_is_not_tried_for_another_status(gave_up):
    matrix, constraints, unknowns = sharing(4, 3)
    m, n = constraints.shape
    parts = [Part(np.ones(n, dtype=bool), np.ones(m, dtype=bool))]
    systems = Systems(matrix, constraints, None, unknowns, parts)
    force = np.random.default_rng(2).standard_normal(n)
    with force_solver("multigrid"):
        for closed in (np.ones(m, dtype=bool), np.arange(m) % 5 > 0):
            system = systems.closed(closed)
            change = system.correction(force, np.zeros(int(closed.sum())))
            assert "conjugate gradients leave a residual" in system.why
            np.testing.assert_allclose(constraints[closed] @ change, 0.0, atol=1e-12)
            assert system.imbalance(force - matrix @ change, np.zeros(1)) < 1e-9
    assert len(gave_up) == 1


# The stabilised system against both equations solved by hand and by elimination.


K = sparse.csr_matrix(np.diag([2.0, 1.0]))
G = sparse.csr_matrix([[1.0, 0.0]])
OWN = np.array([True, True])
SPRING = Compliance(sparse.csr_matrix([[0.5]]), np.array([1.0]))
"""S = ¼."""


def neighbours(slave: int, stiffness: float) -> Compliance:
    """Of (slave + 1)² nodes: the pressure less its mean over the next ones, 0 if uniform."""
    line = sparse.diags([1.0, 1.0], [-1, 1], shape=(slave + 1,) * 2)
    near = sparse.kronsum(line, line).tocsr()
    mean = sparse.diags(1 / np.asarray(near.sum(axis=1)).ravel()) @ near
    scatter = sparse.csr_matrix(sparse.identity(near.shape[0]) - mean)
    return Compliance(scatter, np.linspace(1.0, 2.0, near.shape[0]) / stiffness)


def solved(matrix, gaps, compliance: Compliance, force, violation):
    """Displacement and pressure by elimination of the whole system."""
    soft = compliance.scatter.T @ sparse.diags(compliance.weight) @ compliance.scatter
    whole = sparse.bmat([[matrix, -gaps.T], [gaps, soft]]).tocsc()
    found = sparse.linalg.splu(whole).solve(np.concatenate([force, violation]))
    return found[: len(force)], found[len(force) :]


def test_one_spring():
    """2 x = f + p with x + s p = b: for f = 0, b = 3, s = 1/4, p = 3 / (1/2 + 1/4) = 4, x = 2."""
    system = condense_compliant(K, G, OWN, SPRING)
    x = system.correction(np.zeros(2), np.array([3.0]))
    assert x == pytest.approx([2.0, 0.0])
    left = -K @ x
    assert system.multiplier(left) == pytest.approx([4.0])
    assert system.imbalance(left, np.array([1.0])) == pytest.approx(0, abs=1e-15)
    assert system.imbalance(left + np.array([0.0, 0.5]), np.array([1.0])) == pytest.approx(0.5)


def test_gaps_that_do_not_fit_the_pressure_are_an_imbalance():
    """p = 4 opens by s p = 1. A gap of 1.5 is 0.5 too large: 0.5 / (1/4 + 1/2), by both."""
    system = condense_compliant(sparse.csr_matrix([[2.0, -1.0], [-1.0, 1.0]]), G, OWN, SPRING)
    assert system.imbalance(np.array([-4.0, 0.0]), np.array([1.5])) == pytest.approx(2 / 3)


def test_what_soft_springs_leave_is_the_rounding_of_a_pressure():
    """A body 10⁹ times as stiff as the spring: a gap of 10⁻¹² is 4·10⁻¹² of pressure, not 10⁻³."""
    stiff = sparse.csr_matrix([[1e9, 0.0], [0.0, 1e9]])
    system = condense_compliant(stiff, G, OWN, SPRING)
    left = system.imbalance(np.array([-4.0, 0.0]), np.array([1.0 + 1e-12]))
    assert left == pytest.approx(4e-12, rel=1e-3)


def test_without_compliance_the_constraint_holds():
    system = condense_compliant(K, G, OWN, Compliance(sparse.csr_matrix((0, 1)), np.empty(0)))
    assert system.correction(np.array([1.0, 1.0]), np.array([3.0])) == pytest.approx([3.0, 1.0])


def test_a_constraint_without_an_unknown_of_its_own():
    with pytest.raises(SolveError, match="1 closed macro-elements have no unknown of their own"):
        condense_compliant(K, G, np.array([False, True]), SPRING)


def system_of(slave: int, master: int, stiffness: float, kind: str) -> tuple:
    """A stabilised system solved by a `kind`, with the matrices behind it."""
    matrix, gaps, own, unknowns = pressed(slave, master)
    compliance = neighbours(slave, stiffness)
    with force_solver(kind):
        system = condense_compliant(matrix, gaps, own, compliance, Solvers(unknowns))
    return system, matrix, gaps, compliance


def assert_solves(system: CompliantSystem, matrix, gaps, compliance) -> None:
    rng = np.random.default_rng(0)
    force, violation = rng.standard_normal(matrix.shape[0]), rng.standard_normal(gaps.shape[0])
    exact, pressure = solved(matrix, gaps, compliance, force, violation)
    found = system.correction(force, violation)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10 * np.abs(exact).max())
    left = force - matrix @ found
    scale = np.abs(pressure).max()
    np.testing.assert_allclose(system.multiplier(left), pressure, rtol=0, atol=1e-9 * scale)
    assert system.imbalance(left, violation - gaps @ found) < 1e-9 * scale


@pytest.mark.parametrize("stiffness", [1e1, 1e3, 1e5])
@pytest.mark.parametrize(
    ("slave", "master", "kind"),
    [(6, 4, "cholmod"), (6, 4, "multigrid"), (2, 1, "multigrid"), (12, 6, "multigrid")],
)
def test_both_equations(slave, master, kind, stiffness):
    """From constraints that hardly hold to nearly rigid ones; (2, 1) has one level alone."""
    parts = system_of(slave, master, stiffness, kind)
    assert_solves(*parts)
    assert ("multigrid" in parts[0].factor.name) == (kind == "multigrid")
    assert parts[0].factor.iterations <= 40


def test_a_rough_correction_is_corrected_further():
    """From each solution the next solves for what is left, not for the whole compliance again."""
    system, matrix, gaps, compliance = system_of(8, 6, 1e2, "multigrid")
    rng = np.random.default_rng(1)
    force, violation = rng.standard_normal(matrix.shape[0]), rng.standard_normal(gaps.shape[0])
    exact, _ = solved(matrix, gaps, compliance, force, violation)
    found, errors = np.zeros(len(force)), []
    for _ in range(5):
        found = found + system.correction(force - matrix @ found, violation - gaps @ found, 1e-3)
        errors.append(np.abs(found - exact).max() / np.abs(exact).max())
    assert errors[-1] < 1e-9
    assert "multigrid" in system.factor.name


def test_springs_missing_beside_contact_cost_iterations(monkeypatch):
    """The exact solve there is all that moves them."""
    iterations = []
    for springs in (True, False):
        if not springs:
            monkeypatch.setattr(Level, "corrected", without_springs)
        system = system_of(8, 6, 1e2, "multigrid")[0]
        solver = system.factor._solver
        assert isinstance(solver, Multigrid)
        try:
            solver.solve(np.ones(system.factor._matrix.shape[0]), 1e-8)
            iterations.append(solver.iterations)
        except SolveError:
            iterations.append(multigrid.MAX_ITERATIONS)
    assert iterations[0] <= 25
    assert iterations[1] > 2 * iterations[0]


corrected = Level.corrected


def without_springs(self, correction, most, beside=None):
    return corrected(self, correction, most)


def test_a_factor_takes_over(monkeypatch):
    def fail(*_):
        raise SolveError("a part of the matrix is not positive definite")

    monkeypatch.setattr(Interface, "__init__", fail)
    parts = system_of(6, 4, 1e2, "multigrid")
    assert_solves(*parts)
    assert "multigrid" not in parts[0].factor.name
