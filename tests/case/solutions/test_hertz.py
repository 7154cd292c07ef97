"""Hertz: the published figures, and that the pressure carries the force."""

import numpy as np
import pytest
from scipy.integrate import quad

from solver.case.material import Material
from solver.case.solutions.base import ParameterError
from solver.case.solutions.hertz import HertzApproach, HertzCylinder, HertzSphere

STEEL, ALUMINIUM = Material(210e3, 0.3), Material(70e3, 0.3)
RIGID = Material(float("inf"), 0.0)
CYLINDER = HertzCylinder(force=35e3, radius=50.0, lower=ALUMINIUM, upper=STEEL)
SOFT = Material(20000.0, 0.3)


def test_the_benchmark_of_the_cylinder_on_a_plane():
    assert CYLINDER.half_width == pytest.approx(6.2146, abs=5e-5)
    assert CYLINDER.peak == pytest.approx(3585.4, abs=0.05)


def test_the_two_spheres():
    spheres = HertzApproach(approach=4.0, radius=50.0, other_radius=50.0, lower=SOFT, upper=SOFT)
    assert spheres.half_width == pytest.approx(10.0, rel=1e-14)
    assert spheres.peak == pytest.approx(2798.3, abs=0.05)


def test_the_pressure_carries_the_force():
    def line(x):
        return CYLINDER.contact_pressure(np.array([[x, 0.0]]))[0]

    a = CYLINDER.half_width
    assert quad(line, -a, a)[0] == pytest.approx(35e3, rel=1e-8)
    sphere = HertzSphere(force=10.0, radius=8.0, lower=SOFT, upper=RIGID, centre=(1.0, 2.0, 3.0))

    def ring(r):
        return 2 * np.pi * r * sphere.contact_pressure(np.array([[1.0 + r, 2.0, 3.0]]))[0]

    assert quad(ring, 0, sphere.half_width)[0] == pytest.approx(10.0, rel=1e-8)


def test_force_and_approach_tell_the_same():
    """F = 4/3 E* √R δ^1.5."""
    given = {"radius": 8.0, "other_radius": 12.0, "lower": SOFT, "upper": STEEL}
    near = HertzApproach(approach=0.1, **given)
    force = 4 / 3 * near.modulus * near.relative_radius**0.5 * 0.1**1.5
    pressed = HertzSphere(force=force, **given)
    assert pressed.half_width == pytest.approx(near.half_width, rel=1e-14)
    assert pressed.peak == pytest.approx(near.peak, rel=1e-14)


def test_a_plane_is_a_body_of_infinite_radius_and_a_rigid_one_does_not_give_way():
    large = HertzCylinder(force=35e3, radius=50.0, other_radius=1e15, lower=ALUMINIUM, upper=STEEL)
    assert large.peak == pytest.approx(CYLINDER.peak, rel=1e-12)
    one = HertzCylinder(force=1.0, radius=50.0, lower=SOFT, upper=RIGID)
    two = HertzCylinder(force=1.0, radius=50.0, lower=SOFT, upper=SOFT)
    assert one.modulus == pytest.approx(2 * two.modulus, rel=1e-14)


def test_outside_there_is_no_pressure_and_the_end_is_not_regular():
    a = CYLINDER.half_width
    x = np.array([[0.0, 0.0], [0.79 * a, 0.0], [-0.81 * a, 0.0], [1.01 * a, 0.0]])
    assert CYLINDER.contact_pressure(x)[3] == 0
    assert CYLINDER.regular(x).tolist() == [True, True, False, False]


def test_the_half_ellipse_is_found_again_in_its_values():
    # Gauss–Chebyshev points of the second kind integrate √(1 − t²) times polynomials exactly.
    angle = np.pi * np.arange(1, 12) / 12
    x = np.c_[CYLINDER.half_width * np.cos(angle), np.zeros(11)]
    pressure = 1.02 * CYLINDER.contact_pressure(x)
    found = CYLINDER.measured(x, np.sin(angle) ** 2, x, pressure)
    expected = {"half_width": CYLINDER.half_width, "peak": 1.02 * CYLINDER.peak}
    assert found == pytest.approx(expected, rel=1e-12)
    assert CYLINDER.measured(x, np.sin(angle) ** 2, x[:2], pressure[:2]) == {}  # too few


def test_the_interior_is_not_offered():
    with pytest.raises(NotImplementedError, match="no displacement; it offers contact_pressure"):
        CYLINDER.displacement(np.zeros((1, 2)))


@pytest.mark.parametrize("wrong", [{"force": 0.0}, {"radius": -1.0}, {"lower": RIGID}])
def test_parameters_are_validated(wrong):
    given = {"force": 1.0, "radius": 1.0, "lower": SOFT, "upper": RIGID}
    with pytest.raises(ParameterError):
        HertzCylinder(**(given | wrong))
