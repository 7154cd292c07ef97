"""Solutions known in the interior: gradient, equilibrium, and the conditions of contact."""

import numpy as np
import pytest

from solver.case.material import Material
from solver.case.solutions.base import ElasticSolution, ParameterError
from solver.case.solutions.bending import Bending
from solver.case.solutions.manufactured import Parabola2d, Paraboloid3d
from solver.case.solutions.meridian import Meridian
from solver.case.solutions.nested import CompoundTube, NestedCylinders, NestedSpheres, NestedTubes
from solver.case.solutions.oval import OvalCylinders
from solver.case.solutions.polynomial import PolynomialPressure2d, PolynomialPressure3d
from solver.case.solutions.uniform import Hydrostatic, UniformCompression
from solver.case.solutions.waves import Waves2d, Waves3d
from solver.mechanics.fem.stress import traction

SOFT, HARD = Material(2000.0, 0.3), Material(70000.0, 0.2)
RADII = (20.0, 30.0, 40.0)
WAVE = {"amplitude": 0.01, "mean_pressure": 60.0}


def nested(cls, inner=SOFT, outer=HARD, pressure=25.0, interference=0.01, **more):
    given = {"pressure": pressure, "interference": interference} | more
    return cls(radii=RADII, inner=inner, outer=outer, **given)


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


def points_of(solution: ElasticSolution, part: int) -> np.ndarray:
    """Points (n, dim) inside a part."""
    random = np.random.default_rng(part)
    x = random.uniform(0.1, 0.9, (20, solution.dim))
    if isinstance(solution, NestedCylinders):
        low, high = RADII[part : part + 2]
        radius = random.uniform(low, high, (20, 1))
        x[:, : solution.around] *= radius / _radius(solution, x)
        return x
    if isinstance(solution, UniformCompression):
        x[:, -1] += 1.0 if part else -1.0
    if isinstance(solution, (Bending, Waves2d, PolynomialPressure2d)):
        x[:, -1] *= 1.0 if part else -1.0
    return x


def _radius(solution: NestedCylinders, x: np.ndarray) -> np.ndarray:
    return np.linalg.norm(x[:, : solution.around], axis=1, keepdims=True)


def interface_of(solution: ElasticSolution) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, dim) of the interface and its normals there, out of the first part."""
    x = np.random.default_rng(5).uniform(0.1, 0.9, (20, solution.dim))
    if isinstance(solution, NestedCylinders):
        normal = x / _radius(solution, x) * (np.arange(solution.dim) < solution.around)
        return RADII[1] * x / _radius(solution, x), normal
    if isinstance(solution, Hydrostatic):  # any surface will do
        return x, x / np.linalg.norm(x, axis=1, keepdims=True)
    x[:, -1] = getattr(solution, "interface", 0.0)
    sign = -1.0 if isinstance(solution, Parabola2d) else 1.0
    return x, np.tile(sign * np.eye(solution.dim)[-1], (len(x), 1))


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
    ("cls", "expected"), [(NestedCylinders, 6.4814815), (NestedSpheres, 4.8941799)]
)
def test_the_published_contact_pressure(cls, expected):
    solution = nested(cls, SOFT, SOFT, interference=0.0)
    assert solution.contact_pressure(np.ones((1, solution.dim)))[0] == pytest.approx(
        expected, abs=5e-8
    )


@pytest.mark.parametrize("cls", [NestedCylinders, NestedSpheres])
def test_equal_materials_without_interference_are_one_shell(cls):
    """Nested or not, the stress is that of the one shell from 20 to 40 (Lamé)."""
    solution = nested(cls, SOFT, SOFT, interference=0.0)
    dim, (a, _, c) = solution.dim, RADII
    for part in (0, 1):
        x = points_of(solution, part)
        r = np.linalg.norm(x, axis=1)
        normal = x / r[:, None]
        radial = np.einsum("ni,ni->n", traction(solution.stress(x, part), normal), normal)
        lame = -25.0 * ((c / r) ** dim - 1) / ((c / a) ** dim - 1)
        np.testing.assert_allclose(radial, lame, rtol=1e-12)


@pytest.mark.parametrize("cls", [NestedCylinders, NestedSpheres])
def test_the_walls_are_loaded_as_asked(cls):
    solution = nested(cls)
    directions = np.eye(solution.dim)
    for part, radius, pressure in ((0, RADII[0], 25.0), (1, RADII[2], 0.0)):
        force = traction(solution.stress(radius * directions, part), directions)
        np.testing.assert_allclose(force, -pressure * directions, atol=1e-11)


def test_press_fit_by_the_textbook():
    """p = δ / (b [ (ν_o + (c²+b²)/(c²−b²))/E_o + ((b²+a²)/(b²−a²) − ν_i)/E_i ]) in plane stress;
    in plane strain with E/(1−ν²) and ν/(1−ν)."""
    a, b, c = RADII
    (e_i, n_i), (e_o, n_o) = (
        (m.young / (1 - m.poisson**2), m.poisson / (1 - m.poisson)) for m in (SOFT, HARD)
    )
    outer = ((c**2 + b**2) / (c**2 - b**2) + n_o) / e_o
    inner = ((b**2 + a**2) / (b**2 - a**2) - n_i) / e_i
    solution = nested(NestedCylinders, pressure=0.0, interference=0.02)
    found = solution.contact_pressure(np.ones((1, 2)))[0]
    assert found == pytest.approx(0.02 / (b * (outer + inner)), rel=1e-12)


@pytest.mark.parametrize("cls", [NestedCylinders, NestedSpheres])
def test_an_outer_part_that_cannot_give_way_takes_it_all(cls):
    """Against a hard outer part and with nothing inside, the interference is all the inner's."""
    rigid = Material(1e16, 0.3)
    solution = nested(cls, SOFT, rigid, pressure=0.0, interference=0.02)
    x, normal = interface_of(solution)
    np.testing.assert_allclose(solution.displacement(x, 0), -0.02 * normal, rtol=1e-9)


