"""The layer behind faces without cells, and the other parts that rigid bodies are made of."""

import doctest

import numpy as np
import pytest

from solver.mechanics.fem import bodies, layer, supports

ABOVE = np.array([[0.0, 0.0, 5.0, 0.0, 0.0, -1.0]])


@pytest.mark.parametrize("module", [bodies, layer, supports])
def test_examples(module):
    result = doctest.testmod(module)
    assert result.attempted
    assert not result.failed


def strip(twisted):
    """A band of five quadrangles around the z axis, with a half turn or without."""
    angle = 2 * np.pi * np.arange(5) / 5
    ring = np.c_[np.cos(angle), np.sin(angle), np.zeros(5)]
    points = np.vstack([ring, 2 * ring])
    i, j = np.arange(5), (np.arange(5) + 1) % 5
    faces = np.c_[i, j, j + 5, i + 5]
    if twisted:
        faces[4] = [4, 5, 0, 9]
    return points, {"QUAD4": faces}


def test_a_surface_with_one_side_cannot_be_turned():
    assert layer.turned(*strip(twisted=True), ABOVE) is None


def test_faces_around_a_hole_are_turned_to_the_slave():
    points, faces = strip(twisted=False)
    faces["QUAD4"][1::2] = faces["QUAD4"][1::2, ::-1]
    turned = layer.turned(points, faces, ABOVE)["QUAD4"]
    corner = points[turned]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 3] - corner[:, 0])
    assert (normal[:, 2] > 0).all()
    more, cells = layer.layer(points, {"QUAD4": turned})
    # A tenth of the shortest first edge, here from radius 1 to 2.
    assert more[:, 2] == pytest.approx(-0.1)
    assert cells["HEXA8"].shape == (5, 8)
