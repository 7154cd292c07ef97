"""Whether faces resolve a pressure: on pressures written by hand, in fits, and in two solves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from solver import solve_case
from solver.case.reader import load_case
from solver.mesh.transforms import transform
from solver.verification.run import mesh_of
from solver.verification.scatter import LIMIT, scatter, unresolved
from tests.sector import sector
from tests.simulation.test_stabilised import LYING, STIFF, waves

SIDE, CASES = 8, Path(__file__).resolve().parents[2] / "cases"


@pytest.fixture(scope="module")
def solved():
    """A uniform pressure on 8 × 8 slave faces of size 1 over as many master faces."""
    block = {"cells": "HEXA8", "divisions": [SIDE, SIDE, 1]}
    return solve_case(
        {
            "name": "flat",
            "mesh": {"recipe": "blocks", "size": SIDE, "bottom": block, "top": block},
            "materials": {"all": {"young": 1.0, "poisson": 0.0}},
            "supports": [{"group": g, "fix": ["x", "y", "z"]} for g in ("base", "press")],
            "contact": [{"slave": "bottom_contact", "master": "top_contact", "interference": 0.1}],
        }
    ).solution


def measured(solution, pressure, closed=None):
    """The scatter of a pressure that is a function of column, row; `closed` those in contact."""
    [zone] = solution.zones
    column, row = np.floor(zone.centre[:, :2].T).astype(int)
    flag = np.ones(len(column), bool) if closed is None else closed(column, row)
    values = np.where(flag, pressure(column, row), 0.0)
    return scatter(solution.mesh.points, replace(zone, multiplier=values, closed=flag))


def test_a_linear_pressure_does_not_scatter(solved):
    assert measured(solved, lambda i, j: 10 + i - 0.5 * j) == pytest.approx(0, abs=1e-12)


def test_a_chequered_pressure_scatters(solved):
    """1 ± a: each differs by 2 a from its neighbours, which differ by 2 a to the other side.

    At the 28 places of the rim the trend is an extrapolation.
    """
    expected = np.sqrt((36 / 64) * (2 * 0.3) ** 2 / (1 + 0.3**2))
    found = measured(solved, lambda i, j: 1 + 0.3 * (-1.0) ** (i + j))
    assert found == pytest.approx(expected, rel=0.35)
    assert found > LIMIT


def test_a_single_high_place(solved):
    """1 at one place: off by 1, its four neighbours by −1/4; those have 1 among four neighbours."""
    found = measured(solved, lambda i, j: 1.0 * ((i == 3) & (j == 4)))
    assert found == pytest.approx(np.sqrt(1 * 1 / 4 + 4 * 1 / 4 * 1 / 4))


def test_the_edge_of_contact_is_resolved(solved):
    """A half ellipse, five faces long, ends with a vertical tangent."""
    found = measured(
        solved, lambda i, j: np.sqrt(np.maximum(1 - (i / 5) ** 2, 0)), lambda i, j: i < 5
    )
    assert found < LIMIT / 2


@pytest.mark.parametrize("width", [1, 2])
def test_patches_one_or_two_faces_wide_are_not_resolved(solved, width):
    found = measured(solved, lambda i, j: 1.0, lambda i, j: i % (width + 2) < width)
    assert found > LIMIT


@pytest.mark.parametrize("factor", [1e-5, 0.1, 1.0, 10.0, 1e5])
def test_a_stretched_surface_is_judged_alike(solved, factor):
    """Neighbours are counted by faces, whatever these measure along either axis."""
    [zone] = solved.zones
    scale = np.array([factor, 1, 1])
    points, centre = solved.mesh.points * scale, zone.centre * scale
    row, column = np.floor(zone.centre[:, 1]), np.floor(zone.centre[:, 0])
    for pressure in (1 + 0 * row, 10 + row - column, 1.5 - row % 2):
        found = [
            scatter(at, replace(zone, centre=c, area=size * zone.area, multiplier=pressure))
            for at, c, size in ((solved.mesh.points, zone.centre, 1.0), (points, centre, factor))
        ]
        assert found[1] == pytest.approx(found[0], abs=1e-10)


@pytest.mark.parametrize("angle", [17.0, 45.0])
def test_a_turned_surface_is_judged_alike(solved, angle):
    """Squares have no axes of their own."""
    [zone] = solved.zones
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    column, row = np.floor(zone.centre[:, :2].T)
    pressure = 1 + 0.3 * (-1.0) ** (column + row) + 0.1 * column
    turned = replace(zone, centre=zone.centre @ turn.T, normal=zone.normal @ turn.T)
    found = [
        scatter(points, replace(z, multiplier=pressure))
        for points, z in ((solved.mesh.points, zone), (solved.mesh.points @ turn.T, turned))
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-12)


def test_stretched_blocks_are_resolved():
    """Two blocks stretched by 1e5 along their interface, and pressed with 25."""
    case = CASES / "ssnp170" / "k.yaml"
    mesh = transform(mesh_of(load_case(case)), {"stretch": [1e5, 1, 1]}, "test")
    found = solve_case(case, mesh)
    assert "scatters" not in found.reason


def test_what_rounding_takes_from_stretched_blocks_is_said():
    """Pressures of TRIA3 stretched so keep all digits, stresses half of them; it is said."""
    case = CASES / "ssnp170" / "g.yaml"
    mesh = transform(mesh_of(load_case(case)), {"stretch": [1e5, 1]}, "test")
    found = solve_case(case, mesh)
    assert found.verdict == "failed"
    assert "tolerance 1.0e-10; rounding alone may change the result by" in found.reason
    assert "small faces of slender cells" in found.reason
    pressures = [check for check in found.checks if check.name == "multiplier"]
    assert all(check.error < 1e-12 for check in pressures)


UPPER, LOWER = (
    (2.0, (13, 12), (20000.0, 1000.0), "upper"),
    (2.0, (13, 12), (20000.0, 1000.0), "lower"),
)


def test_a_pressure_that_swings_along_stretched_faces():
    """The inner node of a face ten times as long as wide hardly moves: the cut is of no use there.

    From the axis outwards the pressure falls; by 12 faces on 13, it rises from the third to the
    fourth and from the fifth to the sixth. Stabilised contact falls all the way.
    """
    for zone, unreliable in (({}, True), ({"stabilised": True}, False)):
        case, mesh = sector(*UPPER, **zone)
        found = solve_case(case, mesh)
        [result] = found.solution.zones
        order = result.centre[:, 0].argsort()[: result.closed.sum()]
        rises = np.diff(result.multiplier[order]) > 0
        assert rises.any() == unreliable
        assert (found.verdict == "unreliable") == unreliable
    assert "scatters by" in solve_case(*sector(*UPPER)).reason


def test_a_smooth_pressure_along_stretched_faces():
    found = solve_case(*sector(*LOWER))
    assert found.verdict == "solved"


@pytest.mark.parametrize("given", [STIFF, LYING], ids=["fine and stiff", "PENTA6"])
def test_both_situations_are_unreliable_and_the_advice_helps(given):
    found = solve_case(waves(**given))
    assert found.verdict == "unreliable"
    assert "exchange slave and master, set `stabilised: true`" in found.outcome.reason
    for case, swapped in ((waves(**given), True), (waves(**given, stabilised=True), False)):
        assert unresolved(solve_case(case, swapped=swapped).solution) == ""


def test_a_tolerance_may_allow_more():
    """A case that allows errors of the pressure of this size gets no warning of them."""
    case = waves(**LYING)
    case["tolerance"] = {"multiplier": 0.5}
    assert unresolved(solve_case(case).solution) == ""


# Press fits and loaded rings of linear faces, and spheres: the exact pressures of the round bodies.


def rings(inner, outer, slave, interference=0.0, load=0.0, cells="QUAD4", **zone):
    """Nested rings 10–20–50 in plane stress, with so many faces on either side."""
    master = {"top": "bottom", "bottom": "top"}[slave]
    sides = {"slave": f"{slave}_contact", "master": f"{master}_contact"}
    case = {
        "name": "rings",
        "mesh": {
            "recipe": "rings",
            "radii": [10, 20, 50],
            "bottom": {"cells": cells, "divisions": [inner, 5]},
            "top": {"cells": cells, "divisions": [outer, 8]},
        },
        "plane": "stress",
        "materials": {"all": {"young": 210000.0, "poisson": 0.29}},
        "supports": [{"group": "farx", "fix": ["y"]}, {"group": "symx", "fix": ["x"]}],
        "contact": [{"name": "fit", **sides, "interference": interference, **zone}],
    }
    if load:
        case["loads"] = [{"group": "base", "pressure": load}]
    return case


# Lamé: 68.9 for an interference of 0.02; a pressure P in the bore leaves 7/32 of it at the fit.
FIT, LOADED = 68.9 / 0.02, 7 / 32


@pytest.mark.parametrize("slave", ["top", "bottom"])
@pytest.mark.parametrize(
    ("inner", "outer"),
    [(5, 7), (10, 14), (12, 17), (13, 9), (15, 22), (16, 23), (24, 35), (6, 12), (16, 8), (7, 8)],
)
@pytest.mark.parametrize("pushed", [{"interference": 0.02}, {"load": 100.0}])
def test_fits_and_rings_that_facets_break(inner, outer, slave, pushed):
    found = solve_case(rings(inner, outer, slave, **pushed))
    exact = FIT * 0.02 if "interference" in pushed else LOADED * 100.0
    error = found.pressure - exact
    assert np.linalg.norm(error) / np.linalg.norm(exact + 0 * error) > 0.2
    assert found.verdict == "unreliable"
    assert "error of the pressure not estimated" in str(found)


def test_a_pressure_that_facets_break_is_no_better_once_its_load_is_gone():
    case = rings(5, 7, "top", load=100.0)
    found = solve_case(case | {"steps": [1.0, 0.0]})
    assert found.verdict == "unreliable"
    assert "facets" in found.reason


@pytest.mark.parametrize(
    "given",
    [
        {"inner": 9, "outer": 9, "interference": 0.02},
        {"inner": 20, "outer": 21, "interference": 0.1},
        {"inner": 9, "outer": 13, "interference": 0.02, "cells": "QUAD8"},
        {"inner": 7, "outer": 5, "load": 100.0, "cells": "QUAD8"},
        {"inner": 9, "outer": 13, "interference": 0.02, "clearance": 0.0},
        {"inner": 24, "outer": 35, "load": 100.0, "clearance": 0.0},
    ],
)
@pytest.mark.parametrize("slave", ["top", "bottom"])
def test_fits_and_rings_that_are_right(given, slave):
    found = solve_case(rings(slave=slave, **given))
    exact = LOADED * given["load"] if "load" in given else FIT * given["interference"]
    error = found.pressure - exact
    assert np.linalg.norm(error) / np.linalg.norm(exact + 0 * error) < 0.1
    assert found.verdict == "solved"


@pytest.mark.parametrize(("inner", "outer", "error"), [(20, 21, 0.06), (7, 8, 0.22)])
def test_the_change_by_facets_is_about_the_error(inner, outer, error):
    interference = 0.02 if inner == 20 else 0.1
    found = solve_case(rings(inner, outer, "bottom", interference))
    true = np.linalg.norm(found.pressure / (FIT * interference) - 1) / np.sqrt(len(found.pressure))
    assert true == pytest.approx(error, rel=0.1)
    assert found.solution.quality.validity.facets == pytest.approx(true, rel=0.25)


@pytest.mark.parametrize(("inner", "outer"), [(7, 5), (8, 10), (9, 13), (6, 12), (12, 6)])
@pytest.mark.parametrize("slave", ["top", "bottom"])
def test_spheres_that_facets_break(inner, outer, slave):
    """Loaded by 25 inside; the exact contact pressure is 4.894."""
    case = yaml.safe_load((CASES / "lame" / "spheres-hexa8.yaml").read_text())
    for side, n in (("bottom", inner), ("top", outer)):
        case["mesh"][side]["divisions"] = [n, n, 3]
    del case["contact"][0]["clearance"], case["reference"], case["expected"], case["tolerance"]
    found = solve_case(case, swapped=slave == "top")
    whole = solve_case(case | {"contact": [case["contact"][0] | {"clearance": 0.0}]})
    assert whole.verdict == "solved"
    assert found.verdict == "unreliable"


def test_advice_is_what_the_case_admits_of():
    """Friction has no stabilised form, and a rigid body is always master."""
    given = rings(13, 9, "top", 0.02)
    assert "exchange slave and master, set `stabilised: true` or refine" in solve_case(given).reason
    rigid = {"bodies": {"bottom": {"rigid": True}}}
    with_friction = rings(13, 9, "top", 0.02, friction=0.1)
    for case in (given | rigid, with_friction | rigid):
        reason = solve_case(case).reason
        assert "exchange" not in reason
        assert ("stabilised" in reason) == (case["contact"] == given["contact"])
