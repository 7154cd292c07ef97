"""The contact status that a search starts from, on a graded sphere and on blocks that touch."""

from dataclasses import replace

import gmsh
import meshio
import numpy as np
import pytest

from solver import solve_case
from solver.lac import operator
from solver.lac.pairing import candidate_pairs
from solver.simulation.equilibrium import constraints
from solver.simulation.equilibrium.constraints import first_guess, moved
from solver.simulation.equilibrium.problem import ContactProblem
from solver.system.errors import InputError
from tests.simulation.test_rough_statuses import sphere


@pytest.fixture(scope="module")
def problem() -> ContactProblem:
    return ContactProblem(sphere("[12, 12, 6]", "[10, 10, 6]"))


def guessed(problem: ContactProblem, step, free_motion=lambda closed: ""):
    return first_guess(problem.scene, problem.constraints, step, free_motion)


def changed(problem: ContactProblem, start, before, step, free_motion=lambda closed: ""):
    return moved(start, before, step, problem.scene, problem.constraints, free_motion)


def test_a_step_starts_from_the_last_status_changed_as_the_guess_is(problem):
    small, large = (guessed(problem, step) for step in (0.3, 1.0))
    assert 0 < small.sum() < large.sum()
    # A macro-element that no guess has, and one less than the guess of the step before.
    start = small.copy()
    start[[np.flatnonzero(small)[0], np.flatnonzero(~large)[-1]]] ^= True
    more = changed(problem, start, 0.3, 1.0)
    np.testing.assert_array_equal(more, start | (large & ~small))
    np.testing.assert_array_equal(changed(problem, more, 1.0, 0.3), start)
    np.testing.assert_array_equal(changed(problem, start, 0.3, 0.3), start)


def test_a_start_that_leaves_a_body_free_is_not_taken(problem):
    start = guessed(problem, 1.0)
    kept = changed(problem, start, 1.0, 0.1, lambda closed: "a motion")
    np.testing.assert_array_equal(kept, start)


def test_a_guess_that_holds_no_body_is_widened_no_more_than_need_be(problem):
    least = guessed(problem, 1.0).sum() + 5

    def few(closed):
        return "a motion" if closed.sum() < least else ""

    guess, eligible = guessed(problem, 1.0, few), problem.constraints.eligible
    assert least <= guess.sum() < eligible.sum()
    gap = problem.constraints.initial / problem.constraints.covered
    assert gap[guess].max() <= gap[~guess].min()
    np.testing.assert_array_equal(guessed(problem, 1.0, lambda closed: "a motion"), eligible)


def test_load_steps_of_a_growing_contact_take_fewer_solves(problem, monkeypatch):
    def solves():
        first = problem.solve(0.2)
        found = problem.solve(1.0, first.status.closed, before=0.2)
        return found.status

    near = solves()
    monkeypatch.setattr(constraints, "_likely", lambda *more: problem.constraints.eligible)
    far = solves()
    np.testing.assert_array_equal(near.closed, far.closed)
    assert near.iterations < far.iterations


@pytest.mark.parametrize("flat", [True, False])
def test_a_graded_surface_has_the_same_pairs_found_among_fewer(monkeypatch, flat):
    """A flat slave has them among few at once, a curved one if it looks nearby first."""
    counted, found = [], []

    def count(*arguments):
        pairs = candidate_pairs(*arguments)
        counted[-1] += len(pairs[0])
        return pairs

    monkeypatch.setattr("solver.lac.pairing.candidate_pairs", count)
    for wider in (operator._WIDER, np.inf):
        monkeypatch.setattr(operator, "_WIDER", wider)
        counted.append(0)
        scene = sphere("[20, 20, 1]", "[18, 18, 1]", swapped=not flat)
        found.append(scene.zones[0].operator)
    faces = sum(len(block.nodes) for block in scene.zones[0].sub_faces)
    if flat:
        assert counted[1] < 20 * faces
    else:
        assert counted[0] < 0.5 * counted[1]
    few, all_pairs = found
    assert few.segments == all_pairs.segments
    for name in ("initial", "covered"):
        np.testing.assert_allclose(getattr(few, name), getattr(all_pairs, name), rtol=1e-12)
    assert abs(few.matrix - all_pairs.matrix).max() < 1e-13 * abs(all_pairs.matrix).max()


def test_a_receding_contact_starts_from_the_last_status(problem):
    """Surfaces that touch are all guessed closed at any load: the guess changes nothing."""
    constraints = replace(problem.constraints, initial=np.zeros(len(problem.constraints.initial)))
    start = np.arange(len(constraints.initial)) % 3 == 0
    found = moved(start, 0.3, 1.0, problem.scene, constraints, lambda closed: "")
    np.testing.assert_array_equal(found, start)


