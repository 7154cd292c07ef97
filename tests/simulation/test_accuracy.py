"""The estimate of rounding bounds the true errors, and does not exceed them without end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from solver import solve_case
from solver.case.reader import load_case, parse_case
from solver.lac.cells.catalogue import BY_NAME
from solver.mechanics.fem.block import Block
from solver.mechanics.fem.stress import largest_strain
from solver.mesh import generate, transform
from solver.simulation.equilibrium.accuracy import Accuracy, estimate, rounding
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.studies.description import read_study
from solver.studies.digits import exact_state
from solver.studies.points import points_of
from solver.verification.judge import judge
from solver.verification.results import read_result, write_result
from solver.verification.run import mesh_of
from tests.scenes import POISSON, YOUNG, block_case, block_mesh, changed_case, with_points
from tests.studies.measured import STABILITY, point

CASES = Path(__file__).parents[2] / "cases"
SPHERES = CASES / "lame/spheres-tetra10.yaml"
USELESS = 1000.0  # an estimate that exceeds the error by more


@pytest.mark.parametrize("swapped", [False, True])
def test_round_off_of_curved_faces_stays_round_off(swapped):
    """Nested spheres whose faces share corners and edges: clipping is decided by the last digit."""
    case = load_case(SPHERES).as_solved(swapped)
    blocks = ("bottom", [3, 3, 1]), ("top", [2, 2, 1])
    made = {side: {"cells": "TETRA10", "divisions": n} for side, n in blocks}
    mesh = generate(case.mesh.source | made, "test")
    (exact,) = simulate(case, mesh).zones
    for seed in range(4):
        noise = 1e-15 * np.random.default_rng(seed).normal(size=mesh.points.shape)
        (zone,) = simulate(case, with_points(mesh, mesh.points * (1 + noise))).zones
        assert zone.coverage == pytest.approx(exact.coverage, abs=1e-11)
        assert zone.multiplier == pytest.approx(exact.multiplier, rel=1e-11)


def error_over_estimate(sweep, mesh, value, young=2000.0, refine=1, state="compression"):
    """The largest error of pressure and stress over the estimate, in a uniform state.

    `young` is the modulus of the lower body, whose stress state is the upper one's.
    """
    case = point(STABILITY, sweep, mesh, x=value).case
    lower = "bottom" if "bottom" in case.materials else "all"
    soft = replace(case.materials[lower], young=young)
    mesh = replace(case.mesh, source=case.mesh.source | {"refine": refine})
    case = replace(case, mesh=mesh, materials={**case.materials, lower: soft})
    raw = generate(case.mesh.source, "test")
    exact = exact_state(case, state, raw)
    found = simulate(
        case, transform(raw, case.mesh.transform, "test") if case.mesh.transform else raw
    )
    master = found.zones[0].surfaces.master_nodes[0]
    stress = exact.stress_at(found.fields.body == found.fields.body[master])
    errors = [np.abs(zone.multiplier / exact.pressure - 1).max() for zone in found.zones]
    errors.append(np.abs(found.stress - stress).max() / exact.pressure)
    return max(errors) / Accuracy(found.quality.accuracy).estimate


@pytest.mark.parametrize("young", [20.0, 2000.0, 2e5])
@pytest.mark.parametrize(("mesh", "refine"), [("2D", 1), ("2D", 4), ("3D", 1), ("3D", 2)])
@pytest.mark.parametrize("distance", [1e4, 2.3e7])
def test_turned_and_far_away(mesh, refine, young, distance):
    """Rounded coordinates tilt faces, along which bodies of unlike stiffness slide far."""
    share = error_over_estimate("turned-and-far", mesh, distance, young, refine)
    assert (1 / USELESS if young == 2000.0 else 0) < share < 1


@pytest.mark.parametrize("height", [1e-13, 1e-12, 1e-10, 1e-9])
def test_faces_that_count_as_flat(height):
    share = error_over_estimate("warp", "3D", height, state="hydrostatic")
    assert 1 / USELESS < share < 1


@pytest.mark.parametrize("height", [0.2, 0.3, 0.4])
def test_warped_faces(height):
    assert error_over_estimate("warp", "3D", height, state="hydrostatic") < 1


@pytest.mark.parametrize("sweep", ["rotation", "tiny-pressure", "poisson", "warp"])
def test_plain_rounding(sweep):
    study = read_study(STABILITY)
    group = study.group(sweep)
    for found in points_of(study, group)[:4]:
        share = error_over_estimate(sweep, "2D", found.numbers["x"], state=group.state)
        assert 1 / USELESS < share < 1


def pressed(pressure):
    """The patch test in the plane: the strain along y is −(1 − ν²) p / E."""
    case = changed_case(2, ("pressure: 25.0", f"pressure: {pressure}"))
    return simulate(case, block_mesh("QUAD4", "TRIA3"))


@pytest.mark.parametrize(
    ("pressure", "noted", "unreliable"),
    [(15.0, False, False), (25.0, True, False), (2.5e5, True, True)],
)
def test_large_strain_is_noted_or_unreliable(pressure, noted, unreliable, tmp_path):
    found = pressed(pressure)
    strain = (1 - POISSON**2) * pressure / YOUNG
    assert found.quality.validity.strain == pytest.approx(strain, rel=1e-12)
    assert found.quality.validity.rotation < 1e-13 * strain
    assert any(line.what.startswith("largest strain") for line in found.plan) == noted
    file = tmp_path / "r.vtkhdf"
    write_result(file, found, [], {})
    for solution in (found, read_result(file).solution):
        verdict = judge(solution, [])
        assert (verdict.verdict == "unreliable") == unreliable
        assert verdict.estimates.validity.strain == found.quality.validity.strain
        assert ("strain 1.1e+02 with rotation" in verdict.reason) == unreliable


def test_strain_and_rotation_of_a_known_motion():
    """Simple shear u = (a y, 0): principal strains ± a / 2, rotation a / 2."""
    points = np.array([[0.1, 0.3], [2.2, 0.1], [0.4, 1.7]])
    block = Block(BY_NAME["TRIA3"], np.array([[0, 1, 2]]), np.ones(1), np.ones(1))
    shear = 0.3 * np.stack([points[:, 1], np.zeros(3)], axis=1)
    assert largest_strain(points, [block], shear) == pytest.approx((0.15, 0.15), rel=1e-13)
    turn = np.array([[0.0, -0.2], [0.2, 0.0]])
    assert largest_strain(points, [block], points @ turn.T) == pytest.approx((0, 0.2), abs=1e-15)


# Bodies on which no force acts: nothing is a share of nothing, in any unit of length.


HEIGHT = 50.0


def blocks(scale, supports, **more):
    """Two blocks of QUAD4 and TRIA3, of edge 50 times `scale`, the upper one on the lower one."""
    return {
        "name": "unforced",
        "mesh": {
            "recipe": "blocks", "size": HEIGHT,
            "bottom": {"cells": "QUAD4", "divisions": [4, 3]},
            "top": {"cells": "TRIA3", "divisions": [3, 3]},
        },
        "transform": {"scale": scale},
        "plane": "strain",
        "materials": {"all": {"young": 2000.0, "poisson": 0.3}},
        "supports": [{"group": group, "fix": fix} for group, fix in supports.items()],
        "contact": [{"slave": "bottom_contact", "master": "top_contact"}],
        **more,
    }  # fmt: skip


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
@pytest.mark.parametrize(
    ("base", "press"),
    [((0.3, -1.0), (0.1, 2.0)), ((0.3, -1.0), (0.1, -1.0)), ((0.0, 0.0), (0.0, 0.0))],
    ids=["apart", "together", "at rest"],
)
def test_bodies_that_only_move(scale, base, press):
    moved = {
        name: {"x": scale * x, "y": scale * y}
        for name, (x, y) in {"base": base, "press": press}.items()
    }
    found = solve_case(blocks(scale, moved))
    assert found.verdict == "solved", found.reason
    assert found.pressure.max() <= 1e-12 * 2000.0
    assert found.outcome.estimates.attainable < 1e-10
    assert max(found.solution.quality.balance.values()) < 1e-12


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_bodies_that_expand_freely(scale):
    supports = {"base": ["y"], "symx": ["x"]}
    heat = [{"group": g, "expansion": 1.3e-5, "temperature": 70} for g in ("top", "bottom")]
    case = blocks(scale, supports, loads=heat)
    case["supports"].append({"group": "press", "spring": {"y": 1e-9 / scale}})
    found = solve_case(case)
    assert found.verdict == "solved", found.reason
    assert found.outcome.estimates.attainable < 1e-4


def test_a_sliver_under_the_end_of_the_master_loosens_no_limit():
    """A macro-element that is covered by 1e-16 of its area made every tension round-off."""
    text = """
