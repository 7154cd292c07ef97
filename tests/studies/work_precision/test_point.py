"""One point measured in a process of its own: what is recorded when it ends well, and when not."""

import json
import os
from dataclasses import replace
from pathlib import Path

import pytest

from solver.case.reader import parse_case
from solver.case.yaml import read_mapping
from solver.commands.cli import main
from solver.simulation.simulate import simulate
from solver.studies import points as measuring
from solver.studies.work_precision.description import read_study
from solver.studies.work_precision.point import measure_point
from solver.system.clock import SOLVING
from solver.system.errors import InputError, SolveError
from solver.verification.run import mesh_of

ROOT = Path(__file__).parents[3]
STUDY = """
title: A study
threads: 1
repetitions: 3
limit: 60
treatments:
  - {name: lac, title: LAC, zone: {treatment: lac}}
  - {name: odd, title: Odd, zone: {treatment: no-such-treatment}}
problems:
  - {name: patch, title: Patch, case: patch-2d.yaml, pairs: [[TRIA3, QUAD4]], levels: [1]}
linear_solvers:
  - {problem: patch, pair: [TRIA3, QUAD4], treatment: lac, solvers: [superlu]}
"""


@pytest.fixture
def study(tmp_path):
    text = (ROOT / "cases/study/templates/patch-2d.yaml").read_text()
    (tmp_path / "patch-2d.yaml").write_text(text)
    (tmp_path / "study.yaml").write_text(STUDY)
    return read_study(tmp_path / "study.yaml")


def record(study, name, folder):
    """The record of a point, and the line that was said of it."""
    output = folder / "record.json"
    line = measure_point(study, study.point(name), output, None)
    assert [path.name for path in folder.glob("*record*")] == ["record.json"]
    return json.loads(output.read_text()), line


def test_a_point_that_ends_well(study, tmp_path):
    found, line = record(study, "patch/tria3-quad4/lac+superlu/1", tmp_path)
    assert (found["outcome"], found["factor"]) == ("solved", "SuperLU")
    assert line.startswith(f"{found['point']}: {found['dofs']} unknowns")
    assert list(found["times"]) == [*SOLVING, "total"]
    for times in found["times"].values():
        assert len(times["wall"]) == len(times["cpu"]) == 3
    total = sum(sum(found["times"][stage]["wall"]) for stage in SOLVING)
    assert total <= sum(found["times"]["total"]["wall"]) < found["whole"]
    assert 0 < found["process"]["wall"] < found["whole"]
    assert found["process"]["peak_memory_mb"] > 20
    assert (found["threads"], len(found["cores"])) == (1, 1)
    assert found["machine"]["threads"] == "1"
    assert found["machine"]["cores"] == 1
    # The patch test: exact but for rounding.
    assert set(found["errors"]) >= {"pressure_l2", "pressure_oscillation", "stress_max"}
    assert max(found["errors"].values()) < 1e-11


def test_a_treatment_that_does_not_exist_is_recorded_with_its_reason(study, tmp_path):
    found, line = record(study, "patch/tria3-quad4/odd/1", tmp_path)
    assert found["outcome"] == "refused"
    assert "contact[0].treatment = 'no-such-treatment'" in found["reason"]
    assert line == f"patch/tria3-quad4/odd/1: refused: {found['reason']}"
    assert (found["times"], found["errors"]) == ({}, {})


def test_a_point_without_an_end_is_stopped(study, tmp_path):
    found, _ = record(replace(study, limit=0.01), "patch/tria3-quad4/lac/1", tmp_path)
    assert (found["outcome"], found["reason"]) == ("failed", "no end within 0.01 s")


def test_a_process_that_dies_is_recorded(study, tmp_path, monkeypatch):
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\necho out of luck >&2\nexit 7\n")
    python.chmod(0o755)
    monkeypatch.setattr(measuring.sys, "executable", str(python))
    found, _ = record(study, "patch/tria3-quad4/lac/1", tmp_path)
    assert found["outcome"] == "crashed"
    assert found["reason"] == "the process died with exit status 7: out of luck"


def test_more_threads_than_there_are_cores_are_refused(study, tmp_path):
    many = replace(study, threads=len(os.sched_getaffinity(0)) + 1)
    with pytest.raises(InputError, match=r"threads = \d+: more than the \d+ cores"):
        measure_point(many, many.points[0], tmp_path / "record.json", None)


def test_a_reference_is_asked_for_where_there_is_no_exact_solution(tmp_path, capsys):
    command = ["study", "point", "cases/study/study.yaml", "half-loaded/quad4-tria3/lac/1"]
    assert main([*command, "-o", str(tmp_path / "record.json")]) == 2
    assert "half-loaded has no exact solution" in capsys.readouterr().err


def test_node_to_segment_in_two_passes_has_no_solution_with_multipliers():
    """Why the study has one pass: two hold both surfaces straight, with dependent constraints."""
    path = Path("cases/study/templates/patch-2d.yaml")
    content = read_mapping(path)
    first = content["contact"][0] | {"name": "first", "treatment": "node_to_segment"}
    second = first | {"name": "second", "slave": first["master"], "master": first["slave"]}
    case = parse_case(json.dumps(content | {"contact": [first, second]}), path)
    with pytest.raises(SolveError, match="may depend on one another"):
        simulate(case, mesh_of(case))
