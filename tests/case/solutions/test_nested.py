"""Lamé's nested cylinders, tubes and spheres, oval ones, and tubes of many parts."""

import numpy as np
import pytest

from solver.case.material import Material
from solver.case.solutions.base import ParameterError
from solver.case.solutions.nested import (
    CompoundTube,
    NestedCylinders,
    NestedSpheres,
    NestedTubes,
    OvalCylinders,
)
from solver.mechanics.fem.stress import traction
from tests.case.solutions.elastic import HARD, RADII, SOFT, interface_of, nested, points_of


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
    """Nested or not, the stress equals the one shell's from 20 to 40 (Lamé)."""
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


def test_spheres_do_not_rotate():
    with pytest.raises(ParameterError, match="spheres do not rotate"):
        nested(NestedSpheres, spin=0.1)


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


@pytest.mark.parametrize("cls", [NestedCylinders, NestedTubes])
def test_a_rotating_shrink_fit_is_lost_at_a_known_speed(cls):
    """p(0) = E δ (b² − a²)(c² − b²)/(2 (1 − ν²) b³ (c² − a²)), lost at ρω² = p(0)/166.6667."""
    still = 2000 * 0.02 * 500 * 700 / (2 * 0.91 * 27000 * 1200)
    lost = still / (500 / 3)
    for spin, pressure in ((0.0, still), (lost / 2, still / 2), (1.001 * lost, 0.0)):
        found = nested(cls, SOFT, SOFT, 0.0, 0.02, spin=spin)
        x = at_radius(30.0, found.dim)
        assert found.contact_pressure(x)[0] == pytest.approx(pressure, rel=1e-9)
    assert found.gap(x)[0] > 0


@pytest.mark.parametrize(
    ("key", "value"),
    [("radii", (20.0, 30.0, 30.0, 50.0)), ("young", (1.0, 2.0)), ("interferences", (0.1,))],
)
def test_a_compound_tube_needs_a_number_for_each_part(key, value):
    with pytest.raises(ParameterError) as refusal:
        CompoundTube(**TUBES | {key: value}, dim=2)
    assert refusal.value.parameter == key
