"""Figures of studies from records made by hand: slopes, gains, treatments, growth, ratios."""

import csv
import io
import math

import pytest

from solver.studies.description import read_study
from solver.studies.figures import growth, inf_sup, orders, profiles, ratios, work_precision
from solver.studies.measures import attempt, profile
from solver.studies.page import read_group, write_page
from solver.studies.points import points_of
from solver.studies.run import run_group, write_group
from solver.studies.theory import THEORY, element_size
from tests.studies.measured import INFSUP, group, study

ORDERS = """
name: small
title: Small & short
figure: orders
smooth: true
set: {mesh: {refine: "=level"}}
least: {linear: {displacement_l2: 1.9}}
axes:
  recovery:
    none: {title: constants, set: {contact: {recovery: none}}}
    automatic: {title: recovered, set: {contact: {recovery: automatic}}}
groups:
  - name: ladder
    vary: {recovery: [none, automatic], level: [1, 2, 4]}
    series: [{name: TRIA3, case: tria3.yaml, finest: {peak: 0.01}, observed: {pressure_l2: 1.04}}]
"""


def ladder(order=2.0, gain=4.0, peak=0.005):
    """Levels whose displacement falls with `order`; recovery gains `gain` on the finest level."""

    def record(point):
        level = point.numbers["level"]
        better = gain * level / 4 if point.labels["recovery"] == "automatic" else 1.0
        errors = {"displacement_l2": level**-order, "pressure_l2": 0.1 / level / better}
        numbers = {"dofs": 100 * level, "macro_elements": int(10 * level), "dim": 2}
        more = {
            "slave": ["TRIA3"],
            "errors": errors | {"peak": peak},
            "pressure_error_estimate": 0.02,
        }
        return numbers | more

    return record


def shown(*arguments):
    of = study(ORDERS)
    return orders.show(of, [group(of, ladder(*arguments))])


def test_slopes_that_are_reached_and_errors_that_are_kept():
    page = shown()
    assert page.problems == []
    assert (
        page.outcome
        == "2 of 2 slopes asked for are reached, on 2 ladders; 2 of 2 errors at finest levels."
    )


def test_slopes_and_errors_that_are_not():
    assert shown(1.5).problems[0] == (
        "ladder/TRIA3, constants: displacement, L2: 1.500 ± 0.000; at least 1.9 is asked for"
    )
    assert "at most 0.01 is asked for at the finest level" in shown(2.0, 4.0, 0.02).problems[0]


def test_levels_without_a_result_are_problems():
    of = study(ORDERS)
    lost = group(of, lambda _: {"outcome": "failed", "reason": "singular"})
    assert (
        "ladder/TRIA3, constants: TRIA3, constants/1: failed: singular"
        in orders.show(of, [lost]).problems
    )


def test_slopes_below_theory_are_marked():
    """Theory guarantees order 2 of the displacement in L2 on linear cells."""
    [section] = [s for s in shown(1.95).sections if s.name == "shortfalls"] or [None]
    assert section is None
    [section] = [s for s in shown(1.8).sections if s.name == "shortfalls"]
    assert section.text.startswith("2 slopes (▽) are below theory")


def test_gain_and_order_between_the_last_two_levels():
    """Constants fall with order 1, the recovered pressure with 2; on 40 faces goals are judged."""
    table = shown().sections[-1].tables[0]
    cells = [str(cell) for cell in table.rows[0].cells]
    assert cells[:5] == ["TRIA3", "automatic", "Ladder", "40", "6.3e-03"]
    assert "<span class=reached>2.00</span>" in cells[5]
    assert "<span class=reached>4</span>" in cells[6]
    low = str(shown(2.0, 2.0).sections[-1].tables[0].rows[0].cells[6])
    assert "<span class=low>2</span><span class=under>goal ≥ 2.5" in low


def test_size_of_macro_elements_and_theory():
    assert element_size(8, 2) == pytest.approx(1 / 8)
    assert element_size(64, 3) == pytest.approx(1 / 8)
    for known in THEORY.values():
        assert all(o.least is None or o.least <= o.best for o in known.values())


