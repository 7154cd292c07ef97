"""Second differences on surfaces: chequered pressures, linear ones, and the rim."""

from dataclasses import replace

import numpy as np
import pytest

from solver.simulation.simulate import simulate
from solver.studies.description import read_study
from solver.verification.norms import oscillation
from solver.verification.run import mesh_of
from tests.studies.measured import WORK

STUDY = read_study(WORK)


@pytest.fixture(
    scope="module", params=["lac", "lac:hexahedra", "uncut", "nodal", "node-to-segment"]
)
def solution(request):
    """The patch test on a slave surface of 6 × 6 squares."""
    treatment, _, cut = request.param.partition(":")
    of = next(
        p
        for p in STUDY.points(STUDY.group("patch-3d"))
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
    return oscillation(solution.mesh.points, zone, solution.case.solution, mean)


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
