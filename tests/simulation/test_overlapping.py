"""Multipliers at slave vertices, with no unknown of their own, in systems solved by multigrid."""

import pytest

from solver import solve_case
from solver.mechanics.linear.choice import force_solver
from tests.scenes import PRESSURE, block_case, block_mesh
from tests.simulation.test_stabilised import check_like_a_factor, waves


@pytest.mark.parametrize("cells", [("HEXA8", "TETRA4"), ("TETRA10", "HEXA20")])
def test_the_patch_test_is_exact(cells):
    case = block_case(3, zone=", treatment: nodal")
    with force_solver("multigrid"):
        found = solve_case(case, block_mesh(*cells, (4, 3)))
    assert "multigrid" in found.solution.linear_solver
    assert found.pressure == pytest.approx(PRESSURE, rel=1e-12)


@pytest.mark.parametrize("treatment", ["nodal", "uncut"])
def test_the_pressures_are_those_of_a_factor(treatment):
    case = waves(("HEXA8", 6), ("HEXA8", 3), (1e3, 1e4), treatment=treatment)
    check_like_a_factor(case, 0.3, 1e-10)
