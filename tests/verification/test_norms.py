"""Errors against an exact solution: known by hand, and falling with the order of interpolation."""

from dataclasses import replace

import meshio
import numpy as np
import pytest

import solver.lac.threads
import solver.verification.in_cells
from solver.case.expressions import EXACT
from solver.case.material import Material
from solver.case.rigid import Rigid
from solver.case.solutions.hertz import HertzCylinder
from solver.case.solutions.polynomial import Parabola2d, Paraboloid3d
from solver.mesh import generate
from solver.simulation.results.solution import NodalContact, ZoneResult
from solver.simulation.simulate import simulate
from solver.studies.description import read_study
from solver.studies.points import points_of
from solver.verification.norms import errors, oscillation
from solver.verification.run import mesh_of
from tests.handmade import plane, surfaces, uniform
from tests.studies.measured import WORK

UNIT = Material(1.0, 0.0)


@pytest.fixture
def handmade(tmp_path):
    """The two blocks by hand, exact to the last digit, and their solution."""
    return with_exact(plane(tmp_path), uniform())


def with_exact(solution, exact):
    solution.case = solution.case.with_exact(exact)
    return solution


def interpolated(solution, cells, exact, size):
    """The exact displacement and stress at the nodes of a mesh of that size around a point."""
    cube = cells[:4] in ("PENT", "PYRA")
    section = {"cells": cells} | ({"contact": "TRIA3"} if cube else {"divisions": 2})
    mesh = generate({"recipe": "blocks", "size": 1.0, "bottom": section, "top": section}, "test")
    dim = exact.dim
    points = size * mesh.points + np.array([0.3, 0.4, 0.35])[:dim]
    return replace(
        with_exact(solution, exact),
        mesh=meshio.Mesh(points, [block for block in mesh.cells if block.dim == dim]),
        displacement=exact.displacement(points),
        stress=exact.stress(points),
        fields=replace(solution.fields, body=(mesh.points[:, -1] > 0).astype(int)),
        zones=[],
    )


def test_without_an_exact_solution_there_are_none(tmp_path):
    assert errors(plane(tmp_path)) == {}


def test_a_solution_of_one_zone_says_nothing_of_another(handmade):
    handmade.case = replace(handmade.case, zones=handmade.case.zones * 2)
    assert max(errors(handmade).values()) < 1e-14
    assert errors(handmade).keys() == {
        "displacement_l2",
        "displacement_h1",
        "stress_l2",
        "stress_max",
    }
    reference = replace(handmade.case.reference, values={"contact_pressure": EXACT})
    handmade.case = replace(handmade.case, reference=reference)
    assert "pressure_l2" in errors(handmade)


def test_the_exact_state_has_none(handmade):
    found = errors(handmade)
    assert found.keys() == {
        *("displacement_l2", "displacement_h1", "stress_l2", "stress_max"),
        *("pressure_l2", "pressure_max", "pressure_means", "pressure_oscillation"),
        *("pressure_inner", "pressure_total"),
    }
    assert max(found.values()) < 1e-14


@pytest.mark.parametrize("threads", [1, 2])
def test_parts_and_threads_change_no_number(handmade, monkeypatch, threads):
    handmade.displacement *= 1.0 + 0.01 * np.arange(len(handmade.displacement))[:, None]
    whole = errors(handmade)
    monkeypatch.setattr(solver.lac.threads, "workers", lambda: threads)
    monkeypatch.setattr(solver.verification.in_cells, "_CHUNK", 1)
    assert whole["stress_l2"] > 0.01
    assert errors(handmade) == pytest.approx(whole, rel=1e-13)


def test_a_share_too_much_is_that_share(handmade):
    handmade.displacement *= 1.02
    handmade.stress *= 0.99
    handmade.zones[0].multiplier = 0.97 * handmade.zones[0].multiplier
    found = errors(handmade)
    expected = dict.fromkeys(("displacement_l2", "displacement_h1", "stress_l2"), 0.02)
    expected |= dict.fromkeys(
        ("pressure_l2", "pressure_max", "pressure_means", "pressure_inner", "pressure_total"), 0.03
    )
    expected |= {"stress_max": 0.01, "pressure_oscillation": 0.0}
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-10, abs=1e-14), name


def test_a_macro_element_counts_as_far_as_it_is_covered(handmade):
    """25 off by 5 on a quarter of one of two macro-elements of the same length."""
    zone = handmade.zones[0]
    zone.multiplier, zone.coverage = np.array([30.0, 25.0]), np.array([0.25, 1.0])
    found = errors(handmade)
    assert found["pressure_l2"] == pytest.approx(np.sqrt(0.25 * 5**2 / (1.25 * 25**2)))
    assert found["pressure_means"] == pytest.approx(found["pressure_l2"])
    assert found["pressure_max"] == pytest.approx(0.2)
    assert found["pressure_total"] == pytest.approx(0.25 * 5 / (1.25 * 25))
    zone.coverage = np.array([0.0, 1.0])
    assert max(errors(handmade)[name] for name in ("pressure_l2", "pressure_max")) < 1e-14


