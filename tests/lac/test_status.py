"""The active set on springs: a row of independent gaps, solved by hand."""

import numpy as np
import pytest

from solver.errors import SolveError
from solver.lac.status import find_status


def springs(push, stiffness=1.0):
    """Each point is pushed by `push` against its own stop: p = push where closed, else gap."""
    push = np.asarray(push, dtype=float)

    def solve(closed):
        return np.where(closed, push, 0.0), np.where(closed, 0.0, -push / stiffness)

    return solve


@pytest.mark.parametrize("start", [True, False])
def test_each_start_ends_where_pressure_and_gap_are_complementary(start):
    push = np.array([1.0, -2.0, 3.0, -0.5])
    result = find_status(springs(push), np.full(4, start), np.full(4, True), 1.0, 1.0)
    assert result.closed.tolist() == [True, False, True, False]
    assert result.iterations == 2
    assert result.changes == [2]


def test_a_right_start_takes_one_solve():
    result = find_status(springs([1.0, 2.0]), np.full(2, True), np.full(2, True), 1.0, 1.0)
    assert result.iterations == 1
    assert result.changes == []


def test_what_may_not_close_stays_open():
    eligible = np.array([True, False])
    result = find_status(springs([1.0, 1.0]), eligible, eligible, 1.0, 1.0)
    assert result.closed.tolist() == [True, False]


@pytest.mark.parametrize("unit", [1e-12, 1e12])
def test_units_do_not_matter(unit):
    push = unit * np.array([1.0, -1e-3, 1e-13, -1e-13])
    result = find_status(springs(push, unit), np.full(4, True), np.full(4, True), unit, 1.0)
    assert result.closed.tolist() == [True, False, True, True]


def test_a_cycle_is_broken_by_single_changes():
    """Closing both opens both and the other way round; closing one alone is the solution."""

    def solve(closed):
        match closed.tolist():
            case [True, True]:
                return np.array([-1.0, -2.0]), np.zeros(2)
            case [False, False]:
                return np.zeros(2), np.array([-1.0, -2.0])
            case [True, False]:
                return np.array([1.0, 0.0]), np.array([0.0, 1.0])
        return np.array([0.0, -1.0]), np.array([-1.0, 0.0])

    result = find_status(solve, np.full(2, True), np.full(2, True), 1.0, 1.0)
    assert result.closed.tolist() == [True, False]


def test_no_end_is_an_error_and_not_an_answer():
    def solve(closed):
        return np.where(closed, -1.0, 0.0), np.where(closed, 0.0, -1.0)

    with pytest.raises(SolveError, match="did not settle"):
        find_status(solve, np.full(3, True), np.full(3, True), 1.0, 1.0)
