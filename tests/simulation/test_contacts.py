"""Contacts that nothing joins: each has its own law and scale, and one rests while another rubs."""

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, aslinearoperator

from solver.mechanics.mortar.coulomb import CoulombContact
from solver.simulation.equilibrium.contacts import Contacts

# Two gaps, each with one slip, on springs without coupling: those of the first are a million times
# as stiff.
STIFF = np.array([1e6, 1.0, 1e6, 1.0])
SLIPS = np.array([[2, 3]])


def contacts(group, stiffness=None) -> Contacts:
    matrix = np.diag(STIFF) if stiffness is None else stiffness
    whole = CoulombContact(matrix, STIFF, np.full(2, 0.5), np.arange(2), SLIPS)
    return Contacts(whole, np.array(group))


def no_rest(_gaps, _jump):
    raise AssertionError("nothing rests")


@pytest.mark.parametrize("whole", [np.diag(STIFF), aslinearoperator(np.diag(STIFF))])
def test_each_slips_by_what_its_bound_leaves_of_the_pull(whole: np.ndarray | LinearOperator):
    both = contacts([0, 1], whole)
    acting = np.array([2e6, 2.0, 1.5e6, 1.5])
    forces, jump, _ = both.solve(acting, 0.0, None, 1.0, 0.0, no_rest)
    assert forces == pytest.approx([2e6, 2.0, 1e6, 1.0], rel=1e-12)
    assert jump == pytest.approx([0.0, 0.0, -0.5, -0.5], abs=1e-12)
    closed, slips = both.statuses(forces, jump)
    assert closed.all()
    assert slips.all()


def test_a_fault_is_measured_by_the_forces_of_its_own_contact():
    acting = np.array([2e6, 2.0, 0.0, 1.5])
    faults = []
    for group in ([0, 1], [0, 0]):
        both = contacts(group)
        both.solve(acting, 0.0, None, 1.0, 0.0, no_rest)
        following, fault = both.corrected(acting, np.zeros(4), 1.0)
        faults.append(fault)
        assert following == pytest.approx([0.0, 0.0, 0.0, -0.5], abs=1e-12)
    # Of the traction 1.5 the bound leaves 1: a quarter of the pressure, or of two million.
    assert faults == pytest.approx([0.25, 0.25e-6], rel=1e-9)


def test_one_rests_where_nothing_presses_it():
    both, asked = contacts([0, 1]), []

    def rest(gaps, _jump):
        asked.append(gaps.tolist())
        return np.array([True, True]), np.array([9.0, 0.125, 9.0, 0.25])

    acting = np.array([2e6, -1.0, 0.0, 0.0])
    forces, jump, _ = both.solve(acting, 0.0, None, 1.0, 0.0, rest)
    assert asked == [[False, True]]
    assert forces.tolist() == [2e6, 0.0, 0.0, 0.0]
    assert jump.tolist() == [0.0, 0.125, 0.0, 0.25]
    # It stays where it rests, touches, and slips freely.
    following, fault = both.corrected(forces, jump, 1.0)
    assert (following.tolist(), fault) == (jump.tolist(), 0.0)
    closed, slips = both.statuses(forces, jump)
    assert (closed.tolist(), slips.tolist()) == ([True, True], [False, True])
    assert both.kept(closed).all()


def test_one_rests_beside_the_jumps_of_the_other():
    """That is pressed by 2 and pulled by 1.5, of which its bound leaves 1."""
    both, asked = contacts([0, 1]), []

    def rest(_gaps, jump):
        asked.append(jump.copy())
        return np.array([True, True]), np.array([9.0, 0.125, 9.0, 0.25])

    _, jump, _ = both.solve(np.array([2e6, -1.0, 1.5e6, 0.0]), 0.0, None, 1.0, 0.0, rest)
    assert asked == [pytest.approx([0.0, 0.0, -0.5, 0.0], rel=1e-12)]
    assert jump == pytest.approx([0.0, 0.125, -0.5, 0.25], rel=1e-12)


def test_all_at_rest_have_no_solution_of_their_own():
    assert contacts([0, 1]).solve(-np.ones(4), 0.0, None, 1.0, 0.0, no_rest) is None
