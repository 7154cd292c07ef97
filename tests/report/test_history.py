"""Records of past batches, made up by hand: each mark turns on and off at its bound."""

import copy
import json
import os
import re
import subprocess

import msgspec
import pytest

from solver.commands.cli import main
from solver.report.history import Course, draw
from solver.report.records import BatchRecord, marks, read_records, series
from tests.report.test_report import BATCH, Page, verdict
from tests.workflow.projects import ROOT

# Median 1.00, deviations 0, 0.03, 0.03, 0.05 and 0.1: noise 1.4826 · 0.03 = 0.0445, but at least
# 5 % of the median; marked from 1.00 + 4 · 0.05.
TIMES = (1.00, 1.03, 0.97, 1.05, 0.90)


def past(revision, day, word="passed", time=1.0, error=1e-3, machine="one", version=""):
    solve = [word, time, "force", {"force": error}, version]
    content = {
        "time": f"2026-01-{day:02d}T00:00:00Z",
        "revision": revision,
        "machine": machine,
        "versions": {},
        "solves": {"fam/a": solve},
    }
    return msgspec.convert(content, BatchRecord)


def last_marks(*records):
    return [(mark.kind, mark.bad) for mark in marks(series(records)["fam/a"])]


def test_a_single_record_has_no_mark():
    assert last_marks(past("a", 1)) == []


@pytest.mark.parametrize(
    ("before", "now", "told"),
    [
        ("passed", "failed", [("verdict", True)]),
        ("failed", "passed", [("verdict", False)]),
        ("failed", "crashed", [("verdict", True)]),
        ("passed", "passed", []),
        ("failed", "failed", []),
    ],
)
def test_a_changed_verdict(before, now, told):
    assert last_marks(past("a", 1, before), past("b", 2, now)) == told


@pytest.mark.parametrize(
    ("before", "now", "told"),
    [
        (1e-3, 1.01e-2, [("error", True)]),
        (1e-3, 0.99e-2, []),
        (1e-2, 1e-4, []),
        (0.0, 1.01e-12, [("error", True)]),
        (0.0, 0.99e-12, []),  # round-off
        (1e-16, 0.99e-12, []),
    ],
)
def test_an_error_that_grew_tenfold(before, now, told):
    assert last_marks(past("a", 1, error=before), past("b", 2, error=now)) == told


@pytest.mark.parametrize(
    ("time", "machine", "times", "told"),
    [
        (1.21, "one", TIMES, [("time", False)]),
        (1.19, "one", TIMES, []),
        (0.5, "one", TIMES, []),
        (1.21, "another", TIMES, []),
        (9.0, "one", TIMES[:3], []),  # too few
        (9.0, "one", TIMES[:4], [("time", False)]),
        # median 1, deviations 0.2: noise 1.4826 · 0.2 = 0.2965, marked from 2.186
        (2.18, "one", (0.8, 1.2, 0.8, 1.2), []),
        (2.19, "one", (0.8, 1.2, 0.8, 1.2), [("time", False)]),
        (None, "one", TIMES, []),
    ],
)
def test_a_time_that_grew_beyond_its_noise(time, machine, times, told):
    before = [past("a", day, time=each) for day, each in enumerate(times, 1)]
    assert last_marks(*before, past("b", 9, time=time, machine=machine)) == told


def test_the_median_is_that_of_the_last_ten_records():
    # Of the last ten, five are 1.0 and five 9.0: median 5.0. Of nine or eleven the median is 1.0.
    times = [1.0] * 6 + [9.0] * 5 + [1.0] * 5
    before = [past("a", day, time=each) for day, each in enumerate(times, 1)]
    assert last_marks(*before, past("b", 20, time=1.3)) == []
    assert last_marks(*before, past("a", 17), past("b", 20, time=1.3)) == [("time", False)]


def test_repeated_records_are_compared_with_the_revision_before():
    known = past("a", 1), past("b", 2, error=1.0), past("b", 3, error=1.0)
    assert last_marks(*known) == [("error", True)]
    assert last_marks(*known, past("c", 4, error=1.0)) == []
    assert last_marks(past("a", 1), past("a", 2, error=1.0)) == [("error", True)]


def test_an_error_is_compared_across_a_crash():
    crashed = past("b", 2, "crashed")
    crashed.solves["fam/a"].errors.clear()
    assert ("error", True) in last_marks(past("a", 1), crashed, past("c", 3, error=1.0))
    assert last_marks(past("a", 1), crashed, past("c", 3)) == [("verdict", False)]


def test_versions_of_another_code_are_a_series():
    known = past("a", 1, version="2.0"), past("b", 2, version="2.0", error=1.0)
    points = series([*known, past("b", 3, version="2.1", error=1.0)])["fam/a"]
    assert [point.label for point in points] == ["2.0", "2.0", "2.1"]
    assert [bool(of) for of in Course("fam/a", points, current=True).marks] == [False, True, False]
    [axis] = [part["spec"]["layer"][0]["encoding"]["x"] for part in _parts(points)][:1]
    assert axis["sort"] == ["2.0", "2.1"]


def test_a_chart_has_all_points_and_colours_those_that_are_marked():
    chart = draw(
        "x", [Course("fam/a", series([past("a", 1), past("b", 2, "failed")])["fam/a"], True)]
    )
    found = [(r["revision"], r["off"], r["late"]) for r in chart.spec["data"]["values"]]
    assert found == [("a", False, False), ("b", True, False)]
    assert "<svg" in chart.svg()
    assert draw("x", []) is None


def _parts(points):
    return draw("x", [Course("fam/a", points, current=True)]).spec["hconcat"]


