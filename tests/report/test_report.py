"""The report of a batch in which everything can go wrong: nobody is left out of any format."""

import csv
import json
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

from solver.commands.cli import main
from solver.report import write_report
from solver.report.page import WORK, left_out
from solver.report.rows import Row
from solver.simulation.options import Shortcuts
from solver.verification.judge import without_result
from tests.report.verdicts import put, record

NASTY = """<script>alert('1 & 2')</script> "quoted" | a_b * `c`"""
CHECK = {
    "name": "multiplier",
    "alias": "LAGS_C",
    "zone": "interface",
    "norm": "max",
    "minimum": 24.9,
    "maximum": 25.0000000001,
    "value": 24.9,
    "reference": 25.0,
    "where": "macro-element 3",
    "scale": 25.0,
    "error": 4e-3,
    "tolerance": 1e-3,
    "regression": None,
    "passed": False,
}


def verdict(job, word, reason="", **more):
    return {
        "case": job,
        "family": "fam",
        "title": "",
        "job": job,
        "swapped": False,
        "direction": "first",
        "variant": "",
        "reference_kind": "analytical",
        "zones": [{"name": "interface", "slave": "lower", "master": "upper"}],
        "verdict": word,
        "passed": word == "passed",
        "reason": reason,
        "result": None,
        "dofs": 1234,
        "macro_elements": 7,
        "iterations": 1,
        "linear_solver": "direct",
        "length": 50.0,
        "load_scale": 25.0,
        "seconds": {"mesh": 0.25, "solve": 0.5, "total": 0.75},
        "cpu_seconds": 0.7,
        "peak_memory_mb": 100.0,
        "pressure_error_estimate": 0.0123,
        "pressure_within": 0.0123,
        "pressure": [24.9, 25.0000000001],
        "stress": [-25.0, -25.0],
        "gap": [-1e-16, 2e-16],
        "status": [1, 1],
        "coverage": [1.0, 1.0],
        "worst": {"name": "multiplier", "zone": "interface", "error": 4e-3},
        "bodies": [
            {
                "name": name,
                "role": role,
                "cells": {cells: 12},
                "faces": 4,
                "reference_cells": 80,
                "reference_faces": None,
            }
            for name, role, cells in (("top", "master", "QUAD4"), ("bottom", "slave", "TRIA3"))
        ],
        "plan": [["no cut", NASTY]],
        "checks": [CHECK | {"passed": word == "passed", "error": 4e-3 if reason else 4e-13}],
        "provenance": {"revision": "abc", "time_utc": "2026-01-02T03:04:05+00:00"},
        **more,
    }


def unfinished(job, word, reason):
    """A verdict without a result, as the solver writes it."""
    found = without_result(word, reason, Path("case.yaml")).plain()
    return found | {"case": job, "family": "fam", "job": job}


BATCH = [
    verdict("fam-a10", "passed"),
    verdict("fam-a2", "passed", title=NASTY),
    verdict("fam-bad", "failed", f"multiplier: {NASTY}"),
    verdict("fam-odd", "unreliable", "the refinement did not converge"),
    unfinished("fam-no", "refused", f"case.yaml: mesh = {NASTY}"),
    unfinished("fam-dead", "crashed", "died with exit status 137 \x1b[31m\x00"),
    unfinished(NASTY, "refused", "no name"),
]
NAMES = [v["job"] for v in BATCH]


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The folder of a report of the batch, one verdict unreadable; and what was logged."""
    folder = tmp_path_factory.mktemp("report")
    paths = []
    for number, content in enumerate(BATCH):
        path = folder / "batch" / "fam" / str(number) / "verdict.json"
        paths.append(put(path, content))
    broken = folder / "batch" / "fam" / "fam-broken" / "verdict.json"
    broken.parent.mkdir()
    broken.write_text('{"case": ')
    return folder / "report", write_report([*paths, broken], folder / "report")


class Page(HTMLParser):
    """The elements, attributes and visible text of a page, and the cells of its tables by row."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.values, self.rows, self._parts = [], [], [], []
        self.feed(path.read_text())
        self.close()
        self.rows = [[" ".join(cell.split()) for cell in row] for row in self.rows if row]
        self.text = " ".join("".join(self._parts).split())

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.values += attributes
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th") and self.rows:
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.tags[-1:] not in (["style"], ["script"]):
            self._parts.append(data)
            if self.rows and self.rows[-1]:
                self.rows[-1][-1] += data


