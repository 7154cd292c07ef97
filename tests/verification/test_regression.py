"""Accepted values: apart from references, changed on purpose only, and shown when they change."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.system.errors import InputError
from solver.verification.checks import accept, accepted_values, regression_file, run_checks
from tests.handmade import PLANE, plane, solid


@pytest.fixture
def solution(tmp_path):
    return plane(tmp_path)


def checked(solution):
    return run_checks(solution, accepted_values(solution))


def test_no_accepted_value_is_none_and_no_success(solution):
    assert accepted_values(solution) == {}
    assert all(check.regression is None for check in checked(solution))


def test_the_file_lies_beside_the_case_by_the_name_of_the_solve(tmp_path):
    folder = tmp_path / "regression"
    assert regression_file(plane(tmp_path)) == folder / "two-blocks.json"
    name = "hexahedron-on-wedges-swapped-hexahedra.json"
    assert regression_file(solid(tmp_path)) == folder / name


def test_accepting_writes_one_line_a_check(solution):
    lines = accept(solution, checked(solution))
    assert "multiplier interface: none → 25" in lines
    text = regression_file(solution).read_text()
    assert '  "displacement": {"minimum": -1.1375, "maximum": 0.24375},\n' in text
    assert '  "balance": {"minimum": 0.0, "maximum": 0.0},\n' in text
    assert text.count("\n") == len(lines) + 2
    assert list(json.loads(text)) == sorted(json.loads(text))


def test_accepted_values_hold_from_then_on(solution):
    accept(solution, checked(solution))
    checks = checked(solution)
    assert all(check.regression.passed and check.passed for check in checks)


def test_nothing_is_written_when_nothing_changed(solution):
    accept(solution, checked(solution))
    path = regression_file(solution)
    before = path.stat().st_mtime_ns, path.stat().st_ino
    solution.zones[0].multiplier[0] *= 1 + 5e-10
    solution.zones[0].gap[0] = 1e-12
    assert accept(solution, checked(solution)) == []
    assert (path.stat().st_mtime_ns, path.stat().st_ino) == before


def test_a_change_fails_until_it_is_accepted_and_changes_one_line(solution):
    accept(solution, checked(solution))
    path = regression_file(solution)
    before = path.read_text().splitlines()
    solution.fields.normal_stress[0] = -25.0001
    check = next(check for check in checked(solution) if check.name == "nodal_stress")
    assert not check.passed
    assert check.regression.change == pytest.approx(4e-6)
    assert accept(solution, [*checked(solution)]) == ["nodal_stress: -25 → -25.0001 … -25"]
    after = path.read_text().splitlines()
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
    assert all(check.passed for check in checked(solution))


def test_a_check_that_no_longer_runs_is_dropped(tmp_path):
    solution = plane(tmp_path)
    accept(solution, checked(solution))
    without = plane(tmp_path, PLANE.replace("  gap: 0.0\n", ""))
    assert accept(without, checked(without)) == [
        "element_gap interface: 0 → none",
        "observation_gap interface: 0 → none",
    ]
    assert "element_gap interface" not in accepted_values(without)


def test_what_is_not_a_number_is_not_accepted(solution):
    solution.stress[0, 0] = float("nan")
    with pytest.raises(InputError, match=r"two-blocks\.json: stress_components.*not a number"):
        accept(solution, checked(solution))
    assert not regression_file(solution).exists()


@pytest.mark.parametrize(
    "text",
    [
        "not JSON",
        "[]",
        '{"multiplier interface": 25.0}',
        '{"multiplier interface": {"minimum": 25.0}}',
        '{"multiplier interface": {"minimum": 25.0, "maximum": null}}',
        '{"multiplier interface": {"minimum": 25.0, "maximum": NaN}}',
        '{"multiplier interface": {"minimum": 25.0, "maximum": true}}',
    ],
)
def test_a_spoilt_file_is_refused_by_name(solution, text):
    path = regression_file(solution)
    path.parent.mkdir()
    path.write_text(text)
    with pytest.raises(InputError, match=r"two-blocks\.json"):
        accepted_values(solution)


@given(pressure=st.floats(1e-3, 1e6), noise=st.floats(-1e-13, 1e-13))
def test_round_off_never_shows(tmp_path_factory, pressure, noise):
    folder = tmp_path_factory.mktemp("case")
    solution = plane(
        folder, PLANE.replace("contact_pressure: 25.0", f"contact_pressure: {pressure!r}")
    )
    solution.zones[0].multiplier[:] = pressure
    accept(solution, checked(solution))
    solution.zones[0].multiplier[0] *= 1 + noise
    solution.zones[0].gap[1] = noise * 50
    assert accept(solution, checked(solution)) == []
