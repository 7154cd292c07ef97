"""The page of error against run time on records whose errors and times are chosen."""

import csv
import json
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.report.measured import disturbed
from solver.report.svg import Drawing
from solver.studies.work_precision import words
from solver.studies.work_precision.description import read_study
from solver.studies.work_precision.figure import LIMIT, Looks, draw_figure
from solver.studies.work_precision.page import outcome, write_study
from solver.studies.work_precision.records import (
    TARGETS,
    Measured,
    Panel,
    failures,
    lines,
    panels,
    read_points,
)

ROOT = Path(__file__).parents[3]
STUDY = """
title: A <study>
threads: 1
repetitions: 3
limit: 60
treatments:
  - {name: lac, title: LAC, zone: {treatment: lac}}
  - {name: uncut, title: whole faces, zone: {treatment: uncut}}
  - {name: nodal, title: nodal, zone: {treatment: nodal}}
problems:
  - {name: patch, title: Patch, case: case.yaml, pairs: [[TRIA3, QUAD4], [QUAD4, TRIA3]],
     levels: [1, 2, 4]}
linear_solvers:
  - {problem: patch, pair: [TRIA3, QUAD4], treatment: lac, solvers: [superlu]}
"""
MACHINE = {"cpu": "a cpu", "revision": "abc", "python": "3", "time_utc": "2026-01-01T00:00:00"}


@cache
def any_study(folder):
    folder.mkdir(exist_ok=True)
    text = (ROOT / "cases/study/templates/patch-2d.yaml").read_text()
    (folder / "case.yaml").write_text(text)
    (folder / "study.yaml").write_text(STUDY)
    return read_study(folder / "study.yaml")


@pytest.fixture
def study(tmp_path):
    return any_study(tmp_path)


def record(point, error, seconds):
    """A solved point: three repetitions, a tenth more and a tenth less than `seconds`."""
    walls = [0.9 * seconds, seconds, 1.1 * seconds]
    half = [wall / 2 for wall in walls]
    return {
        "point": point.name,
        "outcome": "solved",
        "reason": "",
        "dofs": 100 * point.level**2,
        "macro_elements": 4 * point.level,
        "iterations": 1,
        "factor": "CHOLMOD",
        "errors": {"pressure_l2": error, "displacement_l2": error**2},
        "times": {
            "solve": {"wall": half, "cpu": half},
            "recovery": {"wall": half, "cpu": half},
            "total": {"wall": walls, "cpu": walls},
        },
        "process": {"wall": seconds + 1, "cpu": seconds + 0.5, "peak_memory_mb": 100.0},
        "machine": MACHINE,
        "threads": 1,
        "load": 0.3,
    }


def refusal(point):
    reason = f"no such treatment of {point.slave} & others"
    return {"point": point.name, "outcome": "refused", "reason": reason, "errors": {}, "times": {}}


def chosen(point):
    """LAC exact; whole faces of order 2; nodal of order 1, slower, and not on QUAD4 at level 4."""
    seconds = 0.1 * point.level
    if point.treatment.name == "lac":
        return record(point, 1e-15, seconds)
    if point.treatment.name == "uncut":
        return record(point, 4e-3 / point.level**2, 2 * seconds)
    if point.slave == "QUAD4" and point.level == 4:
        return refusal(point)
    return record(point, 0.02 / point.level, 3 * seconds)


@pytest.fixture
def results(study, tmp_path):
    for point in study.points:
        path = tmp_path / "records" / f"{point.name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(chosen(point)))
    return tmp_path / "records"


@pytest.fixture
def panel(study, results):
    return pressure(study, read_points(study, results))


def pressure(study, points):
    plain = [m for m in points if m.point.linear_solver == "auto"]
    return panels(study.problems[0], lines(plain))[0]


