"""The treatments on the patch test: who passes, who fails, and what is refused."""

import numpy as np
import pytest

from solver.lac.errors import SolveError
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from tests.scenes import (
    POISSON,
    PRESSURE,
    YOUNG,
    block_case,
    block_mesh,
    changed_case,
    errors,
)

PLANE = ["TRIA3", "TRIA6", "QUAD4", "QUAD8", "QUAD9"]
SOLID = ["TETRA4", "TETRA10", "HEXA8", "HEXA20", "HEXA27", "PENTA15", "PYRA5"]
POINTS = ["quadrature, points: 2", "quadrature, points: 8", "node_to_segment"]


def solved(treatment, mesh, extra=""):
    dim = mesh.points.shape[1]
    return simulate(block_case(dim, extra, f", treatment: {treatment}"), mesh)


def worst(solution):
    return max(errors(solution).values())


@pytest.mark.parametrize("cells", ["TRIA3", "QUAD8", "HEXA8", "HEXA27"])
def test_node_to_segment_fails_where_they_do_not(cells):
    solution = solved("node_to_segment", block_mesh(cells, cells, (4, 3)))
    found = errors(solution)
    assert found["pressure"] > 2e-3
    assert found["stress"] > 2e-2
    # which is not for lack of balance
    assert found["balance"] < 1e-14


@pytest.mark.parametrize("cells", ["HEXA8", "HEXA27"])
def test_quadrature_fails_less_with_more_points(cells):
    """The integrands have kinks: the error of n points falls as n⁻², and is never round-off."""
    mesh = block_mesh(cells, cells)
    stress = [errors(solved(f"quadrature, points: {n}", mesh))["stress"] for n in (2, 4, 8)]
    assert stress[0] > 5e-3
    assert stress[2] > 1e-4
    orders = np.log2(np.array(stress[:-1]) / stress[1:])
    assert np.abs(orders - 2).max() < 0.4


@pytest.mark.parametrize(
    ("treatment", "cells", "named", "others"),
    [
        ("nodal_dual", "HEXA20", "QUAD8 of HEXA20", "lac, uncut, quadrature, nodal"),
        ("nodal_dual", "TRIA6", "SEG3 of TRIA6", "lac, uncut, quadrature, node_to_segment, nodal"),
        ("node_to_segment", "TETRA10", "TRIA6 of TETRA10", "lac, uncut, quadrature, nodal"),
    ],
)
def test_a_treatment_that_does_not_exist_says_so(treatment, cells, named, others):
    other = "QUAD4" if cells == "TRIA6" else "HEXA8"
    mesh = block_mesh(cells, other)
    with pytest.raises(InputError) as refusal:
        solved(treatment, mesh)
    message = str(refusal.value)
    assert (
        f"contact[0].treatment = '{treatment}': does not exist for slave faces {named}" in message
    )
    assert message.endswith(f"allowed there: {others}")
    # the other way round it does
    case = block_case(mesh.points.shape[1], zone=f", treatment: {treatment}")
    simulate(case.as_solved(True), mesh)


def held_at_a_side(treatment, mesh):
    """Blocks held in all directions at x = 0, the vertical displacement there that of the patch."""
    dim, up = mesh.points.shape[1], "xyz"[mesh.points.shape[1] - 1]
    modulus = YOUNG / (1 - POISSON**2) if dim == 2 else YOUNG
    sinking = f'"{-PRESSURE / modulus} * ({up} + 1)"'
    held = ("{group: symx, fix: [x]}", f"{{group: symx, fix: {{x: 0, {up}: {sinking}}}}}")
    return simulate(changed_case(dim, held, zone=f", treatment: {treatment}"), mesh)


@pytest.mark.parametrize("treatment", ["lac", "nodal", "nodal_dual"])
@pytest.mark.parametrize(
    ("cells", "counts"),
    [("QUAD4", (4, 4)), ("QUAD4", (4, 3)), ("TRIA3", (3, 4)), ("HEXA8", (3, 3)), ("HEXA8", (3, 2))],
)
def test_slave_nodes_may_be_held(treatment, cells, counts):
    """The state is still uniform. Where the meshes match, a held node's multiplier meets nothing
    that is free; given up for its neighbours', it leaves the patch test exact."""
    solution = held_at_a_side(treatment, block_mesh(cells, cells, counts))
    assert worst(solution) < 1e-12
    zone = solution.zones[0]
    if zone.nodal:
        assert zone.nodal.multiplier == pytest.approx(PRESSURE, rel=1e-12)


def test_quadratic_slave_nodes_may_be_held():
    for cells in ("QUAD8", "TRIA6"):
        assert worst(held_at_a_side("nodal", block_mesh(cells, cells, (4, 4)))) < 1e-12


def test_a_node_to_segment_multiplier_between_held_nodes_is_left_out():
    solution = held_at_a_side("node_to_segment", block_mesh("QUAD4", "QUAD4", (4, 4)))
    assert "interface: 1 multipliers left out" in [line.what for line in solution.plan]
    assert solution.quality.balance["free nodes: force"] < 1e-14


def test_multipliers_that_depend_on_one_another_are_refused_with_the_reason():
    """One constant on each of 26 uncut faces of TETRA4: more than the 20 pairs of nodes answer."""
    with pytest.raises(SolveError, match="26 closed multipliers may depend on one another"):
        solved("uncut", block_mesh("TETRA4", "TETRA4", (3, 3)))
