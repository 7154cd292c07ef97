"""The active set on springs: a row of independent gaps, solved by hand; and its fallback."""

import doctest
from itertools import product

import numpy as np
import pytest

from solver.lac import status
from solver.lac.errors import SolveError
from solver.lac.status import Trial, complementary, find_status
from solver.simulation.equilibrium.constraints import likely_closed


def trial(pressure, gap, limit=1e-10):
    """What was found, with the same limit for all."""
    limits = np.full(len(pressure), limit)
    return Trial(pressure=pressure, gap=gap, pressure_limit=limits, gap_limit=limits)


def springs(push, stiffness=1.0, limit=1e-10):
    """Each point is pushed by `push` against its own stop: p = push where closed, else gap."""
    push = np.asarray(push, dtype=float)

    def solve(closed):
        gap = np.where(closed, 0.0, -push / stiffness)
        return trial(np.where(closed, push, 0.0), gap, limit)

    return solve


def not_needed():
    raise AssertionError("the quick search suffices")


def searched(solve, start, eligible=None, stiffness=not_needed):
    start = np.asarray(start)
    eligible = np.full(len(start), True) if eligible is None else eligible
    return find_status(solve, start, eligible, np.ones(len(start)), stiffness)


@pytest.mark.parametrize("start", [True, False])
def test_each_start_ends_where_pressure_and_gap_are_complementary(start):
    result = searched(springs([1.0, -2.0, 3.0, -0.5]), np.full(4, start))
    assert result.closed.tolist() == [True, False, True, False]
    assert result.iterations == 2
    assert result.changes == [2]


def test_a_right_start_takes_one_solve():
    result = searched(springs([1.0, 2.0]), [True, True])
    assert result.iterations == 1
    assert result.changes == []


def test_what_may_not_close_stays_open():
    eligible = np.array([True, False])
    assert searched(springs([1.0, 1.0]), eligible, eligible).closed.tolist() == [True, False]


@pytest.mark.parametrize("unit", [1e-12, 1e12])
def test_units_do_not_matter(unit):
    push = unit * np.array([1.0, -1e-3, 1e-13, -1e-13])
    result = searched(springs(push, unit, 1e-10 * unit), np.full(4, True))
    assert result.closed.tolist() == [True, False, True, True]


def test_without_any_scale_only_what_is_negative_changes():
    assert searched(springs([0.0, -1e-300], limit=0.0), [True, True]).closed.tolist() == [
        True,
        False,
    ]


def test_a_cycle_is_broken_by_single_changes():
    """Closing both opens both and the other way round; closing one alone is the solution."""

    def solve(closed):
        match closed.tolist():
            case [True, True]:
                return trial(np.array([-1.0, -2.0]), np.zeros(2))
            case [False, False]:
                return trial(np.zeros(2), np.array([-1.0, -2.0]))
            case [True, False]:
                return trial(np.array([1.0, 0.0]), np.array([0.0, 1.0]))
        return trial(np.array([0.0, -1.0]), np.array([-1.0, 0.0]))

    assert searched(solve, np.full(2, True)).closed.tolist() == [True, False]


def test_no_end_is_an_error_and_not_an_answer():
    def solve(closed):
        return trial(np.where(closed, -1.0, 0.0), np.where(closed, 0.0, -1.0))

    with pytest.raises(SolveError, match="did not settle"):
        searched(solve, np.full(3, True), stiffness=lambda: np.eye(3))


def test_a_search_that_shrinks_ring_by_ring_goes_on():
    """The second ring has one macro-element, fewer than each of the next nineteen."""
    rings = [30, 1, *range(20, 0, -1)]
    closed_before = (8 + np.cumsum(rings[::-1])[::-1]).tolist()

    def solve(closed):
        pressure, count = np.where(closed, 1.0, 0.0), int(closed.sum())
        if count in closed_before:
            ring = rings[closed_before.index(count)]
            pressure[count - ring : count] = -1.0
        return trial(pressure, np.where(closed, 0.0, 1.0))

    result = searched(solve, np.full(8 + sum(rings), True))
    assert result.changes == rings
    assert result.closed.sum() == 8


def test_no_more_close_at_once_than_are_closed_and_the_worst_first():
    """One holds all the load and sinks in; any other number that is closed holds what it should."""
    deep = np.where(np.arange(400) < 300, 1.0 + np.arange(400), -1.0)

    def solve(closed):
        return trial(np.where(closed, deep, 0.0), np.where(closed, 0.0, -deep))

    result = searched(solve, np.arange(400) == 0)
    assert result.changes == [50, 51, 102, 96]
    np.testing.assert_array_equal(result.closed, deep > 0)


