"""Clipping of convex polygons: areas known by hand, and properties on random polygons."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.lac.clipping import clip, overlap, quadrature, triangles
from solver.lac.regions import Regions, clip_to_face

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def convex(seed, size, offset=(0.0, 0.0)):
    """A convex polygon of 3 to 6 vertices, counter-clockwise."""
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 7)))
    return size * np.column_stack([np.cos(angles), np.sin(angles)]) + offset


def area_and_moment(polygon, window):
    clipped, count = clip(polygon[None], np.array([len(polygon)]), window[None])
    _, corner, area = triangles(clipped, count)
    return area.sum(), (area[:, None] * corner.mean(axis=1)).sum(axis=0)


def cut_in_pieces(polygon):
    """The polygon's two parts on either side of its first diagonal."""
    return polygon[: len(polygon) - 1], polygon[[0, -2, -1]]


def test_overlapping_squares():
    area, moment = area_and_moment(SQUARE + np.array([0.5, 0.25]), SQUARE)
    assert area == pytest.approx(0.375, rel=1e-15)
    assert moment == pytest.approx(0.375 * np.array([0.75, 0.625]), rel=1e-15)


def test_triangle_in_a_square_and_around_it():
    triangle = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75]])
    assert area_and_moment(triangle, SQUARE)[0] == pytest.approx(0.125, rel=1e-15)
    around = np.array([[-5.0, -5.0], [20.0, -5.0], [-5.0, 20.0]])
    assert area_and_moment(around, SQUARE)[0] == pytest.approx(1.0, rel=1e-15)


def test_polygons_apart_or_touching_have_no_common_area():
    assert area_and_moment(SQUARE + np.array([2.0, 0.0]), SQUARE)[0] == 0
    assert area_and_moment(SQUARE + np.array([1.0, 0.0]), SQUARE)[0] == 0


@pytest.mark.parametrize("shift", [1e-15, 1e-12, 1e-9, 1e-3])
def test_slivers_are_kept(shift):
    left = area_and_moment(SQUARE + np.array([shift, 0.0]), SQUARE)[0]
    right = area_and_moment(SQUARE + np.array([shift - 1.0, 0.0]), SQUARE)[0]
    assert left + right == pytest.approx(1.0, abs=1e-15)
    assert right == pytest.approx(shift, abs=2e-16)
    assert right > 0


@pytest.mark.parametrize("noise", [1e-15, 1e-12, 1e-10, 1e-8])
def test_edges_that_are_straight_but_for_rounding_have_no_common_area(noise):
    """A triangle on a square, with middles of edges that are not half-way."""
    rng = np.random.default_rng(1)

    def rounded(corners, n=400):
        chord = np.roll(corners, -1, axis=0) - corners
        bulge = 0.2 * rng.uniform(-1, 1, (n, len(corners), 1)) * chord
        return (a + noise * rng.uniform(-1, 1, bulge.shape) for a in (corners, bulge))

    start, bulge = rounded(np.array([[0.0, 1.0], [1.0, 1.0], [0.3, 1.9]]))
    triangle = Regions(start=start, bulge=bulge, count=np.full(len(start), 3))
    for _, part in clip_to_face(triangle, *rounded(SQUARE)):
        for _, points, weights in quadrature(part, 2):
            assert np.abs(weights.sum(axis=1)).max(initial=0.0) < 5 * noise + 1e-15
            assert np.abs(points).max(initial=0.0) < 2


seeds = st.integers(0, 10_000)
offsets = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))


@given(seeds, seeds, offsets)
def test_intersection_does_not_depend_on_the_order(a, b, offset):
    first, second = convex(a, 1.0), convex(b, 0.8, offset)
    one, other = area_and_moment(first, second), area_and_moment(second, first)
    assert one[0] == pytest.approx(other[0], abs=1e-14)
    assert one[1] == pytest.approx(other[1], abs=1e-14)


@given(seeds, seeds, offsets)
def test_parts_of_a_polygon_add_up(a, b, offset):
    polygon, window = convex(a, 1.0), convex(b, 0.8, offset)
    if len(polygon) < 4:
        return
    whole = area_and_moment(polygon, window)
    parts = [area_and_moment(part, window) for part in cut_in_pieces(polygon)]
    assert sum(p[0] for p in parts) == pytest.approx(whole[0], abs=1e-14)
    assert sum(p[1] for p in parts) == pytest.approx(whole[1], abs=1e-14)


@given(seeds, seeds, offsets, st.floats(0, 7))
def test_rotation_changes_nothing(a, b, offset, angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    first, second = convex(a, 1.0), convex(b, 0.8, offset)
    before, moment = area_and_moment(first, second)
    after, turned = area_and_moment(first @ turn.T, second @ turn.T)
    assert after == pytest.approx(before, abs=1e-14)
    assert turned == pytest.approx(turn @ moment, abs=1e-14)


def test_many_at_once_equal_one_by_one():
    polygons = np.array([SQUARE + np.array([0.1 * k, 0.05 * k]) for k in range(25)])
    windows = np.array([SQUARE] * 25)
    clipped, count = clip(polygons, np.full(25, 4), windows)
    which, _, area = triangles(clipped, count)
    together = np.bincount(which, area, minlength=25)
    alone = [area_and_moment(p, SQUARE)[0] for p in polygons]
    assert together == pytest.approx(alone, abs=1e-15)


def test_intervals():
    ends, length = overlap(np.array([[0.0, 2.0], [0.0, 1.0]]), np.array([[1.0, 3.0], [1.5, 2.0]]))
    assert ends[0].tolist() == [1.0, 2.0]
    assert length.tolist() == [1.0, -0.5]
