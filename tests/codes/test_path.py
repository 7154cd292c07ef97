"""Bodies that move far, by other codes: the steps of a deck, and results at the last position."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.case.reader import load_case
from solver.codes.calculix import PROGRAM, CalculiX, deck_lines
from solver.codes.deck import UnsupportedError, deck_of
from solver.codes.foreign import Field, ForeignResult
from solver.codes.run import Limits, run_code
from solver.codes.verdicts import check_foreign
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.run import mesh_of
from tests.simulation.test_motion import TEXT, moving

needs_ccx = pytest.mark.skipif(not shutil.which(PROGRAM), reason="no CalculiX")
PULL, ZONE = TEXT["supports"][1], TEXT["contact"][0]
CASES = Path(__file__).resolve().parents[2] / "cases/motion"


@pytest.fixture(scope="module")
def slid():
    """A case that slides by eight faces, its mesh, and our own result as that of another code."""
    case = load_case(CASES / "slide-c.yaml")
    mesh = mesh_of(case)
    return case, mesh, as_foreign(case, mesh)


def as_foreign(case, mesh):
    solution, count = simulate(case, mesh), len(mesh.points)
    nodes = np.arange(count)

    def field(values, of=nodes):
        return Field(places=mesh.points[of], values=values, nodes=of)

    zone, whole = solution.zones[0], solution.displacement + solution.fields.motion
    slave = zone.surfaces.slave_nodes[zone.surfaces.slave_nodes < count]
    # the master is on x from 40 to 50 in the end
    pressed = 25.0 * (solution.mesh.points[slave, 0] > 40.0 - 1e-6)
    return ForeignResult(
        code="mine",
        mesh=mesh,
        displacement=field(whole[:count]),
        stress=field(solution.stress[:count]),
        pressure=field(pressed, slave),
    )


def test_a_right_result_is_compared_where_its_bodies_are(slid):
    case, mesh, foreign = slid
    found = check_foreign(case, foreign, mesh)
    checks = {check.name: check for check in found.checks}
    assert found.verdict == "passed", found.reason
    assert checks["stress_components"].error < 1e-9
    assert checks["multiplier"].error < 1e-9
    assert found.foreign.compared["stress"] == f"{len(mesh.points)} of {len(mesh.points)} nodes"


def test_shear_by_friction_turns_no_frame():
    """It turns a body as a whole, but not the surface that slides."""
    case = load_case(CASES / "slide-c-friction.yaml")
    mesh = mesh_of(case)
    found = check_foreign(case, as_foreign(case, mesh), mesh)
    assert found.verdict == "passed", found.reason
    assert max(check.error for check in found.checks) < 1e-9


def test_what_is_wrong_at_the_last_position_fails(slid):
    case, mesh, foreign = slid
    values = foreign.pressure.values.copy()
    values[values > 0] *= 1.01
    wrong = replace(foreign, pressure=replace(foreign.pressure, values=values))
    assert check_foreign(case, wrong, mesh).verdict == "failed"
    values = foreign.stress.values.copy()
    values[:, 1] += 1.0
    wrong = replace(foreign, stress=replace(foreign.stress, values=values))
    assert check_foreign(case, wrong, mesh).verdict == "failed"


def test_a_body_that_is_somewhere_else_bears_nothing(slid):
    """Past the end of the other one no pressure can be compared, which is not passed over."""
    case, mesh, foreign = slid
    values = foreign.displacement.values + [30.0, 0.0] * (foreign.displacement.values[:, :1] > 20)
    wrong = replace(foreign, displacement=replace(foreign.displacement, values=values))
    found = check_foreign(case, wrong, mesh)
    assert "multiplier" in found.foreign.not_given
    assert found.verdict == "partial"


def test_a_result_without_displacements_is_refused(slid):
    case, mesh, foreign = slid
    with pytest.raises(InputError, match="displacement: is needed where bodies move far"):
        check_foreign(case, replace(foreign, displacement=None), mesh)


def test_the_steps_of_a_deck(slid):
    """The pull moves by 5 a step; of ten columns each has the traction where no master is."""
    case, mesh, _ = slid
    deck = deck_of(case, mesh, layer=True, follows=True)
    assert [np.nanmax(step.held) for step in deck.path] == [5.0 * n for n in range(1, 9)]
    down = [step.forces[:, 1].sum() for step in deck.path]
    thick = np.ptp(deck.points[:, 2])
    assert down == pytest.approx([-25 * (10 + 40) * thick] * 8)
    lines = list(deck_lines(deck))
    assert sum(line.startswith("*STEP, NLGEOM") for line in lines) == 1
    amplitude = lines.index("*AMPLITUDE, NAME=GIVEN0")
    assert lines[amplitude + 1 : amplitude + 10] == [f"{n}., {5.0 * n:.13e}" for n in range(9)]


def test_steps_without_names_have_one_factor():
    loads = [{"group": "press", "pressure": 2.5}]
    pull = {key: value for key, value in PULL.items() if key != "name"}
    case = moving(steps=[0.5, 2.0], loads=loads, supports=[TEXT["supports"][0], pull])
    first, last = deck_of(case, mesh_of(case), follows=True).path
    assert np.nanmax(first.held) == 3.5
    assert np.nanmax(last.held) == 14.0
    assert (first.pressures, last.pressures) == ([1.25], [5.0])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"supports": [{"group": "base", "fix": ["normal"]}, PULL]}, "a support along normals"),
        ({"contact": [ZONE | {"interference": 0.01}]}, "an interference"),
        ({"loads": [{"group": "press", "pressure": "x", "name": "press"}]}, "a pressure that var"),
    ],
)
def test_what_no_path_has(changes, said):
    case = moving(**changes)
    with pytest.raises(UnsupportedError, match=f"{said}.* of bodies that move far"):
        deck_of(case, mesh_of(case), follows=True)


def test_codes_that_follow_no_motion_are_refused_it(slid):
    with pytest.raises(UnsupportedError, match="motion: large"):
        deck_of(*slid[:2])


@needs_ccx
def test_calculix_pulls_a_block_up_a_slope(tmp_path):
    """The horizontal force is (tan α + μ)/(1 − μ tan α) of the weight."""
    case = load_case(CASES / "slope.yaml")
    deck = deck_of(case, mesh_of(case), layer=True, follows=True)
    force = run_code(CalculiX(), deck, tmp_path, Limits()).forces["interface"]
    assert force[:2] == pytest.approx([-10000.0 * 0.4 / 0.97, 10000.0], rel=1e-6)


@needs_ccx
def test_calculix_slides_a_block_by_eight_faces(slid, tmp_path):
    """The upper block is where it is moved to, and contact bears its load."""
    case, mesh, _ = slid
    deck = deck_of(case, mesh, layer=True, follows=True)
    found = run_code(CalculiX(), deck, tmp_path, Limits())
    upper = deck.points[:, 1] > 1e-6
    assert found.displacement.values[upper, 0] == pytest.approx(40.0, abs=0.1)
    force = found.forces["interface"]
    assert abs(force[1]) == pytest.approx(250.0, rel=1e-4)
    assert check_foreign(case, found, mesh).verdict == "failed"  # its ends do not pass
