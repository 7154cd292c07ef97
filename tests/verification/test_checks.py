"""Every check holds on the exact state and fails when its own quantity is wrong."""

from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import solver.lac.threads
import solver.verification.in_cells
from solver.case.checks import CHECKS, ERRORS
from solver.verification.checks import SCALES, Accepted, block_size, run_checks, sampler_of
from tests.handmade import PLANE, plane


@pytest.fixture
def solution(tmp_path):
    return plane(tmp_path)


def by_name(solution, accepted=None):
    return {check.name: check for check in run_checks(solution, accepted)}


def failing(solution):
    return {check.name for check in run_checks(solution) if not check.passed}


def test_every_row_names_functions_that_are_there():
    assert len({check.name for check in CHECKS}) == len(CHECKS)
    for check in CHECKS:
        assert callable(sampler_of(check)), check.name
        assert check.scale in SCALES, check.name


def test_only_numbers_without_a_unit_are_compared_with_one(solution):
    """Where the reference is zero; the blocks are 50 wide, pressed by 25, E = 2000."""
    plain = {check.name for check in CHECKS if check.scale == "unit"} - set(ERRORS)
    assert plain == {"element_status", "coverage", "balance", "friction_law", "counts"}
    assert SCALES["area"](solution) == 50.0
    assert SCALES["work"](solution) == pytest.approx(25.0**2 / 2000.0 * 50.0**2)


def test_the_exact_state_passes_every_check_of_the_table(solution):
    checks = run_checks(solution)
    given = {None, *solution.case.reference.values}
    named = [c.name for c in CHECKS if c.name not in ERRORS and c.key in given]
    # Of zones with friction, and of bodies that move far.
    named = [name for name in named if name not in ("friction_law", "position_pressure")]
    assert [check.name for check in checks] == named
    assert len(named) > 15
    assert all(check.passed for check in checks)
    assert max(check.error for check in checks) < 1e-14


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("node", [0, 7, 20])
@pytest.mark.parametrize("value", [-0.3, 0.3, float("nan")])
def test_stress_of_cells_in_parts_is_judged_as_in_one(solution, monkeypatch, value, node, threads):
    """The same extremes and the same worst place, wherever the parts of the cells begin."""
    solution.displacement[node] += value
    whole = by_name(solution)["integration_stress"]
    assert not whole.passed
    monkeypatch.setattr(solver.lac.threads, "workers", lambda: threads)
    monkeypatch.setattr(solver.verification.in_cells, "_CHUNK", 1)
    parts = by_name(solution)["integration_stress"]
    assert parts.where == whole.where
    for name in ("minimum", "maximum", "value", "reference", "scale", "error"):
        ours, theirs = getattr(parts, name), getattr(whole, name)
        assert ours == pytest.approx(theirs, rel=1e-13, nan_ok=True)


def test_the_contracts_names_and_default_tolerances(solution):
    table = {name: (c.alias, c.tolerance) for name, c in by_name(solution).items()}
    assert table["multiplier"] == ("LAGS_C", 1e-3)
    assert table["nodal_stress"] == ("SIEF_NOEU", 1e-3)
    assert table["element_pressure"] == ("CONT_ELEM/PRES", 1e-3)
    assert table["element_gap"] == ("CONT_ELEM/JEU", 2e-5)
    assert table["element_status"] == ("CONT_ELEM/CONT", 0.0)
    assert table["coverage"] == ("CONT_ELEM/COEFSURF", 1e-6)
    assert table["covered_pressure"][0] == "CONT_ELEM/PRESCOOR"
    assert table["balance"] == (None, 1e-10)


def zone_array(name, index, value):
    def spoil(solution):
        zone = solution.zones[0]
        getattr(zone if hasattr(zone, name) else zone.surfaces, name)[index] = value

    return spoil


def field(name, index, value):
    def spoil(solution):
        getattr(solution, name)[index] = value

    return spoil


def normal(index, value):
    def spoil(solution):
        solution.fields.normal_stress[index] = value

    return spoil


def balance(name, value):
    def spoil(solution):
        solution.quality.balance[name] = value

    return spoil


def observed(step, quantity, value):
    def spoil(solution):
        solution.steps[step].observations[0][quantity] = value

    return spoil


