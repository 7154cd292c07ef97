"""Curved surfaces laid flat: arcs and angles by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from solver.report.unrolled import laid_flat


def zone(centre, normal, pressed=None):
    pressed = np.ones(len(centre)) if pressed is None else pressed
    return SimpleNamespace(centre=centre, normal=normal, multiplier=pressed)


def around_z(degrees, radius=2.0, at=(10.0, 5.0)):
    """Points on a cylinder around z at heights 0 and 3, and the directions away from its axis."""
    angle = np.repeat(np.radians(degrees), 2)
    out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])
    height = np.tile([0.0, 3.0], len(degrees))
    points = radius * out + [*at, 0.0]
    points[:, 2] = height
    return points, out


@pytest.mark.parametrize("sign", [1, -1], ids=["pin", "hole"])
def test_a_cylinder_is_unrolled(sign):
    """Its middle is at 90°: there the arc is zero; of 45° on a radius of 2 it is π/2."""
    points, out = around_z([45, 90, 135])
    flat = laid_flat(zone(points, sign * out))
    assert flat.names == ("arc around z", "z")
    half = np.pi / 2
    expected = [[-half, 0], [-half, 3], [0, 0], [0, 3], [half, 0], [half, 3]]
    np.testing.assert_allclose(flat.plan(points), expected, atol=1e-12)
    np.testing.assert_allclose(flat.profile(points), [-45, -45, 0, 0, 45, 45], atol=1e-10)
    assert flat.profile_name == "angle around z from the middle of the contact, degrees"


def test_two_faces_tell_their_axis_too():
    points, out = around_z([45])
    out[1] = [np.cos(np.radians(135)), np.sin(np.radians(135)), 0.0]
    points[1] = 2.0 * out[1] + [10.0, 5.0, 3.0]
    assert laid_flat(zone(points, out)).names == ("arc around z", "z")


def test_only_what_is_pressed_counts_for_the_middle():
    points, out = around_z([0, 45, 90, 180])
    flat = laid_flat(zone(points, out, np.repeat([0.0, 1.0, 1.0, 0.0], 2)))
    np.testing.assert_allclose(flat.profile(points[::2]), [-67.5, -22.5, 22.5, 112.5], atol=1e-10)


def test_faces_over_the_cut_of_a_ring_are_left_out():
    points, out = around_z(np.arange(0, 360, 30))
    flat = laid_flat(zone(points, out))
    faces = np.array([[0, 2], [10, 12], [12, 14]])  # 0° to 30°, 150° to 180°, 180° to 210°
    places = flat.plan(points)[faces]
    assert flat.whole(places).sum() == 2
    assert flat.around == pytest.approx(4 * np.pi)


def test_a_sphere_is_seen_from_its_pole():
    """The middle of four points at 30° around z is z; their arcs are π/6 times the radius."""
    a, r = np.radians(30), 4.0
    out = np.array(
        [[np.sin(a) * c, np.sin(a) * s, np.cos(a)] for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    )
    points = r * out + [1.0, 2.0, 3.0]
    flat, arc = laid_flat(zone(points, out)), r * a
    expected = [[arc, 0], [0, arc], [-arc, 0], [0, -arc]]
    np.testing.assert_allclose(flat.plan(points), expected, atol=1e-12)
    np.testing.assert_allclose(flat.profile(points), 30, atol=1e-10)


@pytest.mark.parametrize("lean", [0.0, 5.0])
def test_a_surface_that_hardly_bends_is_seen_along_its_normal(lean):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]])
    angle = np.radians([-lean, lean, lean, -lean])
    normal = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    flat = laid_flat(zone(points, normal))
    np.testing.assert_allclose(flat.plan(points), points[:, :2], atol=1e-12)
    assert (flat.names, flat.profile_name) == (("x", "y"), "x")


def test_other_surfaces_are_seen_along_their_mean_normal():
    """A saddle has no axis and no middle."""
    x, y = (v.ravel() for v in np.mgrid[-1:1:5j, -1:1:5j])
    normal = np.column_stack([-2 * x, 2 * y, np.ones(25)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    flat = laid_flat(zone(np.column_stack([x, y, x * x - y * y]), normal))
    assert flat.names == ("x", "y")