@pytest.mark.parametrize("cls", [NestedCylinders, NestedSpheres])
def test_a_gap_that_does_not_close_leaves_no_pressure(cls):
    solution = nested(cls, pressure=1.0, interference=-1.0)
    x, normal = interface_of(solution)
    assert (solution.contact_pressure(x) == 0).all()
    jump = np.einsum("ni,ni->n", solution.displacement(x, 1) - solution.displacement(x, 0), normal)
    np.testing.assert_allclose(solution.gap(x), jump + 1.0, rtol=1e-12)
    assert (solution.gap(x) > 0.9).all()
    assert (solution.displacement(x, 1) == 0).all()


def test_a_point_is_taken_by_its_place_unless_its_part_is_given():
    solution = nested(NestedCylinders)
    inside, outside = np.array([[25.0, 0.0]]), np.array([[35.0, 0.0]])
    assert (solution.displacement(inside) == solution.displacement(inside, 0)).all()
    assert (solution.displacement(outside) == solution.displacement(outside, 1)).all()
    both = np.vstack([inside, inside])
    given = solution.displacement(both, np.array([0, 1]))
    assert (given[0] == solution.displacement(inside, 0)[0]).all()
    assert (given[1] == solution.displacement(inside, 1)[0]).all()
    ring = np.array([[30 - 1e-9, 0.0], [35.0, 0.0], [0.0, 30 - 1e-9], [0.0, 40.0]])
    assert solution.body_part(ring) == 1


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


def test_a_wave_of_pressure_leaves_bore_and_outside_as_they_have_to_be():
    """The bore carries its pressure alone; the outside has no shear."""
    solution = OvalCylinders(radii=RADII, inner=SOFT, outer=HARD, pressure=25.0, wave=3.0)
    angle = np.linspace(0.1, 1.4, 7)
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    bore = traction(solution.stress(RADII[0] * normal, 0), normal)
    np.testing.assert_allclose(bore, -25.0 * normal, atol=1e-11)
    outside = traction(solution.stress(RADII[2] * normal, 1), normal)
    along = outside[:, 0] * normal[:, 1] - outside[:, 1] * normal[:, 0]
    np.testing.assert_allclose(along, 0.0, atol=1e-11)