PRESSURES = {"multiplier", "element_pressure", "covered_pressure"}
NAN = float("nan")


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (zone_array("multiplier", slice(None), -25.0), PRESSURES),
        (zone_array("multiplier", 1, 25.1), PRESSURES),
        (zone_array("multiplier", 1, NAN), PRESSURES),
        (zone_array("multiplier", 0, np.inf), PRESSURES),
        (zone_array("gap", 1, 0.00101), {"element_gap"}),
        (zone_array("gap", 0, -0.00101), {"element_gap"}),
        (zone_array("gap", 0, NAN), {"element_gap"}),
        (zone_array("closed", 1, False), {"element_status"}),
        (zone_array("coverage", 1, 0.99), {"coverage", "covered_pressure"}),
        (zone_array("coverage", 1, 1 - 2e-6), {"coverage"}),
        (zone_array("coverage", 1, NAN), {"coverage", "covered_pressure"}),
        (zone_array("stress_slave", 3, 25.0), {"surface_stress_slave"}),
        (zone_array("stress_slave", 3, NAN), {"surface_stress_slave"}),
        (zone_array("stress_master", 0, -25.03), {"surface_stress_master"}),
        (normal(20, -24.9), {"nodal_stress"}),
        (normal(0, NAN), {"nodal_stress"}),
        (field("displacement", (5, 0), 0.1), {"displacement", "integration_stress"}),
        (field("displacement", (21, 1), 1.1375), {"displacement", "integration_stress"}),
        (field("displacement", (3, 1), NAN), {"displacement", "integration_stress"}),
        (field("stress", (4, 0), 0.03), {"stress_components"}),
        (field("stress", (4, 2), 7.5), {"stress_components"}),
        (field("stress", (4, 3), NAN), {"stress_components"}),
        (balance("reactions and loads: moment", -2e-10), {"balance"}),
        (balance("reactions and loads: moment", NAN), {"balance"}),
        (observed(0, "pressure", 25.0), {"observation"}),
        (observed(1, "pressure", NAN), {"observation"}),
        (observed(1, "gap", 0.0011), {"observation_gap"}),
    ],
)
def test_one_wrong_quantity_fails_its_checks_and_no_other(solution, spoil, expected):
    spoil(solution)
    assert failing(solution) == expected


def test_the_pressure_by_forces_is_a_value_of_its_own(solution):
    zone = solution.zones[0]
    zone.estimates.pressure_of_forces = np.array([25.0, 25.1])
    assert failing(solution) == {"element_pressure"}
    zone.multiplier, zone.estimates.pressure_of_forces = np.array([25.0, 25.1]), zone.multiplier
    assert failing(solution) == PRESSURES - {"element_pressure"}


def test_stress_at_integration_points_is_independent_of_that_at_nodes(solution):
    solution.stress[:] += 1.0
    assert "integration_stress" not in failing(solution)
    solution.stress[:] -= 1.0
    solution.displacement[0, 0] += 0.001
    check = by_name(solution)["integration_stress"]
    # On a QUAD4 of 25/3 × 50 the strain at the Gauss point nearest to the corner changes by
    # -g · 0.001 / (25/3) along x, with g = (1 + 1/√3)/2; λ + 2μ = 35000/13.
    g = (1 + 1 / np.sqrt(3)) / 2
    assert check.value == pytest.approx(-g * 0.001 / (25 / 3) * 35000 / 13, rel=1e-9)
    assert (check.passed, check.where) == (False, "cell 0 (xx)")


def test_the_worst_integration_point_counts_where_the_reference_varies(tmp_path):
    """Far to the right, where stress and reference have neither of their extremes."""
    text = PLANE.replace("yy: -25.0, zz", "yy: -25.0 + 0.1*x, zz")
    check = by_name(plane(tmp_path, text))["integration_stress"]
    farthest = 50 - 25 / 3 * (1 - 1 / np.sqrt(3)) / 2
    assert check.value - check.reference == pytest.approx(-0.1 * farthest, rel=1e-9)


def test_the_deviations_within_the_tolerances_pass(solution):
    solution.zones[0].multiplier[:] = [25.024, 24.976]
    solution.zones[0].gap[:] = [0.00099, -0.00099]
    solution.zones[0].coverage[:] = 1 - 9e-7
    assert failing(solution) == set()


def test_a_failure_says_where_and_by_how_much(solution):
    solution.zones[0].multiplier[1] = 26.0
    check = by_name(solution)["multiplier"]
    assert (check.minimum, check.maximum, check.value, check.reference) == (25.0, 26.0, 26.0, 25.0)
    assert check.error == pytest.approx(0.04)
    assert check.where == "macro-element 1"
    assert check.reason == (
        "multiplier interface: 26 (macro-element 1), reference 25: "
        "error 4.00e-02, tolerance 1.0e-03"
    )


def test_nothing_to_check_is_no_success(solution):
    solution.quality.balance = {}
    solution.zones[0].surfaces.stress_slave = np.empty(0)
    solution.zones[0].surfaces.slave_nodes = np.empty(0, int)
    assert failing(solution) == {"balance", "surface_stress_slave"}


def test_a_check_without_a_reference_is_not_listed(tmp_path):
    text = "\n".join(
        line
        for line in PLANE.splitlines()
        if not line.strip().startswith(("normal_stress", "gap", "stress", "displacement"))
    )
    names = {check.name for check in run_checks(plane(tmp_path, text))}
    others = {"element_status", "coverage", "balance", "counts", "observation"}
    assert names == PRESSURES | others


def test_balance_runs_without_any_reference(tmp_path):
    checks = run_checks(plane(tmp_path, PLANE[: PLANE.index("reference")]))
    assert [check.name for check in checks] == ["balance"]


def test_references_may_be_expressions(tmp_path):
    solution = plane(tmp_path, PLANE.replace("contact_pressure: 25.0", "contact_pressure: 20 + x"))
    assert failing(solution) >= PRESSURES
    solution.zones[0].multiplier[:] = [32.5, 57.5]
    for step in solution.steps:
        step.observations[0]["pressure"] = 32.5 * step.factor
    assert failing(solution) == set()


