"""Zones that share nodes: corners, junctions, chains of slave and master, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from solver import solve_case
from solver.case.reader import parse_case
from solver.simulation.judgement.validity import meshed
from solver.simulation.scene.attributes import Attributes
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.studies.measures import inf_sup_constant
from solver.system.errors import InputError
from solver.verification.run import mesh_of
from tests.faults.planted import CASES
from tests.patches import force_solver
from tests.scenes import block_mesh, changed_case, solved

BLOCK = {"cells": "QUAD4", "divisions": [2, 2]}
CORNER = (CASES / "shared/corner-quad4-tria6.yaml").read_text(encoding="utf-8")
CHAIN = """\
name: chain
mesh:
  recipe: bricks
  bricks:
    - {name: base, low: [0, -1], high: [4, 0], block: {cells: QUAD4, divisions: [5, 2]}}
    - {name: left, low: [0, 0], high: [2, 1], block: {cells: TRIA3, divisions: [3, 2]}}
    - {name: right, low: [2, 0], high: [4, 1], block: {cells: QUAD4, divisions: [4, 3]}}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
groups:
  floor: {within: base, box: {low: [0, 0], high: [4, 0]}}
  under_left: {within: left, box: {low: [0, 0], high: [2, 0]}}
  under_right: {within: right, box: {low: [2, 0], high: [4, 0]}}
  ground: {plane: {point: [0, -1], normal: [0, 1]}}
  sides: {where: 1e-9 - abs(x*(x - 4)), within: [base, left, right]}
  side: {within: left, box: {low: [2, 0], high: [2, 1]}}
  facing: {within: right, box: {low: [2, 0], high: [2, 1]}}
  top: {plane: {point: [0, 1], normal: [0, 1]}}
supports:
  - {group: ground, fix: [y]}
  - {group: sides, fix: [x]}
loads: [{group: top, pressure: PRESSURE}]
contact:
  - {name: one, slave: under_left, master: floor}
  - {name: two, slave: floor, master: under_right}
  - {name: three, slave: side, master: facing}
"""


def exact_at_the_corner(solution, allowed=1e-13):
    for zone, pressure in zip(solution.zones, (25.0, 10.0), strict=True):
        assert np.abs(zone.multiplier / pressure - 1).max() < allowed
    uniform = solution.stress[:, [0, 1, 3]] - [-10.0, -25.0, 0.0]
    assert np.abs(uniform).max() < 25 * allowed


@pytest.mark.parametrize("treatment", ["uncut", "nodal", "nodal_dual"])
@pytest.mark.parametrize("swap", [False, True])
def test_corner_with_other_treatments(treatment, swap):
    text = CORNER.replace("cells: TRIA6", "cells: TRIA3")
    for name in ("under}", "side}"):
        text = text.replace(f"master: {name}", f"master: {name[:-1]}, treatment: {treatment}}}")
    assert text.count(treatment) == 2
    exact_at_the_corner(solved(text, swapped=swap), 1e-12)


@pytest.mark.parametrize("recovery", ["linear", "quadratic", "smooth"])
def test_corner_with_recovery(recovery):
    exact_at_the_corner(solved(CORNER, recovery=recovery))


def test_corner_with_multigrid():
    text = (CASES / "shared/corner-hexa8-tetra4.yaml").read_text(encoding="utf-8")
    with force_solver("multigrid"):
        solution = solved(text)
    assert "multigrid" in solution.cost.linear_solver
    for zone, pressure in zip(solution.zones, (10.0, 15.0, 25.0), strict=True):
        assert np.abs(zone.multiplier / pressure - 1).max() < 1e-12


def at_the_corner(n, treatment):
    """β_h of a seat with n slave faces on the wall and 2n on the floor, master faces far longer."""
    block = f"cells: QUAD4, divisions: [{n // 2}, 1]"
    text = CORNER.replace("cells: TRIA6, divisions: [3, 3]", block)
    for sizes in ("[2, 2]", "[4, 2]"):
        text = text.replace(f"divisions: {sizes}", f"divisions: [{n * int(sizes[1]) // 2}, {n}]")
    for name in ("under}", "side}"):
        text = text.replace(f"master: {name}", f"master: {name[:-1]}, treatment: {treatment}}}")
    text = text.replace("transform: {perturb: 0.15}", "").replace("young: 2000.0", "young: 1.0")
    case = parse_case(text, Path("shared.yaml"))
    return inf_sup_constant(build_scene(case, mesh_of(case)))


def test_the_inf_sup_constant_at_a_corner():
    """It equals one zone's, and levels off; without the cut it halves with the mesh."""
    assert [at_the_corner(n, "lac") for n in (4, 8)] == pytest.approx([0.594, 0.579], abs=1e-3)
    coarse, fine = (at_the_corner(n, "uncut") for n in (4, 8))
    assert fine / coarse == pytest.approx(0.5, abs=0.02)


def mean_gaps(solution):
    """Of the left block over the base, by macro-element, from the nodes on the interface alone.

    All edges there are straight: displacements are linear between the nodes of each body.
    """
    x, u = solution.mesh.points[:, 0], solution.displacement[:, 1]
    level = np.abs(solution.mesh.points[:, 1]) < 1e-9
    names = [body.name for body in solution.bodies]
    upper, lower = (
        level & (solution.fields.body == names.index(name)) for name in ("left", "base")
    )
    ends = np.linspace(0, 2, 4)
    places = np.unique(np.concatenate([ends, x[upper], x[lower][x[lower] < 2]]))
    gap = np.zeros(len(places))
    for side, sign in ((upper, 1.0), (lower, -1.0)):
        order = np.argsort(x[side])
        gap += sign * np.interp(places, x[side][order], u[side][order])
    area = np.append(0.0, np.cumsum(np.diff(places) * (gap[1:] + gap[:-1]) / 2))
    return np.diff(np.interp(ends, places, area))