def test_the_search_is_repeated_from_a_guess_before_the_complementarity_problem():
    """From all closed it alternates between halves; the guess is one step from the end."""
    even, count = np.arange(40) % 2 == 0, 40

    def solve(closed):
        if closed[:4].all():
            return trial(np.where(even, -1.0, 1.0), np.zeros(count))
        wrong = closed if closed.sum() >= 10 else np.zeros(count, dtype=bool)
        gap = np.where(~closed & (closed.sum() >= 10), -1.0, 1.0)
        return trial(np.where(wrong, -1.0, 1.0), np.where(closed, 0.0, gap))

    guess = np.arange(count) < 3
    start, all_may = np.full(count, True), np.full(count, True)
    found = find_status(solve, start, all_may, np.ones(count), not_needed, guess=lambda: guess)
    np.testing.assert_array_equal(found.closed, guess)
    assert found.iterations == len(found.changes) + 1 > 10
    with pytest.raises(AssertionError, match="suffices"):
        find_status(solve, start, all_may, np.ones(count), not_needed)


def stiff_blocks(seed, count=40):
    """Gaps that stiff beams couple, on soft springs: `solve`, and what gaps bring up.

    Forces at gaps x are W x + q; with the closed ones at zero, the open ones are without force.
    """
    rng = np.random.default_rng(seed)
    bend = np.diff(np.eye(count), n=2, axis=0)
    matrix = bend.T * 10.0 ** rng.uniform(0, 7, count - 2) @ bend + np.eye(count)
    force = 0.2 + np.sin(rng.uniform(0.2, 1.5) * np.arange(count) + rng.uniform(0, 6))

    def solve(closed):
        gap, free = np.zeros(count), ~closed
        gap[free] = np.linalg.solve(matrix[np.ix_(free, free)], -force[free])
        return trial(np.where(closed, matrix @ gap + force, 0.0), gap, 1e-9)

    return solve, matrix


def test_random_problems_all_end_with_pressure_and_gap_complementary():
    """Newton's steps alone leave many of them unsolved; the fallback ends all."""
    asked = []
    for seed in range(60):
        solve, matrix = stiff_blocks(seed)
        closed = searched(
            solve, np.full(40, True), stiffness=lambda m=matrix: asked.append(m) or m
        ).closed
        found = solve(closed)
        assert found.pressure.min() > -1e-9
        assert found.gap.min() > -1e-9
    assert asked


def test_a_body_that_is_let_go_is_caught_by_the_fallback():
    """Three points on a free beam, pulled at its ends: opening both at once leaves it loose.

    Opened by 1 at the first point alone, its forces are q + (1, −2, 1) = (0, 2, 1/2).
    """
    matrix = np.outer([1.0, -2.0, 1.0], [1.0, -2.0, 1.0])
    force = np.array([-1.0, 4.0, -0.5])

    def solve(closed):
        if closed.sum() < 2:
            raise SolveError("nothing keeps the beam")
        gap, free = np.zeros(3), ~closed
        gap[free] = np.linalg.solve(matrix[np.ix_(free, free)], -force[free])
        return trial(np.where(closed, matrix @ gap + force, 0.0), gap)

    result = searched(solve, np.full(3, True), stiffness=lambda: matrix)
    assert result.closed.tolist() == [False, True, True]


def test_a_body_that_nothing_presses_touches_one_of_two_stops():
    """It is 3 shorter than what is between them: fitted by tension, or free if it touches none."""
    matrix = np.ones((2, 2))

    def solve(closed):
        if not closed.any():
            raise SolveError("nothing keeps the body")
        pressure = np.full(2, -3.0 if closed.all() else 0.0)
        return trial(pressure, np.where(closed, 0.0, 3.0))

    result = searched(solve, np.full(2, True), stiffness=lambda: matrix)
    assert result.closed.sum() == 1


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


def test_contact_that_peels_off_row_by_row():
    """Each solve shows tension in the outermost closed one of 60 alone, until 3 are left."""

    def solve(closed):
        pressure = np.where(closed, 1.0, 0.0)
        if closed.sum() > 3:
            pressure[np.flatnonzero(closed)[-1]] = -1.0
        return trial(pressure, np.where(closed, 0.0, 1.0))

    result = searched(solve, np.full(60, True))
    assert np.flatnonzero(result.closed).tolist() == [0, 1, 2]
    assert result.iterations == 58


# Linear complementarity problems, solved by hand, by enumeration, and of random stiffness.


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
    with pytest.raises(SolveError, match="not positive semidefinite"):
        complementary(np.diag([1.0, -1e-9]), np.array([-1.0, -1.0]))


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
    assert doctest.testmod(status).failed == 0
