"""The report of a batch in which everything can go wrong: nobody is left out of any format."""

import csv
import json
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from urllib.parse import unquote

import pytest

from solver.report import write_report
from tests.report.verdicts import put

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
    nothing = dict.fromkeys(
        [
            "dofs",
            "macro_elements",
            "iterations",
            "linear_solver",
            "length",
            "load_scale",
            "cpu_seconds",
            "peak_memory_mb",
            "pressure",
            "stress",
            "gap",
            "status",
            "coverage",
            "worst",
        ]
    )
    empty = {"seconds": {}, "bodies": [], "plan": [], "checks": [], "provenance": {}}
    return verdict(job, word, reason) | nothing | empty | {"reference_kind": None, "zones": []}


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
    folder, logged = tmp_path_factory.mktemp("report"), []
    paths = []
    for number, content in enumerate(BATCH):
        path = folder / "batch" / "fam" / str(number) / "verdict.json"
        paths.append(put(path, content))
    broken = folder / "batch" / "fam" / "fam-broken" / "verdict.json"
    broken.parent.mkdir()
    broken.write_text('{"case": ')
    assert write_report([*paths, broken], folder / "report", logged.append) == 0
    return folder / "report", "\n".join(logged)


class Page(HTMLParser):
    """The elements, identifiers and visible text of a page."""

    def __init__(self):
        super().__init__()
        self.tags, self.values, self.text = [], [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.values += attributes

    def handle_data(self, data):
        if self.tags[-1:] not in (["style"], ["script"]):
            self.text.append(data)


def read_page(folder, name="summary.html"):
    page = Page()
    page.feed((folder / name).read_text())
    page.close()
    return page


def test_every_solve_stands_in_every_output(report):
    folder, logged = report
    everyone = {*NAMES, "fam-broken"}
    jobs = {v["job"] for v in json.loads((folder / "summary.json").read_text())}
    assert jobs == everyone
    with (folder / "summary.csv").open(newline="") as stream:
        assert {row["job"] for row in csv.DictReader(stream)} == everyone
    cases = ET.parse(folder / "junit.xml").iter("testcase")
    assert {case.get("name") for case in cases} == everyone
    values = read_page(folder, "fam.html").values
    assert {value for key, value in values if key == "id"} >= {f"fam/{name}" for name in everyone}
    links = {unquote(value) for key, value in read_page(folder).values if key == "href"}
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
    text = "".join(read_page(folder).text)
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


def test_junit_tells_failures_from_errors(report):
    folder, _ = report
    suites = ET.parse(folder / "junit.xml").getroot()
    [suite] = suites
    assert suite.get("tests") == "8"
    assert suite.get("failures") == "2"
    assert suite.get("errors") == "4"
    ending = {case.get("name"): [e.tag for e in case] for case in suites.iter("testcase")}
    assert ending["fam-a2"] == []
    assert ending["fam-bad"] == ending["fam-odd"] == ["failure"]
    assert ending["fam-no"] == ending["fam-dead"] == ending["fam-broken"] == ["error"]
    messages = {e.get("message") for e in suites.iter("failure")}
    assert f"multiplier: {NASTY}" in messages


@pytest.mark.parametrize("name", ["summary.html", "fam.html"])
def test_pages_ask_for_nothing_from_outside(report, name):
    folder, _ = report
    page = read_page(folder, name)
    assert not {"link", "img", "iframe", "object"} & set(page.tags)
    assert page.tags.count("script") == 1  # our own, and nothing that a verdict brought in
    assert "src" not in {key for key, _ in page.values}
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
    text = " ".join("".join(read_page(folder).text).split())
    assert "LAGS_C is negative in compression in the reference code" in text
    text = " ".join("".join(read_page(folder, "fam.html").text).split())
    assert "12 / 80" in text
    assert "no value accepted yet" in text
    assert "Not drawn" in text


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
    logged = []
    write_report([path], tmp_path / "report", logged.append)
    assert (tmp_path / "report" / "failures.txt").read_text() == ""
    assert logged[0].startswith("The one solve passed.")


def test_a_batch_of_nothing_is_no_success(tmp_path):
    logged = []
    write_report([], tmp_path / "report", logged.append)
    assert "none at all" in logged[0]
    assert 'class="outcome bad"' in (tmp_path / "report" / "summary.html").read_text()