def test_the_cheapest_way_is_the_quickest_solve_that_is_accurate_enough(panel):
    cheapest = panel.cheapest("whole faces", 1e-3)
    assert (cheapest.point.level, cheapest.time.median) == (2, pytest.approx(0.4))
    assert panel.cheapest("whole faces", 1e-4) is None
    assert [title for title, _ in panel.ranked(1e-2)] == ["LAC", "whole faces", "nodal"]
    assert [title for title, _ in panel.ranked(1e-6)] == ["LAC"]


def test_an_accuracy_lost_again_on_a_finer_mesh_is_not_reached(study, results):
    points = read_points(study, results)
    for m in points:
        if m.point.treatment.name == "uncut" and m.point.level == 4:
            m.record["errors"]["pressure_l2"] = 2e-3
    panel = pressure(study, points)
    assert panel.cheapest("whole faces", 1e-3) is None
    assert panel.cheapest("whole faces", 1e-2).point.level == 1


def test_orders_are_observed_level_by_level(panel):
    whole, nodal = (panel.of(title)[0] for title in ("whole faces", "nodal"))
    assert whole.order("pressure_l2").value == pytest.approx(2)
    assert nodal.order("pressure_l2").value == pytest.approx(1)
    assert panel.of("LAC")[0].order("pressure_l2") is None
    assert panel.of("LAC")[0].at_round_off("pressure_l2")


def test_the_paragraph_tells_the_chosen_numbers(panel):
    text = words.paragraph(panel)
    assert text.startswith("LAC reaches 0.1 % soonest, in 0.1 s (TRIA3–QUAD4, level 1); ")
    assert "whole faces is next and takes 4 times as long, 0.4 s (TRIA3–QUAD4, level 2)." in text
    assert "Nodal (0.5 %) does not" in text
    assert "LAC is at round-off (below 1.0e-11) at every level of every pair" in text
    assert "between 1.0e-15 (LAC, TRIA3–QUAD4) and 0.5 % (nodal, TRIA3–QUAD4)" in text
    assert "1 of 18 points have no solve" in text


def test_times_within_the_spread_are_not_told_apart(study, results):
    points = read_points(study, results)
    for m in points:
        if m.solved and m.point.treatment.name == "uncut":
            m.record["times"]["total"]["wall"] = [0.05 * m.point.level] * 2 + [0.5]
            m.record["errors"]["pressure_l2"] = 1e-4
    text = words.paragraph(pressure(study, points))
    assert text.startswith("Whole faces reaches 0.1 % soonest, in 50 ms")
    assert "LAC is next with 0.1 s (TRIA3–QUAD4, level 1), no later within the spread" in text


def test_where_none_is_accurate_enough_the_nearest_is_told(study, results):
    points = [m for m in read_points(study, results) if m.point.treatment.name == "nodal"]
    text = words.paragraph(pressure(study, points))
    assert text.startswith("None reaches 0.1 %; nodal comes nearest with 0.5 % on its finest mesh.")
    assert "soonest" not in text
    assert "never" not in text


def test_errors_that_do_not_differ_are_told_once(study, results):
    points = [m for m in read_points(study, results) if m.solved]
    for m in points:
        m.record["errors"]["pressure_l2"] = 0.009 * (1 + 1e-6 * m.point.level)
    text = words.paragraph(pressure(study, points))
    assert text.startswith("None reaches 0.1 %; all come to 0.9 % on their finest mesh.")
    assert "between" not in text


def test_hardly_longer_is_no_number_of_times(study, results):
    points = read_points(study, results)
    for m in (m for m in points if m.solved):
        slower = {"lac": 1.0, "uncut": 1.02}.get(m.point.treatment.name, 9.0)
        m.record["times"]["total"]["wall"] = [0.1 * slower * m.point.level] * 3
        m.record["errors"]["pressure_l2"] = 1e-4
    text = words.paragraph(pressure(study, points))
    assert "whole faces is next and takes little longer, 0.1 s (TRIA3–QUAD4, level 1)." in text


