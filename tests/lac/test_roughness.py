"""Quadrics behind facets: normals by hand."""

import numpy as np
import pytest

from solver.lac.roughness import _quadric


def rings(radius, count=7, tall=5.0):
    """Points of a surface of revolution of radius(z), in rings that are turned from each other."""
    around = np.arange(12) * np.pi / 6
    found = []
    for k, z in enumerate(np.linspace(0, tall, count)):
        angle, r = around + 0.2 * k, radius(z)
        found.append(np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * angle + z]))
    return np.concatenate(found)


TURNED = np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 + np.eye(3))[0]


@pytest.mark.parametrize(
    ("points", "normal", "digits"),
    [
        (rings(lambda z: np.sqrt(9 - (z - 2.5) ** 2)), lambda p: p - [0, 0, 2.5], 1e-9),
        (rings(lambda z: 10.0), lambda p: p * [1, 1, 0], 1e-9),
        (rings(lambda z: 10.0, count=2), lambda p: p * [1, 1, 0], 1e-9),
        (rings(lambda z: 1 + 0.1 * z), lambda p: p * [1, 1, 0] - [0, 0, 0.1] * at_axis(p), 1e-9),
    ],
    ids=["sphere", "cylinder", "cylinder of two rings", "cone"],
)
def test_normals_of_quadrics(points, normal, digits):
    """Also inside the surface, on any axes, far from the origin."""
    places = 0.9 * points + [0, 0, 0.1 * 2.5]
    exact = normal(places)
    exact = exact / np.linalg.norm(exact, axis=1)[:, None]
    facets = exact + 0.1 * (-1.0) ** np.arange(len(exact))[:, None] * [0, 0, 1]
    quadric = _quadric(points @ TURNED.T + 100, places @ TURNED.T + 100, facets @ TURNED.T)
    found = quadric(places @ TURNED.T + 100) @ TURNED
    found *= np.sign((found * exact).sum(axis=1))[:, None]
    assert np.abs(found - exact).max() < digits


def at_axis(points):
    """What a cone's gradient has along its axis, by the radius where its axis is cut: 1 + 0.1 z."""
    return 1 + 0.1 * points[:, 2:]


@pytest.mark.parametrize(
    "points",
    [
        rings(lambda z: 3 + 0.1 * np.sin(z)),
        np.column_stack([*np.mgrid[:6, :6].reshape(2, -1), np.sin(np.arange(36) // 6 * 1.5)]),
        rings(lambda z: 10.0)[:10],
    ],
    ids=["vase", "wave", "ten points"],
)
def test_other_surfaces_are_no_quadrics(points):
    assert _quadric(points, points[:3], np.eye(3)) is None


def test_a_plane_that_rounding_bends_is_one():
    """Coordinates stored to 1e-8 tilt faces; a plane is on as many quadrics as there are others."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.random((30, 2)), 1e-8 * rng.standard_normal(30)])
    found = _quadric(points @ TURNED.T, points[:3], np.eye(3))(np.zeros((2, 3)))
    level = TURNED @ [0.0, 0.0, 1.0]
    assert np.abs(np.abs(found @ level) - 1).max() < 1e-12
