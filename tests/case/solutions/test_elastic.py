"""Solutions known in the interior: gradient, equilibrium, and the conditions of contact."""

import numpy as np
import pytest

from solver.case.material import Material
from solver.case.solutions.base import ElasticSolution, ParameterError
from solver.case.solutions.meridian import Meridian
from solver.case.solutions.nested import NestedCylinders, NestedSpheres, NestedTubes, OvalCylinders
from solver.case.solutions.polynomial import (
    Bending,
    Hydrostatic,
    Parabola2d,
    Paraboloid3d,
    PolynomialPressure2d,
    PolynomialPressure3d,
    UniformCompression,
)
from solver.case.solutions.waves import Waves2d, Waves3d
from solver.mechanics.fem.stress import traction
from tests.case.solutions.elastic import HARD, RADII, SOFT, WAVE, interface_of, nested, points_of

ALL = [
    UniformCompression(pressure=25.0, base=-50.0, lower=SOFT, upper=HARD, dim=2, interface=1.0),
    UniformCompression(pressure=25.0, base=-50.0, lower=SOFT, upper=HARD, dim=3, interface=1.0),
    Hydrostatic(pressure=25.0, material=SOFT, dim=2),
    Hydrostatic(pressure=25.0, material=SOFT, dim=3),
    Bending(mean=9.0, slope=(-3.0,), base=-1.0, bottom=SOFT, top=HARD, dim=2),
    Bending(mean=9.0, slope=(-3.0, 2.0), base=-1.0, bottom=SOFT, top=HARD, dim=3),
    nested(NestedCylinders),
    nested(NestedCylinders, spin=0.002),
    nested(NestedTubes, spin=0.002),
    nested(NestedSpheres),
    OvalCylinders(radii=RADII, inner=SOFT, outer=HARD, pressure=25.0, interference=0.01, wave=3.0),
    Parabola2d(material=Material(3.0, 0.0)),
    Paraboloid3d(material=Material(3.0, 0.0)),
    *(cls(bottom=SOFT, top=HARD, size=1.0, **WAVE) for cls in (Waves2d, Waves3d)),
    *(
        cls(bottom=SOFT, top=HARD, size=2.0, coefficients=(9.0, 1.0, -4.0, 2.0, 3.0))
        for cls in (PolynomialPressure2d, PolynomialPressure3d)
    ),
]


def names(solution):
    return f"{solution.name}-{solution.dim}d"


def derivative(function, x: np.ndarray, step: float) -> np.ndarray:
    """∂f_i/∂x_j (n, …, dim) by central differences."""
    columns = [
        (function(x + step * axis) - function(x - step * axis)) / (2 * step)
        for axis in np.eye(x.shape[1])
    ]
    return np.stack(columns, axis=-1)


def parts_of(solution: ElasticSolution) -> range:
    return range(len(solution.parts))


@pytest.mark.parametrize("solution", ALL, ids=names)
def test_the_gradient_is_that_of_the_displacement(solution):
    for part in parts_of(solution):
        x = points_of(solution, part)
        step = 1e-5 * np.abs(x).max()
        found = derivative(lambda y, part=part: solution.displacement(y, part), x, step)
        expected = solution.gradient(x, part)
        np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("solution", ALL, ids=names)
