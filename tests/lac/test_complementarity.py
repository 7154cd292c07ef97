"""Linear complementarity problems, solved by hand, by enumeration, and of random stiffness."""

import doctest
from itertools import product

import numpy as np
import pytest

from solver.lac import status as complementarity
from solver.lac.errors import SolveError
from solver.lac.status import complementary


def conditions(matrix, force, x):
    """The largest violation of x ≥ 0, W x + q ≥ 0 and x (W x + q) = 0, in units of 1."""
    slope = matrix @ x + force
    size = np.abs(matrix) @ np.abs(x) + np.abs(force)
    return max((-x).max(initial=0.0), (-slope / size).max(), np.abs(x * slope / size).max())


def enumerated(matrix, force):
    """The unknowns that are free, by trial of all 2^k sets."""
    for free in product([False, True], repeat=len(force)):
        free, x = np.array(free), np.zeros(len(force))
        x[free] = np.linalg.solve(matrix[np.ix_(free, free)], -force[free])
        if (x >= 0).all() and (matrix @ x + force >= -1e-12).all():
            return free
    raise AssertionError("no set fulfils the conditions")


def test_two_unknowns_by_hand():
    """Alone each would be 1; coupled by 1/2, x₁ = 1 leaves 1/2 − 1/2 = 0 for the second."""
    matrix = np.array([[1.0, 0.5], [0.5, 1.0]])
    assert complementary(matrix, np.array([-1.0, -0.5])) == pytest.approx([1.0, 0.0], abs=1e-12)
    assert complementary(matrix, np.array([-1.0, -1.0])) == pytest.approx([2 / 3, 2 / 3])
    assert complementary(matrix, np.array([1.0, 0.0])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("seed", range(20))
def test_random_problems_end_at_the_set_that_enumeration_finds(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(8, 8))
    matrix, force = root @ root.T, rng.normal(size=8)
    assert ((complementary(matrix, force) > 0) == enumerated(matrix, force)).all()


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("unit", [1e-15, 1.0, 1e15])
def test_stiffness_over_many_orders_of_magnitude(seed, unit):
    """Strings of springs of 1 … 1e6 with bending, each gap seen on its own scale."""
    rng = np.random.default_rng(seed)
    n = 120
    bend = np.diff(np.eye(n), n=2, axis=0)
    matrix = unit * ((bend.T * 10.0 ** rng.uniform(0, 6, n - 2)) @ bend + np.eye(n))
    force = unit * rng.normal(size=n).cumsum()
    assert conditions(matrix, force, complementary(matrix, force)) < 1e-9


def test_a_motion_that_nothing_resists_ends_where_it_is_stopped():
    """Both gaps open together without any force until q₃ holds the sum: W has rank two."""
    rows = np.array([[1.0, -1.0, 0.0], [1.0, 0.0, -1.0]])
    matrix, force = rows.T @ rows, np.array([-1.0, -1.0, 2.0])
    x = complementary(matrix, force)
    assert conditions(matrix, force, x) < 1e-6
    assert x[2] == pytest.approx(0.0, abs=1e-6)


def test_a_stiffness_with_a_negative_motion_is_refused():
    with pytest.raises(SolveError, match="not positive semidefinite"):
        complementary(np.array([[1.0, 2.0], [2.0, 1.0]]), np.array([-1.0, -1.0]))


def test_the_example_of_its_docstring():
    assert doctest.testmod(complementarity).failed == 0