name: sliver
mesh:
  recipe: punch
  bottom_size: [50, 10]
  top_size: [10, 10]
  bottom: {cells: QUAD4, divisions: [10, 2]}
  top: {cells: QUAD4, divisions: [3, 2]}
transform: {shift: {group: top, by: [2.0e-15, 0.0]}}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports: [{group: base, fix: [x, y]}, {at: [2.0e-15, 10.0], fix: [x]}]
loads: [{group: press, pressure: 25.0}]
contact: [{name: interface, slave: bottom_contact, master: top_contact}]
"""
    case = parse_case(text, Path("sliver.yaml"))
    problem = ContactProblem(build_scene(case, mesh_of(case)))
    covered = problem.scene.zones[0].operator.covered
    assert ((covered > 0) & (covered < 1e-12)).any()
    trial = problem.solve(1.0).trial
    assert trial.pressure_limit.max() < 1e-9 * trial.pressure.max()


def test_a_pressure_that_is_rounding_is_judged_by_what_loads_cause():
    """Where bodies touch and nothing presses; a pressure that is small has lost its digits."""
    assembled = ContactProblem(build_scene(block_case(2), block_mesh("QUAD4", "TRIA3")))
    state, left = assembled.solve(1.0), 1e-9

    def error(share):
        about = state.iterate, rounding(state.iterate), share * state.pressure, assembled.diagonal
        about += assembled._rough, assembled.unsupported
        return estimate(*about, left, state.force_scale).estimate

    assert left / 10 < error(1.0) < 10 * left
    assert error(1e-5) > 1e4 * error(1.0)
    assert error(1e-11) < 10 * left
    assert error(1e-16) < 10 * left


def test_a_body_that_is_all_but_free_to_turn():
    """It stands on one row of macro-elements that are all but in line: its loads have long arms."""
    content = yaml.safe_load((CASES / "friction-patch/m-stick.yaml").read_text())
    content["mesh"]["bottom"] |= {"cells": "PENTA6", "divisions": [1, 3, 1], "contact": "QUAD4"}
    content["mesh"]["top"] |= {"cells": "PENTA15", "divisions": [3, 3, 1], "contact": "TRIA6"}
    content["transform"] = {"perturb": 0.05}
    solution = solve_case(content).solution
    accuracy, (zone,) = solution.quality.accuracy, solution.zones
    error = np.abs(zone.multiplier / 25.0 - 1).max()
    assert max(accuracy, key=lambda name: accuracy[name]) == "arms"
    assert 1e-14 < error < 10 * accuracy["arms"]
    assert accuracy["arms"] < USELESS * error
    others = {name: value for name, value in accuracy.items() if name != "arms"}
    assert error > 10 * Accuracy(others).estimate


@pytest.mark.parametrize("gap", [{"interference": 1e-9}, {"clearance": 0.0}, {}])
def test_a_gap_that_the_case_gives_is_as_exact_as_it_is_given(gap):
    """Strains of 1e-12 on a turned mesh, whose gaps of 1e-15 count as zero."""
    supports = {"base": ["normal"], "symx": ["normal"]}
    case = blocks(1.0, supports, transform={"rotate": 33.3})
    case["loads"] = [{"group": "press", "pressure": 2e-9}]
    case["contact"][0] |= gap
    found = solve_case(case)
    assert found.verdict == "solved", found.reason
    assert found.pressure == pytest.approx(2e-9, rel=1e-11)
    assert found.solution.quality.accuracy["gap"] < 1e-11


@pytest.mark.parametrize("name", ["a-slip", "e-slip"])
def test_faint_loads_that_slide_are_as_exact_as_others(name):
    """The sliding patch test at 1e-10 times its pressure: slips are no gaps of the mesh."""
    content = yaml.safe_load((CASES / f"friction-patch/{name}.yaml").read_text())
    exact = content["reference"]["solution"]
    exact |= {key: 1e-10 * exact[key] for key in ("pressure", "traction", "slide")}
    content["reference"]["dissipation"] = [1e-20 * content["reference"]["dissipation"][0]]
    found = solve_case(content)
    assert (found.verdict, found.reason) == ("passed", "")
    assert found.solution.quality.accuracy["gap"] < 1e-12
