"""Bodies that slide, turn and roll far: frames, history, forces that turn, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from solver.case.model import CaseReference
from solver.case.reader import load_case, parse_case
from solver.lac.errors import SolveError
from solver.mesh import generate
from solver.simulation.motion import _joined, _position
from solver.simulation.options import LEAN
from solver.simulation.scene.parts.springs import springs_of
from solver.simulation.simulate import refusals_on, simulate, solved
from solver.system.errors import InputError
from solver.system.progress import Clock
from solver.verification.run import mesh_of

CASES = Path(__file__).resolve().parents[2] / "cases"
MESH = {
    "recipe": "punch",
    "bottom_size": [50.0, 10.0],
    "top_size": [10.0, 10.0],
    "bottom": {"cells": "QUAD4", "divisions": [10, 2]},
    "top": {"cells": "QUAD8", "divisions": [3, 2]},
}
TEXT = {
    "name": "moving",
    "mesh": MESH,
    "plane": "strain",
    "motion": "large",
    "materials": {"all": {"young": 2000.0, "poisson": 0.3}},
    "supports": [
        {"group": "base", "fix": ["x", "y"]},
        {"at": [0.0, 10.0], "fix": {"x": 7.0}, "name": "pull"},
    ],
    "loads": [{"group": "press", "pressure": 2.5, "name": "press"}],
    "steps": [{"press": 1, "pull": k} for k in (1, 2, 3, 1, 0)],
    "contact": [{"name": "interface", "slave": "top_contact", "master": "bottom_contact"}],
}


def moving(**changes):
    return parse_case(json.dumps(TEXT | changes), Path("moving.yaml"))


def run(case):
    return solved(case, mesh_of(case), LEAN, Clock())


def whole(solution):
    """The displacement from the mesh as given."""
    return solution.fields.motion + solution.displacement


def test_a_path_and_its_reverse_come_back():
    """Without friction the last position is the first one again, far away in between."""
    there = run(moving(steps=[{"press": 1, "pull": 0}]))
    back = run(moving())
    assert np.ptp([p.points[:, 0].max() for p in back.earlier]) == pytest.approx(0.0, abs=1e-12)
    far = [float(p.at_points["motion"][:, 0].max()) for p in back.earlier]
    assert far == pytest.approx([7, 14, 21, 7], rel=1e-12)
    assert whole(back) == pytest.approx(whole(there), abs=1e-12)
    assert back.zones[0].multiplier == pytest.approx(there.zones[0].multiplier, rel=1e-11)


def pushed(angle, **changes):
    """The upper block, pushed by its left side, which is turned with all the rest."""
    along = [float(np.cos(np.radians(angle))), float(np.sin(np.radians(angle)))]
    side = {"within": "top", "plane": {"point": [0.0, 0.0], "normal": along}}
    held = [
        {"group": "base", "fix": ["x", "y"]},
        {"group": "left", "fix": {"normal": -7.0}, "name": "pull"},
    ]
    return moving(groups={"left": side}, supports=held, transform={"rotate": angle}, **changes)


def pressures(solution):
    earlier = [position.of_cells["pressure"] for position in solution.earlier]
    cells = np.concatenate([values[~np.isnan(values)] for values in earlier])
    return np.concatenate([cells, solution.zones[0].multiplier])


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_the_same_pressures_whatever_way_the_assembly_is_turned(friction):
    zone = {**TEXT["contact"][0], "friction": friction} if friction else TEXT["contact"][0]
    plain = run(pushed(0.0, contact=[zone]))
    for angle in (30.0, 120.0, 210.0):
        found = run(pushed(angle, contact=[zone]))
        assert pressures(found) == pytest.approx(pressures(plain), rel=1e-12)


def test_work_of_the_path_is_strain_energy_and_friction():
    """The rubbing block slides on by equal steps: its strain energy does not change."""
    case = load_case(CASES / "motion/slide-c-friction.yaml")
    solution = run(case)
    work, rubbed = ([getattr(s, k) for s in solution.steps] for k in ("work", "dissipation"))
    assert work[1:] == pytest.approx(rubbed[1:], rel=1e-11)
    assert sum(work) > 0.9 * sum(rubbed)


def test_pressure_turns_with_its_face_and_traction_does_not():
    """A block turned by a right angle, pressed on a side: the reaction turns with the pressure."""
    turned = [
        {"at": [0.0, 10.0], "fix": {"x": 1.0}, "name": "x"},
        {"at": [0.0, 10.0], "fix": {"y": 1.0}, "name": "y"},
        {"at": [10.0, 10.0], "fix": {"x": 1.0}, "name": "x2"},
        {"at": [10.0, 10.0], "fix": {"y": 1.0}, "name": "y2"},
        {"group": "base", "fix": ["x", "y"]},
    ]
    # About (5, 5): (0, 10) goes to (0, 0), (10, 10) to (0, 10).
    step = {"press": 1, "x": 0, "y": -10, "x2": -10, "y2": 0}
    still = {"press": 1, "x": 0, "y": 0, "x2": 0, "y2": 0}
    # The left side comes to lie on the lower block.
    left = {"within": "top", "plane": {"point": [0.0, 0.0], "normal": [1.0, 0.0]}}
    groups = {"left": left, "skin": ["top_contact", "left"]}
    zone = {"name": "interface", "slave": "bottom_contact", "master": "skin"}
    of_kind = {
        "pressure": {"group": "press", "pressure": 2.5, "name": "press"},
        "traction": {"group": "press", "traction": [0.0, -2.5], "name": "press"},
    }
    found = {}
    for kind, load in of_kind.items():
        posed = {"supports": turned, "loads": [load], "groups": groups, "contact": [zone]}
        solution = run(moving(steps=[still, step], **posed))
        assert not solution.ended
        found[kind] = sum(r.force for r in solution.reactions)
    assert found["pressure"] == pytest.approx([-25.0, 0.0], abs=1e-8)
    assert found["traction"] == pytest.approx([0.0, 25.0], abs=1e-8)


def test_springs_pull_back_from_where_they_were_made():
    """A block slides by 20 on springs along x: the force is that of their whole length."""
    spring = {"group": "press", "spring": {"x": 0.05}}
    solution = run(moving(supports=[*TEXT["supports"], spring], steps=[{"press": 1, "pull": 3}]))
    held = {r.group: r.force for r in solution.reactions}
    assert held["springs"][0] == pytest.approx(-0.05 * 10 * 21, rel=1e-3)
    top = np.isclose(solution.mesh.points[:, 1], 10.0)
    drawn = whole(solution)[top & (solution.fields.body == solution.fields.body[np.argmax(top)]), 0]
    assert drawn == pytest.approx(21, abs=0.1)


def test_a_rigid_master_moves_by_its_finite_rotation():
    """A rigid plane turned by a quarter presses a block from the other side."""
    bodies = {
        "wall": {
            "plane": {"point": [5.0, 11.0], "normal": [0.0, -1.0]},
            "reference": [5.0, 5.0],
            "move": {"x": 0.0, "y": -1.01, "rz": 0.0},
            "name": "wall",
        }
    }
    mesh = {
        "recipe": "bricks",
        "bricks": [
            {
                "name": "block",
                "low": [0.0, 0.0],
                "high": [10.0, 10.0],
                "block": {"cells": "QUAD4", "divisions": [2, 2]},
            }
        ],
    }
    planes = {"press": ([0.0, 10.0], [0.0, 1.0]), "base": ([0.0, 0.0], [0.0, 1.0])}
    case = moving(
        mesh=mesh,
        bodies=bodies,
        groups={n: {"plane": {"point": p, "normal": v}} for n, (p, v) in planes.items()},
        supports=[{"group": "base", "fix": ["y"]}, {"at": [0.0, 0.0], "fix": ["x"]}],
        loads=[],
        steps=[{"wall": 1}],
        contact=[{"name": "interface", "slave": "press", "master": "wall"}],
    )
    solution = run(case)
    stiff = 2000 / (1 - 0.3**2)
    assert solution.zones[0].multiplier == pytest.approx(stiff * 0.01 / 10, rel=1e-9)
    (rigid,) = solution.rigid
    assert rigid.translation == pytest.approx([0.0, -1.01], abs=1e-12)


def test_a_block_is_pulled_up_a_slope():
    """The horizontal force is (tan α + μ)/(1 − μ tan α) of the weight."""
    solution = run(load_case(CASES / "motion/slope.yaml"))
    for step in solution.steps:
        force = step.resultants["interface"].force
        assert force == pytest.approx([-10000.0 * 0.4 / 0.97, 10000.0], rel=2e-5)
    moved = whole(solution)[solution.fields.body == solution.fields.body[-1]]
    up = 9 * np.sin(np.arctan(0.1))
    assert solution.fields.motion[:, 1].max() == pytest.approx(up, rel=1e-3)
    assert np.isfinite(moved).all()


def test_a_roller_that_sticks_goes_as_far_as_it_turns():
    """By R θ, to the order of a/R; its x is free, and no force holds it along."""
    block = {"cells": "QUAD4", "divisions": [40, 10]}
    planes = {"top": ([0.0, 10.0], [0.0, 1.0]), "base": ([0.0, 0.0], [0.0, 1.0])}
    bricks = [{"name": "block", "low": [0.0, 0.0], "high": [40.0, 10.0], "block": block}]
    circle = {"sphere": {"centre": [10.0, 29.8], "radius": 20.0}, "name": "go"}
    case = moving(
        mesh={"recipe": "bricks", "bricks": bricks},
        groups={n: {"plane": {"point": p, "normal": v}} for n, (p, v) in planes.items()},
        supports=[{"group": "base", "fix": ["x", "y"]}],
        loads=[],
        bodies={"roller": {**circle, "move": {"y": 0.0, "rz": -1.0}, "force": {"x": 0.0}}},
        contact=[{"name": "interface", "slave": "top", "master": "roller", "friction": 0.5}],
        steps=[{"go": 0}, {"go": 1}],
        substeps=10,
    )
    solution = run(case)
    gone = np.array([step.rigid[0].translation[0] for step in solution.steps])
    turned = -np.array([step.rigid[0].rotation[2] for step in solution.steps])
    assert np.diff(gone)[10:] == pytest.approx(20 * np.diff(turned)[10:], rel=0.01)
    forces = [step.resultants["interface"].force[0] for step in solution.steps]
    assert np.abs(forces).max() < 1e-8


def test_a_roller_goes_as_far_as_it_is_moved():
    """Its contact stays where it is; its centre goes on, and does not rise."""
    case = load_case(CASES / "motion/rolling.yaml")
    solution = run(replace(case, steps=case.steps[:3]))
    for step, gone in zip(solution.steps, (0.05, 1.35, 2.65), strict=True):
        rigid = step.rigid[0]
        assert rigid.translation == pytest.approx([gone, 0.0], abs=1e-6)
        assert rigid.rotation[2] == pytest.approx(-gone / 5000)
    assert rigid.point == pytest.approx([2.65, 5000.0])


def test_bodies_beyond_the_digits_of_coordinates_have_no_place():
    case = load_case(CASES / "motion/rolling.yaml")
    far = structs.replace(case.rigid["cylinder"], move={"x": 1e20})
    with pytest.raises(SolveError, match="no longer tell nodes apart"):
        run(replace(case, rigid={"cylinder": far}))


def test_a_ring_that_turns_rubs_by_its_pressure():
    """Its moment is μ p 2πr², at every angle that it slid to, to the error of its polygons."""
    case = load_case(CASES / "motion/rings.yaml")
    zones = (structs.replace(case.zones[0], friction=0.2),)
    solution = run(replace(case, zones=zones, reference=CaseReference()))
    pressure = case.reference.values["contact_pressure"]
    for step in solution.steps[1:]:
        moment = step.resultants["interface"].moment[2]
        assert moment == pytest.approx(-0.2 * pressure * 2 * np.pi * 10**2, rel=0.01)


def test_a_ring_slides_along_its_axis_in_a_rigid_sleeve():
    """Without friction nothing changes on the way; with it the force is that of μ p."""
    bricks = [
        ("ring", [20.0, 0.0], [30.0, 10.0], "QUAD8", [4, 4]),
        ("sleeve", [30.0, -40.0], [35.0, 60.0], "QUAD4", [1, 40]),
    ]
    sides = {"outer": ("ring", 30.0), "bore": ("ring", 20.0), "inside": ("sleeve", 30.0)}
    radial = {
        name: {"within": body, "plane": {"point": [x, 0.0], "normal": [1.0, 0.0]}}
        for name, (body, x) in sides.items()
    }
    foot = {"within": "ring", "plane": {"point": [0.0, 0.0], "normal": [0.0, 1.0]}}
    blocks = [
        {"name": n, "low": low, "high": high, "block": {"cells": cells, "divisions": parts}}
        for n, low, high, cells, parts in bricks
    ]
    for friction in (0.0, 0.2):
        zone = {"name": "interface", "slave": "outer", "master": "inside", "friction": friction}
        solution = run(
            moving(
                mesh={"recipe": "bricks", "bricks": blocks},
                plane="axisymmetric",
                groups={**radial, "foot": foot},
                bodies={"sleeve": {"rigid": True, "move": {"y": 30.0}, "name": "go"}},
                supports=[{"group": "foot", "fix": ["y"]}],
                loads=[{"group": "bore", "pressure": 25.0, "name": "press"}],
                steps=[{"press": 1, "go": 0}, {"press": 1, "go": 1}],
                contact=[zone],
            )
        )
        first, last = (step.resultants["interface"] for step in solution.steps)
        assert solution.rigid[0].translation == pytest.approx([0.0, 30.0])
        if friction:
            assert last.force[1] == pytest.approx(-friction * last.force[0], rel=1e-10)
        else:
            assert last.force == pytest.approx(first.force, abs=1e-8)


def test_substeps_are_equal_parts_of_the_way():
    steps = moving(steps=[{"press": 1, "pull": 1}, {"press": 1, "pull": 3}], substeps=2).steps
    pulls = [step["pull"] for step in steps]
    assert pulls == [0.5, 1, 2, 3]
    assert [step["press"] for step in steps] == [0.5, 1, 1, 1]
    with pytest.raises(InputError, match="makes 1002 steps"):
        moving(steps=[{"press": 1, "pull": 1}] * 2, substeps=501)


def test_what_slid_off_ends_the_path_and_keeps_the_steps_before():
    case = moving(steps=[{"press": 1, "pull": k} for k in (1, 9)])
    solution = run(case)
    assert solution.ended.startswith("step 2")
    assert len(solution.steps) == 1
    with pytest.raises(SolveError, match="step 2"):
        simulate(case, generate(MESH, "moving"))


def test_what_the_first_step_makes_impossible_is_told_without_solving():
    """Pulled 60 to the side, the block lies over nothing; as meshed it lies on the other one."""
    gone = moving(steps=[{"press": 1, "pull": 60 / 7}])
    told = [str(error) for error in refusals_on(gone, mesh_of(gone))]
    with pytest.raises(InputError) as refused:
        run(gone)
    assert told == [str(refused.value)]
    assert not list(refusals_on(moving(), mesh_of(moving())))


def test_small_motion_is_that_of_linear_theory():
    """Where bodies move by less than a tenth of a face, nothing is followed."""
    small = [{"press": 1, "pull": 0.01}]
    one, other = (run(moving(steps=small, motion=motion)) for motion in ("small", "large"))
    assert other.displacement == pytest.approx(one.displacement, abs=1e-15)
    assert not other.fields.motion.any()
    assert any("followed" in line.what for line in other.plan)
    assert not any("followed" in line.what for line in one.plan)


def test_the_work_of_loads_is_energy_and_friction():
    """Of blocks that slide flat: all of it energy, or lost to friction from the second step on."""
    free, rough = (run(load_case(CASES / f"motion/slide-c{n}.yaml")) for n in ("", "-friction"))
    work = sum(step.work for step in free.steps)
    assert work == pytest.approx(free.scalars.strain_energy, rel=1e-12)
    for step in rough.steps[1:]:
        assert step.work == pytest.approx(step.dissipation, rel=1e-12)


def test_a_recovered_pressure_of_the_last_step_alone_is_nan_before():
    solution = run(load_case(CASES / "motion/slide-c-friction.yaml"))
    points = {"recovered_pressure": np.zeros(3)}
    position = _position(solution, (points, {}))
    assert np.isnan(position.at_points["recovered_pressure"]).all()


def test_the_slip_of_all_steps_turns_with_the_slave():
    """A body turned by a right angle after it slid: its whole slip turns with it."""
    case = load_case(CASES / "motion/slide-c-friction.yaml")
    solution = run(case)
    total = solution.zones[0].friction.slip_total[:, 0]
    assert total.max() == pytest.approx(2 * 5.0, rel=0.1)  # each face is passed by two columns
    joined = _joined(case.until(1), [replace(solution, steps=solution.steps[:1], earlier=[])])
    assert joined.quality.validity == solution.quality.validity


def test_a_place_that_a_step_brings_bodies_to_is_no_fault_of_the_input():
    soft = moving(materials={"all": {"young": 2.0, "poisson": 0.3}})
    assert not list(refusals_on(soft, mesh_of(soft)))
    with pytest.raises(SolveError, match=r"^step 1 .*: the surfaces overlap by 7\."):
        run(soft)


FAULTS = {
    "frames are not followed": (
        "solver.simulation.motion._followed",
        lambda rest, faces, old, new: old,
        test_a_path_and_its_reverse_come_back,
    ),
    "pressure does not turn": (
        "solver.simulation.scene.moved.Frames.turned",
        lambda frames, vectors, body: vectors,
        test_pressure_turns_with_its_face_and_traction_does_not,
    ),
    "springs are drawn from where bodies are": (
        "solver.simulation.scene.parts.springs.springs_of",
        lambda groups: springs_of(groups.at_rest),
        test_springs_pull_back_from_where_they_were_made,
    ),
    "slip is counted from the start in each step": (
        "solver.simulation.motion._Place.displacement",
        property(lambda place: 0 * place.groups.motion),
        test_work_of_the_path_is_strain_energy_and_friction,
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_noticed(monkeypatch, fault):
    place, patch, noticing = FAULTS[fault]
    monkeypatch.setattr(place, patch)
    with pytest.raises(AssertionError):
        noticing()