# Chosen values make ties and values at the very limit likely.
ERROR = st.one_of(st.floats(1e-17, 10), st.sampled_from([1e-12, LIMIT, 0.5]))
SECONDS = st.one_of(st.floats(1e-4, 1e3), st.sampled_from([1.0, 2.0]))


@settings(max_examples=60)
@given(st.lists(st.tuples(ERROR, SECONDS), min_size=18, max_size=18))
def test_whatever_the_numbers_the_sentences_are_true(tmp_path_factory, numbers):
    study = any_study(tmp_path_factory.getbasetemp() / "any")
    plain = [p for p in study.points if p.linear_solver == "auto"]
    points = [
        Measured(p, record(p, error, seconds))
        for p, (error, seconds) in zip(plain, numbers, strict=True)
    ]
    text = words.paragraph(pressure(study, points))
    curves = [points[i : i + 3] for i in range(0, 18, 3)]
    good = [
        m
        for curve in curves
        for i, m in enumerate(curve)
        if all(finer.error("pressure_l2") <= LIMIT for finer in curve[i:])
    ]
    if good:
        soonest = min(m.time.median for m in good)
        when = words.seconds(soonest)
        titles = {m.point.treatment.title for m in good if m.time.median == soonest}
        starts = [f"{t[:1].upper()}{t[1:]} reaches 0.1 % soonest, in {when} (" for t in titles]
        assert text.startswith(tuple(starts))
    else:
        assert text.startswith("None reaches 0.1 %")
    for title in ("LAC", "whole faces", "nodal"):
        mine = [m.error("pressure_l2") for m in points if m.point.treatment.title == title]
        finest = [c[-1].error("pressure_l2") for c in curves if c[0].point.treatment.title == title]
        never = f"{title} ({words.percent(min(finest))})"
        reached = any(m.point.treatment.title == title for m in good)
        assert (never.lower() in text.lower()) == (bool(good) and not reached)
        exact = text.partition("at round-off")[0].rpartition(". ")[2]
        assert (title.lower() in exact.lower() and "at round-off" in text) == (max(mine) <= 1e-11)


def test_failures_are_listed_once_for_each_reason(study, results):
    [(why, what, where)] = failures(read_points(study, results))
    assert why == "refused: no such treatment of QUAD4 & others"
    assert (what, where) == ("nodal", "Patch, QUAD4–TRIA3: level 4")


def test_reasons_that_differ_in_numbers_alone_are_told_once(study):
    points = [
        Measured(p, refusal(p) | {"reason": f"no end within {p.level}.5 s of TRIA3"})
        for p in study.points[:3]
    ]
    [(why, _, where)] = failures(points)
    assert (why, where) == (
        "refused: no end within 1.5 s of TRIA3",
        "Patch, TRIA3–QUAD4: level 1, 2, 4",
    )


def test_a_line_is_broken_where_a_level_has_no_solve(study, results):
    gone = results / "patch/tria3-quad4/uncut/2.json"
    whole = draw(study, results)
    gone.unlink()
    broken = draw(study, results)
    style = 'stroke="#d55e00" stroke-width="17"'
    # One in the legend, one a pair.
    assert sum(style in part for part in whole) == 1 + 2
    assert sum(style in part for part in broken) == 1 + 3
    assert "not measured" in failures(read_points(study, results))[0][0]


def draw(study, results):
    panel = pressure(study, read_points(study, results))
    drawing = draw_figure(panel, Looks(panel.lines))
    return [ET.tostring(part, encoding="unicode") for part in ET.fromstring(drawing)]


@pytest.mark.parametrize("uncertainty", [LIMIT / 1.1, LIMIT, LIMIT * 1.1, LIMIT * 100])
def test_labels_at_the_right_keep_apart(panel, monkeypatch, uncertainty):
    monkeypatch.setattr(Panel, "uncertainty", uncertainty)
    drawing = ET.fromstring(draw_figure(panel, Looks(panel.lines)))
    texts = {"".join(t.itertext()): float(t.get("y")) for t in drawing.iter() if t.get("y")}
    limit, reference = texts["0.1 %"], texts["reference ±"]
    assert abs(limit - reference) >= 12


