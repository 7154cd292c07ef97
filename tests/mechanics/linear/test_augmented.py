"""Constraints that overlap, solved on a definite factor, compared with dense elimination."""

import numpy as np
import pytest
from scipy import sparse

from solver.mechanics.linear.augmented import augment
from solver.system.errors import SolveError

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
    system = augment(matrix, constraints, 2, "tried")
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
    system = augment(matrix, sparse.csr_matrix([[1.0, 0.0, -1.0]]), 2, "tried")
    assert system.imbalance(np.array([2.0, 5.0, -2.0]), np.zeros(1)) == pytest.approx(5.0)
    assert system.multiplier(np.array([2.0, 5.0, -2.0])) == pytest.approx([-2.0])


def test_what_leaves_no_solution_is_refused():
    matrix = springs(4)
    twice = sparse.csr_matrix([[1.0, 1.0, 0.0, 0.0], [1.0, 1.0 + 1e-7, 0.0, 0.0]])
    with pytest.raises(SolveError, match="singular to working precision"):
        augment(matrix, twice, 2, "tried")
    with pytest.raises(SolveError, match="a constraint holds no unknown"):
        augment(matrix, 0 * twice, 2, "tried")
    floating = sparse.block_diag([springs(2, held=False), springs(2)]).tocsr()
    with pytest.raises(SolveError):
        augment(floating, sparse.csr_matrix([[0.0, 0.0, 1.0, 0.0]]), 2, "tried")