def later(batch, revision, day):
    """A batch solved once more at another revision, in other times."""
    found = copy.deepcopy(batch)
    for number, each in enumerate(found):
        each["provenance"] = {"revision": revision, "cpu": "some", "cores": 2}
        each["provenance"]["time_utc"] = f"2026-01-{day:02d}T00:00:00+00:00"
        each["cpu_seconds"] = 0.7 + 1e-3 * day + 1e-5 * number
    return found


@pytest.fixture
def run(tmp_path, capsys):
    """Records a batch: exit status, lines, page."""

    def record(batch):
        report = tmp_path / "results" / "report"
        report.mkdir(parents=True, exist_ok=True)
        (report / "summary.json").write_text(json.dumps(batch))
        history = tmp_path / "history"
        status = main(["record", str(report.parent), "--history", str(history)])
        page = report / "history.html"
        text = Page(page).text if page.is_file() else ""
        return status, capsys.readouterr(), text

    return record


def test_batches_are_recorded_once_and_marked(run, tmp_path):
    folder = tmp_path / "history"
    good = [verdict("fam-a", "passed"), verdict("fam-b", "passed")]
    assert run(later(good, "aaa", 1))[0] == 0
    status, told, _ = run(later(good, "aaa", 1))
    assert status == 0
    assert "Nothing new to record." in told.out
    assert len(read_records(folder)) == 1
    worse = later(good, "bbb", 2)
    worse[0] |= {"verdict": "failed", "passed": False, "reason": "why"}
    worse[1]["checks"][0]["error"] = 1e-5
    status, told, page = run(worse)
    assert status == 1
    assert "fam/fam-a: passed → failed\n" in told.out
    assert "fam/fam-b: error of multiplier 4.0e-13 → 1.0e-05\n" in told.out
    outcome = "2 solves: verdict changed in 1, an error grew tenfold in 1, time grew beyond"
    assert outcome in told.out
    assert outcome in page
    assert "passed → failed" in page
    [_, last] = read_records(folder)
    assert (last.revision, last.machine, last.time.day) == ("bbb", "some / 2", 2)
    assert last.solves["fam/fam-b"].errors == {"multiplier": 1e-5}
    assert run(later(worse, "ccc", 3))[0] == 0  # nothing got worse since
    gone, _, page = run(later(good[1:], "ddd", 4))
    assert gone == 0
    assert "not in this batch" in page


def test_a_solve_that_did_not_run_again_is_recorded_once(run, tmp_path):
    known = later([verdict("fam-a", "passed"), verdict("fam-b", "passed")], "aaa", 1)
    run(known)
    run([known[0], *later([verdict("fam-b", "passed")], "bbb", 2)])
    points = series(read_records(tmp_path / "history"))
    assert {name: len(of) for name, of in points.items()} == {"fam/fam-a": 1, "fam/fam-b": 2}


def test_other_codes_and_crashes_have_the_revision_of_the_batch(run, tmp_path):
    code = verdict("fam-a@code", "passed", code="code", code_version="2.1", provenance={})
    run([*later([verdict("fam-a", "passed")], "aaa", 1), code, BATCH[5]])
    points = series(read_records(tmp_path / "history"))
    assert [p.label for p in points["fam/fam-a@code"]] == ["2.1"]
    assert [(p.label, p.solve.verdict) for p in points["fam/fam-dead"]] == [("aaa", "crashed")]


GOOD = '{"time":"2026-01-01T00:00:00Z","revision":"","machine":"","versions":{},"solves":%s}'


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "damaged record (Input data was truncated)"),
        (GOOD % '{"fam/a":["good",1.0,"",{}]}', "damaged record (Invalid enum value 'good'"),
        (GOOD % '{"fam/a":["passed",-1.0,"",{}]}', "damaged record (Expected `float` >= 0.0"),
        (GOOD % '{"fam/a":["passed"]}', "damaged record (Expected `array` of at least length 4"),
        ((GOOD % "{}").replace("Z", ""), "damaged record (Expected `datetime` with a timezone"),
        (GOOD % "{}" + "]", "damaged record (JSON is malformed"),
        ("[" * 100_000, "damaged record ("),
    ],
)
def test_a_damaged_record_is_refused_in_one_line(run, tmp_path, content, message):
    bad = tmp_path / "history" / "bad.json"
    bad.parent.mkdir()
    bad.write_text(content)
    status, told, _ = run([verdict("fam-a", "passed")])
    assert status == 2
    assert told.err.startswith(f"{bad}: file: {message}")
    assert told.err.count("\n") == 1
    assert list(bad.parent.iterdir()) == [bad]


def test_make_hands_over_the_folder():
    environment = os.environ | {"MAKEFLAGS": "INSTALL=:"}
    for folder, given in (("", ""), ("past batches", ' --history "past batches"')):
        command = ["make", "-n", "record", *([f"HISTORY={folder}"] if folder else [])]
        run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
        assert re.search(rf"-m solver record{given} ?$", run.stdout, re.MULTILINE), run.stdout


def test_the_page_of_the_documentation_names_commands_that_run(run, tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs" / "history.md").read_text(encoding="utf-8")
    commands = re.findall(r"^\.venv/bin/python -m solver (.*)$", page, re.MULTILINE)
    assert len(commands) == 2
    run(later([verdict("fam-a", "passed")], "aaa", 1))
    monkeypatch.chdir(tmp_path)
    for command in commands:
        assert main(command.split()) == 0
        assert "1 solves: verdict changed in 0" in capsys.readouterr().out
    assert (tmp_path / "results" / "history").is_dir()
