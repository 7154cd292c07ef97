"""What a solve takes for granted: slip, overlap and covered parts by hand, and the verdict."""

from pathlib import Path

import numpy as np
import pytest

import solver.lac.threads
import solver.simulation.judgement.validity
from solver import solve_case
from solver.case.reader import parse_case
from solver.lac.cells.catalogue import BY_NAME
from solver.mesh import generate
from solver.simulation.judgement import validity
from solver.simulation.judgement.validity import inside_others
from solver.simulation.simulate import simulate
from solver.verification.checks import run_checks
from solver.verification.judge import judge
from solver.verification.results import read_result, write_result
from tests import scenes
from tests.scenes import grid

# Two blocks with ν = 0, of width 1.5 and WIDE; the upper one is pushed along both axes.
CASE = """\
name: pushed
mesh:
  recipe: bricks
  bricks:
    - {name: lower, low: [0, -1], high: [1.5, 0], block: {cells: QUAD4, divisions: [3, 2]}}
    - {name: upper, low: [0, LOW], high: [WIDE, HIGH], block: {cells: QUAD4, divisions: [4, 2]}}
plane: strain
materials: {all: {young: 1000.0, poisson: 0.0}}
groups:
  base: {plane: {point: [0, -1], normal: [0, 1]}}
  left: {plane: {point: [0, 0], normal: [1, 0]}, within: lower}
  side: {plane: {point: [0, 0], normal: [1, 0]}, within: upper}
  top: {plane: {point: [0, HIGH], normal: [0, 1]}}
  floor: {plane: {point: [0, 0], normal: [0, 1]}, within: lower}
  under: {plane: {point: [0, LOW], normal: [0, 1]}, within: upper}
supports:
  - {group: base, fix: [y]}
  - {group: left, fix: [x]}
  - {group: side, fix: {x: ALONG}}
  - {group: top, fix: {y: DOWN}}
contact:
  - {name: interface, slave: floor, master: under}
steps: [1, 0]
"""
SLIDING = {"LOW": "0", "HIGH": "1", "WIDE": "1.5", "DOWN": "-0.001"}


def solved(text=CASE, **values):
    for name, value in (SLIDING | values).items():
        text = text.replace(name, value)
    return scenes.solved(text)


def lines(solution):
    return " ".join(line.what for line in solution.plan)


@pytest.mark.parametrize(
    ("along", "noted", "unreliable"), [(0.04, False, False), (0.4, True, False), (-0.6, True, True)]
)
@pytest.mark.parametrize("treatment", ["lac", "nodal"])
def test_slip_over_the_size_of_a_face(along, noted, unreliable, treatment, tmp_path):
    """The upper block moves along x as a whole, slave faces are 0.5 long; then it is at rest."""
    text = CASE.replace("master: under", f"master: under, treatment: {treatment}")
    found = solved(text, ALONG=str(along))
    assert found.quality.validity.slip == pytest.approx(abs(along) / 0.5, rel=1e-12)
    assert found.quality.validity.strain == pytest.approx(0.0005, rel=1e-12)
    assert ("contact slides by up to" in lines(found)) == noted
    write_result(tmp_path / "r.vtkhdf", found, [], {})
    for solution in (found, read_result(tmp_path / "r.vtkhdf").solution):
        verdict = judge(solution, [])
        assert (verdict.verdict == "unreliable") == unreliable
        assert ("contact slides by 1.2 of a face" in verdict.reason) == unreliable
        assert verdict.estimates.validity.slip == found.quality.validity.slip


def test_closing_is_no_slip(monkeypatch):
    """A gap of 0.6, more than a face, is closed along the normal."""
    given = {"LOW": "0.6", "HIGH": "1.6", "DOWN": "-0.601", "ALONG": "0.0"}
    assert solved(**given).quality.validity.slip < 1e-12
    monkeypatch.setattr(validity, "_slip", lambda *_: 1.2)
    assert judge(solved(**given), []).verdict == "unreliable"


