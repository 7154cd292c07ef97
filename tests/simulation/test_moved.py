"""Frames of bodies that move far, and what does not go with `motion: large`."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs
from scipy.spatial.transform import Rotation

from solver.case.model import CaseReference
from solver.case.reader import load_case
from solver.simulation.scene.moved import Frames, _best_turn, rotation_by, rotation_vector
from solver.system.errors import InputError
from solver.verification.judge import judge
from tests.simulation.test_motion import CASES, TEXT, moving, run, whole

angles = st.floats(-3.0, 3.0)


@given(st.integers(0, 2**31), st.tuples(angles, angles, angles))
@settings(max_examples=50, deadline=None)
def test_a_rotation_is_found_whatever_its_angle(seed, vector):
    before = np.random.default_rng(seed).normal(size=(6, 3))
    turn = Rotation.from_rotvec(vector).as_matrix()
    found = _best_turn(before, before @ turn.T)
    assert found == pytest.approx(turn, abs=1e-12)
    assert rotation_by(rotation_vector(found), 3) == pytest.approx(found, abs=1e-12)


def test_a_flat_surface_turns_without_a_reflection():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 2, 0]]) - [0.5, 1, 0]
    turn = Rotation.from_rotvec([0.3, -0.8, 1.1]).as_matrix()
    found = _best_turn(flat, flat @ turn.T)
    assert found == pytest.approx(turn, abs=1e-12)
    assert np.linalg.det(found) == pytest.approx(1.0)


def test_a_ring_that_widens_moves_along_its_axis_alone():
    now = np.array([[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0]])
    then = now * [1.1, 1.0] + [0.0, 3.0]
    frames = Frames.still(1, 2).following(0, now, then, around_axis=True)
    assert frames.turn[0] == pytest.approx(np.eye(2))
    assert frames.shift[0] == pytest.approx([0.0, 3.0])
    free = Frames.still(1, 2).following(0, now, then)
    assert free.shift[0] == pytest.approx([0.15, 3.0])


def test_frames_stay_orthogonal_over_many_steps():
    frames, turn = Frames.still(1, 3), Rotation.from_rotvec([0.1, 0.2, -0.3]).as_matrix()
    for _ in range(1000):
        frames = frames.with_body(0, turn @ frames.turn[0], np.zeros(3))
    assert frames.turn[0].T @ frames.turn[0] == pytest.approx(np.eye(3), abs=1e-14)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"contact": [{**TEXT["contact"][0], "clearance": 0}]}, "contact[0].clearance"),
        ({"probes": {"a": {"at": [1.0, 1.0]}}}, "probes.a.at"),
        ({"supports": [{"group": "press", "together": ["y"]}]}, "supports[0].together"),
        (
            {"supports": [{"group": "farx", "cyclic": {"of": "symx", "shift": [1.0, 0.0]}}]},
            "supports[0].cyclic",
        ),
        (
            {"loads": [{"group": "top", "temperature": 1.0, "expansion": 1.0}]},
            "loads[0].temperature",
        ),
        ({"loads": [{"group": "top", "strain": {"xx": 1.0}}]}, "loads[0].strain"),
        (
            {"reference": {"kind": "analytical", "displacement": [0.0, 0.0]}},
            "reference.displacement",
        ),
    ],
)
def test_what_does_not_go_with_motion_is_refused_by_both_keys(changes, key):
    plain = {
        "steps": [1.0],
        "supports": [{"group": "base", "fix": ["x", "y"]}],
        "loads": [{"group": "press", "pressure": 2.5}],
    }
    with pytest.raises(InputError, match="`motion: large`") as error:
        moving(**(plain | changes))
    assert error.value.key == key


HERTZ = {"name": "hertz_half_planes", "end": 3.3, "radius": 500, "bottom": "all", "top": "rigid"}
CYLINDER = {"parabola": {"point": [0, 0], "normal": [0, -1], "radius": 500}}


@pytest.mark.parametrize(
    ("solution", "bodies"),
    [
        (
            {"name": "hydrostatic", "pressure": 1},
            {"cylinder": CYLINDER | {"move": {"x": 1}, "name": "go"}},
        ),
        (HERTZ, {}),
        (HERTZ, {"cylinder": CYLINDER | {"move": {"x": 1}}}),
        (HERTZ, {"cylinder": CYLINDER | {"move": {"x": 1, "rz": 1}, "name": "go"}}),
        (HERTZ, {n: CYLINDER | {"move": {"x": 1}, "name": "go"} for n in ("one", "two")}),
    ],
)
def test_an_exact_solution_goes_along_with_one_named_body_alone(solution, bodies):
    zones = [
        {"name": name, "slave": "top_contact", "master": name} for name in bodies or ["bottom"]
    ]
    reference = {"kind": "analytical", "solution": solution, "contact_pressure": "solution"}
    given = {
        "reference": reference,
        "steps": [{"go": 1.0}] if "go" in str(bodies) else [1.0],
        "bodies": bodies,
        "contact": zones,
    }
    with pytest.raises(InputError, match="`motion: large`") as error:
        moving(**given, supports=[{"group": "base", "fix": ["x", "y"]}], loads=[])
    assert error.value.key == "reference.solution"


def test_an_exact_solution_is_where_each_step_has_its_body():
    case = load_case(CASES / "motion/hertz.yaml")
    places = [case.exact_in(step).origin for step in case.steps]
    np.testing.assert_allclose(places, 0.05 + 1.3 * np.arange(10), rtol=1e-13)
    assert case.reference.exact.origin == places[-1]


@pytest.mark.parametrize("name", ["a", "q"])
def test_a_block_that_went_down_comes_back_where_its_load_is_taken_away(name):
    """With friction, on the mesh where it was: what is left of the load is round-off."""
    case = load_case(CASES / f"ssnp170/{name}.yaml")
    zones = (structs.replace(case.zones[0], friction=0.3),)
    changes = {"motion": "large", "steps": (0.5, 1.0, 0.0), "reference": CaseReference()}
    solution = run(replace(case, zones=zones, **changes))
    assert whole(solution).min() > -1e-12
    assert np.abs(solution.fields.motion).max() < 1e-13
    assert solution.zones[0].multiplier.max() < 1e-12
    assert judge(solution, []).verdict == "solved"
    pressed = [step.resultants["interface"].pressure[1] for step in solution.steps]
    assert pressed == pytest.approx([12.5, 25.0, 0.0], abs=1e-10)