WORK = """
name: work
title: Work
figure: work_precision
measure: timed
set: {mesh: {refine: "=level"}}
axes: {treatment: {lac: {title: LAC}, nodal: {title: nodal}, slow: {title: slow}}}
groups:
  - {name: patch, vary: {treatment: [lac, nodal, slow], level: [1, 2, 4]},
     series: [{name: QUAD4–QUAD8, case: quad4.yaml}]}
"""


def timed(point, errors, seconds):
    level = {1: 0, 2: 1, 4: 2}[point.numbers["level"]]
    time = seconds[point.labels["treatment"]] * 2**level
    total = {"wall": [time, time, 1.01 * time], "cpu": [time, time, 1.01 * time]}
    record = {"errors": {"pressure_l2": errors[point.labels["treatment"]][level]}, "dofs": 100}
    record |= {"times": {"total": total, "solve": total}, "threads": 1, "load": 0.1}
    return record | {"linear_solver": "CHOLMOD", "process": {"peak_memory_mb": 80.0}}


ERRORS = {"lac": [0.02, 0.005, 1e-3], "nodal": [9e-3, 0.02, 1e-4], "slow": [1e-3, 1e-4, 1e-5]}
SECONDS = {"lac": 0.1, "nodal": 0.1, "slow": 1.0}


def panel(seconds=SECONDS, errors=ERRORS):
    of = study(WORK)
    return work_precision.Panel(group(of, lambda p: timed(p, errors, seconds)), "pressure_l2")


def test_the_cheapest_way_is_the_quickest_solve_that_is_accurate_enough():
    assert panel().cheapest("LAC", 1e-2)["name"].endswith("/2")
    assert panel().cheapest("LAC", 1e-4) is None


def test_an_accuracy_lost_again_on_a_finer_mesh_is_not_reached():
    assert panel().cheapest("nodal", 1e-2)["name"].endswith("/4")


def test_treatments_within_noise_are_tied():
    assert list(panel().quickest(1e-2)) == ["LAC"]
    assert list(panel(SECONDS | {"nodal": 0.05}).quickest(1e-2)) == ["LAC", "nodal"]
    assert list(panel(SECONDS | {"nodal": 0.054}).quickest(1e-2)) == ["LAC", "nodal"]
    assert list(panel(SECONDS | {"nodal": 0.056}).quickest(1e-2)) == ["LAC"]


def test_the_page_of_work_and_a_line_that_is_broken(tmp_path):
    of = study(WORK)

    def record(point):
        if point.name.endswith("LAC/2"):
            return {"outcome": "failed", "reason": "no <end>"}
        return timed(point, ERRORS, SECONDS)

    measured = group(of, record)
    said = write_page(of, [measured], tmp_path)
    assert "8 of 9 points are measured. 1 have no result" in said
    text = (tmp_path / "work.html").read_text()
    assert "no &lt;end&gt;" in text
    assert "★" in text
    rows = list(csv.DictReader(io.StringIO((tmp_path / "work.csv").read_text())))
    assert [row["outcome"] for row in rows].count("failed") == 1
    [chart] = work_precision.draw(panel(), work_precision.looks_of(measured))
    assert len({r["series"] for r in chart.spec["data"]["values"]}) == 3


def test_no_two_treatments_look_alike():
    of = study(WORK)
    looks = work_precision.looks_of(group(of, lambda p: timed(p, ERRORS, SECONDS)))
    assert len(set(looks.values())) == 3


SCALING = """
name: scaling
title: Growth
figure: growth
measure: process
fit: [1000, 4000]
goals:
  - {title: Time, series: A, at: large, what: cpu, most: 5, unit: s, others: {other: 9}}
  - {title: Exponent, series: A, what: growth of whole, most: 0.9}
  - {title: Ratio, series: B, at: large, what: cpu, over: A, most: 3}
  - {title: Absent, series: A, at: huge, what: wall, most: 1}
groups:
  - {name: a, vary: {size: {small: 1, middle: 2, large: 4}},
     series: [{name: A, case: quad4.yaml}, {name: B, case: quad4.yaml, threads: 1}]}
"""