def test_the_stress_balances_the_body_force(solution):
    for part in parts_of(solution):
        x = points_of(solution, part)
        step = 1e-5 * np.abs(x).max()

        def tensor(y, part=part):
            s = solution.stress(y, part)
            full = s[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
            return full[:, : solution.dim, : solution.dim]

        divergence = np.einsum("nijj->ni", derivative(tensor, x, step))
        scale = np.abs(tensor(x)).max() / np.abs(x).max()
        np.testing.assert_allclose(-divergence, solution.body_force(x, part), atol=1e-8 * scale)


@pytest.mark.parametrize("solution", ALL, ids=names)
def test_the_parts_touch_and_press_without_friction(solution):
    x, normal = interface_of(solution)
    pressure = solution.contact_pressure(x)
    assert (pressure > 0).all()
    assert (solution.gap(x) == 0).all()
    for part in parts_of(solution):
        force = traction(solution.stress(x, part), normal)
        if not isinstance(solution, Parabola2d):  # there a tangential traction is applied
            np.testing.assert_allclose(force, -pressure[:, None] * normal, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(np.einsum("ni,ni->n", force, normal), -pressure, rtol=1e-12)
    if len(solution.parts) == 2:
        jump = solution.displacement(x, 1) - solution.displacement(x, 0)
        opening = np.einsum("ni,ni->n", jump, normal)
        np.testing.assert_allclose(opening, opening_of(solution, x), atol=1e-14)


def opening_of(solution: ElasticSolution, x: np.ndarray) -> np.ndarray | float:
    """By how much the interface opens: against an interference, or to close the waves."""
    if isinstance(solution, Waves2d):
        return -solution.amplitude * (1 - np.cos(np.pi * x[:, :-1]).prod(axis=1))
    return getattr(solution, "interference", 0.0)


@pytest.mark.parametrize("cls", [Waves2d, Waves3d])
def test_waves_on_high_layers_press_as_on_half_spaces(cls):
    """p₁ = π E* Δ / λ in two dimensions, √2 times that for square waves (Johnson et al. 1985)."""
    count = 6.0  # half waves within the height: the layers are 3 wavelengths high
    n = (count,) * (cls.dim - 1)
    solution = cls(bottom=SOFT, top=HARD, size=1.0, amplitude=1e-3, mean_pressure=1e4, half_waves=n)
    x = np.zeros((1, cls.dim))
    modulus = 1 / sum((1 - m.poisson**2) / m.young for m in (SOFT, HARD))
    expected = np.sqrt(cls.dim - 1) * np.pi * modulus * 1e-3 / (2 / count)
    assert solution.contact_pressure(x)[0] - 1e4 == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("part", [0, 1])
def test_the_far_faces_of_wavy_layers_stay_flat_and_slide(part):
    solution = Waves3d(bottom=SOFT, top=HARD, size=1.0, **WAVE)
    x = np.random.default_rng(3).uniform(0, 1, (20, 3))
    x[:, 2] = 1.0 if part else -1.0
    moved = -solution.approach if part else 0.0
    np.testing.assert_allclose(solution.displacement(x, part)[:, 2], moved, atol=1e-15)
    np.testing.assert_allclose(solution.stress(x, part)[:, 4:], 0.0, atol=1e-12)


def test_waves_that_the_mean_pressure_does_not_close_are_refused():
    with pytest.raises(ParameterError, match="mean_pressure"):
        Waves2d(bottom=SOFT, top=HARD, size=1.0, amplitude=0.01, mean_pressure=1.0)


def test_a_polynomial_pressure_is_that_polynomial():
    solution = PolynomialPressure3d(bottom=SOFT, top=HARD, size=2.0, coefficients=(1.0, 0.0, 8.0))
    x = np.array([[1.0, 2.0, 0.0]])
    assert solution.contact_pressure(x)[0] == pytest.approx(2 * 1 + 8 * (0.25 + 1.0))


@pytest.mark.parametrize("dim", [2, 3])
def test_the_patch_test(dim):
    """The displacement that the blocks of 50 have in closed form."""
    solution = UniformCompression(pressure=25.0, base=-50.0, lower=SOFT, upper=SOFT, dim=dim)
    x = np.random.default_rng(0).uniform(-50, 50, (9, dim))
    lateral, axial = (0.004875, -0.011375) if dim == 2 else (0.00375, -0.0125)
    expected = np.c_[lateral * x[:, :-1], axial * (x[:, -1] + 50)]
    np.testing.assert_allclose(solution.displacement(x), expected, rtol=1e-12, atol=1e-15)
    stress = [0, -25, -7.5, 0, 0, 0] if dim == 2 else [0, 0, -25, 0, 0, 0]
    np.testing.assert_allclose(solution.stress(x), np.tile(stress, (9, 1)), atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_hydrostatic_traction_is_the_pressure_on_any_surface(dim):
    solution = Hydrostatic(pressure=3.0, material=SOFT, dim=dim, centre=(1.0, 2.0, 3.0))
    x, normal = interface_of(solution)
    np.testing.assert_allclose(traction(solution.stress(x), normal), -3 * normal, atol=1e-14)
    at_centre = solution.displacement(np.array([[1.0, 2.0, 3.0]])[:, :dim])
    np.testing.assert_array_equal(at_centre, 0.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: nested(NestedCylinders, interference=0.0).__class__(
            radii=(30.0, 20.0, 40.0), inner=SOFT, outer=SOFT
        ),
        lambda: NestedSpheres(radii=(20.0, 30.0), inner=SOFT, outer=SOFT),
        lambda: Parabola2d(material=SOFT),
        lambda: Parabola2d(material=Material(1.0, 0.0), strain=-0.01),
        lambda: Hydrostatic(pressure=-1.0, material=SOFT, dim=2),
        lambda: Hydrostatic(pressure=1.0, material=SOFT, dim=4),
        lambda: UniformCompression(pressure=1.0, base=1.0, lower=SOFT, upper=SOFT, dim=2),
    ],
)
def test_parameters_are_validated(make):
    with pytest.raises(ParameterError):
        make()


def test_a_solution_in_its_meridian_plane():
    """The axes r, z, θ of a sphere: its hoop strain is u_r / r, its stress that in space."""
    whole = nested(NestedSpheres)
    plane, x = Meridian(whole), np.array([[15.0, 20.0], [30.0, 10.0]])
    space = np.array([[15.0, 0.0, 20.0], [30.0, 0.0, 10.0]])
    assert plane.displacement(x) == pytest.approx(whole.displacement(space)[:, [0, 2]])
    hoop = plane.displacement(x)[:, 0] / x[:, 0]
    assert plane.gradient(x)[:, 2, 2] == pytest.approx(hoop)
    stress = whole.stress(space)
    assert plane.stress(x) == pytest.approx(stress[:, [0, 2, 1, 5, 4, 3]])
    assert plane.contact_pressure(x) == pytest.approx(whole.contact_pressure(space))
    assert plane.level(x) == pytest.approx(whole.level(space))
    assert plane.materials == whole.materials


@pytest.mark.parametrize("dim", [2, 3])
def test_bending_leaves_the_sides_free_and_the_rollers_flat(dim):
    solution = Bending(
        mean=9.0, slope=(-3.0, 2.0)[: dim - 1], base=-1.0, bottom=SOFT, top=HARD, dim=dim
    )
    x = points_of(solution, 1)
    stress, p = solution.stress(x), 9.0 + x[:, :-1] @ np.array([-3.0, 2.0])[: dim - 1]
    expected = np.zeros((len(x), 6))
    expected[:, dim - 1] = -p
    if dim == 2:
        expected[:, 2] = -0.2 * p
    np.testing.assert_allclose(stress, expected, atol=1e-13)
    x[:, -1] = -1.0
    assert (solution.displacement(x)[:, -1] == 0).all()
    # a beam of height 1 + 1 in the plane of x: u_x,zz = s/E' = -3/E'
    bent = solution.gradient(np.array([[0.5] * dim, [0.5] * (dim - 1) + [1.5]]), 1)[:, 0, -1]
    young = 70000.0 / (1 - 0.2**2) if dim == 2 else 70000.0
    assert np.ptp(bent) == pytest.approx(3.0 / young, rel=1e-12)