def test_open_contact_is_expected_where_the_reference_pressure_is_zero(tmp_path):
    text = PLANE.replace("contact_pressure: 25.0", "contact_pressure: 0.0")
    solution = plane(tmp_path, text)
    assert "element_status" in failing(solution)
    solution.zones[0].closed[:] = False
    solution.zones[0].multiplier[:] = 0.0
    for step in solution.steps:
        step.observations[0]["pressure"] = 0.0
    assert failing(solution) == set()


def test_a_zero_reference_is_measured_against_the_load(tmp_path):
    solution = plane(tmp_path, PLANE.replace("contact_pressure: 25.0", "contact_pressure: 0.0"))
    solution.zones[0].multiplier[:] = 0.025 * 2
    assert by_name(solution)["multiplier"].error == pytest.approx(2e-3)


def test_one_tolerance_for_the_relative_checks_only(tmp_path):
    tolerance = {
        n: c.tolerance for n, c in by_name(plane(tmp_path, PLANE + "tolerance: 0.5\n")).items()
    }
    assert tolerance["multiplier"] == tolerance["covered_pressure"] == 0.5
    assert tolerance["coverage"] == 1e-6
    assert tolerance["element_status"] == 0.0
    assert tolerance["balance"] == 1e-10
    assert tolerance["element_gap"] == 2e-5


def test_a_small_tolerance_for_all_holds_for_gap_and_coverage_too(tmp_path):
    checks = by_name(plane(tmp_path, PLANE + "tolerance: {all: 1.0e-10, coverage: 1.0e-8}\n"))
    wanted = {"multiplier": 1e-10, "element_gap": 1e-10, "coverage": 1e-8, "element_status": 0.0}
    assert {name: checks[name].tolerance for name in wanted} == wanted


def test_a_tolerance_for_one_check(tmp_path):
    solution = plane(tmp_path, PLANE + "tolerance: {multiplier: 1.0e-9}\n")
    solution.zones[0].multiplier[0] = 25 + 1e-7
    assert failing(solution) == {"multiplier"}


def test_the_block_size_is_that_of_a_block_and_not_of_the_stack(solution):
    assert block_size(solution) == 50.0


def test_checks_run_zone_by_zone(solution):
    second = deepcopy(solution.zones[0])
    second.name, second.gap[0] = "other", 1.0
    solution.zones.append(second)
    gaps = {c.zone: c.passed for c in run_checks(solution) if c.name == "element_gap"}
    assert gaps == {"interface": True, "other": False}
    assert [c.zone for c in run_checks(solution) if c.name == "balance"] == [None]


def test_an_accepted_value_is_kept_apart_from_the_reference(solution):
    accepted = {"multiplier interface": Accepted(25.0, 25.0), "coverage interface": Accepted(1, 1)}
    solution.zones[0].multiplier[0] = 25 + 1e-6
    check = by_name(solution, accepted)["multiplier"]
    assert check.error <= check.tolerance
    assert not check.regression.passed
    assert not check.passed
    assert "accepted 25:" in check.reason
    assert by_name(solution, accepted)["coverage"].passed
    assert by_name(solution, accepted)["element_gap"].regression is None


def test_the_covered_pressure_may_move_by_a_millionth_of_its_accepted_value(solution):
    accepted = {"covered_pressure interface": Accepted(25.0, 25.0)}
    solution.zones[0].multiplier[:] = 25 * (1 + 9e-7)
    assert by_name(solution, accepted)["covered_pressure"].passed
    solution.zones[0].multiplier[:] = 25 * (1 + 1.1e-6)
    assert not by_name(solution, accepted)["covered_pressure"].passed


@given(index=st.integers(0, 1), change=st.floats(-1e3, 1e3), scale=st.floats(1e-9, 1e9))
def test_errors_do_not_depend_on_the_units_of_stress(tmp_path_factory, index, change, scale):
    folder = tmp_path_factory.getbasetemp()
    plain = plane(folder)
    scaled = plane(
        folder, PLANE.replace("contact_pressure: 25.0", f"contact_pressure: {25 * scale!r}")
    )
    plain.zones[0].multiplier[index] += change
    scaled.zones[0].multiplier[:] = plain.zones[0].multiplier * scale
    errors = [by_name(s)["multiplier"].error for s in (plain, scaled)]
    assert errors[1] == pytest.approx(errors[0], rel=1e-9, abs=1e-14)


def test_a_reference_that_is_zero_but_for_rounding_is_measured_against_the_load(tmp_path):
    """25 sin π is 3e-15; so is what a solve may find."""
    text = PLANE.replace("contact_pressure: 25.0", "contact_pressure: 25*sin(pi)")
    solution = plane(tmp_path, text)
    solution.zones[0].multiplier[:] = -3e-15
    solution.zones[0].closed[:] = False
    for step in solution.steps:
        step.observations[0]["pressure"] = 0.0
    assert failing(solution) == set()
