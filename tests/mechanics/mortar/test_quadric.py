"""Rigid surfaces without a mesh: distances along lines, found by hand."""

import numpy as np
import pytest

from solver.mechanics.mortar.quadric import ball, cylinder, parabola, plane

X, Y, Z = np.eye(3)
ROOT = np.sqrt(3.0)


@pytest.mark.parametrize(
    ("surface", "place", "normal", "distance"),
    [
        (plane(2 * Z, -Z), [5, 0, 0], Z, 2.0),
        (plane(2 * Z, -Z), [5, 0, 3], Z, -1.0),  # within the body
        (plane(2 * Z, -Z), [0, 0, 0], (X + ROOT * Z) / 2, 4 / ROOT),  # at 30 degrees
        (ball(3 * Z, 2.0), [1, 0, 0], Z, 3 - ROOT),
        (ball(3 * Z, 2.0), [0, 0, 1.5], Z, -0.5),
        (ball(0 * Z, 2.0, hollow=True), [1, 0, 0], Z, ROOT),
        (ball(0 * Z, 2.0, hollow=True), [1, 0, -1], -Z, ROOT - 1),
        (cylinder(3 * Z, 5 * Y, 2.0), [1, 7, 0], Z, 3 - ROOT),
        (cylinder(0 * Z, Y, 2.0, hollow=True), [1, -4, 0], Z, ROOT),
        (parabola(Z, -Z, 2.0), [1, 2, 0], Z, 1 + 5 / 4),
        (parabola(Z, -Z, 2.0, hollow=True), [1, 2, 0], Z, 1 - 5 / 4),
        # −1 + t = (2 − t)²
        (parabola(0 * Z, -X, 0.5), [-1, 2, 0], (X - Y) / np.sqrt(2), (5 - np.sqrt(5)) / np.sqrt(2)),
    ],
)
def test_distances(surface, place, normal, distance):
    found, there = surface.distance(np.array(place, dtype=float), normal)
    assert there
    assert found == pytest.approx(distance, abs=1e-14)
    out = surface.gradient(place + found * normal)
    assert out @ normal < 0
    if surface.level:
        assert np.linalg.norm(out) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("surface", "place", "normal"),
    [
        (plane(2 * Z, -Z), [5, 0, 0], -Z),  # looks away
        (plane(2 * Z, -Z), [5, 0, 0], X),  # looks along it
        (ball(3 * Z, 2.0), [2.1, 0, 0], Z),  # past it
        (ball(3 * Z, 2.0), [1, 0, 0], -Z),
        (cylinder(3 * Z, Y, 2.0), [0, 0, 0], Y),
        (ball(0 * Z, 2.0), [0, 0, 1], Z),  # within the body, looking out
    ],
)
def test_some_places_do_not_see_the_surface(surface, place, normal):
    found, there = surface.distance(np.array(place, dtype=float), normal)
    assert (found, there) == (0.0, False)
