"""The time that a study is expected to take, from what was measured before and from the model."""

import json
import sys
from math import prod
from pathlib import Path

import pytest

from solver.studies.points import announcement, expected, measured_before, run_compiled
from solver.studies.work_precision.description import read_study
from solver.system.compiled import available
from solver.system.process import cores_for

FILE = Path(__file__).parents[2] / "cases/study/study.yaml"
STUDY = read_study(FILE, "quick")
MODEL = {point.name: point.seconds for point in STUDY.points}


def test_unknowns_of_regular_grids_are_counted():
    pair = ("HEXA20", "HEXA20")
    points = read_study(FILE, "full").points
    point = next(p for p in points if (p.slave, p.master) == pair and p.level == 2)
    corners = [prod(2 * n + 1 for n in body) for body in point.problem.divisions]
    edges = [
        prod(2 * n + (i != k) for k, n in enumerate(body))
        for body in point.problem.divisions
        for i in range(3)
    ]
    nodes = [*corners, *edges]
    assert point.mesh.unknowns == 3 * sum(nodes)


def test_what_was_measured_before_is_taken_as_it_is():
    earlier = dict.fromkeys(MODEL, 2.0)
    assert expected(MODEL, MODEL, earlier, 100.0) == pytest.approx(2.0 * len(STUDY.points))
    assert expected(MODEL, list(MODEL)[:3], earlier, 100.0) == pytest.approx(6.0)


def test_the_model_is_scaled_by_what_is_known():
    first, *others = MODEL
    plain = sum(MODEL[name] for name in others)
    assert expected(MODEL, others, {}, 1e6) == pytest.approx(plain)
    thrice = {first: 3 * MODEL[first]}
    assert expected(MODEL, others, thrice, 1e6) == pytest.approx(3 * plain)


def test_no_point_is_expected_to_take_more_than_its_limit():
    name = next(iter(MODEL))
    assert expected(MODEL, [name], {name: 1000.0}, 100.0) == 100.0


def test_the_announcement_says_how_many_how_long_and_from_what(tmp_path):
    one = STUDY.points[0].name
    assert "all" in announcement(STUDY, tmp_path, [])
    assert "from a model" in announcement(STUDY, tmp_path, [one])
    record = tmp_path / f"{one}.json"
    record.parent.mkdir(parents=True)
    record.write_text(json.dumps({"point": one, "outcome": "failed", "reason": "", "whole": 40.0}))
    text = announcement(STUDY, tmp_path, [one])
    assert f"1 of {len(STUDY.points)} points" in text
    assert "about 40 s (from earlier measurements)" in text


def test_records_that_cannot_be_read_are_no_measurements(tmp_path):
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    good.write_text('{"point": "a/b/c/1", "outcome": "failed", "reason": "", "whole": 3}')
    bad.write_text("{")
    assert measured_before([good, bad, tmp_path / "none.json"]) == {"a/b/c/1": 3.0}


_PROGRAM = """
import sys
with open({runs!r}, "a") as runs:
    runs.write("x")
sys.path.insert(0, {folder!r})
import loops, numpy
out = numpy.zeros(1)
loops.add(numpy.arange(5.0), out)
print("sum", out[0])
sys.exit({status})
"""


@pytest.fixture
def compiling(tmp_path, monkeypatch):
    """Runs a program with a compiled function; the runs, and how the last one ended."""
    (tmp_path / "loops.py").write_text(
        "from solver.system.compiled import compiled\n@compiled\ndef add(numbers, out):\n"
        "    for number in numbers:\n        out[0] += number\n"
    )
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))

    def run(status=0):
        runs = tmp_path / "runs"
        runs.write_text("")
        text = _PROGRAM.format(runs=str(runs), folder=str(tmp_path), status=status)
        done = run_compiled(lambda: [sys.executable, "-c", text], cores_for(1), 60.0)
        return len(runs.read_text()), done

    return run


@pytest.mark.skipif(not available(), reason="Numba is not installed")
def test_a_run_that_compiled_functions_is_not_measured(compiling):
    runs, done = compiling()
    assert (runs, done.status, done.output) == (2, 0, "sum 10.0\n")
    # They are kept: nothing is compiled any more.
    runs, done = compiling()
    assert (runs, done.status, done.output) == (1, 0, "sum 10.0\n")


@pytest.mark.skipif(not available(), reason="Numba is not installed")
def test_a_run_that_failed_is_not_repeated(compiling):
    runs, done = compiling(status=3)
    assert (runs, done.reason) == (1, "the process died with exit status 3: sum 10.0")
