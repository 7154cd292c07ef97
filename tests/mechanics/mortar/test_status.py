"""The active set on springs: a row of independent gaps, solved by hand."""

import numpy as np
import pytest

from solver.mechanics.mortar.status import find_status, likely_closed
from solver.system.errors import SolveError


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


# Macro-elements of length 1 with gaps 0, 1, 2 … under a force that brings the bodies 2.5 nearer.
def test_the_guess_in_the_plane_is_the_force_over_the_stiffness():
    gap, area, eligible = np.arange(5.0), np.ones(5), np.full(5, True)
    assert likely_closed(gap, area, eligible, 2.5, 2).tolist() == [True] * 3 + [False] * 2


def test_the_guess_in_space_falls_with_the_size_of_the_contact():
    # On 1, 2, 3 … faces of area 1 the approach is 3, 2.12, 1.73, 1.5: the third face is out.
    gap, area, eligible = np.arange(5.0), np.ones(5), np.full(5, True)
    assert likely_closed(gap, area, eligible, 3.0, 3).tolist() == [True] * 2 + [False] * 3


def test_the_guess_starts_from_where_the_bodies_first_touch():
    area, eligible = np.ones(4), np.array([False, True, True, True])
    apart = np.array([0.0, 10.0, 11.0, 13.0])
    assert likely_closed(apart, area, eligible, 2.0, 2).tolist() == [False, True, True, False]
    overlapping = np.array([0.0, -10.0, -1.0, 3.0])
    assert likely_closed(overlapping, area, eligible, 2.0, 2).tolist() == [False, True, True, False]


def test_surfaces_that_touch_are_all_closed():
    assert likely_closed(np.zeros(9), np.ones(9), np.full(9, True), 1e-30, 3).all()