def test_every_solve_stands_in_every_output(report):
    folder, logged = report
    everyone = {*NAMES, "fam-broken"}
    jobs = {v["job"] for v in json.loads((folder / "summary.json").read_text())}
    assert jobs == everyone
    with (folder / "summary.csv").open(newline="") as stream:
        assert {row["job"] for row in csv.DictReader(stream)} == everyone
    cases = ET.parse(folder / "junit.xml").iter("testcase")
    assert {case.get("name") for case in cases} == everyone
    values = Page(folder / "fam.html").values
    assert {value for key, value in values if key == "id"} >= {f"fam/{name}" for name in everyone}
    links = {unquote(value) for key, value in Page(folder / "summary.html").values if key == "href"}
    assert links >= {f"fam.html#fam/{name}" for name in everyone}
    markdown = (folder / "summary.md").read_text()
    for name in everyone - {NASTY}:
        assert re.search(rf"^\| {re.escape(name)} \|", markdown, re.MULTILINE), name
    assert markdown.count("\n| ") == len(everyone) + 2  # a head, and the rule below it
    failures = (folder / "failures.txt").read_text().splitlines()
    assert len(failures) == 6
    assert all(line in logged for line in failures)
    assert "8 solves: 2 crashed, 2 refused, 1 failed, 1 unreliable, 2 passed." in logged


def test_reasons_stand_in_every_output(report):
    folder, _ = report
    reason = "the refinement did not converge"
    text = Page(folder / "summary.html").text
    assert reason in text
    assert f"multiplier: {NASTY}" in text
    for name in ("summary.json", "summary.csv", "summary.md", "junit.xml", "failures.txt"):
        assert reason in (folder / name).read_text(), name


def test_failures_come_first_then_names_in_their_natural_order(report):
    folder, _ = report
    with (folder / "summary.csv").open(newline="") as stream:
        rows = [(row["verdict"], row["job"]) for row in csv.DictReader(stream)]
    words = [word for word, _ in rows]
    order = ["crashed", "refused", "failed", "unreliable", "passed"]
    assert words == sorted(words, key=order.index)
    assert [job for word, job in rows if word == "passed"] == ["fam-a2", "fam-a10"]


@pytest.mark.parametrize("name", ["summary.html", "fam.html"])
def test_pages_ask_for_nothing_from_outside(report, name):
    folder, _ = report
    page = Page(folder / name)
    assert not {"link", "iframe", "object"} & set(page.tags)
    # Our own, the script of the charts with a chart; that of results to turn on the page of a
    # family, the chart of the recorded study on the first one; nothing that a verdict brought in.
    assert page.tags.count("script") == 4
    for source in (v for key, v in page.values if key == "src"):
        assert (folder / unquote(source)).is_file()
    links = [v for key, v in page.values if key in ("href", "xlink:href")]
    assert links
    for link in links:
        target = unquote(link.partition("#")[0])
        assert not target or (folder / target).is_file(), link
    text = (folder / name).read_text()
    assert "url(" not in text
    assert "@import" not in text


def test_pages_show_counts_beside_the_reference_and_say_which_sign(report):
    folder, _ = report
    text = Page(folder / "summary.html").text
    assert "LAGS_C is negative in compression in the reference code" in text
    assert "12 cells (reference 80)" in (folder / "fam.html").read_text()
    text = Page(folder / "fam.html").text
    assert "no value accepted yet" in text
    assert "Not drawn" in text


def test_pages_show_the_estimated_error(report):
    folder, _ = report
    assert "pressure within 1.2 % (estimated)." in (folder / "fam.html").read_text()


