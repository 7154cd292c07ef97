"""Oscillation found without a reference: on pressures written by hand, and in two solves."""

from dataclasses import replace

import numpy as np
import pytest

from solver import solve_case
from solver.verification.scatter import LIMIT, oscillating, scatter
from tests.simulation.test_stabilised import LYING, STIFF, waves

SIDE = 8


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
    assert measured(solved, lambda i, j: 10 + i - 0.5 * j) == (pytest.approx(0, abs=1e-12), 0)


def test_a_chequered_pressure_oscillates(solved):
    """1 ± 1/2: each differs by 1 from its neighbours, which differ by 1 to the other side."""
    size, _ = measured(solved, lambda i, j: 1 + (-1.0) ** (i + j) / 2)
    assert size == pytest.approx(1 / 1.5)


def test_a_single_high_place(solved):
    """Higher by 1: off the trend by 1, its neighbours by −1/4, these with a mean of 1/4 around."""
    size, _ = measured(solved, lambda i, j: 1.0 * ((i == 3) & (j == 4)))
    assert size == pytest.approx(1 / 4)


def test_the_edge_of_contact_is_no_oscillation(solved):
    """A half ellipse, five faces long, ends with a vertical tangent."""
    size, spots = measured(
        solved, lambda i, j: np.sqrt(np.maximum(1 - (i / 5) ** 2, 0)), lambda i, j: i < 5
    )
    assert size < LIMIT / 4
    assert spots == 0


def test_contact_in_spots(solved):
    """Faces two apart, each smaller than a master face twice as large."""
    [zone] = solved.zones
    _, nodes = zone.master_faces[0]
    stretched = solved.mesh.points.copy()
    stretched[nodes] *= [2, 2, 1]
    flag = (np.floor(zone.centre[:, 0]) % 3 == 0) & (np.floor(zone.centre[:, 1]) % 3 == 0)
    spotted = replace(zone, multiplier=1.0 * flag, closed=flag)
    assert scatter(stretched, spotted)[1] == 9


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