def cost(point, verdict="passed"):
    size, factor = point.numbers["size"], 2.0 if point.series.name == "B" else 1.0
    cpu = factor * size
    record = {"dofs": 1000 * size, "faces": 10 * size, "matrix_entries": 1, "iterations": 2}
    record |= {"process": {"wall": cpu, "cpu": cpu, "peak_memory_mb": 100.0 * size}}
    stages = {"solve": cpu / 2, "pairing": cpu / 4}
    record |= {"stage_cpu_seconds": stages, "seconds": stages, "linear_iterations": 3}
    record |= {"meshing": {"wall": 0.1}, "linear_solver": "multigrid", "verdict": verdict}
    return record | {"errors": {"pressure_max": 1e-12}, "threads": 3 - int(factor), "load": 0}


def test_exponents_goals_and_speed_ups():
    of = study(SCALING)
    page = growth.show(of, [group(of, cost)])
    assert page.problems == []
    assert "2 of 3 goals measured here are reached" in page.outcome
    measured = [str(row.cells[3]) for row in page.sections[0].tables[0].rows]
    assert measured[0] == "<span class=reached>4 s</span>"
    assert measured[1] == "<span class=short>1 </span>"
    assert measured[2] == "<span class=reached>2 </span>"
    assert measured[3] == "not in this part of the study"
    exponents, ups = page.sections[1].tables
    [points] = page.sections[2].tables
    assert exponents.rows[0].cells[1:3] == ["1,000 … 4,000", "1.00 ± 0.00"]
    assert len(points.rows) == 6
    assert [row.cells[1:3] for row in ups.rows] == [["1 → 2", "2.00"]] * 3


def test_points_whose_checks_fail_are_listed():
    of = study(SCALING)
    page = growth.show(of, [group(of, lambda p: cost(p, "failed"))])
    assert len(page.problems) == 6


RATIOS = """
{name: bench, title: Ratios, figure: ratios, measure: timed,
 axes: {way: {one: {title: one}, two: {title: two}, other: {title: other}}},
 groups: [{name: g, vary: {way: [one, two, other]}, series: [{name: S, case: quad4.yaml}]}]}
"""


def test_a_ways_time_is_the_median_of_its_repetitions_else_of_the_process():
    of = study(RATIOS)

    def record(point):
        way = point.labels["way"]
        if way == "other":
            return {"outcome": "missing", "reason": "not installed"}
        known = {
            "process": {"cpu": 3.0, "peak_memory_mb": 100.0},
            "dofs": 100,
            "linear_solver": "L",
        }
        times = {"times": {"total": {"cpu": [2.0, 6.0, 4.0]}}} if way == "two" else {}
        return known | times | {"errors": {"pressure_max": 1e-12}}

    measured = group(of, record)
    page = ratios.show(of, [measured])
    assert page.problems == []  # a code that is not installed is no failure
    rows = page.sections[0].tables[0].rows
    assert [row.cells[2:4] for row in rows[:2]] == [["3.00 s", "1.00"], ["4.00 s", "1.33"]]
    assert rows[2].cells[1] == "missing: not installed"
    assert "3.00 s" in page.sections[0].tables[0].text()


def test_the_order_is_the_power_of_the_face_size():
    points = [{"numbers": {"level": n}, "constant": 0.3 * n**-0.5} for n in (2, 4, 8)]
    assert inf_sup.falls_with(points) == pytest.approx(0.5)
    assert not inf_sup.levels_off(points)
    assert inf_sup.levels_off([p | {"constant": 0.3} for p in points])
    assert math.isnan(inf_sup.falls_with([p | {"constant": 1e-9} for p in points]))


def test_the_cut_alone_has_to_level_off():
    of = read_study(INFSUP, "quick")

    def record(point):
        falling = 0.4 if point.labels["cut"] == "lac" else 0.8 / point.numbers["level"]
        return {"constant": falling, "dofs": 10, "macro_elements": 3}

    page = inf_sup.show(of, [group(of, record)])
    assert page.problems == []
    bad = group(of, lambda point: {"constant": 0.8 / point.numbers["level"], "dofs": 1})
    assert all("β_h falls with order 1.00" in line for line in inf_sup.show(of, [bad]).problems)
    assert len(inf_sup.show(of, [bad]).problems) == 5


def block(cells, cut, contact):
    of = read_study(INFSUP, "quick")
    points = points_of(of, of.group("half-loaded"))
    return next(p for p in points if p.line.startswith(f"{cells}, {cut}, {contact}"))


