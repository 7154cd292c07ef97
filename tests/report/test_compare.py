"""Two batches side by side: what got worse comes first and in the exit status, round-off never."""

import copy
import json
import os
import re
import subprocess

import pytest

from solver.commands.cli import main
from tests.report.test_report import BATCH, NASTY, verdict
from tests.workflow.projects import ROOT

SCALE = 25.0


def write(folder, batch):
    (folder / "report").mkdir(parents=True)
    (folder / "report" / "summary.json").write_text(json.dumps(batch))
    return folder


def changed(job, **more):
    """A copy of the verdict of the batch, some of its keys others."""
    [found] = [each for each in BATCH if each["job"] == job]
    return copy.deepcopy(found) | more


def compare(tmp_path, capsys, this, base=BATCH):
    """Exit status and Markdown."""
    before, now = write(tmp_path / "before", base), write(tmp_path / "now", this)
    status = main(["compare", str(before), str(now)])
    return status, capsys.readouterr().out


def rows(markdown, heading):
    """The rows of the first table below a heading, as lists of cells."""
    part = re.split(r"\n## |\nReport: ", markdown.partition(f"\n## {heading}\n")[2])[0]
    table = re.split(r"\n\n(?=[|…])", part.strip())[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in table]


def test_the_same_batch_has_not_changed(tmp_path, capsys):
    status, markdown = compare(tmp_path, capsys, BATCH)
    assert status == 0  # failures stay failures: nothing got worse
    assert "7 solves: 5 did not pass before either; no number changed." in markdown
    assert len(rows(markdown, "Not passed, as before")) == 5
    assert "\n## Numbers" not in markdown


def test_verdicts_new_failures_first(tmp_path, capsys):
    this = [
        changed("fam-a10"),
        changed("fam-a2", verdict="failed", passed=False, reason=f"why: {NASTY}"),
        changed("fam-bad", verdict="passed", passed=True, reason=""),
        changed("fam-odd", verdict="crashed", reason="died"),
        changed("fam-dead"),
        verdict("fam-new", "passed"),
        verdict("fam-new-bad", "failed", "too far off"),
    ]
    status, markdown = compare(tmp_path, capsys, this)
    assert status == 1
    heads = re.findall(r"^## (.*)$", markdown, re.MULTILINE)
    assert heads == [
        "Worse than before",
        "Not passed, as before",
        "Better than before",
        "New, and passed",
        "No longer there",
    ]
    worse = {row[0]: row[1] for row in rows(markdown, "Worse than before")}
    assert worse == {
        "fam/fam-odd": "unreliable → crashed",
        "fam/fam-a2": "passed → failed",
        "fam/fam-new-bad": "not there → failed",
    }
    assert next(iter(worse)) == "fam/fam-odd"  # the worst first
    assert [r[:2] for r in rows(markdown, "Better than before")] == [
        ["fam/fam-bad", "failed → passed"]
    ]
    assert [r[0] for r in rows(markdown, "New, and passed")] == ["fam/fam-new"]
    gone = [r[:2] for r in rows(markdown, "No longer there")]
    assert ["fam/fam-no", "refused → not there"] in gone
    assert len(gone) == 2
    assert "<script>" not in markdown
    assert "9 solves: 3 got worse, 1 got better, 1 did not pass before either, 1 new, 2" in markdown


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("maximum", 25.0000000001 + 2e-9 * SCALE, "multiplier interface: maximum"),
        ("maximum", 25.0000000001 + 0.5e-9 * SCALE, None),  # round-off
        ("minimum", None, "multiplier interface: minimum"),
        ("error", 4e-13 + 1.1e-9, "multiplier interface: error"),
        ("error", 5e-13, None),
        ("tolerance", 1e-2, "multiplier interface: tolerance"),
    ],
)
def test_numbers_that_moved_by_more_than_accepted_ones_may(tmp_path, capsys, key, value, told):
    this = copy.deepcopy(BATCH)
    this[1]["checks"][0][key] = value
    status, markdown = compare(tmp_path, capsys, this)
    assert status == 0  # a number that stays within its tolerance is no failure
    found = [row[:2] for row in rows(markdown, "Numbers")]
    assert found == ([["fam/fam-a2", told]] if told else [])
    assert ("numbers changed in 1 of them" in markdown) == bool(told)


def test_counts_checks_and_norms_that_changed(tmp_path, capsys):
    this = copy.deepcopy(BATCH)
    this[1] |= {"dofs": 1250, "linear_solver": "another", "errors": {"peak": 0.5}}
    this[1]["checks"][0]["zone"] = "rim"
    _, markdown = compare(tmp_path, capsys, this)
    found = {row[1]: row[2:4] for row in rows(markdown, "Numbers")}
    assert found == {
        "unknowns": ["1234", "1250"],
        "linear solver": ["direct", "another"],
        "multiplier interface": ["there", "not there"],
        "multiplier rim": ["not there", "there"],
        "error peak": ["–", "0.5"],
    }


def test_largest_changes_first_and_all_where_asked_for(tmp_path, capsys):
    many = [verdict(f"fam-{n}", "passed") for n in range(50)]
    this = copy.deepcopy(many)
    for n, each in enumerate(this):
        each["checks"][0]["maximum"] += SCALE * 1e-6 * (n + 1)
    _, markdown = compare(tmp_path, capsys, this, many)
    found = rows(markdown, "Numbers")
    assert [row[0] for row in found[:2]] == ["fam/fam-49", "fam/fam-48"]
    assert found[0][4] == "5.0e-05"
    assert len(found) == 40
    assert "… and 10 more" in markdown
    main(["compare", str(tmp_path / "before"), str(tmp_path / "now"), "--all"])
    assert len(rows(capsys.readouterr().out, "Numbers")) == 50


def test_times_of_the_solves_that_both_have(tmp_path, capsys):
    this = copy.deepcopy(BATCH[:-1])
    this[0]["seconds"] = {"mesh": 0.25, "solve": 2.5, "total": 2.75}
    this.append(verdict("fam-new", "passed"))
    status, markdown = compare(tmp_path, capsys, this)
    assert status == 0  # times are shown, not judged
    assert "wall time 3.00 s, processor time 2.80 s, before; wall time 5.00 s" in markdown


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "must be a folder of results with a report, or its summary.json"),
        ('[{"job": ', "must be JSON ("),
        ("{}", "not as in a verdict: must be a list"),
        (
            '[{"job": "a", "family": "b"}]',
            "[0]: not as in a verdict: Object missing",
        ),
        (
            '[{"job": "a", "family": "b", "verdict": "passed", "seconds": 3}]',
            "[0].seconds: not as in a verdict: Expected `object`, got `int`",
        ),
        (
            '[{"job": "a", "family": "b", "verdict": "passed", "checks": [1]}]',
            "[0].checks[0]: not as in a verdict: Expected `object`, got `int`",
        ),
    ],
)
def test_what_is_no_batch_is_refused_in_one_line(tmp_path, capsys, content, message):
    good = write(tmp_path / "good", BATCH)
    bad = tmp_path / "bad"
    bad.mkdir()
    if content is not None:
        (bad / "summary.json").write_text(content)
    assert main(["compare", str(bad), str(good)]) == 2
    told = capsys.readouterr().err
    assert told.startswith(str(bad))
    assert message in told
    assert told.count("\n") == 1


def test_make_says_what_it_needs():
    environment = os.environ | {"MAKEFLAGS": "INSTALLED=yes"}
    run = subprocess.run(
        ["make", "compare"], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 2
    assert "make compare: name a folder of results, BASE=…" in run.stdout
