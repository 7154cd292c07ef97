"""Solutions written by hand: two blocks pressed together with 25, exact to the last digit."""

from pathlib import Path

import meshio
import numpy as np

from solver.case.material import Material
from solver.case.reader import load_case
from solver.case.solutions.catalogue import SOLUTIONS
from solver.simulation.results.records import Cost, Fields, Places, Quality, Scalars
from solver.simulation.results.solution import (
    BodyInfo,
    Line,
    Solution,
    StepResult,
    ZoneResult,
    ZoneSurfaces,
)

PLANE = """\
name: two-blocks
title: Two blocks, plane strain
mesh: {file: blocks.msh}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports:
  - {group: sym, fix: [x]}
  - {group: base, fix: [y]}
loads: [{group: press, pressure: 25.0}]
contact: [{name: interface, slave: lower, master: upper}]
directions: both
steps: [0.5, 1.0]
observe: [{zone: interface, nearest: [0, 0]}]
reference:
  kind: analytical
  contact_pressure: 25.0
  normal_stress: -25.0
  gap: 0.0
  displacement: [0.004875*x, -0.011375*(y + 50)]
  stress: {xx: 0.0, yy: -25.0, zz: -7.5, xy: 0.0}
counts: {bottom: {cells: 2, faces: 2}, top: {cells: 3, faces: 3}}
"""
SOLID = """\
name: hexahedron-on-wedges
mesh: {file: blocks.msh}
materials: {all: {young: 2000.0, poisson: 0.3}}
supports: [{group: base, fix: [z]}]
loads: [{group: press, pressure: 25.0}]
contact: [{name: interface, slave: lower, master: upper}]
reference:
  kind: analytical
  contact_pressure: 25.0
  normal_stress: -25.0
  gap: 0.0
  displacement: [0.00375*x, 0.00375*y, -0.0125*(z + 10)]
"""


def plane(folder: Path, text: str = PLANE) -> Solution:
    """Blocks of 50 × 50: six QUAD4 under three, two slave macro-elements of three sub-faces."""
    points, cells = [], []
    for columns, low in ((6, -50.0), (3, 0.0)):
        start = len(points)
        rows = [(x, y) for y in (low, low + 50) for x in np.linspace(0, 50, columns + 1)]
        points += rows
        cells += [
            (start + i, start + i + 1, start + i + columns + 2, start + i + columns + 1)
            for i in range(columns)
        ]
    x = np.array(points)
    slave, master = np.arange(7, 14), np.arange(14, 18)
    stress = np.tile([0.0, -25.0, -7.5, 0.0, 0.0, 0.0], (len(x), 1))
    zone = ZoneResult(
        name="interface",
        faces=[("SEG2", np.c_[slave[1:], slave[:-1]], np.repeat([0, 1], 3))],
        centre=np.array([[12.5, 0.0], [37.5, 0.0]]),
        normal=np.array([[0.0, 1.0]] * 2),
        area=np.full(2, 25.0),
        multiplier=np.full(2, 25.0),
        gap=np.zeros(2),
        closed=np.ones(2, dtype=bool),
        coverage=np.ones(2),
        surfaces=surfaces([("SEG2", np.c_[master[:-1], master[1:]])], slave, master),
    )
    seen = {"zone": "interface", "macro_element": 0, "gap": 0.0, "status": 1, "coverage": 1.0}
    return Solution(
        case=_case(folder, text),
        mesh=meshio.Mesh(
            x,
            [("quad", np.array(cells))],
            cell_sets={"bottom": [np.arange(6)], "top": [np.arange(6, 9)]},
        ),
        displacement=np.c_[0.004875 * x[:, 0], -0.011375 * (x[:, 1] + 50)],
        stress=stress,
        bodies=[
            BodyInfo("bottom", {"QUAD4": 2}, 2, "slave"),
            BodyInfo("top", {"QUAD4": 3}, 3, "master"),
        ],
        zones=[zone],
        fields=Fields(np.repeat([0, 1], [14, 8]), stress[:, 1].copy()),
        quality=Quality(
            balance={
                "zone interface: force": 1e-15,
                "reactions and loads: moment": 0.0,
                "free nodes: force": 0.0,
            }
        ),
        places=Places(
            acted={
                "supports[0].group": np.array([0, 7, 14, 18]),
                "supports[1].group": np.arange(7),
                "loads[0].group": np.arange(18, 22),
            }
        ),
        steps=[
            StepResult(0.5, 1, 0, 1e-16, 0.0, [{**seen, "pressure": 12.5}]),
            StepResult(1.0, 1, 0, 1e-16, 0.0, [{**seen, "pressure": 25.0}]),
        ],
        scalars=Scalars(length=50.0, load_scale=25.0),
        plan=[
            Line("refinement", "none: by hand", "refinement"),
            Line("refinement", "said twice"),
        ],
        cost=Cost(
            dofs=44,
            macro_elements=2,
            iterations=1,
            linear_solver="by hand",
            matrix_entries=352,
            linear_iterations=3,
            seconds={"mesh": 0.25, "solve": 0.5},
            stage_cpu_seconds={"mesh": 0.25, "solve": 0.75},
            cpu_seconds=0.75,
            peak_memory_mb=1.0,
        ),
    )