def test_pages_list_the_forces_of_each_step_and_the_probes(tmp_path):
    """Round-off beside the largest force of 1250 is shown as zero."""
    base = {"factor": 0.5, "moment": [0, 0, -1e-13], "step": 2}
    contact = base | {"name": "zone a", "force": [1e-12, -1250], "area": [50, 50, 50]}
    forces = [base | {"step": 1, "name": "zone a", "force": [0, -625]}, contact]
    forces += [base | {"name": "floor", "force": [0, 1250]}]
    probes = [{"name": "tip", "place": [1, 2], "displacement": [0.5, 1e-12], "stress": [0] * 6}]
    probes += [{"name": "middle", "place": [1, 0], "pressure": 25}]
    more = {"forces": forces, "probes": probes, "largest_displacement": 0.5}
    path = put(tmp_path / "a" / "verdict.json", verdict("a", "passed", **more))
    write_report([path], tmp_path / "report", [])
    page = (tmp_path / "report" / "fam.html").read_text()
    table = re.sub(r"<[^>]*>", " ", page[page.index("class=forces") :])
    for row in ("2 0.5 zone a 0, -1250 0, 0, 0 50 –", "2 0.5 floor 0, 1250 0, 0, 0 – –"):
        assert row in " ".join(table.split())
    for row in ("tip 1, 2 0.5, 0 0, 0, 0, 0, 0, 0 –", "middle 1, 0 – – 25"):
        assert row in " ".join(table.split())


def test_numbers_keep_their_digits_in_csv(report):
    folder, _ = report
    with (folder / "summary.csv").open(newline="") as stream:
        row = next(row for row in csv.DictReader(stream) if row["job"] == "fam-a2")
    assert float(row["pressure_maximum"]) == 25.0000000001
    assert float(row["error_multiplier"]) == 4e-13
    assert row["seconds_solve"] == "0.5"
    assert row["slave_cells"] == "TRIA3 12"
    assert row["master_reference_cells"] == "80"


def test_a_batch_that_passed_leaves_no_failures(tmp_path):
    path = put(tmp_path / "fam-a" / "verdict.json", verdict("fam-a", "passed"))
    logged = write_report([path], tmp_path / "report")
    assert (tmp_path / "report" / "failures.txt").read_text() == ""
    assert logged.splitlines()[-1].startswith("The one solve passed. Report: ")


def test_older_results_are_shown_but_are_no_failures_of_this_batch(tmp_path):
    new = put(tmp_path / "fam-a" / "verdict.json", verdict("fam-a", "passed"))
    old = put(tmp_path / "fam-b" / "verdict.json", verdict("fam-b", "failed", "too coarse"))
    logged = write_report([new], tmp_path / "report", older=[old]).splitlines()
    assert (tmp_path / "report" / "failures.txt").read_text() == ""
    assert logged[-2] == "Older results in the report, not of this run: 1 solve: 1 failed."
    assert logged[-1].startswith("This run: The one solve passed. Report: ")
    assert not any("too coarse" in line for line in logged)
    assert "too coarse" in (tmp_path / "report" / "summary.html").read_text()
    write_report([old], tmp_path / "report", older=[new])
    assert (tmp_path / "report" / "failures.txt").read_text() == "fam-b: failed: too coarse\n"


def test_a_badge_says_how_strictly_a_solve_was_judged(tmp_path):
    check = CHECK | {"error": 1e-3, "tolerance": 1.5e-3, "expected": 1.2e-3, "passed": True}
    made = verdict("fam-a", "passed") | {"judged": "expected error", "checks": [check]}
    write_report([put(tmp_path / "fam-a" / "verdict.json", made)], tmp_path / "report")
    page = (tmp_path / "report" / "fam.html").read_text()
    badges = '<span class="badge passed">passed</span> <span class="badge expected-error">'
    assert f"{badges}expected error</span>" in page
    assert "<td class=n>1.2e-03</td>\n<td class=n>1.5e-03</td>" in page


