"""Friction: the search for stick and slip, its fallback, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest

from solver import solve_case
from solver.case.reader import load_case, parse_case
from solver.lac import recovery as sweeps
from solver.lac.errors import SolveError
from solver.mechanics.mortar import coulomb
from solver.mechanics.mortar.coulomb import CoulombContact
from solver.simulation.equilibrium import contact_stiffness
from solver.simulation.equilibrium import recovery as batch
from solver.simulation.equilibrium.problem import ContactProblem
from solver.simulation.options import Options
from solver.simulation.scene.scene import build_scene
from solver.simulation.simulate import simulate
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.norms import errors
from solver.verification.run import mesh_of, refined

HERE, CASES = Path(__file__).parent, Path(__file__).parents[2] / "cases"
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


@pytest.mark.parametrize("poisson", [0.3, 0.499])
def test_the_smallest_coefficient_keeps_coulombs_law(poisson):
    """Tractions of 1e-5 of the pressure are known to the rounding of the pressure."""
    case = plate(1e-5, 0.05, n=40, change=lambda text: text.replace("0.3}", f"{poisson}}}"))
    assert law(solved(case)) < 1e-9


@pytest.mark.parametrize(
    ("mu", "push"), [(0.3, 0.05), (1.0, 0.1), (1.0, 0.2), (2.0, 0.3), (5.0, 0.5)]
)
def test_every_plate_ends_in_a_state_that_keeps_coulombs_law(mu, push):
    solution = solved(plate(mu, push))
    assert law(solution) < 1e-9
    assert max(solution.quality.balance.values()) < 1e-11
    assert solution.steps[0].dissipation > 0
    found = solution.zones[0].friction
    assert {1, 2} <= set(found.status.tolist())
    # Nothing is gained by the sign: the plate is pushed to +x, and friction on it acts to −x.
    assert (found.friction_traction[:, 0] <= 1e-12).all()


def test_products_in_place_of_a_matrix_find_the_same_state(monkeypatch):
    """On faces of unequal size: a product takes gaps and gives forces, row by row."""
    uneven = "plane: strain\ntransform: {perturb: 0.2}"
    case = plate(0.5, 0.05, change=lambda text: text.replace("plane: strain", uneven))
    dense = solved(case)
    assert dense.cost.iterations <= 4
    monkeypatch.setattr(contact_stiffness, "_MOST_ROWS", 0)
    product = solved(case)
    np.testing.assert_allclose(product.displacement, dense.displacement, atol=1e-12)
    for name in ("friction_traction", "slip", "status"):
        one, other = (getattr(each.zones[0].friction, name) for each in (product, dense))
        np.testing.assert_allclose(one, other, atol=1e-11 * np.abs(other).max())


def test_what_is_at_its_bound_and_does_not_move_sticks():
    """Of three pressed by 2 and held by 1, μ = 1/2, the last one slips."""
    rows, one = np.array([[3, 4, 5]]), np.ones(6)
    contact = CoulombContact(np.eye(6), one, one[:3] / 2, np.arange(3), rows)
    forces, jump = np.array([2.0, 2, 2, 1, 1, 1]), np.array([0, 0, 0, 0, -1e-14, -1e-6])
    closed, slips = contact.statuses(forces, jump)
    assert closed.all()
    assert slips.tolist() == [False, False, True]


def test_newton_finds_no_state_where_nothing_balances_the_force():
    """Pressed by 2 and pulled by 5, μ = 0.1, and no stiffness along the face."""
    contact = CoulombContact(
        np.diag([1.0, 0.0]), np.array([1.0, 0.1]), np.array([0.1]), np.array([0]), np.array([[1]])
    )
    assert contact.solve(np.array([2.0, 5.0])) is None


def test_newton_goes_on_from_forces_that_act():
    """Gaps so wide that closing them takes 1e12 of what acts: the law is lost in their rounding."""
    stiffness = np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    contact = CoulombContact(
        stiffness, np.diag(stiffness), np.array([0.5]), np.array([0]), np.array([[2]])
    )
    # Pressed by 3 on the first gap, pulled by 2 along it; the second one is 1e12 wide.
    wide = np.array([0.0, 1e12, 0.0])
    start = np.array([3.0, 0.0, 2.0]) - stiffness @ wide
    _, jump, _ = contact.solve(start)
    exact = np.array([3.0, 0.0, 1.5]), wide - [0.0, 0.0, 0.5]
    assert contact.opens_wide(exact[0], exact[1])
    assert contact.kept(contact.statuses(*exact)[0]).tolist() == [True, False, True]
    acting = np.array([3.0, 0.0, 2.0]) + stiffness @ (jump - wide)
    again = contact.again(acting, jump)
    np.testing.assert_allclose(again, exact[1], atol=1e-3)  # of 1e12, known to 1e-4
    following, fault = contact.corrected(exact[0], exact[1], np.abs(start).max())
    assert fault < 1e-15
    np.testing.assert_allclose(following, exact[1])


def test_a_way_that_only_the_shortest_parts_follow_has_an_end():
    """A thousand parts of 1/1000 would lead there; each is a search of its own."""
    tried = []

    def found_at(gone, z):
        tried.append(gone)
        return (None, np.full_like(z, gone), 1) if gone - z[0] < 2e-3 else None

    assert coulomb._by_way(np.zeros(1), 1.0, 0.1, found_at) is None
    assert len(tried) == 50


def test_newton_keeps_the_law_in_space():
    """Random coupled contacts: 6 gaps, 2 tangents with different stiffness along each."""
    rng = np.random.default_rng(3)
    for mu in (0.1, 0.5, 1.0):
        half = rng.standard_normal((18, 18))
        stiffness = half @ half.T + np.diag(np.repeat([20.0, 30.0, 60.0], 6))
        contact = CoulombContact(
            stiffness,
            np.diag(stiffness),
            np.full(6, mu),
            np.arange(6),
            6 + np.arange(12).reshape(2, 6),
        )
        start = np.concatenate([rng.uniform(-1, 2, 6), rng.standard_normal(12)])
        forces, jump, _ = contact.solve(start)
        np.testing.assert_allclose(forces, start + stiffness @ jump, atol=1e-12)
        pressure, gap = forces[:6], jump[:6]
        assert (pressure > -1e-12).all()
        assert (gap > -1e-12).all()
        assert np.abs(pressure * gap).max() < 1e-12
        traction, slip = (v[6:].reshape(2, 6) for v in (forces, jump))
        size, far = np.linalg.norm(traction, axis=0), np.linalg.norm(slip, axis=0)
        assert (size <= mu * pressure + 1e-12).all()
        assert np.abs(far * (mu * pressure - size)).max() < 1e-11
        np.testing.assert_allclose((traction * slip).sum(axis=0), -size * far, atol=1e-11)


# Two blocks in a uniform state by the return map, exchanged where asked for: pressure, traction on
# the lower body and slip of the last step. A coefficient of 4 and of 2, a slave 1e6 times stiffer.
UNIFORM = [
    ("large-mu-4", True, 0.0191748265792492, [0.069096875096294], 0.0),
    ("large-mu-2", False, 0.00663147559827853, [0.013262951196557], 0.000712689844492),
]


@pytest.mark.parametrize(("name", "swapped", "pressure", "traction", "slip"), UNIFORM)
def test_uniform_states_of_extreme_coefficients(name, swapped, pressure, traction, slip):
    found = solve_case(HERE / "uniform" / f"{name}.yaml", swapped=swapped)
    assert found.verdict == "solved"
    assert found.pressure == pytest.approx(pressure, rel=1e-11)
    zone = found.solution.zones[0].friction
    size = np.linalg.norm(zone.friction_traction, axis=1)
    assert size == pytest.approx(np.linalg.norm(traction), rel=1e-8)
    assert np.linalg.norm(zone.slip, axis=1) == pytest.approx(slip, rel=1e-5, abs=1e-13)
    assert any("other states may exist" in line.what for line in found.solution.plan)


def test_a_coefficient_of_the_size_of_rounding_is_refused():
    with pytest.raises(InputError, match="friction = 1e-06: must be 0, or at least 1e-05"):
        solved(plate("1.0e-06", 0.05))


def test_a_stiff_slave_is_unreliable_by_rounding_and_no_failure():
    found = solve_case(HERE / "uniform" / "stiff-slave.yaml", swapped=True)
    assert found.verdict == "unreliable"
    assert found.reason.startswith("friction_law i: ")
    assert "; rounding alone may change the result by" in found.reason
    assert found.pressure.mean() == pytest.approx(0.011686579637947, rel=1e-6)


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
    assert max(recovered.quality.balance.values()) < 1e-11
    status = recovered.zones[0].friction.status
    np.testing.assert_array_equal(status, constant.zones[0].friction.status)
    assert {0, 1, 2} == set(status.tolist())
    for norm in ("traction_means", "traction_l2"):
        assert errors(recovered)[norm] < 0.6 * errors(constant)[norm]


def test_sweeps_that_do_not_settle_leave_the_constants(monkeypatch):
    for module in (sweeps, batch):  # so many are too few
        monkeypatch.setattr(module, "MOST_SWEEPS", 2)
    case = load_case(CASES / "friction" / "ladders" / "cylinder-tria6.yaml")
    found = solved(case.as_solved(recovery="automatic"))
    assert found.zones[0].recovered is None
    assert 0 < found.pressure_error_estimate < 0.2
    assert any(line.what.endswith("pressure not recovered") for line in found.plan)
    assert law(found) < 1e-9


def test_friction_across_a_meshed_gap_is_a_couple_and_no_imbalance():
    """A rigid cylinder: its tractions act on its own face, a gap above the half-plane."""
    case = load_case(CASES / "friction" / "rigid-cylinder-tria6.yaml")
    solution = solved(case)
    assert max(solution.quality.balance.values()) < 1e-12
    zone, exact = solution.zones[0], case.reference.exact
    force = zone.multiplier * zone.area
    place = (force @ zone.centre[:, 0]) / force.sum()
    # The resultant is at −(2/3) ε a from the middle, which is −2 ε a from the apex (Johnson §8.2).
    expected = -(2 + 2 / 3) * exact.skew * exact.half_width
    assert place == pytest.approx(expected, rel=0.02)
    recovered = solved(case.as_solved(recovery="automatic"))
    assert max(recovered.quality.balance.values()) < 1e-12
    norms = [errors(each)["traction_l2"] for each in (solution, recovered)]
    assert norms[1] < norms[0]


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


def test_an_exact_work_needs_the_steps_that_it_is_of():
    case = CASES / "friction" / "sphere-hexa27.yaml"
    with pytest.raises(InputError, match=r"each of the 2 steps; the solution has 1") as refused:
        parse_case(case.read_text() + "\nsteps: [0.5, 1]\n", case)
    assert refused.value.key == "reference.dissipation"


def test_contact_between_bodies_that_are_held_whole_is_refused():
    with pytest.raises(InputError, match=r"supports: .* have no free unknown of their own"):
        solved(plate(0.3, change=lambda text: text.replace("group: base,", "group: all,")))
