"""Friction: the search for stick and slip, its fallback, and what it refuses."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from solver.case.reader import load_case, parse_case
from solver.lac.errors import SolveError
from solver.mechanics.mortar.tresca import coulomb_by_cones
from solver.simulation.equilibrium import friction
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.judgement import plan
from solver.simulation.options import Options
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.norms import errors
from solver.verification.results import read_result, write_result
from solver.verification.run import mesh_of, refined

CASES = Path(__file__).parents[2] / "cases"
PLATE = """\
name: plate
mesh:
  recipe: blocks
  size: [10, 2]
  bottom: {{cells: QUAD4, divisions: [{n}, 2]}}
  top: {{cells: QUAD4, divisions: [{m}, 2]}}
plane: strain
materials: {{all: {{young: 1000.0, poisson: 0.3}}}}
groups:
  end: {{of: faces, within: top, plane: {{point: [0, 0], normal: [1, 0]}}}}
supports:
  - {{group: base, fix: [x, y]}}
{push}
loads:
  - {{group: press, pressure: 10.0}}
{pull}
contact:
  - {{name: interface, slave: top_contact, master: bottom_contact, friction: {mu}}}
{steps}
"""


def plate(mu, push=None, pull=None, n=20, steps="", change=lambda text: text):
    """A plate on another one, whose end is moved by `push` or pulled by a traction."""
    moved = "" if push is None else f"  - {{group: end, fix: {{x: {push}}}}}"
    pulled = "" if pull is None else f"  - {{group: end, traction: [{pull}, 0]}}"
    text = PLATE.format(mu=mu, push=moved, pull=pulled, n=n, m=n + 5, steps=steps)
    return parse_case(change(text), Path("case.yaml"))


def solved(case):
    return simulate(case, mesh_of(case))


def law(solution):
    [check] = [check for check in run_checks(solution) if check.name == "friction_law"]
    return check.error


@pytest.mark.parametrize(
    ("mu", "push"), [(0.3, 0.05), (1.0, 0.1), (1.0, 0.2), (2.0, 0.3), (5.0, 0.5)]
)
def test_every_plate_ends_in_a_state_that_keeps_coulombs_law(mu, push):
    solution = solved(plate(mu, push))
    assert law(solution) < 1e-9
    assert max(solution.balance.values()) < 1e-11
    assert solution.steps[0].dissipation > 0
    found = solution.zones[0].friction
    assert {1, 2} <= set(found.status.tolist())
    # Nothing is gained by the sign: the plate is pushed to +x, and friction on it acts to −x.
    assert (found.friction_traction[:, 0] <= 1e-12).all()


def test_the_cone_programs_find_the_state_of_the_search(monkeypatch):
    """Where the quick search settles, the fallback finds the same, by another formulation.

    On faces of unequal size: the programs are in forces, the search in pressures.
    """
    uneven = "plane: strain\ntransform: {perturb: 0.2}"
    case = plate(0.5, 0.05, change=lambda text: text.replace("plane: strain", uneven))
    quick = solved(case)
    used = []

    def noted(*arguments):
        used.append(coulomb_by_cones(*arguments))
        return used[-1]

    monkeypatch.setattr(friction, "coulomb_by_cones", noted)
    monkeypatch.setattr(friction.Search, "starts", lambda search: iter([search._by_cones()]))
    slow = solved(case)
    [(forces, jump, settled)] = used
    assert settled
    zone, m = quick.zones[0], len(quick.zones[0].multiplier)
    assert np.ptp(zone.area) > 0.2 * zone.area.mean()
    pressure, traction = forces[:m] / zone.area, np.abs(forces[m:]) / zone.area
    np.testing.assert_allclose(pressure, zone.multiplier, atol=1e-7 * zone.multiplier.max())
    along = {
        name: np.abs(getattr(zone.friction, name)[:, 0]) for name in ("friction_traction", "slip")
    }
    np.testing.assert_allclose(traction, along["friction_traction"], atol=1e-7)
    np.testing.assert_allclose(np.abs(jump[m:]), along["slip"], atol=1e-9)
    np.testing.assert_allclose(slow.displacement, quick.displacement, atol=1e-11)


@pytest.mark.parametrize("along", [0.0, 1e-14])
def test_the_cone_programs_settle_no_bounds_of_a_force_that_nothing_balances(along):
    """Pressed by 2 and pulled by 5, μ = 0.1, and no stiffness along the face."""
    of, friction = np.array([0]), np.array([0.1])
    start = np.array([2.0, 5.0])
    *_, settled = coulomb_by_cones(np.diag([1.0, along]), start, friction, of, 1)
    assert not settled


def test_recovery_raises_the_order_of_friction():
    """Sliding waves: constants have order 2, a recovered pressure and its friction more than 3."""
    found = {}
    for recovery in ("none", "automatic"):
        case = load_case(CASES / "friction" / "ladders" / "sliding-tria6.yaml")
        case = case.as_solved(recovery=recovery)
        found[recovery] = [errors(solved(refined(case, level))) for level in (1, 2)]
    for recovery, least in (("none", 1.9), ("automatic", 3.0)):
        coarse, fine = (each["traction_means"] for each in found[recovery])
        assert np.log2(coarse / fine) > least
    for norm in ("pressure_l2", "traction_l2"):
        coarse, fine = (each[norm] for each in found["automatic"])
        assert np.log2(coarse / fine) > 2.8


def test_a_recovered_stick_zone_keeps_the_law_and_the_balance():
    case = load_case(CASES / "friction" / "ladders" / "cylinder-tria6.yaml")
    constant, recovered = (solved(case.as_solved(recovery=r)) for r in (None, "automatic"))
    assert law(recovered) < 1e-9
    assert max(recovered.balance.values()) < 1e-11
    status = recovered.zones[0].friction.status
    np.testing.assert_array_equal(status, constant.zones[0].friction.status)
    assert {0, 1, 2} == set(status.tolist())
    for norm in ("traction_means", "traction_l2"):
        assert errors(recovered)[norm] < 0.6 * errors(constant)[norm]


def test_friction_across_a_meshed_gap_is_a_couple_and_no_imbalance():
    """A rigid cylinder: its tractions act on its own face, a gap above the half-plane."""
    case = load_case(CASES / "friction" / "rigid-cylinder-tria6.yaml")
    solution = solved(case)
    assert max(solution.balance.values()) < 1e-12
    zone, exact = solution.zones[0], case.solution
    force = zone.multiplier * zone.area
    place = (force @ zone.centre[:, 0]) / force.sum()
    # The resultant is at −(2/3) ε a from the middle, which is −2 ε a from the apex (Johnson §8.2).
    expected = -(2 + 2 / 3) * exact.skew * exact.half_width
    assert place == pytest.approx(expected, rel=0.02)
    recovered = solved(case.as_solved(recovery="automatic"))
    assert max(recovered.balance.values()) < 1e-12
    norms = [errors(each)["traction_l2"] for each in (solution, recovered)]
    assert norms[1] < norms[0]


@pytest.mark.parametrize(("rate", "told"), [(0.4, "only one nearby"), (1.2, "other states nearby")])
def test_the_plan_claims_no_more_than_the_contraction_shows(rate, told):
    state = SimpleNamespace(friction=SimpleNamespace(contraction=rate))
    assert told in list(plan._friction([state]))[-1].why


def test_without_a_coefficient_nothing_changes():
    zero = solved(plate(0, 0.05))
    without = solved(plate(0, 0.05, change=lambda text: text.replace(", friction: 0", "")))
    assert zero.zones[0].friction is None
    np.testing.assert_array_equal(zero.displacement, without.displacement)


def test_friction_alone_holds_a_body_until_it_is_overcome():
    """The plate of the weight 100 is held up to a pull of μ · 100; its end is 2 high."""
    held = solved(plate(0.5, pull=24.0))
    assert held.zones[0].resultants.friction[0] == pytest.approx(-48.0, rel=1e-9)
    assert law(held) < 1e-9
    with pytest.raises(SolveError, match="overcome friction"):
        solved(plate(0.5, pull=26.0))


def test_what_slipped_stays_when_the_load_returns():
    """Pushed and pushed back: an elastic state would be that of the start."""
    path = "steps: [{push: 1}, {push: 0}]"
    named = ("{group: end, fix: {x: 0.08}}", "{group: end, fix: {x: 0.08}, name: push}")
    solution = solved(plate(0.3, 0.08, steps=path, change=lambda text: text.replace(*named)))
    first, back = solution.steps
    assert first.dissipation > 0
    assert back.dissipation > 0
    found = solution.zones[0].friction
    assert law(solution) < 1e-9
    assert np.abs(found.friction_traction).max() > 1.0
    assert np.abs(found.slip_total).max() > 0.1 * 0.08


def test_friction_of_two_zones_with_their_own_coefficients():
    case = plate(0.3, 0.05, change=lambda text: text.replace(
        "contact:",
        "bodies: {floor: {plane: {point: [0, -2], normal: [0, 1]}}}\ncontact:\n"
        "  - {name: below, slave: base, master: floor, friction: 0.6}",
    ).replace("  - {group: base, fix: [x, y]}\n", "  - {group: symx, fix: [y]}\n"))  # fmt: skip
    solution = solved(case)
    for zone, given in zip(solution.zones, solution.case.zones, strict=True):
        assert zone.friction is not None
        size = np.linalg.norm(zone.friction.friction_traction, axis=1)
        assert (size <= given.friction * zone.multiplier * (1 + 1e-9) + 1e-12).all()


def test_a_result_file_keeps_friction(tmp_path):
    solution = solved(plate(0.3, 0.05))
    path = tmp_path / "result.vtkhdf"
    write_result(path, solution, run_checks(solution), {})
    back = read_result(path).solution
    before, after = solution.zones[0], back.zones[0]
    for name in ("friction_traction", "slip", "slip_total", "status"):
        np.testing.assert_array_equal(getattr(after.friction, name), getattr(before.friction, name))
    assert back.steps[0].dissipation == solution.steps[0].dissipation
    np.testing.assert_array_equal(after.resultants.friction, before.resultants.friction)
    np.testing.assert_array_equal(
        back.steps[0].resultants["interface"].stick, before.resultants.stick
    )


def test_each_row_of_gap_and_slip_has_an_unknown_of_its_own_on_a_tilted_interface():
    tilted = ("plane: strain", "plane: strain\ntransform: {rotate: 25}")
    turned = ("normal: [1, 0]", f"normal: [{np.cos(np.radians(25))}, {np.sin(np.radians(25))}]")
    case = plate(0.3, change=lambda text: text.replace(*tilted).replace(*turned))
    problem = ContactProblem(build_scene(case, mesh_of(case), Options()))
    assert not len(problem.constraints.dependent)
    assert problem.constraints.normal.sum() == len(problem.constraints.normal) / 2


@pytest.mark.parametrize(
    ("change", "key", "why"),
    [
        (("friction: 0.3", "friction: 0.3, treatment: nodal"), "contact[0].treatment", "lac"),
        (("friction: 0.3", "friction: 0.3, normal: nodal"), "contact[0].normal", "element"),
        (("friction: 0.3", "friction: 0.3, stabilised: true"), "contact[0].stabilised", "false"),
        (("friction: 0.3", "friction: -0.1"), "contact[0].friction", "from 0 to 10"),
        (("friction: 0.3", "friction: 0.1*x"), "contact[0].friction", "from 0 to 10"),
        (
            (", friction: 0.3}", "}\nreference: {kind: analytical, slip: [0, 0]}"),
            "reference.slip", "no contact zone has friction",
        ),
        (
            ("loads:", "reference: {kind: analytical, dissipation: [1, 2]}\nloads:"),
            "reference.dissipation", "each of the 1 steps",
        ),
    ],
)  # fmt: skip
def test_what_friction_does_not_do_is_refused_by_name(change, key, why):
    with pytest.raises(InputError) as refused:
        solved(plate(0.3, 0.05, change=lambda text: text.replace(*change)))
    assert key in str(refused.value)
    assert why in str(refused.value)


def test_contact_between_bodies_that_are_held_whole_is_refused():
    with pytest.raises(InputError, match=r"supports: .* have no free unknown of their own"):
        solved(plate(0.3, change=lambda text: text.replace("group: base,", "group: all,")))
