"""Contact without tension and overlap, whatever the units, loads, zones and stiffnesses."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from solver.case.reader import parse_case
from solver.lac.errors import SolveError
from solver.lac.status import StatusResult
from solver.mechanics.linear.choice import MULTIGRID
from solver.mechanics.mortar.treatments import TREATMENTS
from solver.mesh import generate
from solver.simulation.equilibrium import contact_stiffness, problem
from solver.simulation.equilibrium.contact_stiffness import refuse_unbalanced
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.judgement.consistency import inconsistency
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from tests.patches import force_solver
from tests.scenes import block_case, block_mesh
from tests.simulation.test_unloaded import SCENE, side_by_side

CASE = """
name: blocks
mesh: {recipe: blocks}
plane: strain
materials: {top: {young: TOP, poisson: 0.3}, bottom: {young: BOTTOM, poisson: 0.3}}
supports:
  - {group: base, fix: [y]}
  - {group: symx, fix: [x]}
"""
PRESSED = "loads:\n  - {group: press, pressure: 25.0}\n"


def blocks(rest, young=2000.0, top=None, zone=""):
    """A case of two blocks with further supports and loads."""
    text = CASE.replace("TOP", repr(top or young)).replace("BOTTOM", repr(young)) + rest
    text += "contact:\n  - {name: interface, slave: bottom_contact, master: top_contact"
    return parse_case(f"{text}{zone}}}\n", Path("blocks.yaml"))


def moved(value):
    """The upper face moved by a value."""
    return f"  - {{group: press, fix: {{y: {value}}}}}\n"


# 80 combinations of unit and size are tried, the treatments in turn.
COMBINATIONS = [(10.0**a, 10.0**b) for a in range(-9, 7, 2) for b in range(-6, 14, 2)]


@pytest.mark.parametrize("treatment", TREATMENTS)
def test_blocks_pulled_apart_open_in_every_unit(treatment):
    first = list(TREATMENTS).index(treatment)
    for size, young in COMBINATIONS[first :: len(TREATMENTS)]:
        case = blocks(moved(repr(1e-3 * size)), young, zone=f", treatment: {treatment}")
        zone = simulate(case, block_mesh("QUAD4", "QUAD4", (4, 3), size)).zones[0]
        assert not zone.closed.any(), (size, young)
        assert not zone.multiplier.any()
        assert zone.gap == pytest.approx(1e-3 * size, rel=1e-9)


@pytest.mark.parametrize("treatment", TREATMENTS)
def test_bent_contact_is_the_same_in_every_unit(treatment):
    """Pressed in at one end, lifted at the other: some macro-elements close."""
    found = []
    first = list(TREATMENTS).index(treatment)
    for size, young in [(1.0, 1.0), *COMBINATIONS[first :: len(TREATMENTS)]]:
        case = blocks(
            moved(f"1e-3*(2*x - {0.7 * size!r})"), young, zone=f", treatment: {treatment}"
        )
        zone = simulate(case, block_mesh("QUAD4", "QUAD4", (4, 3), size)).zones[0]
        found.append(zone.multiplier / young)
    assert 0 < (found[0] > 0).sum() < 4
    assert np.abs(np.array(found) - found[0]).max() < 1e-11 * found[0].max()


@pytest.mark.parametrize("size", [1e-12, 1e-6, 1.0])
def test_moved_together_blocks_in_contact_carry_nothing(size):
    """Round-off of a large rigid motion is no tension: nothing opens and leaves the upper block."""
    rest = "  - {group: base, fix: {y: 0.125}}\n".replace("0.125", repr(0.1 * size))
    case = parse_case(
        blocks("").about.source.replace("  - {group: base, fix: [y]}\n", rest), Path("moved.yaml")
    )
    found = simulate(case, block_mesh("TRIA3", "QUAD8", (4, 3), size))
    assert np.abs(found.displacement[:, 1] - 0.1 * size).max() < 1e-12 * size
    assert np.abs(found.zones[0].multiplier).max() < 1e-11 * 2000.0


def test_loads_on_held_nodes_hide_no_tension():
    """1e14 pushes on the foot, which supports hold; the blocks are pulled apart by 1e-3."""
    rest = moved(1e-3) + "loads:\n  - {group: base, traction: [0.0, 1.0e14]}\n"
    zone = simulate(blocks(rest), block_mesh("QUAD4", "QUAD4", (4, 3))).zones[0]
    assert not zone.closed.any()
    assert not zone.multiplier.any()


@pytest.mark.parametrize("stiff", [1e3, 1e18])
def test_one_zones_pressure_hides_no_tension_in_another(stiff):
    """The near pair bears 1e14 times what the far one would bear in tension."""
    text = SCENE.replace("{all: {young: 2000.0", f"{{all: {{young: {stiff!r}")
    text = text.replace("pressure: 25.0", f"pressure: {1e-2 * stiff!r}").replace(
        "loads:", "  - {group: press_far, fix: {y: 1.0e-16}}\nloads:"
    )
    mesh = side_by_side(*(block_mesh("QUAD4", "TRIA3", (4, 3)) for _ in range(2)))
    near, far = simulate(parse_case(text, Path("beside.yaml")), mesh).zones
    assert near.multiplier == pytest.approx(1e-2 * stiff, rel=1e-12)
    assert not far.closed.any()
    assert not far.multiplier.any()


def punch(seed):
    """A case of stiff and soft blocks under a random load, pressed over a random clearance."""
    rng = np.random.default_rng(seed)
    ratio, stiff = 10.0 ** rng.uniform(0, 5), rng.choice(["top", "bottom"])
    young = {"top": 2000.0, "bottom": 2000.0}
    young[stiff] *= ratio
    a, b, c = rng.uniform(-2, 2, 3)
    height, waves = 10.0 ** rng.uniform(-5, -3), rng.uniform(3, 40)
    load = f"loads:\n  - {{group: press, pressure: '1 + {a}*x + {b}*cos(3*x) + {c}*sin(7*x)'}}\n"
    clearance = f", clearance: '{height}*(1 + sin({waves}*x))'"
    return blocks(load, young["bottom"], young["top"], clearance)


# Those whose status Newton's steps alone do not find, and some others.
@pytest.mark.parametrize("seed", [0, 1, 4, 7, 15, 50, 57, 73, 79])
def test_punches_of_any_stiffness_end_with_pressure_and_gap_complementary(seed):
    found = simulate(punch(seed), block_mesh_of(60, 17))
    zone = found.zones[0]
    assert 0 < zone.closed.sum() < 60
    assert zone.multiplier.min() >= 0
    assert zone.gap.min() > -1e-10 * np.abs(found.displacement).max()
    assert not (zone.multiplier[~zone.closed] > 0).any()
    assert np.abs(zone.gap[zone.closed]).max() < 1e-10 * zone.gap.max()


def block_mesh_of(*faces):
    """QUAD4 blocks with so many faces on the contact of each."""
    sides = {
        name: {"cells": "QUAD4", "divisions": [count, 10]}
        for name, count in zip(("bottom", "top"), faces, strict=True)
    }
    return generate({"recipe": "blocks", "size": 1.0, **sides}, "test")


def slender(length):
    """Blocks of height 1: each of four slave faces lies below two and a half master faces."""
    bottom = {"cells": "TRIA3", "divisions": [4, 4]}
    top = {"cells": "QUAD8", "divisions": [10, 10]}
    size = [length, 1.0]
    return generate({"recipe": "blocks", "size": size, "bottom": bottom, "top": top}, "test")


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("length", [1e4, 1e5])
def test_slender_blocks_are_solved(length, swapped):
    """The upper one bends so easily, (height / length)^4, that its stiffness is singular."""
    found = simulate(blocks(PRESSED).as_solved(swapped), slender(length))
    assert np.abs(found.zones[0].multiplier / 25 - 1).max() < 1e-11
    assert np.abs(found.stress[:, 1] / 25 + 1).max() < 1e-6


def test_a_load_that_bends_them_between_the_macro_elements_is_refused():
    wave = PRESSED.replace("25.0", "'25 + 10*cos(8e-5*3.141592653589793*x)'")
    with pytest.raises(SolveError, match=r"singular|not positive definite"):
        simulate(blocks(wave), slender(1e5))


def test_a_slender_body_in_space_does_not_turn_about_its_own_axis():
    """10⁷ times as long as thick; contact holds the upper body against that turn as well."""
    mesh = block_mesh("HEXA8", "HEXA8", (2, 3))
    mesh.points[:, 0] *= 1e7
    zone = simulate(block_case(3), mesh).zones[0]
    assert np.abs(zone.multiplier / 25 - 1).max() < 1e-9


def test_a_body_that_its_loads_pull_away_is_not_searched_for_long(monkeypatch):
    """The load on the whole is a pull: no macro-element system of unit gaps is worth forming."""
    monkeypatch.setattr(contact_stiffness, "_AT_ONCE", 0)
    pull = PRESSED.replace("25.0", "'25.0 - 60*x'")
    with pytest.raises(SolveError, match="nothing keeps top from a free motion"):
        simulate(blocks(pull), block_mesh("QUAD4", "TRIA3", (6, 4)))


@pytest.fixture
def bent():
    """A problem with an open end, and its state."""
    case = blocks("loads:\n  - {group: press, pressure: '60.0 - 115*x'}\n")
    scene = build_scene(case, block_mesh("QUAD4", "TRIA3", (6, 4)))
    assembled = ContactProblem(scene)
    return assembled, assembled.solve(1.0)


def test_a_further_load_is_solved_with_the_status_kept(bent):
    """A tenth of the load more is a tenth more of all, gaps of the closed ones apart."""
    assembled, state = bent
    found = assembled.corrected(state, 0.1 * state.force)
    closed = state.status.closed
    assert 0 < closed.sum() < len(closed)
    assert (found.status.closed == closed).all()
    assert found.pressure == pytest.approx(1.1 * state.pressure, rel=1e-11)
    assert found.displacement == pytest.approx(1.1 * state.displacement, rel=1e-9, abs=1e-12)
    assert np.abs(found.gap[closed]).max() < 1e-15
    assert found.residual < 1e-14


def test_what_gaps_bring_up_is_what_opening_takes_away(bent):
    """Forces |T| p = W ḡ + q of the state, with q for all macro-elements closed."""
    assembled, state = bent
    area = assembled.constraints.covered
    nothing, closable = np.zeros(len(area), dtype=bool), assembled.constraints.closable
    stiffness = assembled._gap_stiffness(1.0, nothing)
    closed = assembled.solve(1.0, imposed=np.where(closable, 0.0, np.nan)).pressure
    assert area * state.pressure == pytest.approx(
        stiffness @ state.gap + area * closed, abs=1e-10 * closed.max()
    )
    assert stiffness == pytest.approx(stiffness.T, abs=1e-11 * stiffness.max())


@pytest.mark.parametrize(("kept", "lost"), [(False, True), (True, False)])
def test_loads_along_a_surface_are_balanced_by_what_is_kept_alone(kept, lost):
    """One row sees y and may close, another one sees x and is kept or not: a load acts along x."""
    sought, beside = sparse.csr_array([[0.0, 1.0]]), sparse.csr_array([[1.0, 0.0]])
    free, loads = sparse.csc_array([[1.0], [0.0]]), np.array([1.0, 0.0])
    with pytest.raises(SolveError, match="balances the loads") if lost else nullcontext():
        refuse_unbalanced(sought, beside if kept else beside[:0], free, loads)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("multiplier", -2.5, "contact bears tension, a pressure of -2.5"),
        ("gap", -2.5, "the surfaces overlap, a gap of -2.5"),
        ("gap", 2.5, "contact that is closed has a gap of 2.5"),
    ],
)
def test_a_result_that_contact_does_not_allow_is_unsound(name, value, message):
    mesh = block_mesh("QUAD4", "QUAD4", (4, 3))
    found = simulate(blocks(PRESSED), mesh)
    assert not inconsistency(found)
    getattr(found.zones[0], name)[1] = 1e-12 * value
    assert not inconsistency(found)
    getattr(found.zones[0], name)[1] = value
    assert inconsistency(found) == f"zone interface: {message}"


@pytest.mark.parametrize("step", [0, 1])
def test_tension_in_any_load_step_is_noticed_whatever_the_search_found(step, monkeypatch):
    """The search ends at once with all closed, in one of two steps."""
    case = blocks("loads:\n  - {group: press, pressure: '60.0 - 115*x'}\n")
    case = replace(case, steps=(1.0, 0.5))
    true, steps = problem.find_status, iter(range(2))

    def stays(solve, start, eligible, *more):
        if next(steps) != step:
            return true(solve, start, eligible, *more)
        solve(eligible)
        return StatusResult(eligible, 1, [])

    monkeypatch.setattr(problem, "find_status", stays)
    with pytest.raises(
        SolveError, match=f"load factor {case.steps[step]:g}: contact bears tension"
    ):
        simulate(case, block_mesh("QUAD4", "TRIA3", (6, 4)))


@pytest.mark.parametrize(("slave", "alone"), [("TRIA6", True), ("QUAD8", True), ("QUAD4", False)])
def test_nodal_multipliers_on_quadratic_edges_own_an_unknown(slave, alone):
    """∫ of an end's linear function times the other end's quadratic one is 0: condensed."""
    case = block_case(2, zone=", treatment: nodal")
    problem = ContactProblem(build_scene(case, block_mesh(slave, "QUAD4", (5, 4))))
    assert (len(problem.constraints.dependent) == 0) == alone


@pytest.mark.parametrize("serves", [1e-11, 0.0])
@pytest.mark.parametrize("young", [2000.0, 2.0])
def test_a_stiffness_in_single_precision_costs_no_digit(monkeypatch, serves, young):
    """Blocks of different stiffness; where single precision does not serve, in double again."""
    text = block_case(3).about.source.replace("{all: {young: 2000.0", f"{{bottom: {{young: {young}")
    text = text.replace("0.3}}", "0.3}, top: {young: 2000.0, poisson: 0.2}}", 1)
    case, mesh = parse_case(text, Path("patch.yaml")), block_mesh("HEXA8", "HEXA8", (6, 5))
    monkeypatch.setattr(problem, "_SINGLE_SERVES", serves)
    found = []
    for least in (10**9, 0):
        monkeypatch.setattr(problem, "SINGLE_FROM", least)
        with force_solver(MULTIGRID):
            contact = ContactProblem(build_scene(case, mesh))
            assert contact.matrix.blocks.dtype == (np.float64 if least else np.float32)
            found.append(contact.solve(1.0))
    double, single = found
    assert contact.single == (serves > 0)
    assert contact.matrix.blocks.dtype == (np.float32 if serves else np.float64)
    assert single.residual < 1e-14
    assert single.pressure == pytest.approx(double.pressure, rel=1e-12)
    scale = np.abs(double.displacement).max()
    assert single.displacement == pytest.approx(double.displacement, abs=1e-12 * scale)


def test_a_stiffness_that_is_factored_is_in_double_precision(monkeypatch):
    monkeypatch.setattr(problem, "SINGLE_FROM", 0)
    contact = ContactProblem(build_scene(block_case(3), block_mesh("HEXA8", "HEXA8", (3, 2))))
    assert contact.matrix.dtype == np.float64


def test_a_start_that_leaves_a_body_free_is_no_end():
    """Contact alone holds the upper block along y, and nothing is closed at the start."""
    case = blocks(PRESSED)
    pressed = ContactProblem(build_scene(case, block_mesh("QUAD4", "QUAD4", (4, 3), 50.0)))
    found = pressed.solve(case.steps[0], np.zeros(len(pressed.constraints.area), dtype=bool))
    assert found.pressure == pytest.approx(25.0, rel=1e-12)
    assert found.status.iterations == 2