def uniform():
    """The exact solution of the blocks of `plane`."""
    steel = Material(2000.0, 0.3)
    cls = SOLUTIONS["uniform_compression"]
    return cls(pressure=25.0, base=-50.0, lower=steel, upper=steel, dim=2)


def solid(folder: Path) -> Solution:
    """A cube of 10, one HEXA8, under two PENTA6; one macro-element of four TRIA3 and one QUAD4."""
    square = np.array([(0, 0), (10, 0), (10, 10), (0, 10)], dtype=float)
    layers = [np.c_[square, np.full(4, z)] for z in (-10.0, 0.0, 0.0, 10.0)]
    x = np.vstack([*layers, [[5.0, 5.0, 0.0]]])
    stress = np.tile([0.0, 0.0, -25.0, 0.0, 0.0, 0.0], (len(x), 1))
    lower, upper = np.array([4, 5, 6, 7, 16]), np.array([8, 9, 10, 11])
    triangles = np.array([(4, 5, 16), (5, 6, 16), (6, 7, 16), (7, 4, 16)])
    zone = ZoneResult(
        name="interface",
        faces=[("QUAD4", lower[None, :4], np.array([1])), ("TRIA3", triangles, np.zeros(4, int))],
        centre=np.array([[5.0, 5.0, 0.0]] * 2),
        normal=np.array([[0.0, 0.0, 1.0]] * 2),
        area=np.full(2, 100.0),
        multiplier=np.array([25.0, 24.0]),
        gap=np.array([0.0, 0.5]),
        closed=np.array([True, False]),
        coverage=np.array([1.0, 0.75]),
        surfaces=surfaces([("TRIA3", np.array([(8, 10, 9), (8, 11, 10)]))], lower, upper),
    )
    wedges = np.array([(8, 9, 10, 12, 13, 14), (8, 10, 11, 12, 14, 15)])
    return Solution(
        case=_case(folder, SOLID).as_solved(True, "hexahedra"),
        mesh=meshio.Mesh(
            x,
            [("hexahedron", np.arange(8)[None]), ("wedge", wedges)],
            cell_sets={
                "bottom": [np.array([0]), np.empty(0, int)],
                "top": [np.empty(0, int), np.array([0, 1])],
            },
        ),
        displacement=np.c_[0.00375 * x[:, :2], -0.0125 * (x[:, 2] + 10)],
        stress=stress,
        bodies=[
            BodyInfo("bottom", {"HEXA8": 1}, 1, "slave"),
            BodyInfo("top", {"PENTA6": 2}, 2, "master"),
        ],
        zones=[zone],
        fields=Fields(np.array([0] * 8 + [1] * 8 + [0]), stress[:, 2].copy()),
        quality=Quality(
            balance={
                "zone interface: force": 0.0,
                "reactions and loads: force": 0.0,
                "free nodes: force": 0.0,
            }
        ),
        places=Places(
            acted={"supports[0].group": np.arange(4), "loads[0].group": np.arange(12, 16)}
        ),
        steps=[StepResult(1.0, 1, 0, 1e-16, 0.0, [])],
        scalars=Scalars(length=20.0, load_scale=25.0),
        cost=Cost(dofs=51, macro_elements=2, iterations=1, linear_solver="by hand"),
        plan=[],
    )


def surfaces(master_faces, slave, master):
    """Those of a zone with faces and nodes on its sides, pressed by 25."""
    stress = (np.full(len(nodes), -25.0) for nodes in (slave, master))
    return ZoneSurfaces(master_faces, *stress, slave, master)


def _case(folder: Path, text: str):
    path = folder / "case.yaml"
    path.write_text(text, encoding="utf-8")
    return load_case(path)