def test_rigid_bodies_are_left_out(handmade):
    handmade.case = replace(handmade.case, rigid={"bottom": Rigid(rigid=True)})
    handmade.displacement[handmade.fields.body == 0] = 7.0
    handmade.stress[handmade.fields.body == 0] = 7.0
    assert max(errors(handmade).values()) < 1e-14


@pytest.mark.parametrize(
    ("order", "cells"),
    [
        *((2, cells) for cells in ("TRIA3", "QUAD4", "TETRA4", "HEXA8", "PENTA6", "PYRA5")),
        *((3, cells) for cells in ("TRIA6", "QUAD8", "QUAD9", "TETRA10", "HEXA20", "HEXA27")),
    ],
)
def test_interpolants_show_the_order_of_their_cells(handmade, order, cells):
    """On a mesh of half the size around the same point, errors are 2^-order of what they were."""
    exact = (Parabola2d if cells[:4] in ("TRIA", "QUAD") else Paraboloid3d)(material=UNIT)
    coarse, fine = (errors(interpolated(handmade, cells, exact, h)) for h in (1 / 32, 1 / 64))
    for name, expected in (
        ("displacement_l2", order),
        ("displacement_h1", order - 1),
        ("stress_l2", order - 1),
    ):
        assert np.log2(coarse[name] / fine[name]) == pytest.approx(expected, abs=0.1), name
    assert fine["stress_max"] == 0  # exact at the nodes


def line(n: int, low: float, high: float, pressure) -> ZoneResult:
    """A surface of n macro-elements of two sub-faces from low to high, pressures at centres."""
    nodes, macro = np.arange(2 * n + 1), np.repeat(np.arange(n), 2)
    x = np.linspace(low, high, n + 1)
    centre = np.c_[(x[1:] + x[:-1]) / 2, np.zeros(n)]
    shuffled = np.random.default_rng(0).permutation(2 * n)
    return ZoneResult(
        name="line",
        faces=[("SEG2", np.c_[nodes[:-1], nodes[1:]][shuffled], macro[shuffled])],
        centre=centre,
        normal=np.tile([0.0, 1.0], (n, 1)),
        area=np.full(n, (high - low) / n),
        multiplier=pressure(centre),
        gap=np.zeros(n),
        closed=np.ones(n, dtype=bool),
        coverage=np.ones(n),
        surfaces=surfaces([], *np.empty((2, 0), dtype=int)),
    )


def on_line(handmade, exact, n, low, high, pressure=None):
    zone = line(n, low, high, pressure or exact.contact_pressure)
    points = np.c_[np.linspace(low, high, 2 * n + 1), np.zeros(2 * n + 1)]
    return replace(
        with_exact(handmade, exact),
        mesh=meshio.Mesh(points, []),
        displacement=np.zeros_like(points),
        stress=np.zeros((len(points), 6)),
        fields=replace(handmade.fields, body=np.zeros(len(points), dtype=int)),
        zones=[zone],
    )


def test_a_zigzag_oscillates(handmade):
    """± 1 in turn: each second difference is 4."""
    exact = HertzCylinder(force=1e9, radius=1e9, lower=UNIT, upper=UNIT)
    solution = on_line(handmade, exact, 20, -1.0, 1.0)
    solution.zones[0].multiplier += (-1.0) ** np.arange(20)
    found = errors(solution)
    assert found["pressure_oscillation"] == pytest.approx(4 / exact.peak, rel=1e-4)


def test_a_slope_and_a_jump_at_the_end_of_a_contact_do_not(handmade):
    exact = HertzCylinder(force=1.0, radius=1.0, lower=UNIT, upper=UNIT)
    a = exact.half_width
    solution = on_line(handmade, exact, 41, -1.5 * a, 1.5 * a)
    zone = solution.zones[0]
    smooth = errors(solution)["pressure_oscillation"]
    zone.multiplier = zone.multiplier + 0.1 * zone.centre[:, 0]
    outside = np.abs(zone.centre[:, 0]) > 0.85 * a
    zone.multiplier[outside] += 100 * (-1.0) ** np.arange(outside.sum())
    assert errors(solution)["pressure_oscillation"] == pytest.approx(smooth, abs=1e-12)
    assert smooth < 5e-3


def test_the_exact_pressure_at_nodes_does_not_oscillate(handmade):
    exact = HertzCylinder(force=1.0, radius=1.0, lower=UNIT, upper=UNIT)
    solution = on_line(handmade, exact, 41, -0.9 * exact.half_width, 0.9 * exact.half_width)
    pressure = exact.contact_pressure(solution.mesh.points)
    nodes = np.arange(len(pressure))
    solution.zones[0].nodal = NodalContact(nodes, pressure, 0 * pressure, pressure > 0)
    assert errors(solution)["pressure_oscillation"] == pytest.approx(0, abs=1e-12)


