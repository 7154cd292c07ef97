"""The receding layer: extent, balance, and its lower face by a layer solved wave by wave."""

import numpy as np
import pytest
from scipy.integrate import quad

from solver.case.material import Material
from solver.case.solutions.base import ParameterError
from solver.case.solutions.receding import RecedingLayer

SOFT, RIGID = Material(1.0, 0.3), Material(np.inf, 0.0)


def layer(loaded, height=1.0, pressure=1.0, bottom=RIGID):
    sizes = {"height": height, "loaded": loaded, "pressure": pressure}
    return RecedingLayer(**sizes, top=SOFT, bottom=bottom)


@pytest.mark.parametrize(
    ("loaded", "extent", "middle"),
    [
        (1e-5, 0.8569939233, 0.9603329605),
        (0.5, 1.0077823995, 0.7895881616),
        (1.0, 1.4021590144, 0.5233892457),
    ],
)
def test_extent_and_pressure_in_the_middle(loaded, extent, middle):
    """Of an independent solve of the same equation with 20 and 28 terms."""
    found = layer(loaded)
    assert found.half_width == pytest.approx(extent, rel=1e-9)
    pressure = found.contact_pressure(np.zeros((1, 2)))[0]
    assert pressure / (2 * loaded) == pytest.approx(middle, rel=1e-9)


def test_lengths_and_loads_scale():
    one, other = layer(0.5), layer(5.0, height=10.0, pressure=4.0)
    x = np.c_[np.linspace(-1.2, 1.2, 9), np.zeros(9)]
    assert other.half_width == pytest.approx(10 * one.half_width, rel=1e-12)
    expected = 4 * one.contact_pressure(x)
    np.testing.assert_allclose(other.contact_pressure(10 * x), expected, atol=1e-11)
    assert expected[0] == expected[-1] == 0


def test_the_pressure_carries_the_load_and_its_extent_is_found_again():
    found = layer(0.5)
    a = found.half_width

    def pressure(x):
        return float(found.contact_pressure(np.array([[x, 0.0]]))[0])

    assert 2 * quad(pressure, 0, a)[0] == pytest.approx(1.0, rel=1e-8)
    angle = np.pi * (np.arange(50) + 0.5) / 50
    x = np.c_[a * np.cos(angle), np.zeros(50)]
    force = np.sin(angle) * found.contact_pressure(x)
    assert found.measured(x, force, x, force)["half_width"] == pytest.approx(a, rel=1e-10)


def test_a_wide_load_is_a_uniform_pressure_with_an_end():
    """In the middle the pressure is that of the load; the contact ends at a fixed distance."""
    wide, wider = layer(2.0), layer(3.0)
    assert wider.contact_pressure(np.zeros((1, 2)))[0] == pytest.approx(1.0, abs=3e-3)
    assert wider.half_width - 3.0 == pytest.approx(wide.half_width - 2.0, abs=5e-4)


def test_the_lower_face_is_flat_in_contact_and_rises_beyond():
    """Its slope, the integral over the waves of the layer; beyond k h = 30 it is a half-plane."""
    loaded, nu = 0.5, 0.3
    found = layer(loaded)
    place, weight = np.polynomial.legendre.leggauss(400)
    k = np.concatenate([15 * (place + 1), 30 + 235 * (place + 1)])
    weight = np.concatenate([15 * weight, 235 * weight])
    angle = np.pi / 400 * (np.arange(200) + 0.5)
    x = found.half_width * np.cos(angle)
    force = np.pi / 400 * found.half_width * np.sin(angle) * found.contact_pressure(np.c_[x, 0 * x])
    below = 2 * np.cos(k[:, None] * x) @ force
    above = 2 * np.sin(k * loaded) / k
    waves = zip(k, below, above, strict=True)
    lift = np.where(k < 30, 0.0, 2 * (1 - nu) * below / k)
    lift[k < 30] = [_lift(*wave, nu) for wave in waves if wave[0] < 30]

    def slope(share):
        at = found.half_width * np.asarray(share)
        return -np.sin(np.outer(at, k)) @ (weight * k * lift) / np.pi

    beyond = np.array([1.2, 1.4, 2.5])
    rising = slope(beyond)
    assert (rising > 0).all()
    assert np.abs(slope([0.1, 0.3, 0.5, 0.7, 0.9])).max() < 2e-3 * rising.max()
    x, step = np.c_[beyond * found.half_width, 0 * beyond], np.array([1e-5, 0.0])
    opening = (found.gap(x + step) - found.gap(x - step)) / 2e-5
    np.testing.assert_allclose(opening[:2], 1.3 * rising[:2], rtol=5e-4)  # E = 1.3 there, 1 here
    np.testing.assert_allclose(opening[2], 1.3 * rising[2], rtol=2e-2)


def test_the_gap_begins_at_the_end_of_the_contact_as_pressure_ends_there():
    """p = C √(a − x), g = 4 C (x − a)^{3/2}/(3 E*), as at any end; two layers open twice as far."""
    found, twice = layer(0.5), layer(0.5, bottom=SOFT)
    a, near = found.half_width, np.array([[1e-4, 0.0], [4e-4, 0.0]])
    end = np.array([[a, 0.0]])
    factor = found.contact_pressure(end - near[:1])[0] / 1e-2
    expected = 4 * factor * 0.91 / 3 * near[:, 0] ** 1.5
    np.testing.assert_allclose(found.gap(end + near), expected, rtol=2e-3)
    far = np.array([[-3.0, 0.0], [0.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    np.testing.assert_allclose(twice.gap(far), 2 * found.gap(far), rtol=1e-12)
    gap = found.gap(far)
    assert (gap[0], gap[1]) == (pytest.approx(gap[3], rel=1e-12), 0.0)


def _lift(k: float, below: float, above: float, nu: float) -> float:
    """v of the lower face for μ = ½: φ = (c₁ + c₂ ky) cosh ky + (c₃ + c₄ ky) sinh ky (Airy).

    σ_y = φ_xx, τ = −φ_xy; 2μ v = −φ_y + (1 − ν) ψ with ψ_y = ∇²φ (plane strain).
    """

    def rows(y):
        z, cosh, sinh = k * y, np.cosh(k * y), np.sinh(k * y)
        value = [cosh, z * cosh, sinh, z * sinh]
        slope = [sinh, cosh + z * sinh, cosh, sinh + z * cosh]
        return np.array(value), np.array(slope)

    (value, slope), (top, top_slope) = rows(0.0), rows(1.0)
    c = np.linalg.solve([value, slope, top, top_slope], [below / k**2, 0.0, above / k**2, 0.0])
    # ∇²φ = 2 k² (c₂ sinh ky + c₄ cosh ky): its integral at y = 0
    return float(-k * slope @ c + (1 - nu) * 2 * k * c[1])


@pytest.mark.parametrize("wrong", [{"loaded": 0.0}, {"loaded": 4.1}, {"height": 0.0}])
def test_parameters_are_validated(wrong):
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        layer(**({"loaded": 1.0} | wrong))
