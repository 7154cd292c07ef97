"""Which way a constrained system is solved, and that every way gives the same answer."""

import numpy as np
from scipy import sparse

from solver.mechanics.linear.condensation import condense
from solver.mechanics.linear.condensed_matrix import CondensedMatrix
from solver.mechanics.linear.unknowns import Unknowns


def chain_over_floor(count):
    """A chain of springs that floats, and one held unknown that is the mean of all of it."""
    line = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(count, count)).tolil()
    line[0, 0] = line[-1, -1] = 1.0
    matrix = sparse.block_diag([[[3.0]], line]).tocsr()
    row = np.concatenate([[1.0], np.full(count, -1 / count)])[None]
    return matrix, sparse.csr_matrix(row)


def stands_for(matrix, dim=3):
    n = matrix.shape[0]
    return Unknowns(dim, np.arange(n), lambda: np.ones((n, 6)), np.zeros(n, dtype=int))


def test_condensed_correction_meets_the_constraint_in_equilibrium():
    """Compared with the system of displacement and multiplier, solved as it is."""
    matrix, constraints = chain_over_floor(30)
    force, violation = np.random.default_rng(0).standard_normal(31), np.array([0.2])
    system = condense(matrix, constraints, np.arange(31) == 0, stands_for(matrix))
    saddle = sparse.bmat([[matrix, -constraints.T], [constraints, None]]).toarray()
    expected = np.linalg.solve(saddle, np.concatenate([force, violation]))
    found = system.correction(force, violation)
    np.testing.assert_allclose(found, expected[:-1], rtol=1e-10, atol=1e-10)
    multiplier = system.multiplier(force - matrix @ found)
    np.testing.assert_allclose(multiplier, expected[-1:], rtol=1e-9)


def between_two_chains(count):
    """Two chains, the facing ends of which stay together through three multipliers."""
    line = sparse.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(count, count))
    matrix = sparse.block_diag([line, 3 * line]).tocsr()
    columns = [[0, count, count + 1], [1, count + 1, count + 2], [2, count + 2, count + 3]]
    rows = np.repeat(np.arange(3), 3)
    weights = np.tile([1.0, -0.3, -0.7], 3)
    return matrix, sparse.csr_matrix((weights, (rows, np.ravel(columns))), shape=(3, 2 * count))


def test_condensed_matrix_is_that_of_the_expansion():
    matrix, constraints = between_two_chains(12)
    own = np.arange(24) < 12
    system = condense(matrix, constraints, own, stands_for(matrix, dim=2))
    expected = (system.expansion.T @ matrix @ system.expansion).toarray()
    np.testing.assert_allclose((constraints @ system.expansion).toarray(), 0, atol=1e-15)
    kept = np.setdiff1d(np.arange(24), system.pivot)
    added = sparse.csr_matrix(expected) - matrix[kept][:, kept]
    condensed = CondensedMatrix(matrix, kept, added.tocsr())
    x = np.random.default_rng(1).standard_normal((21, 2))
    np.testing.assert_allclose(condensed @ x, expected @ x, atol=1e-14)
    np.testing.assert_allclose(condensed.diagonal(), expected.diagonal(), atol=1e-15)
    np.testing.assert_allclose(condensed.tocsr().toarray(), expected, atol=1e-15)
    some = np.array([20, 3, 7])
    np.testing.assert_allclose(condensed[some].toarray(), expected[some], atol=1e-15)
    right = np.random.default_rng(2).standard_normal(21)
    np.testing.assert_allclose(expected @ system.factor.solve(right), right, atol=1e-13)