@pytest.mark.parametrize("swap", [False, True])
def test_a_face_that_is_slave_in_one_zone_and_master_in_another(swap):
    """The middle face of the base lies under both blocks: σ_yy = −25, no strain along x."""
    solution = solved(CHAIN.replace("PRESSURE", "25.0"), swapped=swap)
    for zone in solution.zones[:2]:
        pressed = zone.coverage > 0.01
        assert np.abs(zone.multiplier[pressed] / 25 - 1).max() < 1e-12
        assert pressed.sum() < len(pressed) or zone.name == ("two" if swap else "one")
    assert np.abs(solution.zones[2].multiplier / (25 * 0.3 / 0.7) - 1).max() < 1e-12


def test_a_cut_master_moves_as_its_cells_do(monkeypatch):
    text = CHAIN.replace("PRESSURE", "10 + 15*x")
    solution = solved(text)
    size = np.abs(solution.displacement).max()
    assert (solution.zones[0].multiplier > 0).all()
    assert np.abs(mean_gaps(solution)).max() < 1e-13 * size
    monkeypatch.setattr(Attributes, "as_cut", lambda _, faces: faces)
    assert np.abs(mean_gaps(solved(text))).max() > 1e-4 * size


def test_two_zones_with_the_same_two_surfaces_are_refused():
    """Both say that the mean of all gaps is zero: the pressures would not be unique."""
    once = "{name: interface, slave: bottom_contact, master: top_contact}"
    again = f"{once}\n  - {{name: back, slave: top_contact, master: bottom_contact}}"
    with pytest.raises(InputError, match=r"of zone .* another zone hold their inner"):
        simulate(changed_case(2, (once, again)), block_mesh("QUAD4", "TRIA3"))


def test_a_block_in_a_corner_of_two_rigid_planes():
    """The node in the corner belongs to both zones; what carries a plane is no cell of a body."""
    text = """\
name: planes
mesh:
  recipe: bricks
  bricks: [{name: block, low: [0, 0], high: [1, 1], block: {cells: QUAD4, divisions: [2, 3]}}]
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
groups:
  under: {plane: {point: [0, 0], normal: [0, 1]}}
  side: {plane: {point: [0, 0], normal: [1, 0]}}
  top: {plane: {point: [0, 1], normal: [0, 1]}}
  right: {plane: {point: [1, 0], normal: [1, 0]}}
bodies:
  floor: {plane: {point: [0, 0], normal: [0, 1]}}
  wall: {plane: {point: [0, 0], normal: [1, 0]}}
supports: [{group: top, together: [y]}]
loads: [{group: top, pressure: 25.0}, {group: right, pressure: 10.0}]
contact:
  - {name: below, slave: under, master: floor}
  - {name: beside, slave: side, master: wall}
"""
    case = parse_case(text, Path("planes.yaml"))
    for zone, pressure in zip(simulate(case, mesh_of(case)).zones, (25.0, 10.0), strict=True):
        assert np.abs(zone.multiplier / pressure - 1).max() < 1e-13
    scene = build_scene(case, mesh_of(case))
    assert len(scene.mesh.cells["TRIA3"]) == 2
    kept = meshed(scene)
    assert len(kept["TRIA3"]) == 0
    assert len(kept["QUAD4"]) == len(scene.mesh.cells["QUAD4"])


@pytest.mark.parametrize("joined", [False, True])
def test_bodies_with_nodes_at_the_same_places_and_no_zone_are_noted(joined):
    """Two halves of a body whose nodes were not merged: they are apart."""
    halves = ["left", "left" if joined else "right"]
    low = [
        {"name": name, "low": [x, -1], "high": [x + 0.5, 0], "block": BLOCK}
        for name, x in zip(halves, (0, 0.5), strict=True)
    ]
    on_top = {"point": [0, 0], "normal": [0, 1]}
    found = solve_case(
        {
            "name": "seam",
            "mesh": {
                "recipe": "bricks",
                "bricks": [*low, {"name": "up", "low": [0, 0], "high": [1, 1], "block": BLOCK}],
            },
            "plane": "strain",
            "materials": {"all": {"young": 1000.0, "poisson": 0.3}},
            "groups": {
                "floor": {"of": "nodes", "plane": {"point": [0, -1], "normal": [0, 1]}},
                "sides": {"of": "nodes", "plane": {"point": [0, 0], "normal": [1, 0]}},
                "press": {"plane": {"point": [0, 1], "normal": [0, 1]}},
                "ub": {"within": "up", "plane": on_top},
                "lt": {"within": sorted(set(halves)), "plane": on_top},
            },
            "supports": [{"group": "floor", "fix": ["x", "y"]}, {"group": "sides", "fix": ["x"]}],
            "loads": [{"group": "press", "pressure": 10.0}],
            "contact": [{"slave": "ub", "master": "lt"}],
        }
    )
    told = [line.what for line in found.solution.plan if "at the same places" in line.what]
    assert told == (
        [] if joined else ["3 nodes of left and right at the same places, and no zone there"]
    )