@pytest.mark.parametrize(("wide", "partly"), [("1.25", 1), ("1.5", 0), ("1.0", 0)])
def test_a_master_that_ends_inside_a_macro_element(wide, partly):
    """Slave faces end at 0.5, 1 and 1.5."""
    found = solved(WIDE=wide, ALONG="0.0")
    assert found.quality.validity.partly_covered == partly
    assert ("the master ends inside 1 macro-elements" in lines(found)) == bool(partly)
    assert judge(found, []).estimates.validity.partly_covered == partly


@pytest.mark.parametrize(("down", "inside"), [("-0.3", 0), ("-0.85", 7)])
def test_bodies_pushed_past_each_other(down, inside):
    """The gap is 0.2, and no zone keeps the blocks apart.

    With −0.85 the upper block reaches from −0.65 to 0.35: 4 of its middles are at y = −0.4, 3 of
    the lower block at −0.25.
    """
    start = CASE.index("contact:")
    text = CASE[:start] + CASE[CASE.index("steps:") :]
    found = solved(text, LOW="0.2", HIGH="1.2", DOWN=down, ALONG="0.01")
    assert found.quality.validity.pushed_past == inside
    verdict = judge(found, [])
    assert (verdict.verdict == "unreliable") == bool(inside)
    assert ("the middle of cells (7) is inside another body" in verdict.reason) == bool(inside)


@pytest.mark.parametrize("name", [name for name, cell in BY_NAME.items() if cell.dim > 1])
def test_cells_in_one_another(name):
    """The middle of a cell is in its copy next to it, not in one that is a whole cell away."""
    kind = BY_NAME[name]
    nodes = np.arange(2 * kind.n_nodes).reshape(2, -1)
    for away, wanted in ((0.05, 2), (1.05, 0)):
        shift = away * np.eye(kind.dim)[0] * np.ptp(kind.nodes[:, 0])
        points = np.concatenate([kind.nodes, kind.nodes + shift])
        assert inside_others(points, {name: nodes}, np.repeat([0, 1], kind.n_nodes)) == wanted
        assert inside_others(points, {name: nodes}, np.zeros(len(points), dtype=int)) == 0


# Cells inside another body, counted in parts and at once.


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("many", [1, 5, 1 << 14])
@pytest.mark.parametrize("layers", [0, 1, 2])
def test_layers_of_cells_in_one_another(monkeypatch, many, layers, threads):
    """Two cubes of 3³ cells: of so many layers of each, the middles are in the other one."""
    monkeypatch.setattr(solver.simulation.judgement.validity, "_AT_ONCE", many)
    monkeypatch.setattr(solver.lac.threads, "workers", lambda: threads)
    points, cells = grid(3)
    depth = np.ptp(points[:, 0]) * (layers + 0.1) / 3
    moved = points + np.array([np.ptp(points[:, 0]) - depth, 1e-3, 1e-3])
    both = {"HEXA8": np.concatenate([cells, cells + len(points)])}
    body = np.repeat([0, 1], len(points))
    assert inside_others(np.concatenate([points, moved]), both, body) == 2 * 9 * layers


def test_a_clearance_is_where_bodies_are_and_not_their_mesh():
    """Meshed in touch, said to be 0.499 apart, moved by 0.5: p = E 0.001 / 4, nothing inside."""
    found = solve_case(
        {
            "name": "apart",
            "mesh": {
                "recipe": "blocks",
                "size": [4.0, 2.0],
                "bottom": {"cells": "QUAD4", "divisions": [4, 1]},
                "top": {"cells": "QUAD4", "divisions": [4, 8]},
            },
            "plane": "strain",
            "materials": {"all": {"young": 100000.0, "poisson": 0.0}},
            "supports": [
                {"group": "base", "fix": ["x", "y"]},
                {"group": "press", "fix": {"x": 0.0, "y": -0.5}},
            ],
            "contact": [{"slave": "top_contact", "master": "bottom_contact", "clearance": 0.499}],
        }
    )
    assert found.pressure == pytest.approx(25.0, rel=1e-9)
    assert found.verdict == "solved"
    assert found.solution.quality.validity.pushed_past == 0


