"""The page of error against run time on records whose errors and times are chosen."""

import csv
import json
from html.parser import HTMLParser
from pathlib import Path

import pytest

from solver.studies.points import disturbed, outcome
from solver.studies.work_precision.description import read_study
from solver.studies.work_precision.figure import Looks, draw_figure
from solver.studies.work_precision.page import write_study
from solver.studies.work_precision.records import (
    TARGETS,
    Panel,
    TimedSolve,
    failures,
    lines,
    panels,
    read_points,
)
from tests.report.test_charts import specifications

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


@pytest.fixture
def study(tmp_path):
    text = (ROOT / "cases/study/templates/patch-2d.yaml").read_text()
    (tmp_path / "case.yaml").write_text(text)
    (tmp_path / "study.yaml").write_text(STUDY)
    return read_study(tmp_path / "study.yaml")


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


def test_the_quickest_treatment_is_marked_alone_where_it_is_clearly_ahead(panel):
    assert list(panel.quickest(1e-2)) == list(panel.quickest(1e-6)) == ["LAC"]
    assert panel.quickest(1e-17) == {}


@pytest.mark.parametrize(
    ("slower", "tied"),
    [([1.05] * 3, True), ([1.15] * 3, False), ([1.05, 1.3, 1.4], True), ([1.11, 1.3, 1.4], False)],
)
def test_times_that_noise_cannot_tell_apart_are_ties(study, slower, tied):
    """Three repetitions of 0.9, 1 and 1.1 times 0.1 s: a range up to 0.11 s, a tenth of noise."""
    points = [TimedSolve(record(p, 1e-4, 0.1), p) for p in study.points]
    for m in points:
        if m.point.treatment.name == "uncut":
            m.record["times"]["total"]["cpu"] = [0.1 * factor for factor in slower]
        if m.point.treatment.name == "nodal":
            m.record["times"]["total"]["cpu"] = [0.9]
    found = pressure(study, points).quickest(1e-3)
    assert list(found) == (["LAC", "whole faces"] if tied else ["LAC"])


def test_failures_are_listed_once_for_each_reason(study, results):
    [(why, what, where)] = failures(read_points(study, results))
    assert why == "refused: no such treatment of QUAD4 & others"
    assert (what, where) == ("nodal", "Patch, QUAD4–TRIA3: level 4")


def test_reasons_that_differ_in_numbers_alone_are_told_once(study):
    points = [
        TimedSolve(refusal(p) | {"reason": f"no end within {p.level}.5 s of TRIA3"}, p)
        for p in study.points[:3]
    ]
    [(why, _, where)] = failures(points)
    assert (why, where) == (
        "refused: no end within 1.5 s of TRIA3",
        "Patch, TRIA3–QUAD4: level 1, 2, 4",
    )


def test_a_line_is_broken_where_a_level_has_no_solve(study, results):
    (results / "patch/tria3-quad4/uncut/2.json").unlink()
    panel = pressure(study, read_points(study, results))
    first, second = draw_figure(panel, Looks(panel.lines))
    [gone] = [r for r in first.spec["data"]["values"] if r["error"] is None]
    assert (gone["series"], gone["level"]) == ("whole faces", 2)
    axes = [chart.spec["layer"][-1]["encoding"] for chart in (first, second)]
    assert axes[0]["x"] == axes[1]["x"]
    assert axes[0]["y"] == axes[1]["y"]
    assert "not measured" in failures(read_points(study, results))[0][0]


def test_no_two_treatments_look_alike(panel):
    looks = [Looks(panel.lines)[title] for title in panel.titles]
    assert len({(look.color, look.shape) for look in looks}) == 3
    assert len({(look.color, look.dashes) for look in looks}) == 3


class Text(HTMLParser):
    """The text of a page."""

    def __init__(self):
        super().__init__()
        self.parts = []

    def handle_data(self, data):
        self.parts.append(data)


def test_the_page_its_table_and_its_figures(study, results, tmp_path):
    said = write_study(study, results, tmp_path / "report")
    assert said.startswith("20 of 21 points are measured. 1 have no solve")
    text = Text()
    text.feed((tmp_path / "report/study.html").read_text())
    page = " ".join(" ".join(text.parts).split())
    assert "A <study>" in page
    assert "no such treatment of QUAD4 & others" in page
    assert "Choice of the linear solver" in page
    assert all(target in page for target in TARGETS.values())
    charts = specifications((tmp_path / "report/study.html").read_text())
    for name in ("patch-pressure-l2", "patch-displacement-l2", "linear-solver-patch-pressure-l2"):
        assert f"{name}-TRIA3-QUAD4" in charts
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
    write_study(study, results, tmp_path / "quiet")
    path = results / "patch/tria3-quad4/lac/1.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"load": 3.5}))
    write_study(study, results, tmp_path / "busy")
    quiet, busy = ((tmp_path / name / "study.html").read_text() for name in ("quiet", "busy"))
    assert "1 points began while the machine was busy" in busy
    assert "points began while" not in quiet
    assert disturbed(read_points(study, results)) == 1


def test_a_study_without_any_record_still_has_a_page(study, tmp_path):
    write_study(study, tmp_path / "nothing", tmp_path)
    page = (tmp_path / "study.html").read_text()
    assert "not measured" in page
    assert "No point of this problem is measured" in page
    assert outcome(read_points(study, tmp_path)).startswith("0 of 21")


def test_panels_share_their_problem_s_lines(panel):
    assert isinstance(panel, Panel)
    assert panel.pairs == ["TRIA3–QUAD4", "QUAD4–TRIA3"]
    assert panel.name == "patch-pressure-l2"