def test_rotation_loosens_a_shrink_fit_at_a_known_speed():
    """Radii 20, 30, 40, E 2000, ν 0.3, δ 0.02: p falls linearly in ρω² and is lost at 1.4245e-3."""
    found = [
        nested(NestedTubes, SOFT, SOFT, 0.0, 0.02, spin=s).contact_pressure(np.ones((1, 3)))[0]
        for s in (0.0, 1e-3, 1.42450e-3, 1.42451e-3)
    ]
    assert found[0] == pytest.approx(0.237416904, rel=1e-8)
    assert found[1] == pytest.approx(0.237416904 - 0.1666667, rel=1e-6)
    assert found[2] == pytest.approx(0.0, abs=1e-6)
    assert found[2] > found[3] == 0
    lost = nested(NestedTubes, SOFT, SOFT, 0.0, 0.02, spin=2e-3)
    assert lost.gap(np.ones((1, 3)))[0] > 0


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


def test_spheres_do_not_rotate():
    with pytest.raises(ParameterError, match="spheres do not rotate"):
        nested(NestedSpheres, spin=0.1)


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


TUBES = {
    "radii": (20.0, 30.0, 40.0, 50.0),
    "young": (2000.0, 1000.0, 4000.0),
    "poisson": (0.3, 0.2, 0.25),
    "interferences": (0.02, 0.01),
    "pressure": 0.5,
}


def at_radius(r, dim=2):
    return np.array([[r, *[0.0] * (dim - 1)]])


@pytest.mark.parametrize("dim", [2, 3])
def test_two_tubes_are_a_compound_tube(dim):
    given = {"pressure": 25.0, "interference": 0.01, "spin": 0.002}
    cls = {2: NestedCylinders, 3: NestedTubes}[dim]
    two = cls(radii=RADII, inner=SOFT, outer=HARD, **given)
    young, poisson = (2000.0, 70000.0), (0.3, 0.2)
    compound = CompoundTube(
        radii=RADII, young=young, poisson=poisson, interferences=(0.01,), dim=dim,
        pressure=25.0, spin=0.002,
    )  # fmt: skip
    x = np.concatenate([points_of(two, 0), points_of(two, 1)])
    np.testing.assert_allclose(compound.stress(x), two.stress(x), rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(compound.part_of(x, None), [0] * 20 + [1] * 20)


@pytest.mark.parametrize("spin", [0.0, 1e-3, 4e-3])
def test_tubes_touch_and_press_at_all_interfaces(spin):
    tubes = CompoundTube(**TUBES, dim=2, spin=spin)
    walls = [20.0, 30.0, 40.0, 50.0]
    pressure = [0.5, *(tubes.contact_pressure(at_radius(b))[0] for b in (30.0, 40.0)), 0.0]
    for part in range(3):
        for wall in (part, part + 1):
            stress = tubes.stress(at_radius(walls[wall]), part)[0, 0]
            assert stress == pytest.approx(-pressure[wall], abs=1e-12)
    for b, overlap, part in ((30.0, 0.02, 0), (40.0, 0.01, 1)):
        x = at_radius(b)
        jump = (tubes.displacement(x, part + 1) - tubes.displacement(x, part))[0, 0]
        assert jump - overlap == pytest.approx(tubes.gap(x)[0], abs=1e-13)
    assert (pressure[1] == 0) == (tubes.gap(at_radius(30.0))[0] > 0) == (spin == 4e-3)
    assert pressure[2] > 0


def test_a_rotating_shrink_fit_is_lost_at_a_known_speed():
    """p(0) = E δ (b² − a²)(c² − b²)/(2 (1 − ν²) b³ (c² − a²)), lost at ρω² = p(0)/166.6667."""
    of = {"radii": RADII, "inner": SOFT, "outer": SOFT, "interference": 0.02}
    still = 2000 * 0.02 * 500 * 700 / (2 * 0.91 * 27000 * 1200)
    lost = still / (500 / 3)
    for spin, pressure in ((0.0, still), (lost / 2, still / 2), (1.001 * lost, 0.0)):
        found = NestedCylinders(**of, spin=spin)
        assert found.contact_pressure(at_radius(30.0))[0] == pytest.approx(pressure, rel=1e-9)
    assert found.gap(at_radius(30.0))[0] > 0


@pytest.mark.parametrize(
    ("key", "value"),
    [("radii", (20.0, 30.0, 30.0, 50.0)), ("young", (1.0, 2.0)), ("interferences", (0.1,))],
)
def test_a_compound_tube_needs_a_number_for_each_part(key, value):
    with pytest.raises(ParameterError) as refusal:
        CompoundTube(**TUBES | {key: value}, dim=2)
    assert refusal.value.parameter == key