def test_a_solve_without_a_reference_has_its_own_word_and_is_no_failure(tmp_path):
    made = [verdict("fam-a", "passed"), verdict("fam-free", "solved", "not verified: no reference")]
    paths = [put(tmp_path / each["job"] / "verdict.json", each) for each in made]
    out = tmp_path / "report"
    logged = write_report(paths, out)
    assert (out / "failures.txt").read_text() == ""
    assert logged.splitlines()[-1].startswith("2 solves: 1 solved, 1 passed. Report: ")
    assert '<span class="badge solved">solved</span>' in (out / "fam.html").read_text()
    told = {each["job"]: each for each in json.loads((out / "summary.json").read_text())}
    assert (told["fam-free"]["verdict"], told["fam-free"]["passed"]) == ("solved", False)
    assert 'failures="0"' in (out / "junit.xml").read_text()


@pytest.mark.parametrize("content", [b"\xff\xfe", b"[" * 100_000, b"[]", b'{"family": 1}', b""])
def test_a_damaged_verdict_is_a_row_of_the_report(tmp_path, content):
    path = put(tmp_path / "fam" / "fam-a" / "verdict.json", verdict("fam-a", "passed"))
    path.write_bytes(content)
    write_report([path], tmp_path / "report")
    failures = (tmp_path / "report" / "failures.txt").read_text()
    assert failures.startswith("fam-a: crashed: ")
    assert failures.endswith("solve again\n")


def test_exchanged_verdicts_are_found_out(tmp_path):
    one, two = (
        put(tmp_path / "results" / "fam" / job / "verdict.json", verdict(job, "passed"))
        for job in ("fam-a", "fam-b")
    )
    content = one.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(content)
    write_report([one, two], tmp_path / "report")
    failures = (tmp_path / "report" / "failures.txt").read_text()
    assert failures == (
        "fam-a: crashed: the verdict belongs to fam/fam-b; solve again\n"
        "fam-b: crashed: the verdict belongs to fam/fam-a; solve again\n"
    )


def test_what_the_solves_of_a_family_left_out():
    plan = [
        ["interface: plain Gauss rules", "every face is an affine image", "quadrature"],
        ["no second active-set solve", "complementary", "status"],
        ["linear solver: CHOLMOD", "a factor is small in 2D", ""],
        ["a line of", "another version"],
    ]
    rows = [Row(record(verdict(name, "passed", plan=plan)), Path()) for name in "ab"]
    assert left_out(rows) == [
        (WORK["quadrature"], "every face is an affine image", 2),
        (WORK["status"], "complementary", 2),
    ]
    assert WORK.keys() == vars(Shortcuts()).keys()


def test_a_batch_of_nothing_is_no_success(tmp_path):
    assert "none at all" in write_report([], tmp_path / "report")
    assert 'class="outcome bad"' in (tmp_path / "report" / "summary.html").read_text()


def test_what_a_run_did_not_ask_for_is_older(tmp_path, capsys):
    results = tmp_path / "all"
    for job, word in (("asked", "passed"), ("asked@code", "failed"), ("other", "failed")):
        code = job.partition("@")[2] or None
        content = {"job": job, "verdict": word, "family": "fam", "code": code}
        put(results / "fam" / job / "verdict.json", content)
    (tmp_path / "run").write_text(f"{results}/fam/asked\n", encoding="utf-8")
    command = ["report", str(results), "-o", str(tmp_path / "report"), "--families"]
    assert main([*command, "--run", str(tmp_path / "run")]) == 0
    assert (
        "Older results in the report, not of this run: 1 solve: 1 failed" in capsys.readouterr().out
    )
    assert len(json.loads((tmp_path / "report" / "summary.json").read_text())) == 3
    assert main(command) == 1
    (tmp_path / "run").write_bytes(b"\x89elsewhere\n")
    assert main([*command, "--run", str(tmp_path / "run")]) == 2
    assert "each line must be a folder in" in capsys.readouterr().err
