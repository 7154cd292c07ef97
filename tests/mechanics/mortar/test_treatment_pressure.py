"""The pressure of nodal multipliers: as a field, in the norms, in the result, on known problems."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from solver.case.material import Material
from solver.case.reader import load_case
from solver.case.solutions.catalogue import SOLUTIONS
from solver.lac.cells.faces import surface_points
from solver.mechanics.mortar.treatments import TREATMENTS
from solver.simulation.results.exact import computed_pressure
from solver.simulation.results.solution import NodalContact
from solver.simulation.simulate import simulate
from solver.verification.norms import errors
from solver.verification.run import mesh_of, refined
from tests.handmade import plane
from tests.scenes import block_mesh, changed_case

CASES = Path(__file__).parents[3] / "cases"
HALF = 'press, pressure: "12.5*(1 - (x - 0.5)/sqrt((x - 0.5)*(x - 0.5)))"'


def nodal(solution, pressure):
    """The zone with multipliers at all slave nodes, `pressure` a function of their places."""
    zone = solution.zones[0]
    nodes = np.unique(np.concatenate([nodes.ravel() for _, nodes, _ in zone.faces]))
    values = pressure(solution.mesh.points[nodes])
    closed = np.ones(len(nodes), dtype=bool)
    zone.nodal = NodalContact(nodes, values, np.zeros(len(nodes)), closed)
    return zone


def test_between_nodes_the_pressure_is_linear(tmp_path):
    solution = plane(tmp_path)
    zone = nodal(solution, lambda x: 2 + 3 * x[:, 0])
    at = surface_points(solution.mesh.points, zone.faces)
    assert computed_pressure(solution.mesh.points, zone) == pytest.approx(
        2 + 3 * at.place[:, 0], rel=1e-14
    )


def test_a_pressure_that_alternates_from_node_to_node_shows(tmp_path):
    """±1 about 25: averages over faces hide it, second differences at nodes are 4."""
    solution = plane(tmp_path)
    steel = Material(2000.0, 0.3)
    exact = SOLUTIONS["uniform_compression"](
        pressure=25.0, base=-50.0, lower=steel, upper=steel, dim=2
    )
    solution.case = solution.case.with_exact(exact)

    def alternating(x):
        order = np.argsort(np.argsort(x[:, 0]))
        return 25.0 + np.where(order % 2, 1.0, -1.0)

    nodal(solution, alternating)
    found = errors(solution)
    assert found["pressure_oscillation"] == pytest.approx(4 / 25)
    # ∫ of the square of a line from −1 to 1 is a third of its length
    assert found["pressure_l2"] == pytest.approx(np.sqrt(1 / 3) / 25)
    assert found["pressure_means"] < 1e-14


def second_difference(treatment, mesh):
    """The largest second difference of the pressure over 25, the top loaded on its left half."""
    half = ("press, pressure: 25.0", HALF)
    solution = simulate(changed_case(2, half, zone=f", treatment: {treatment}"), mesh)
    zone = solution.zones[0]
    assert zone.closed.all()
    place, values = zone.centre, zone.multiplier
    if zone.nodal:
        place, values = solution.mesh.points[zone.nodal.nodes], zone.nodal.multiplier
    return np.abs(np.diff(values[np.argsort(place[:, 0])], 2)).max() / 25


@pytest.mark.parametrize("cells", ["TRIA3", "QUAD4"])
def test_only_a_constant_on_uncut_faces_keeps_oscillating(cells):
    """Block loaded on one half, the master four times as coarse as the slave.

    The exact pressure has bounded derivatives, so second differences fall with refinement wherever
    the multipliers are stable: four times as fine meshes at least halve them.
    """
    meshes = [block_mesh(cells, cells, counts) for counts in ((16, 4), (64, 16))]
    for treatment in TREATMENTS:
        coarse, fine = (second_difference(treatment, mesh) for mesh in meshes)
        if treatment == "uncut":
            assert fine > 0.3
            assert fine > coarse
        else:
            assert fine < 0.1
            assert fine < 0.5 * coarse


@pytest.mark.parametrize("treatment", TREATMENTS)
def test_displacements_converge_with_every_treatment(treatment):
    """Contact on a parabola with TRIA3: order two in L2, whatever the treatment."""
    found = []
    for factor in (1, 2):
        case = refined(load_case(CASES / "manufactured/tria3.yaml"), factor)
        case = replace(
            case, zones=tuple(structs.replace(z, treatment=treatment) for z in case.zones)
        )
        solution = simulate(case, mesh_of(case))
        found.append(errors(solution)["displacement_l2"])
        assert solution.zones[0].closed.all()
    assert np.log2(found[0] / found[1]) == pytest.approx(2, abs=0.1)
