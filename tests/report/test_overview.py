"""The first screen of the report: its sentence, charts, and tables."""

import json
import math

import pytest

from solver.report import cards, formats
from solver.report import page as overview
from solver.report.charts import RED
from solver.report.families import Family
from solver.report.rows import Row
from solver.report.sections import FamilySection
from solver.system.files import write_text
from solver.verification.savings import Savings
from tests.report.test_report import CHECK, verdict
from tests.report.verdicts import record


def row(job, folder, word="passed", judged="exact", error=1e-14, **more):
    worst = CHECK | {"error": error}
    content = verdict(job, word, judged=judged, worst=worst, checks=[worst], **more)
    return Row(record(content), folder)


@pytest.fixture
def rows(tmp_path):
    plan = [["no second solve", "the first status holds", "status"], ["by a factor", "small", ""]]
    return [
        row("a", tmp_path, accuracy={"gap": 1e-9, "sums": 1e-15}, attainable=1e-9, plan=plan),
        row("b", tmp_path, judged="expected error", error=2e-2, attainable=1e-13, plan=plan),
        row("c", tmp_path, word="failed", error=0.5, reason="wrong", judged="", plan=plan[1:]),
        row("d", tmp_path, family="other", error=3e-13),
    ]


def test_the_sentence_says_how_well(rows):
    assert overview.in_words(rows) == (
        "Of 4 solves on 2 cell types, 2 reach an exact answer, with errors up to 3.0e-13 "
        "(multiplier); 1 have the error that refined meshes predict, at most 2 % (multiplier)."
    )


def test_every_solve_is_a_mark_that_leads_to_it(rows):
    chart = overview.error_chart(rows)
    marks = {mark["case"]: mark for mark in chart.spec["data"]["values"]}
    assert {name: mark["series"] for name, mark in marks.items()} == {
        "a": "exact",
        "b": "expected error",
        "c": "not passed",
        "d": "exact",
    }
    assert marks["c"]["error"] == 0.5
    assert marks["c"]["seconds"] == 0.75
    assert marks["d"]["url"] == "other.html#other/d"
    assert marks["a"]["cells"] == "QUAD4 TRIA3"
    picks = {pick["name"]: pick["bind"]["options"] for pick in chart.spec["params"]}
    assert picks == {"pick_family": ["", "fam", "other"], "pick_cells": ["", "QUAD4", "TRIA3"]}


def test_the_digits_are_those_of_the_estimate(rows):
    kept = {r.name: overview.digits_kept(r) for r in overview.fewest_digits(rows)}
    assert kept == pytest.approx({"a": 9.0, "b": 13.0})
    assert list(kept) == ["a", "b"]
    assert overview.cause(rows[0]) == overview.CAUSES["gap"]
    marks = overview.digit_chart(rows).spec["data"]["values"]
    assert [mark["digits"] for mark in marks] == pytest.approx([9.0, 13.0])


def test_an_estimate_of_nothing_keeps_all_digits_of_doubles(tmp_path):
    assert overview.digits_kept(row("x", tmp_path, attainable=1e-30)) == -math.log10(2.0**-52)


def test_work_left_out_is_counted_by_family(rows, tmp_path):
    saved = {"jobs": ["a"], "seconds": 9.0, "cost": 2.0, "lean": 1.0, "everything": 1.5}
    write_text(tmp_path / "saved" / "fam.json", json.dumps(saved))
    write_text(tmp_path / "saved" / "other.json", "null")
    found = overview.left_out_by_family(rows, tmp_path)
    time = Savings(**saved)
    assert time.saved == 2.25
    assert found == {"fam": (3, [0, 0, 2], time), "other": (1, [0, 0, 0], None)}


@pytest.mark.parametrize(("status", "is_one"), [([1, 1], True), ([0, 1], False), ([0, 0], False)])
def test_a_column_of_ones_is_left_out(tmp_path, status, is_one):
    section = FamilySection(
        Family("t", name="t"), [row("a", tmp_path, status=status)], tmp_path, False
    )
    assert section.is_one("status") == is_one


def test_round_off_of_a_gap_is_zero():
    assert formats.both([-1e-16, 2e-16], 50.0) == ["0"]
    assert formats.both([1e-9, 0.5], 50.0) == ["1.0e-09", "0.5"]


def test_without_solves_there_is_nothing_to_show():
    assert overview.in_words([]) == ""
    assert overview.error_chart([]) is None
    assert overview.digit_chart([]) is None


CARD = {
    "page": "stability",
    "level": "full",
    "measured": "2 of 2 points are measured.",
    "facts": [["Machine", "a machine"], ["Revision", "abc"]],
    "quantities": {"far": {"map": "map-far", "digits": {"2D": [14, 3], "3D": [12, None]}}},
}


def test_a_card_shows_ones_own_study_else_a_part_of_it_else_the_recorded_one(tmp_path):
    recorded = cards.study_card("stability", tmp_path)
    assert recorded.link == ""
    assert recorded.remark.startswith("Recorded: ")
    quick = CARD | {"level": "quick", "page": "stability-quick"}
    (tmp_path / "stability-quick-card.json").write_text(json.dumps(quick))
    part = cards.study_card("stability", tmp_path)
    assert part.link == "stability-quick.html"
    assert part.remark.startswith("a part of the study: quick.")
    (tmp_path / "stability-card.json").write_text(json.dumps(CARD))
    own = cards.study_card("stability", tmp_path)
    assert (own.link, own.remark) == ("stability.html", CARD["measured"])


@pytest.mark.parametrize("name", ["study", "stability"])
def test_the_recorded_studies_say_where_they_were_measured(name):
    content = json.loads((cards.RECORDED / f"{name}.json").read_text())
    assert {"Measured", "Machine", "Revision"} <= dict(content["facts"]).keys()
    assert content["level"] == "full"
    assert content["problems" if name == "study" else "quantities"]


@pytest.mark.parametrize(("digits", "color"), [(15, "#0b5d57"), (5, "#f3d28b"), (None, RED)])
def test_more_digits_are_darker_and_none_are_red(digits, color):
    assert cards.shade(digits) == color


@pytest.mark.parametrize(
    ("value", "text"), [(0.23, "23 %"), (1e-3, "0.1 %"), (2e-12, "2.0e-12"), (math.nan, "–")]
)
def test_errors_are_percent_where_people_say_so(value, text):
    assert formats.percent(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.012, "12 ms"), (-0.012, "-12 ms"), (-0.44, "-0.44 s"), (-1.4, "-1.4 s"), (-14.2, "-14 s")],
)
def test_a_saving_may_be_a_loss(value, text):
    assert formats.duration(value) == text
