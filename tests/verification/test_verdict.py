"""The verdict: strict JSON with the same keys whatever happened."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from solver.case.model import SolvedAs
from solver.system.errors import InputError
from solver.verification.checks import run_checks
from solver.verification.flat import flat, to_json
from solver.verification.judge import judge, without_result
from solver.verification.results import write_result
from solver.verification.stored import read_verdict, unbound, write_verdict
from solver.verification.verdict import Problem, Verdict
from tests.handmade import PLANE, plane, solid

CONTRACT = {
    *("case", "family", "swapped", "verdict", "passed", "reason", "dofs", "macro_elements"),
    *("iterations", "seconds", "peak_memory_mb", "checks"),
}
CHECK = {
    *("name", "zone", "norm", "minimum", "maximum", "value", "reference", "error", "tolerance"),
    *("regression", "passed"),
}


def refuse(constant):
    raise AssertionError(f"{constant} is no JSON")


def strict(text):
    return json.loads(text, parse_constant=refuse)


def flaw(path):
    """Why the file cannot be relied on; empty where it can."""
    try:
        return unbound(read_verdict(path), path)
    except InputError as error:
        return error.detail


def verdict_of(solution, **more):
    return judge(solution, run_checks(solution), **more).plain()


def test_a_solve_whose_checks_hold_has_passed(tmp_path):
    verdict = strict(to_json(verdict_of(plane(tmp_path), result="result.vtkhdf")))
    assert (verdict["verdict"], verdict["passed"], verdict["reason"]) == ("passed", True, "")
    assert verdict.keys() >= CONTRACT
    assert all(check.keys() >= CHECK for check in verdict["checks"])
    assert verdict["seconds"] == {"mesh": 0.25, "solve": 0.5, "total": 0.75}
    assert verdict["result"] == "result.vtkhdf"
    assert verdict["pressure"] == [25.0, 25.0]
    assert verdict["stress"] == [-25.0, -25.0]
    assert verdict["status"] == [1, 1]
    assert verdict["bodies"][1] == {
        "name": "top",
        "role": "master",
        "cells": {"QUAD4": 3},
        "faces": 3,
        "reference_cells": 3,
        "reference_faces": 3,
    }
    assert verdict["plan"][0] == ["refinement", "none: by hand", "refinement"]


def test_no_two_records_of_a_verdict_share_a_key(tmp_path):
    """In the flat mapping of the file one would hide the other."""

    def count(record):
        inner = [getattr(record, f.name) for f in fields(record) if "joined" in f.metadata]
        return len(fields(record)) - len(inner) + sum(map(count, inner))

    verdict = judge(plane(tmp_path), [])
    assert len(flat(verdict)) == count(verdict)


def test_one_failing_check_fails_the_solve_and_is_the_reason(tmp_path):
    solution = plane(tmp_path)
    solution.zones[0].closed[1] = False
    solution.zones[0].gap[1] = 1.0
    verdict = verdict_of(solution)
    assert (verdict["verdict"], verdict["passed"]) == ("failed", False)
    assert verdict["reason"].startswith("element_gap interface: 1 (macro-element 1)")
    assert verdict["reason"].endswith("(and 1 more)")
    closest = {"name": "element_status", "zone": "interface", "error": 1.0}
    assert verdict["closest_to_tolerance"] == closest


def test_a_result_without_digits_is_unreliable_though_its_checks_hold(tmp_path):
    solution = plane(tmp_path)
    solution.quality.accuracy = {"forces": 1e-9, "gap": 2e-4}
    verdict = verdict_of(solution)
    assert (verdict["verdict"], verdict["passed"]) == ("unreliable", False)
    assert verdict["reason"].startswith("rounding alone may change")
    assert "the gap is lost" in verdict["reason"]
    assert verdict["attainable"] == 2e-4
    solution.quality.accuracy = {"forces": 1e-9, "gap": 9e-5}
    assert verdict_of(solution)["verdict"] == "passed"


@pytest.mark.parametrize(
    ("rounding", "name", "word"),
    [(1e-7, "balance", "unreliable"), (1e-9, "balance", "failed"), (1e-7, "multiplier", "failed")],
)
def test_the_solve_by_itself_is_judged_no_finer_than_it_is_rounded(tmp_path, rounding, name, word):
    """A reference is another matter: its tolerance is stated."""
    solution, checks = plane(tmp_path), []
    solution.quality.accuracy = {"forces": rounding}
    for check in run_checks(solution):
        off = {"error": 1e-8, "tolerance": 1e-10, "passed": False} if check.name == name else {}
        checks.append(replace(check, **off))
    found = judge(solution, checks)
    assert found.verdict == word
    assert found.reason.startswith(name)
    assert ("rounding alone may change" in found.reason) == (rounding > 1e-8)


def test_what_is_not_a_number_is_null_and_fails(tmp_path):
    solution = plane(tmp_path)
    solution.zones[0].multiplier[0] = np.nan
    solution.cost.cpu_seconds = float("inf")
    verdict = strict(to_json(verdict_of(solution)))
    assert verdict["verdict"] == "failed"
    assert verdict["pressure"] == [None, None]
    assert verdict["cpu_seconds"] is None
    check = next(c for c in verdict["checks"] if c["name"] == "multiplier")
    assert (check["error"], check["passed"]) == (None, False)


def test_the_other_direction_exchanges_slave_and_master(tmp_path):
    verdict = verdict_of(solid(tmp_path))
    assert verdict["job"] == "hexahedron-on-wedges-swapped-hexahedra"
    assert (verdict["direction"], verdict["variant"]) == ("swapped", "hexahedra")
    assert verdict["zones"] == [{"name": "interface", "slave": "upper", "master": "lower"}]


@pytest.mark.parametrize("word", ["refused", "failed", "crashed"])
def test_a_solve_without_an_end_has_the_same_keys(tmp_path, word):
    solution = plane(tmp_path)
    verdict = without_result(word, "said why", solution.case, SolvedAs(swapped=True)).plain()
    assert verdict.keys() == verdict_of(solution).keys()
    assert (verdict["verdict"], verdict["passed"], verdict["reason"]) == (word, False, "said why")
    assert verdict["job"] == "two-blocks-swapped"
    assert verdict["checks"] == []


def test_a_case_file_that_cannot_be_read_is_known_by_its_path(tmp_path):
    verdict = without_result("refused", "no YAML", tmp_path / "mine.yaml")
    assert (verdict.problem.case, verdict.problem.family) == ("mine", tmp_path.name)


def test_the_file_is_strict_json_and_gives_the_verdict_back(tmp_path):
    solution, path = plane(tmp_path), tmp_path / "results" / "verdict.json"
    solution.cost.cpu_seconds, solution.zones[0].gap[0] = np.float64(2), np.nan
    verdict = judge(solution, run_checks(solution))
    write_verdict(path, verdict)
    told = strict(path.read_text())
    assert (told["cpu_seconds"], told["gap"]) == (2.0, [None, None])
    assert read_verdict(path).plain() == verdict.plain()


def test_a_verdict_that_cannot_be_written_leaves_the_old_one(tmp_path):
    path = tmp_path / "verdict.json"
    problem = Problem(family="f", job="j")
    write_verdict(path, Verdict(problem=problem, verdict="passed"))
    before = path.read_bytes()
    with pytest.raises(TypeError):
        write_verdict(path, Verdict(problem=problem, verdict="passed", reason=object()))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_with_another_recovery_a_solve_is_not_judged(tmp_path):
    solution = plane(tmp_path)
    solution.case = solution.case.as_solved(recovery="linear")
    verdict = judge(solution, run_checks(solution))
    assert (verdict.verdict, verdict.sound) == ("solved", True)
    assert verdict.reason == "not verified: the tolerances belong to another recovery"


def test_without_a_reference_a_solve_is_solved_and_not_verified(tmp_path):
    solution = plane(tmp_path, PLANE[: PLANE.index("reference")])
    verdict = judge(solution, run_checks(solution))
    assert (verdict.verdict, verdict.passed, verdict.sound) == ("solved", False, True)
    assert verdict.summary == (
        "two-blocks: solved: not verified: compared with no reference, "
        "error of the pressure not estimated"
    )
    # the counts of a mesh verify no solution
    counts = "counts: {bottom: {cells: 2}}\n"
    solution = plane(tmp_path, PLANE[: PLANE.index("reference")] + counts)
    assert judge(solution, run_checks(solution)).verdict == "solved"
    solution.quality.balance["reactions: moment"] = 1.0
    assert judge(solution, run_checks(solution)).verdict == "failed"


def test_the_worst_error_and_the_check_closest_to_its_tolerance(tmp_path):
    tolerance = "tolerance: {multiplier: 0.1, element_gap: 1.0e-6}\n"
    solution = plane(tmp_path, PLANE + tolerance)
    solution.zones[0].multiplier[0] = 25.5  # 2 % of 25, a fifth of what is allowed
    solution.zones[0].gap[0] = 4.5e-5  # 0.9e-6 of 50, nine tenths
    verdict = judge(solution, run_checks(solution))
    assert (verdict.worst.name, verdict.worst.error) == ("multiplier", pytest.approx(0.02))
    assert verdict.closest_to_tolerance.name == "element_pressure"  # its tolerance is 0.001
    solution.zones[0].multiplier[0] = 25.0
    verdict = judge(solution, run_checks(solution))
    assert verdict.closest_to_tolerance.name == "element_gap"
    assert "largest checked error" in verdict.summary


@pytest.fixture
def solved(tmp_path):
    """The verdict file of a solve in its folder, its result beside it."""
    solution = plane(tmp_path)
    folder = tmp_path / "results" / solution.case.family / solution.job
    checks = run_checks(solution)
    sha256 = write_result(folder / "result.vtkhdf", solution, checks, {})
    verdict = judge(solution, checks, "result.vtkhdf", {}, sha256)
    write_verdict(folder / "verdict.json", verdict)
    assert flaw(folder / "verdict.json") == ""
    return folder / "verdict.json"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'"passed": true', b'"passed": 1'),
        (b'"verdict": "passed"', b'"verdict": "failed"'),
        (b'"dofs": 44', b'"dofs": 45'),
        (b'"dofs": 44', b'"dofs": "44"'),
        (b'"checks": [', b'"checks": [7, '),
        (b'"family"', b'"famili"'),
        (b"}", b""),
        (b"two-blocks", b"two-bl\xffcks"),
    ],
)
def test_a_verdict_that_was_edited_or_damaged_is_found_out(solved, old, new):
    content = solved.read_bytes()
    assert old in content
    solved.write_bytes(content.replace(old, new, 1))
    assert flaw(solved)


def test_any_damage_to_a_byte_is_found_out_without_a_traceback(solved):
    content = solved.read_bytes()
    rng = np.random.default_rng(0)
    for place in rng.integers(0, len(content), 200):
        byte = bytes([rng.integers(0, 256)])
        damaged = content[:place] + byte + content[place + 1 :]
        if json_of(damaged) != json_of(content):
            solved.write_bytes(damaged)
            assert flaw(solved), place
    for size in (0, 1, 100, len(content) // 2):
        solved.write_bytes(content[:size])
        assert flaw(solved)
    solved.write_bytes(b"[" * 100_000)
    assert flaw(solved)


def json_of(content):
    """The content of a JSON file; None for any other file."""
    try:
        return json.loads(content)
    except ValueError:
        return None


def test_a_verdict_is_bound_to_its_result_and_folder(solved, tmp_path):
    result = solved.with_name("result.vtkhdf")
    whole = result.read_bytes()
    result.unlink()
    assert flaw(solved) == "the result result.vtkhdf is missing or damaged"
    result.write_bytes(whole[:1000] + b"x" + whole[1001:])
    assert flaw(solved) == "the result result.vtkhdf is missing or damaged"
    other = plane(tmp_path)
    other.zones[0].multiplier[0] = 26.0
    write_result(result, other, [], {})
    assert flaw(solved) == "the result result.vtkhdf belongs to another solve"
    result.write_bytes(whole)
    assert flaw(solved) == ""
    swapped = solved.parent.with_name("two-blocks-swapped")
    solved.parent.rename(swapped)
    assert "the verdict belongs to" in flaw(swapped / "verdict.json")


def test_the_verdict_says_where_the_reference_comes_from(tmp_path):
    origin = "kind: other_code\n  code: {name: solver, version: '14'}\n  uncertainty: 0.01"
    text = PLANE.replace("kind: analytical", origin)
    verdict = verdict_of(plane(tmp_path, text))
    assert verdict["reference_kind"] == "other_code"
    assert verdict["reference_code"] == {"name": "solver", "version": "14"}
    assert verdict["reference_uncertainty"] == 0.01


def judged(solution, tolerance, expected=()):
    reference = solution.case.reference
    reference = replace(reference, tolerance=tolerance, expected=dict(expected))
    case = replace(solution.case, reference=reference)
    return judge(replace(solution, case=case), run_checks(replace(solution, case=case)))


def test_a_verdict_says_how_strict_its_tolerances_are(tmp_path):
    solution = plane(tmp_path)
    strict = {"all": 1e-10}
    assert judged(solution, strict).judged == "exact"
    assert judged(solution, strict | {"element_gap": 1e-6}).judged == "stated tolerance"
    assert judged(solution, {"all": 1e-3}).judged == "stated tolerance"
    fitted = judged(solution, strict | {"multiplier": 1.5e-3}, {"multiplier": 1e-3})
    assert fitted.judged == "expected error"
    by_name = {check.name: check for check in fitted.checks}
    assert (by_name["multiplier"].expected, by_name["displacement"].expected) == (1e-3, None)
    solution.zones[0].multiplier[0] += 25 * 1.6e-3
    failed = judged(solution, strict | {"multiplier": 1.5e-3}, {"multiplier": 1e-3})
    assert (failed.verdict, failed.judged) == ("failed", "")


def test_the_line_of_a_verdict_has_the_expected_error(tmp_path):
    solution = plane(tmp_path)
    solution.zones[0].multiplier[0] += 25 * 1.2e-3
    solution.zones[0].estimates.pressure_of_forces = np.array([25.0, 25.0])
    fitted = judged(solution, {"all": 1e-2, "multiplier": 1.5e-3}, {"multiplier": 1e-3})
    assert fitted.summary.startswith(
        "two-blocks: passed, largest checked error 1.2e-03 (multiplier), expected 1.0e-03, "
    )
    solution.zones[0].multiplier[0] = 25.0
    assert ", exact, " in judged(solution, {"all": 1e-10}).summary