def test_the_last_two_macro_elements_of_a_contact_are_left_out(handmade):
    """Elements of 0.1; the contact ends at 0.95, in the 30th of 40."""
    unit = HertzCylinder(force=1.0, radius=1.0, lower=UNIT, upper=UNIT)
    exact = replace(unit, force=(0.95 / unit.half_width) ** 2)
    solution = on_line(handmade, exact, 40, -2.0, 2.0)
    zone, found = solution.zones[0], {}
    exactly = zone.multiplier
    for number in (28, 29, 30, 31):
        zone.multiplier = exactly + exact.peak / 2 * (np.arange(40) == number - 1)
        found[number] = errors(solution)["pressure_inner"]
    assert found[28] == pytest.approx(0.5, rel=0.02)
    assert max(found[number] for number in (29, 30, 31)) < 0.005  # centres instead of means


def test_half_width_and_peak_of_a_half_ellipse(handmade):
    exact = HertzCylinder(force=1.0, radius=1.0, lower=UNIT, upper=UNIT)
    a = exact.half_width
    wider = replace(exact, force=1.0201)  # half-width and peak are 1.01 times as large
    found = errors(on_line(handmade, exact, 400, -2 * a, 2 * a, wider.contact_pressure))
    assert found["half_width"] == pytest.approx(0.01, abs=2e-4)  # pressures at centres, not means
    assert found["peak"] == pytest.approx(0.01, rel=1e-6)
    few = errors(on_line(handmade, exact, 2, -2 * a, 2 * a))
    assert "peak" not in few


def test_half_width_and_peak_are_measured_without_the_exact_ones():
    """The same pressures, whatever half-width is expected; a triangle's from its second moment."""
    one = HertzCylinder(force=1.0, radius=1.0, lower=UNIT, upper=UNIT)
    x = np.c_[(np.arange(200) + 0.5) / 200, np.zeros(200)]
    pressure = 1 - x[:, 0]
    found = [e.measured(x, pressure, x, pressure) for e in (one, replace(one, force=9.0))]
    assert found[0] == found[1]
    assert found[0]["half_width"] == pytest.approx(2 * np.sqrt(1 / 6), rel=1e-4)


def test_constants_show_order_one_and_exact_means_none(handmade):
    """∫ (p − p̄)² over an element is p'² h³/12 where p is linear."""
    exact = Parabola2d(material=UNIT)
    coarse, fine = (errors(on_line(handmade, exact, n, 0.0, 1.0)) for n in (16, 32))
    assert np.log2(coarse["pressure_l2"] / fine["pressure_l2"]) == pytest.approx(1.0, abs=0.01)
    assert np.log2(coarse["pressure_means"] / fine["pressure_means"]) == pytest.approx(2, abs=0.01)


# Second differences on surfaces: chequered pressures, linear ones, and the rim.


STUDY = read_study(WORK)


@pytest.fixture(
    scope="module", params=["lac", "lac:hexahedra", "uncut", "nodal", "node-to-segment"]
)
def solution(request):
    """The patch test on a slave surface of 6 × 6 squares."""
    treatment, _, cut = request.param.partition(":")
    of = next(
        p
        for p in points_of(STUDY, STUDY.group("patch-3d"))
        if p.labels == {"treatment": treatment, "level": "2"}
    )
    case = of.case.as_solved(False, cut or None)
    return simulate(case, mesh_of(case))


def measured(solution, change):
    """The second difference of the exact pressure with `change` of x, y, column and row added."""
    [zone] = solution.zones
    nodal = zone.nodal
    place = zone.centre if nodal is None else solution.mesh.points[nodal.nodes]
    column, row = np.floor(place[:, :2].T / (50 / 6) + 0.25).astype(int)
    added = change(*place[:, :2].T, column, row)
    if nodal is None:
        zone = replace(zone, multiplier=25 + added)
    else:
        zone = replace(zone, nodal=replace(nodal, multiplier=25 + added))
    mean = np.full(len(zone.area), 25.0)
    return oscillation(solution.mesh.points, zone, solution.case.reference.exact, mean)


def test_a_linear_pressure_does_not_oscillate(solution):
    found = measured(solution, lambda x, y, column, row: 3 + 0.2 * x - 0.1 * y)
    assert found == pytest.approx(0, abs=1e-9)


def test_a_chequered_pressure_oscillates(solution):
    """± 1 in turn: all four neighbours differ by 2, twice their mean difference is 4."""
    found = measured(solution, lambda x, y, column, row: (-1.0) ** (column + row))
    assert found == pytest.approx(4, abs=1e-9)


def test_a_single_place_differs_from_its_neighbours(solution):
    """One place higher by 1: there 2, at each of its four neighbours 2 / 4."""
    found = measured(solution, lambda x, y, column, row: 1.0 * ((column == 2) & (row == 3)))
    assert found == pytest.approx(2, abs=1e-9)


def test_corners_have_no_second_difference(solution):
    """A corner's neighbours lie at the rim as it does."""
    found = measured(solution, lambda x, y, column, row: 100.0 * ((column == 0) & (row == 0)))
    assert found == pytest.approx(0, abs=1e-9)
