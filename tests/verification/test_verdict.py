"""The verdict: strict JSON with the same keys whatever happened."""

import json

import numpy as np
import pytest

from solver.verification.checks import run_checks
from solver.verification.verdict import of_solution, to_json, without_result, write_verdict
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


def verdict_of(solution, **more):
    return of_solution(solution, run_checks(solution), **more)


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


def test_one_failing_check_fails_the_solve_and_is_the_reason(tmp_path):
    solution = plane(tmp_path)
    solution.zones[0].closed[1] = False
    solution.zones[0].gap[1] = 1.0
    verdict = verdict_of(solution)
    assert (verdict["verdict"], verdict["passed"]) == ("failed", False)
    assert verdict["reason"].startswith("element_gap interface: 1 at macro-element 1")
    assert verdict["reason"].endswith("(and 1 more)")
    assert verdict["worst"] == {"name": "element_status", "zone": "interface", "error": 1.0}


def test_a_result_without_digits_is_unreliable_though_its_checks_hold(tmp_path):
    solution = plane(tmp_path)
    solution.accuracy = {"forces": 1e-9, "gap": 2e-4}
    verdict = verdict_of(solution)
    assert (verdict["verdict"], verdict["passed"]) == ("unreliable", False)
    assert verdict["reason"].startswith("rounding alone may change")
    assert "the gap is lost" in verdict["reason"]
    assert verdict["attainable"] == 2e-4
    solution.accuracy = {"forces": 1e-9, "gap": 9e-5}
    assert verdict_of(solution)["verdict"] == "passed"


def test_what_is_not_a_number_is_null_and_fails(tmp_path):
    solution = plane(tmp_path)
    solution.zones[0].multiplier[0] = np.nan
    solution.cpu_seconds = float("inf")
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
    verdict = without_result(word, "said why", solution.case, swapped=True)
    assert verdict.keys() == verdict_of(solution).keys()
    assert (verdict["verdict"], verdict["passed"], verdict["reason"]) == (word, False, "said why")
    assert verdict["job"] == "two-blocks-swapped"
    assert verdict["checks"] == []


def test_a_case_file_that_cannot_be_read_is_known_by_its_path(tmp_path):
    verdict = without_result("refused", "no YAML", tmp_path / "mine.yaml")
    assert (verdict["case"], verdict["family"]) == ("mine", tmp_path.name)


def test_the_file_is_strict_json(tmp_path):
    path = tmp_path / "results" / "verdict.json"
    write_verdict(path, {"number": np.float64(2), "count": np.int64(3), "no": [np.nan, -np.inf]})
    assert strict(path.read_text()) == {"number": 2.0, "count": 3, "no": [None, None]}


def test_a_verdict_that_cannot_be_written_leaves_the_old_one(tmp_path):
    path = tmp_path / "verdict.json"
    write_verdict(path, {"verdict": "passed"})
    with pytest.raises(TypeError):
        write_verdict(path, {"verdict": object()})
    assert strict(path.read_text()) == {"verdict": "passed"}
    assert list(tmp_path.iterdir()) == [path]


def test_the_verdict_says_where_the_reference_comes_from(tmp_path):
    origin = "kind: other_code\n  code: {name: solver, version: '14'}\n  uncertainty: 0.01"
    text = PLANE.replace("kind: analytical", origin)
    verdict = verdict_of(plane(tmp_path, text))
    assert verdict["reference_kind"] == "other_code"
    assert verdict["reference_code"] == {"name": "solver", "version": "14"}
    assert verdict["reference_uncertainty"] == 0.01
