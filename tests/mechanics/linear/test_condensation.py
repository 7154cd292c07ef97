"""Pivots of constraints that contain each other's unknowns, compared with dense elimination."""

import numpy as np
import pytest
from scipy import sparse

from solver.mechanics.linear.condensation import choose_pivots, condense

# The first two rows own columns 0 and 1; the third column 2 among the rest, the fourth column 3.
CHAIN = np.array(
    [
        [2.0, 0.0, 0.5, 0.0, 0.0, 1.0],
        [0.0, 4.0, 1.0, -0.5, 1.0, 0.0],
        [0.0, 0.0, 3.0, 0.25, 0.0, -1.0],
        [0.0, 0.0, 0.0, 2.0, 1.0, 1.0],
    ]
)
OWN = np.array([True, True, True, True, False, False])


def test_layers_of_pivots():
    pivot, found = choose_pivots(sparse.csr_matrix(CHAIN), OWN)
    assert found.all()
    assert pivot.tolist() == [0, 1, 2, 3]
    everywhere = np.vstack([CHAIN[:, :4] * 0 + 1, np.ones((1, 4))])
    assert not choose_pivots(sparse.csr_matrix(everywhere), OWN[:4])[1].any()


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 1, 0, 2]])
def test_a_chain_of_constraints(order):
    rows = CHAIN[order]
    stiffness = np.diag([4.0, 5, 6, 7, 8, 9]) + 1.0
    force, violation = np.arange(1.0, 7.0), np.array([0.5, -1.0, 2.0, 1.0])
    whole = np.block([[stiffness, -rows.T], [rows, np.zeros((4, 4))]])
    exact = np.linalg.solve(whole, np.concatenate([force, violation]))
    system = condense(sparse.csr_matrix(stiffness), sparse.csr_matrix(rows), OWN)
    x = system.correction(force, violation)
    assert x == pytest.approx(exact[:6], rel=1e-12)
    left = force - stiffness @ x
    assert system.multiplier(left) == pytest.approx(exact[6:], rel=1e-12)
    assert system.imbalance(left, np.zeros(1)) < 1e-12
