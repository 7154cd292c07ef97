"""Multipliers at slave vertices, with no unknown of their own, in systems solved by multigrid."""

import numpy as np
import pytest

from solver import solve_case
from solver.mechanics.linear.direct import force_solver
from tests.scenes import PRESSURE, block_case, block_mesh
from tests.simulation.test_stabilised import waves


@pytest.mark.parametrize("cells", [("HEXA8", "TETRA4"), ("TETRA10", "HEXA20")])
def test_the_patch_test_is_exact(cells):
    case = block_case(3, zone=", treatment: nodal")
    with force_solver("multigrid"):
        found = solve_case(case, block_mesh(*cells, (4, 3)))
    assert "multigrid" in found.solution.linear_solver
    assert found.pressure == pytest.approx(PRESSURE, rel=1e-12)


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
@pytest.mark.parametrize("treatment", ["nodal", "uncut"])
def test_the_pressures_are_those_of_a_factor(treatment, poisson):
    """A layer that lifts off in places: several statuses are solved roughly."""
    case = waves(("HEXA8", 6), ("HEXA8", 3), (1e3, 1e4), treatment=treatment)
    case["materials"]["bottom"]["poisson"] = poisson
    case["supports"][-1]["fix"] = ["x", "y"]
    case["loads"] = [{"group": "press", "pressure": 0.5}]
    case.pop("reference")
    found = []
    for kind in ("multigrid", "auto"):
        with force_solver(kind):
            found.append(solve_case(case).solution)
    assert [("multigrid" in solution.linear_solver) for solution in found] == [True, False]
    assert found[0].iterations > 1
    one, other = (solution.zones[0] for solution in found)
    assert 0 < one.closed.sum() < len(one.closed)
    assert (one.closed == other.closed).all()
    peak = other.multiplier.max()
    assert np.abs(one.multiplier - other.multiplier).max() < 1e-10 * peak
