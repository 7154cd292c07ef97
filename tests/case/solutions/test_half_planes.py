"""Half-planes in contact: equilibrium, Hooke's law, conditions of contact, published formulas."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from solver.case.material import Material
from solver.case.solutions.base import ParameterError
from solver.case.solutions.hertz import HertzCylinder
from solver.case.solutions.pressed import (
    ContactEdge,
    HertzHalfPlanes,
    PartialWaves,
    RoundedPunch,
    Wedge,
)
from tests.case.solutions.test_elastic import derivative

SOFT, HARD = Material(2000.0, 0.3), Material(70000.0, 0.2)
BOTH = {"bottom": SOFT, "top": HARD}
MODULUS = 1 / (0.91 / 2000 + 0.96 / 70000)
EDGE = ContactEdge(edge=0.3, factor=5.0, **BOTH)
WAVES = PartialWaves(size=1.0, amplitude=0.01, mean_pressure=12.0, **BOTH)
HERTZ = HertzHalfPlanes(end=0.4, radius=3.0, **BOTH)
PUNCH = RoundedPunch(end=0.5, flat=0.2, radius=3.0, **BOTH)
WEDGE = Wedge(end=0.5, slope=0.02, **BOTH)
ALL = [EDGE, WAVES, HERTZ, PUNCH, WEDGE]
each = pytest.mark.parametrize("solution", ALL, ids=lambda solution: solution.name)
both = pytest.mark.parametrize("part", [0, 1])


def inside(part: int) -> np.ndarray:
    """Points (20, 2) inside a part."""
    x = np.random.default_rng(part).uniform(-0.9, 0.9, (20, 2))
    x[:, 1] = (1 if part else -1) * np.abs(x[:, 1])
    return x


def on_interface(count: int = 96) -> np.ndarray:
    """Places along the interface: neither an end of contact nor a tip."""
    return np.c_[np.linspace(-0.967, 0.969, count), np.zeros(count)]


@both
@each
def test_the_gradient_is_that_of_the_displacement(solution, part):
    x = inside(part)
    found = derivative(lambda y: solution.displacement(y, part), x, 1e-6)
    expected = solution.gradient(x, part)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


@both
@each
def test_a_moved_solution_has_the_same_values_further_along(solution, part):
    moved, x, further = solution.moved(2.5), inside(part), np.array([2.5, 0.0])
    for name in ("displacement", "gradient", "stress"):
        expected = getattr(solution, name)(x, part)
        found = getattr(moved, name)(x + further, part)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    places = on_interface()
    for name in ("contact_pressure", "gap", "regular"):
        expected = getattr(solution, name)(places)
        found = getattr(moved, name)(places + further)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_one_body_may_be_rigid_and_not_both():
    rigid = Material(np.inf, 0.0)
    one = replace(HERTZ, top=rigid)
    assert one.modulus == pytest.approx(2000 / 0.91)
    with pytest.raises(ParameterError, match="top"):
        replace(HERTZ, bottom=rigid, top=rigid)


@both
@each
def test_the_stress_is_in_equilibrium(solution, part):
    def tensor(y):
        return solution.stress(y, part)[:, [0, 3, 3, 1]].reshape(-1, 2, 2)

    x = inside(part)
    divergence = np.einsum("nijj->ni", derivative(tensor, x, 1e-6))
    np.testing.assert_allclose(divergence, 0.0, atol=2e-7 * np.abs(tensor(x)).max())


@each
def test_the_conditions_of_contact(solution):
    """Pressed or open; the same pressure from both sides, no shear; u₂ − u₁ = g − g₀."""
    x = on_interface()
    pressure, gap, closed = solution.contact_pressure(x), solution.gap(x), solution.closed(x[:, 0])
    assert 10 < np.count_nonzero(closed) < 90
    assert np.array_equal(pressure > 0, closed)
    assert np.array_equal(gap > 0, ~closed)
    for part in (0, 1):
        stress = solution.stress(x, part)
        np.testing.assert_allclose(stress[:, 1], -pressure, atol=1e-11)
        np.testing.assert_array_equal(stress[:, 3], 0.0)
    jump = (solution.displacement(x, 1) - solution.displacement(x, 0))[:, 1]
    np.testing.assert_allclose(solution.initial_gap(x[:, 0]) + jump, gap, atol=1e-15)


@both
@each
def test_in_3d_the_second_axis_is_that_of_a_plane_state(solution, part):
    """x, z for x, y; no strain along y, and σ_yy = ν (σ_xx + σ_zz)."""
    solid, plane = replace(solution, dim=3), inside(part)
    x = np.c_[plane[:, 0], np.linspace(-5, 5, len(plane)), plane[:, 1]]
    along = [0, 2]
    moved, slope = solid.displacement(x, part), solid.gradient(x, part)
    np.testing.assert_array_equal(moved[:, along], solution.displacement(plane, part))
    np.testing.assert_array_equal(slope[:, along][:, :, along], solution.gradient(plane, part))
    assert not moved[:, 1].any()
    assert not slope[:, 1].any()
    assert not slope[:, :, 1].any()
    xx, yy, zz, xy, yz, xz = solid.stress(x, part).T
    expected = solution.stress(plane, part)
    np.testing.assert_allclose(np.c_[xx, zz, yy, xz], expected[:, :4], atol=1e-10)
    np.testing.assert_allclose(yy, solid.materials[part].poisson * (xx + zz), atol=1e-10)
    assert not xy.any()
    assert not yz.any()
    flat = x * [1, 1, 0]
    for known in ("contact_pressure", "gap"):
        same = getattr(solution, known)(plane * [1, 0])
        np.testing.assert_array_equal(getattr(solid, known)(flat), same)


@pytest.mark.parametrize("solution", ALL[1:], ids=lambda solution: solution.name)
@both
def test_symmetry(solution, part):
    """The middle plane stays where it is and has no shear; the left side mirrors the right one."""
    y = (1 if part else -1) * np.linspace(0.0, 2.0, 9)
    middle = np.c_[0 * y, y]
    np.testing.assert_allclose(solution.displacement(middle, part)[:, 0], 0.0, atol=1e-14)
    np.testing.assert_allclose(solution.stress(middle, part)[:, 3], 0.0, atol=1e-11)
    x = inside(part)
    mirrored = solution.displacement(x * [-1, 1], part) * [-1, 1]
    np.testing.assert_allclose(solution.displacement(x, part), mirrored, atol=1e-14)


def test_the_edge():
    """p = C √ξ before the end, g = 4 C ξ^{3/2}/(3 E*) behind it."""
    x = np.array([[0.05, 0.0], [0.34, 0.0]])
    assert EDGE.contact_pressure(x) == pytest.approx([5 * 0.5, 0.0], rel=1e-14)
    assert EDGE.gap(x) == pytest.approx([0.0, 20 / (3 * MODULUS) * 0.04**1.5], rel=1e-12)


def test_waves_by_westergaard():
    x = np.linspace(0.01, 0.99, 33)
    s = np.sqrt(12 / (np.pi * MODULUS * 0.01 / 2))
    sine, cosine = np.sin(np.pi * x / 2), np.cos(np.pi * x / 2)
    share = np.sqrt(np.abs(s**2 - sine**2))
    pressure = np.where(sine < s, 24 * cosine / s**2 * share, 0)
    gap = 0.02 * (sine * share - s**2 * np.log((sine + share) / s)) * (sine > s)
    place = np.c_[x, 0 * x]
    assert WAVES.half_width == pytest.approx(2 / np.pi * np.arcsin(s), rel=1e-14)
    np.testing.assert_allclose(WAVES.contact_pressure(place), pressure, atol=1e-11)
    np.testing.assert_allclose(WAVES.gap(place), gap, atol=1e-15)
    # Their sides are symmetry planes: no shear, the same normal displacement along each.
    side = np.c_[np.ones(5), np.linspace(-0.9, -0.1, 5)]
    np.testing.assert_allclose(WAVES.stress(side, 0)[:, 3], 0.0, atol=1e-12)
    assert np.ptp(WAVES.displacement(side, 0)[:, 0]) < 1e-15


def test_lightly_pressed_waves_are_hertz_contacts():
    """Crests of the radius λ²/(4π² Δ), each under p̄ λ (Johnson, §13.2)."""
    light = PartialWaves(size=1.0, amplitude=0.01, mean_pressure=1e-5, **BOTH)
    crest = HertzCylinder(radius=1 / (np.pi**2 * 0.01), force=2e-5, lower=SOFT, upper=HARD)
    assert light.half_width == pytest.approx(crest.half_width, rel=1e-6)
    assert light.peak == pytest.approx(crest.peak, rel=1e-6)


def test_hertz_by_its_theory():
    theory = HertzCylinder(radius=3.0, force=HERTZ.force, lower=SOFT, upper=HARD)
    x = on_interface()
    assert (theory.half_width, theory.peak) == pytest.approx((0.4, HERTZ.peak), rel=1e-14)
    np.testing.assert_allclose(HERTZ.contact_pressure(x), theory.contact_pressure(x), atol=1e-11)
    # Largest shear stress 0.3 p₀ at the depth 0.786 a (Johnson, §4.2a)
    depth = np.c_[np.zeros(400), -np.linspace(0.2, 0.5, 400)]
    stress = HERTZ.stress(depth, 0)
    shear = np.abs(stress[:, 0] - stress[:, 1]) / 2
    assert shear.max() == pytest.approx(0.300 * HERTZ.peak, rel=2e-3)
    assert depth[shear.argmax(), 1] == pytest.approx(-0.786 * 0.4, rel=5e-3)


def test_the_punch_by_ciavarella_hills_and_monno():
    a, b, start = 0.5, 0.2, np.arcsin(0.4)
    x = np.linspace(0.01, 0.49, 30)
    phi, whole = np.arcsin(x / a), np.pi - 2 * start - np.sin(2 * start)
    force = MODULUS * a**2 * whole / (4 * 3.0)
    terms = (
        (np.pi - 2 * start) * np.cos(phi)
        + np.sin(phi) * np.log(np.abs(np.sin(phi + start) / np.sin(phi - start)))
        + np.sin(start) * np.log(np.abs(np.tan((phi + start) / 2) * np.tan((phi - start) / 2)))
    )
    expected = 2 * force / (np.pi * a * whole) * terms
    np.testing.assert_allclose(PUNCH.contact_pressure(np.c_[x, 0 * x]), expected, rtol=1e-12)
    assert PUNCH.force == pytest.approx(force, rel=1e-14)
    at_the_shoulder = PUNCH.contact_pressure(np.array([[b, 0.0], [b - 1e-9, 0.0]]))
    assert at_the_shoulder[0] == pytest.approx(at_the_shoulder[1], rel=1e-7)
    sharp = RoundedPunch(end=0.5, flat=1e-9, radius=3.0, **BOTH)
    parabola = HertzHalfPlanes(end=0.5, radius=3.0, **BOTH)
    x = inside(0)
    np.testing.assert_allclose(sharp.stress(x, 0), parabola.stress(x, 0), atol=1e-5)


def test_the_wedge():
    """p = (E* m/π) arcosh(a/|x|), finite even at a node on its tip."""
    x = np.c_[np.linspace(0.01, 0.49, 9), np.zeros(9)]
    expected = MODULUS * 0.02 / np.pi * np.arccosh(0.5 / x[:, 0])
    np.testing.assert_allclose(WEDGE.contact_pressure(x), expected, rtol=1e-12)
    assert np.isfinite(WEDGE.gradient(np.zeros((1, 2)), 1)).all()
    np.testing.assert_allclose(WEDGE.displacement(np.zeros((1, 2)), 1)[:, 1], 0.0, atol=1e-15)


@pytest.mark.parametrize("solution", [HERTZ, PUNCH, WEDGE], ids=lambda solution: solution.name)
def test_force_and_second_moment(solution):
    def pressure(x):
        return float(solution.contact_pressure(np.array([[x, 0.0]]))[0])

    points = [0.2] if solution is PUNCH else None
    force, moment = (
        2 * quad(lambda x, n=n: pressure(x) * x**n, 0, solution.half_width, points=points)[0]
        for n in (0, 2)
    )
    assert force == pytest.approx(solution.force, rel=1e-8)
    assert moment / force == pytest.approx(solution.moment * solution.half_width**2, rel=1e-8)


@pytest.mark.parametrize("solution", ALL[1:], ids=lambda solution: solution.name)
def test_the_half_width_is_found_again(solution):
    """By Gauss–Chebyshev points of √(1 − t²), where the pressure is smooth times this."""
    angle = np.pi * (np.arange(4000) + 0.5) / 4000
    x = np.c_[solution.half_width * np.cos(angle), np.zeros(len(angle))]
    pressure = 1.02 * solution.contact_pressure(x)
    found = solution.measured(x, pressure * np.sin(angle), x, pressure)
    assert found["half_width"] == pytest.approx(solution.half_width, rel=1e-4)
    if "peak" in solution.quantities:
        assert found["peak"] == pytest.approx(1.02 * solution.peak, rel=1e-10)


@pytest.mark.parametrize(
    ("cls", "wrong", "named"),
    [
        (ContactEdge, {"factor": 0.0}, "factor"),
        (PartialWaves, {"size": 1.0, "amplitude": 0.01, "mean_pressure": 40.0}, "mean_pressure"),
        (HertzHalfPlanes, {"end": 0.0, "radius": 1.0}, "end"),
        (RoundedPunch, {"end": 1.0, "flat": 1.0, "radius": 1.0}, "flat"),
        (Wedge, {"end": 1.0, "slope": -1.0}, "slope"),
    ],
)
def test_parameters_are_validated(cls, wrong, named):
    with pytest.raises(ParameterError, match=named):
        cls(**(BOTH | wrong))
