"""Oscillation found without a reference: on pressures written by hand, and in two solves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver import solve_case
from solver.case.reader import load_case
from solver.mesh.transforms import transform
from solver.verification.run import mesh_of
from solver.verification.scatter import LIMIT, oscillating, scatter
from tests.sector import sector
from tests.simulation.test_stabilised import LYING, STIFF, waves

SIDE, CASES = 8, Path(__file__).resolve().parents[2] / "cases"

# Rows of 1 ± 1/2: each is off by 1/2, and of four neighbours two are so to the other side.
ROWS = np.sqrt(0.5 * 0.25) / 1.5


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


def test_a_linear_pressure_does_not_oscillate(solved):
    found = measured(solved, lambda i, j: 10 + i - 0.5 * j)
    assert found == pytest.approx((0, 0, 0, 0), abs=1e-12)


def test_a_chequered_pressure_oscillates(solved):
    """1 ± 1/2: each differs by 1 from its neighbours, which differ by 1 to the other side."""
    found = measured(solved, lambda i, j: 1 + (-1.0) ** (i + j) / 2)
    assert found.size == found.averaged == pytest.approx(1 / 1.5)


def test_a_single_high_place(solved):
    """Higher by 1: off the trend by 1, its neighbours by −1/4, these with a mean of 1/4 around."""
    found = measured(solved, lambda i, j: 1.0 * ((i == 3) & (j == 4)))
    assert found.size == pytest.approx(1 / 4)


def test_what_averages_out_over_master_faces(solved):
    """Rows of 1 ± 1/2 under master faces twice as wide: their means do not oscillate.

    A master face over the middle of a row has it whole and half of each row beside it.
    """
    [zone] = solved.zones
    _, nodes = zone.master_faces[0]
    stretched = solved.mesh.points.copy()
    stretched[nodes] *= [1, 2, 1]
    row = np.floor(zone.centre[:, 1])
    found = scatter(stretched, replace(zone, multiplier=1 + (-1.0) ** row / 2))
    assert found.size == pytest.approx(ROWS)
    assert found.averaged < LIMIT


def test_the_edge_of_contact_is_no_oscillation(solved):
    """A half ellipse, five faces long, ends with a vertical tangent."""
    found = measured(
        solved, lambda i, j: np.sqrt(np.maximum(1 - (i / 5) ** 2, 0)), lambda i, j: i < 5
    )
    assert found.size < LIMIT / 4
    assert found.spots == 0


def test_contact_in_spots(solved):
    """Faces two apart, each smaller than a master face twice as large."""
    [zone] = solved.zones
    _, nodes = zone.master_faces[0]
    stretched = solved.mesh.points.copy()
    stretched[nodes] *= [2, 2, 1]
    flag = (np.floor(zone.centre[:, 0]) % 3 == 0) & (np.floor(zone.centre[:, 1]) % 3 == 0)
    spotted = replace(zone, multiplier=1.0 * flag, closed=flag)
    found = scatter(stretched, spotted)
    assert found.spots == 9
    assert found.in_spots == 1.0


@pytest.mark.parametrize("factor", [1e-5, 0.1, 1.0, 10.0, 1e5])
def test_a_stretched_surface_is_judged_alike(solved, factor):
    """Neighbours are counted by faces, whatever these measure along either axis."""
    [zone] = solved.zones
    scale = np.array([factor, 1, 1])
    points, centre = solved.mesh.points * scale, zone.centre * scale
    row, column = np.floor(zone.centre[:, 1]), np.floor(zone.centre[:, 0])
    for pressure, size in ((1 + 0 * row, 0.0), (10 + row - column, 0.0), (1.5 - row % 2, ROWS)):
        stretched = replace(zone, centre=centre, area=factor * zone.area, multiplier=pressure)
        found = scatter(points, stretched)
        assert found.size == pytest.approx(size, abs=1e-10)
        assert found.spots == 0


def test_stretched_blocks_are_in_one_piece():
    """Two blocks stretched by 1e5 along their interface, and pressed with 25."""
    case = CASES / "ssnp170" / "k.yaml"
    mesh = transform(mesh_of(load_case(case)), {"stretch": [1e5, 1, 1]}, "test")
    found = solve_case(case, mesh)
    assert "spots" not in found.reason


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
    assert "oscillates by" in solve_case(*sector(*UPPER)).reason


def test_a_smooth_pressure_along_stretched_faces():
    found = solve_case(*sector(*LOWER))
    assert found.verdict == "solved"


@pytest.mark.parametrize("given", [STIFF, LYING], ids=["fine and stiff", "PENTA6"])
def test_both_situations_are_unreliable_and_the_advice_helps(given):
    found = solve_case(waves(**given))
    assert found.verdict == "unreliable"
    assert "exchange slave and master, set `stabilised: true`" in found.outcome.reason
    for case, swapped in ((waves(**given), True), (waves(**given, stabilised=True), False)):
        assert oscillating(solve_case(case, swapped=swapped).solution) == ""


def test_a_tolerance_may_allow_more():
    """A case that allows errors of the pressure of this size gets no warning of them."""
    case = waves(**LYING)
    case["tolerance"] = {"multiplier": 0.5}
    assert oscillating(solve_case(case).solution) == ""