def test_no_two_treatments_look_alike(panel):
    looks = Looks(panel.lines)
    keys = set()
    for title in panel.titles:
        drawing = Drawing(50, 14, "key")
        looks.draw_marks(drawing, title, np.zeros((1, 2)))
        keys.add((drawing.svg(), str(looks.line(title))))
    assert len({mark for mark, _ in keys}) == len({line for _, line in keys}) == 3


class Text(HTMLParser):
    """The text of a page."""

    def __init__(self):
        super().__init__()
        self.parts = []

    def handle_data(self, data):
        self.parts.append(data)


def test_the_page_its_table_and_its_figures(study, results, tmp_path):
    said = []
    write_study(study, results, tmp_path / "report", said.append)
    assert said[0].startswith("20 of 21 points are measured. 1 have no solve")
    text = Text()
    text.feed((tmp_path / "report/study.html").read_text())
    page = " ".join(" ".join(text.parts).split())
    assert "A <study>" in page
    assert "no such treatment of QUAD4 & others" in page
    assert "Choice of the linear solver" in page
    assert all(target in page for target in TARGETS.values())
    assert words.paragraph(pressure(study, read_points(study, results))) in page
    for name in ("patch-pressure-l2", "patch-displacement-l2", "linear-solver-patch-pressure-l2"):
        ET.parse(tmp_path / f"report/study/{name}.svg")

    with (tmp_path / "report/study.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(study.points)
    row = next(
        r for r in rows if (r["treatment"], r["slave"], r["level"]) == ("uncut", "TRIA3", "2")
    )
    keys = ("pressure_l2", "total_wall_median", "total_wall_low", "solve_cpu_high")
    values = [float(row[key]) for key in keys]
    assert values == pytest.approx([1e-3, 0.4, 0.36, 0.22])
    assert [r["reason"] for r in rows if r["outcome"] != "solved"] == [
        "no such treatment of QUAD4 & others"
    ]


def test_points_begun_on_a_busy_machine_are_counted_and_warned_of(study, results, tmp_path):
    write_study(study, results, tmp_path / "quiet", lambda line: None)
    path = results / "patch/tria3-quad4/lac/1.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"load": 3.5}))
    write_study(study, results, tmp_path / "busy", lambda line: None)
    quiet, busy = ((tmp_path / name / "study.html").read_text() for name in ("quiet", "busy"))
    assert "1 points began while other work kept the machine busy" in busy
    assert "points began while" not in quiet
    assert disturbed([m.record for m in read_points(study, results) if m.solved]) == 1


def test_a_study_without_any_record_still_has_a_page(study, tmp_path):
    write_study(study, tmp_path / "nothing", tmp_path, lambda line: None)
    page = (tmp_path / "study.html").read_text()
    assert "not measured" in page
    assert "No point of this problem is measured" in page
    assert outcome(read_points(study, tmp_path)).startswith("0 of 21")


def test_numbers_in_sentences():
    assert words.listed(["a"]) == "a"
    assert words.listed(["a", "b", "c"]) == "a, b and c"
    assert [words.seconds(t) for t in (0.0123, 0.123, 1.23, 123.4)] == [
        "12 ms",
        "0.12 s",
        "1.2 s",
        "123 s",
    ]
    assert [words.percent(e) for e in (0.0123, 1e-5, 25.0)] == ["1.2 %", "1.0e-05", "2500 %"]


def test_panels_share_their_problem_s_lines(panel):
    assert isinstance(panel, Panel)
    assert panel.pairs == ["TRIA3–QUAD4", "QUAD4–TRIA3"]
    assert panel.name == "patch-pressure-l2"