def in_a_hole(hole, inside, size: float) -> meshio.Mesh:
    """A lug with a hole and what is inside it, of TETRA4; the functions make shapes of gmsh."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Verbosity", 1)
        shapes = gmsh.model.occ
        block, bore = hole(shapes)
        [(_, lug)], _ = shapes.cut([(3, block)], [(3, bore)])
        shank = inside(shapes)
        shapes.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.model.mesh.generate(3)
        _, places, _ = gmsh.model.mesh.getNodes()
        cells = {}
        for name, volume in (("lug", lug), ("pin", shank)):
            _, _, [nodes] = gmsh.model.mesh.getElements(3, volume)
            cells[name] = nodes.reshape(-1, 4).astype(int) - 1
    finally:
        gmsh.finalize()
    count = [len(cells["lug"]), len(cells["pin"])]
    sets = {"lug": [np.arange(count[0])], "pin": [count[0] + np.arange(count[1])]}
    points = places.reshape(-1, 3)
    return meshio.Mesh(points, [("tetra", np.concatenate(list(cells.values())))], cell_sets=sets)


def pin(size: float) -> meshio.Mesh:
    """A pin through the hole of a lug."""
    return in_a_hole(
        lambda s: (s.addBox(-25, -25, 0, 50, 65, 5), s.addCylinder(0, 0, 0, 0, 0, 5, 10)),
        lambda s: s.addCylinder(0, 0.05, 0, 0, 0, 5, 9.95),
        size,
    )


def ball(size: float) -> meshio.Mesh:
    """A ball in a socket, half of it in the lug."""
    return in_a_hole(
        lambda s: (s.addBox(-2, -2, -2, 4, 4, 2), s.addSphere(0, 0, 0, 1)),
        lambda s: s.addSphere(0, 0, 0, 1),
        size,
    )


GROUPS = {
    "top": {"within": "lug", "plane": {"point": [0, 40, 0], "normal": [0, 1, 0]}},
    "ends": {"within": "pin", "plane": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
    "hole": {"within": "lug", "where": "1e-3 - abs(sqrt(x * x + y * y) - 10)"},
    "shank": {
        "within": "pin",
        "where": "1e-3 - abs(sqrt(x * x + (y - 0.05) * (y - 0.05)) - 9.95)",
    },
}
AROUND = {
    "bottom": {"within": "lug", "plane": {"point": [0, 0, -2], "normal": [0, 0, 1]}},
    "socket": {"within": "lug", "where": "1e-6 - abs(x * x + y * y + z * z - 1)"},
    "shell": {"within": "pin", "where": "1e-6 - abs(x * x + y * y + z * z - 1)"},
}


@pytest.mark.parametrize("sides", [("socket", "shell"), ("shell", "socket")])
def test_facets_keep_no_ball_from_turning(sides):
    """The facets of a sphere lean to all sides; it turns in its socket all the same."""
    case = {
        "name": "ball",
        "materials": {"all": {"young": 70000.0, "poisson": 0.33}},
        "groups": AROUND,
        "supports": [{"group": "bottom", "fix": ["x", "y", "z"]}],
        "loads": [{"group": "pin", "body_force": [0, 0, -100.0]}],
        "contact": [{"slave": sides[0], "master": sides[1]}],
    }
    with pytest.raises(InputError, match=r"nothing keeps pin from a free motion .turn about"):
        solve_case(case, ball(0.6))


def test_facets_keep_no_pin_from_turning():
    """Nor those of a pin that only its ends hold, along its axis."""
    case = {
        "name": "pin",
        "materials": {"all": {"young": 70000.0, "poisson": 0.33}},
        "groups": GROUPS,
        "supports": [{"group": "top", "fix": ["x", "y", "z"]}, {"group": "ends", "fix": ["z"]}],
        "loads": [{"group": "pin", "body_force": [0, -20.0, 0]}],
        "contact": [{"slave": "shank", "master": "hole"}],
    }
    with pytest.raises(InputError, match=r"nothing keeps pin from a free motion .turn about z"):
        solve_case(case, pin(5.0))


@pytest.mark.parametrize("held", [False, True])
def test_facets_alone_hold_no_body(held):
    """A hole of TETRA4 is rough: along its axis and around it, a smooth one would not hold."""
    case = {
        "name": "pin",
        "materials": {"all": {"young": 70000.0, "poisson": 0.33}},
        "groups": GROUPS,
        "supports": [{"group": "ends", "fix": ["x", "y", "z"]}],
        "loads": [{"group": "top", "force": [0, 2000.0, 0]}],
        "contact": [{"slave": "hole", "master": "shank"}],
    }
    if held:
        case["supports"].append({"group": "top", "fix": ["x", "z"]})
        assert solve_case(case, pin(5.0)).verdict == "unreliable"  # its facets are too deep
        return
    with pytest.raises(InputError, match="nothing keeps lug from a free motion"):
        solve_case(case, pin(5.0))