@pytest.mark.parametrize("cells", ["TRIA3", "QUAD4", "QUAD8"])
def test_the_pressure_does_not_oscillate_with_the_cut(cells):
    assert profiles.oscillation(profile(block(cells, "LAC", "bilateral"))) < 0.1
    assert profiles.oscillation(profile(block(cells, "LAC", "opening"))) < 0.15


@pytest.mark.parametrize("cells", ["TRIA3", "QUAD4"])
def test_it_oscillates_without_the_cut(cells):
    assert profiles.oscillation(profile(block(cells, "uncut", "bilateral"))) > 0.5


def test_contact_that_opens_does_not_pull_and_carries_the_load():
    bilateral, opening = (profile(block("QUAD8", "LAC", c)) for c in ("bilateral", "opening"))
    assert min(bilateral["pressure"]) < 0 <= min(opening["pressure"])
    # The load of 25 on a length of 1, over 32 faces of a length of 1/16.
    for one in (bilateral, opening):
        assert sum(one["pressure"]) / 25 / 16 == pytest.approx(1.0, rel=1e-12)
    assert profiles.oscillation({"pressure": [0.0, 25.0, 0.0, -25.0]}) == 2.0


def test_an_oscillating_pressure_is_a_problem():
    of = read_study(INFSUP, "quick")
    [one] = [g for g in of.groups if g.name == "half-loaded"]
    number = of.groups.index(one)
    bad = group(of, lambda _: {"place": [0, 1, 2], "pressure": [0, 25, 0]}, number)
    assert len(profiles.show(of, [bad]).problems) == 10  # of five cells, bilateral and opening


def test_from_file_to_record_and_back(tmp_path):
    file = tmp_path / "study.yaml"
    file.write_text(ORDERS.replace("tria3.yaml", "case.yaml").replace("[1, 2, 4]", "[1]"))
    from tests.studies.measured import CASES

    text = (CASES / "manufactured/tria3.yaml").read_text()
    (tmp_path / "case.yaml").write_text(text.replace("[16, 16]", "[4, 4]"))
    of = read_study(file)
    assert write_group(of, "ladder", tmp_path / "ladder.json", file, "full").startswith(
        "ladder: 2 of 2"
    )
    again = read_group(of, of.groups[0], tmp_path)
    assert [p["outcome"] for p in again.points] == ["solved", "solved"]
    assert again.points[0]["slave"] == ["TRIA3"]
    (tmp_path / "ladder.json").write_text("{}")
    assert [p["reason"] for p in read_group(of, of.groups[0], tmp_path).points] == [
        "not measured"
    ] * 2


def test_a_timed_point_is_measured_in_a_process_of_its_own(tmp_path):
    from tests.studies.measured import CASES

    file = CASES / "studies" / "study.yaml"
    quick = read_study(file, "quick")
    patch = next(g for g in quick.groups if g.name == "patch-2d")
    name = points_of(quick, patch)[0].name
    from solver.studies.timing import measure_apart

    job = {"study": str(file), "level": "quick", "group": "patch-2d", "point": name}
    record = measure_apart(job, [0], 60.0)
    assert record["outcome"] == "solved", record["reason"]
    assert len(record["times"]["total"]["cpu"]) == quick.repetitions
    assert record["errors"]["pressure_max"] < 1e-12
    assert record["process"]["peak_memory_mb"] > 10
    assert measure_apart(job, [0], 0.01)["reason"] == "no end within 0.01 s"


def test_what_is_refused_is_recorded(tmp_path):
    text = ORDERS.replace("set: {mesh", "set: {plane: bent, mesh").replace("[1, 2, 4]", "[1]")
    of = study(text)
    record = run_group(of, of.groups[0])
    assert {p["outcome"] for p in record["points"]} == {"refused"}
    assert attempt(lambda: {"dofs": 1})["outcome"] == "solved"


def test_a_process_from_mesh_to_verdict():
    of = study(SCALING.replace("{small: 1, middle: 2, large: 4}", "{small: 1}"))
    record = run_group(of, of.groups[0])["points"][0]
    assert record["outcome"] == "solved", record["reason"]
    assert record["verdict"] == "passed"
    assert record["process"]["cpu"] > 0
    assert record["faces"] > 0
