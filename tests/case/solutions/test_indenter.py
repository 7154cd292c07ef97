"""Axisymmetric indenters against closed forms and their own integrals."""

from dataclasses import replace

import numpy as np
import pytest

from solver.case.material import Material
from solver.case.solutions.base import ParameterError
from solver.case.solutions.hertz import HertzSphere, Indenter

SOFT, HARD = Material(2000.0, 0.3), Material(70000.0, 0.2)
CONE = Indenter(power=1, factor=0.1, force=100.0, lower=SOFT, upper=HARD)
MODULUS = 1 / (0.91 / 2000 + 0.96 / 70000)


def along(radii):
    return np.c_[radii, np.zeros((len(radii), 2))]


def test_a_sphere_is_that_of_hertz():
    sphere = replace(CONE, power=2, factor=1 / (2 * 50.0))
    hertz = HertzSphere(radius=50.0, force=100.0, lower=SOFT, upper=HARD)
    x = along(hertz.half_width * np.linspace(0, 1.3, 7))
    assert sphere.half_width == pytest.approx(hertz.half_width)
    assert sphere.contact_pressure(x) == pytest.approx(hertz.contact_pressure(x))


def test_a_cone():
    """p = E* m/2 arcosh(a/ρ) and F = π/2 E* m a²."""
    a = CONE.half_width
    assert np.pi / 2 * MODULUS * 0.1 * a**2 == pytest.approx(100.0)
    share = np.array([0.1, 0.5, 0.9])
    expected = MODULUS * 0.1 / 2 * np.arccosh(1 / share)
    assert CONE.contact_pressure(along(a * share)) == pytest.approx(expected)
    assert CONE.regular(along(a * np.array([0.1, 0.5, 0.9]))).tolist() == [False, True, False]


def test_a_quartic_shape():
    """p ∝ √(1 − t²) (1 + 2 t²)/3, t = ρ/a: largest off the axis."""
    blunt = replace(CONE, power=4, factor=1e-3)
    t = np.array([0.0, 0.3, 0.8, 1.0])
    found = blunt.contact_pressure(along(blunt.half_width * t))
    assert found / found[0] == pytest.approx(np.sqrt(1 - t**2) * (1 + 2 * t**2))
    assert blunt.regular(along(np.zeros(1)))[0]


@pytest.mark.parametrize("power", [1, 1.5, 2, 3, 4, 8])
def test_pressure_integrates_to_the_force_and_its_second_moment_to_the_radius(power):
    shape = replace(CONE, power=power)
    a = shape.half_width
    angle, weight = np.polynomial.legendre.leggauss(200)
    angle, weight = np.pi / 4 * (1 + angle), np.pi / 4 * weight
    radii = a * np.sin(angle)
    x = along(radii)
    force = shape.contact_pressure(x) * 2 * np.pi * radii * a * np.cos(angle) * weight
    assert force.sum() == pytest.approx(100.0, rel=1e-6)
    assert shape.measured(x, force, x, force)["half_width"] == pytest.approx(a, rel=1e-6)


def test_values_that_are_refused():
    for key, value in {"power": 0.5, "factor": 0.0, "force": -1.0, "centre": (0.0,)}.items():
        with pytest.raises(ParameterError, match=key):
            replace(CONE, **{key: value})
    with pytest.raises(ParameterError, match="rigid"):
        replace(CONE, lower=Material(np.inf, 0.0), upper=Material(np.inf, 0.0))
