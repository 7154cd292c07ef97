"""The stabilised system against both equations solved by hand."""

import numpy as np
import pytest
from scipy import sparse

from solver.mechanics.linear.stabilised import stabilise
from solver.system.errors import SolveError

K = sparse.csr_matrix(np.diag([2.0, 1.0]))
G = sparse.csr_matrix([[1.0, 0.0]])
OWN = np.array([True, True])


def test_one_spring():
    """2 x = f + p with x + s p = b: for f = 0, b = 3, s = 1/4, p = 3 / (1/2 + 1/4) = 4, x = 2."""
    system = stabilise(K, G, OWN, sparse.csr_matrix([[0.25]]))
    x = system.correction(np.zeros(2), np.array([3.0]))
    assert x == pytest.approx([2.0, 0.0])
    left = -K @ x
    assert system.multiplier(left) == pytest.approx([4.0])
    assert system.imbalance(left) == pytest.approx(0, abs=1e-15)
    assert system.imbalance(left + np.array([0.0, 0.5])) == pytest.approx(0.5)


def test_without_compliance_the_constraint_holds():
    system = stabilise(K, G, OWN, sparse.csr_matrix((1, 1)))
    assert system.correction(np.array([1.0, 1.0]), np.array([3.0])) == pytest.approx([3.0, 1.0])


def test_a_constraint_without_an_unknown_of_its_own():
    with pytest.raises(SolveError, match="1 closed macro-elements have no unknown of their own"):
        stabilise(K, G, np.array([False, True]), sparse.csr_matrix((1, 1)))