FITTED = """\
name: fitted
mesh:
  recipe: rings
  radii: [0.5, 1, 1.5]
  bottom: {cells: QUAD4, divisions: [9, 3]}
  top: {cells: QUAD4, divisions: [9, 3]}
plane: stress
materials: {all: {young: 1000.0, poisson: 0.3}}
supports:
  - {group: symx, fix: [x]}
  - {group: farx, fix: [y]}
contact: [{name: fit, slave: bottom_contact, master: top_contact}]
reference: {kind: analytical, contact_pressure: PRESSURE}
tolerance: 5.0e-2
"""


def nodes_in(mesh, group):
    """Which nodes (n,) are in the cells of a group."""
    chosen = np.zeros(len(mesh.points), dtype=bool)
    for block, cells in zip(mesh.cells, mesh.cell_sets[group], strict=True):
        chosen[block.data[cells]] = True
    return chosen


@pytest.mark.parametrize(("lost", "verdict"), [(0.0, "passed"), (0.02, "failed")])
def test_facets_that_overlap_end_beside_each_other_on_a_plane_of_symmetry(lost, verdict):
    """Normals of the last facet lean by 5° and pass the end of the bore by 0.004 tan 5°.

    A bore that ends early is told from it.
    """
    over = 0.004
    pressure = 1000 * over / ((1.5**2 + 1) / (1.5**2 - 1) + (1 + 0.5**2) / (1 - 0.5**2))
    case = parse_case(FITTED.replace("PRESSURE", f"{pressure}"), Path("case.yaml"))
    mesh = generate(case.mesh.source, "test")
    inner = nodes_in(mesh, "bottom")
    mesh.points[inner] *= 1 + over
    x, y = mesh.points[~inner, :2].T
    angle, radius = np.arctan2(x, y) * (1 - lost), np.hypot(x, y)
    mesh.points[~inner, 0] = radius * np.sin(angle)
    mesh.points[~inner, 1] = radius * np.cos(angle)
    solution = simulate(case, mesh)
    checks = run_checks(solution)
    judged = judge(solution, checks)
    assert judged.verdict == verdict, judged.reason
    assert next(c.passed for c in checks if c.name == "coverage") == (not lost)
    assert min(judged.values.coverage) < 1 - 1e-4


def test_the_flank_of_a_rounding_needs_no_partner():
    """A rounded slave on a plate: faces that turn away far from contact lie opposite nothing."""
    text = CASE.replace("high: [1.5, 0]", "high: [20, 0]")
    for name, value in (SLIDING | {"WIDE": "1", "LOW": "0"}).items():
        text = text.replace(name, value)
    text = text.replace("slave: floor, master: under", "slave: under, master: floor")
    text = text.replace("[4, 2]", "[20, 4]").replace("ALONG", "0")
    mesh = generate(parse_case(text, Path("case.yaml")).mesh.source, "test")
    upper = nodes_in(mesh, "upper")
    x, t = mesh.points[upper, 0].copy(), 1 - mesh.points[upper, 1]
    turn = np.maximum(x - 0.5, 0) * np.pi
    x = np.minimum(x, 0.5) + 0.5 * np.sin(turn)
    mesh.points[upper, 0] = x
    mesh.points[upper, 1] = 1 - t * (0.5 + 0.5 * np.cos(turn))
    bottom = '{within: upper, where: "min(0.51 - y, 2*x - y)"}'
    text = text.replace("{plane: {point: [0, 0], normal: [0, 1]}, within: upper}", bottom)
    found = scenes.solved(text, mesh)
    assert len(found.zones[0].area) == 20
    assert found.zones[0].coverage.min() == 0
    assert found.quality.validity.unpaired == 0
