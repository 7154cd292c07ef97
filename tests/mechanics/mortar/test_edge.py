"""The edge of contact from the means of √ pressures, on any line of macro-elements."""

import numpy as np
import pytest

from solver.mechanics.mortar.edge import contact_edges

PLACES = np.array([0.0, 0.7, 1.5, 2.9, 3.8, 5.0])


def found(end: float, places=PLACES, closed=None, coverage=None, order=slice(None)):
    """Edges under √(end − x), given its means; by default closed where there is pressure."""
    reach = np.maximum(end - places, 0.0) ** 1.5
    length = np.diff(places)
    mean = -2 / 3 * np.diff(reach) / length
    closed = mean > 0 if closed is None else np.array(closed)
    chain = np.stack([np.arange(len(length)), np.arange(1, len(length) + 1)], axis=1)
    points = np.stack([3 + 0.6 * places, 0.8 * places], axis=1)
    coverage = np.ones(len(length)) if coverage is None else np.array(coverage)
    given = (chain[:, ::-1], length, coverage, mean, closed)
    return contact_edges(points, *(values[order] for values in given))


@pytest.mark.parametrize("end", [3.1, 3.79])
@pytest.mark.parametrize("order", [slice(None), [2, 4, 0, 3, 1]])
def test_the_edge_of_a_root_is_exact(end, order):
    edges = found(end, order=order)
    assert edges.better.tolist() == [True]
    assert edges.position == pytest.approx(np.array([[3 + 0.6 * end, 0.8 * end]]), rel=1e-12)
    assert edges.lengths[0, 0] == pytest.approx(end - 3.8, rel=1e-11)


def test_pressure_that_an_open_macro_element_hands_to_the_last_ones_is_counted():
    """The edge is in the open one; its force and that of the last one act on the one before."""
    end = 4.2
    reach = np.maximum(end - PLACES, 0.0) ** 1.5
    force = -2 / 3 * np.diff(reach)
    force[2] += force[4]
    force[4] = 0.0
    points = np.stack([PLACES, 0 * PLACES], axis=1)
    chain = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    length = np.diff(PLACES)
    edges = contact_edges(points, chain, length, np.ones(5), force / length, force > 0)
    assert edges.better.tolist() == [True]
    assert edges.position[0, 0] == pytest.approx(end, rel=1e-12)


def test_both_ends_of_a_half_ellipse():
    """Its root is one at its ends only: within 0.05 of a macro-element, twenty to a half-width."""
    n, h = 80, 0.05
    places = np.linspace(-2.0, 2.0, n + 1)
    x = np.clip(places, -1, 1)
    mean = np.diff(x * np.sqrt(1 - x**2) + np.arcsin(x)) / 2 / h
    points = np.stack([places, 0 * places], axis=1)
    chain = np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)
    edges = contact_edges(points, chain, np.full(n, h), np.ones(n), mean, mean > 1e-9)
    assert edges.better.all()
    assert np.sort(edges.position[:, 0]) == pytest.approx([-1, 1], abs=0.05 * h)
    assert edges.lower[:, 0] * edges.position[:, 0] == pytest.approx(1 - h / 4, abs=0.1 * h)


@pytest.mark.parametrize(
    "case",
    [
        {"closed": [False, False, True, True, False]},  # two closed ones only
        {"coverage": [1, 1, 1, 0.9, 1]},  # the master ends below the last one
        {"coverage": [1, 1, 1, 1, 0]},  # and here at its end
    ],
)
def test_elsewhere_it_is_known_to_a_macro_element(case):
    edges = found(3.5, **{"closed": [True, True, True, True, False]} | case)
    assert not edges.better.any()
    [at, low, high] = edges.lengths[edges.macro.argmax()]
    assert at == 0
    assert low == pytest.approx(-0.9)
    free = 0.0 if case.get("coverage", [1])[-1] == 0 else 1.2
    assert high == pytest.approx(free)


def test_a_pressure_that_ends_by_a_jump_has_no_such_edge():
    """Constant up to the end: the form would go far beyond the open one."""
    chain = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    points = np.stack([PLACES, 0 * PLACES], axis=1)
    mean = np.array([1.0, 1.0, 1.0, 1.0, 0.0])
    edges = contact_edges(points, chain, np.diff(PLACES), np.ones(5), mean, mean > 0)
    assert edges.better.tolist() == [False]


def test_there_is_none_where_all_are_closed():
    assert len(found(9.0).better) == 0
