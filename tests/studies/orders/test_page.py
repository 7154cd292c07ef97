"""The page of orders on ladders whose errors are known powers, and on ladders that fall short."""

import csv
import json
from html.parser import HTMLParser

import pytest
from msgspec import structs

from solver.commands.cli import main
from solver.report.html import NORMS
from solver.studies.orders import page as orders
from solver.studies.orders.description import read_ladders
from solver.studies.orders.page import write_orders
from solver.studies.orders.records import groups, read_curves
from tests.report.test_charts import specifications
from tests.report.verdicts import put as write

LADDERS = """
title: Powers of <h>
levels: [1, 2, 4, 8]
least: {linear: {displacement_l2: 1.9}, quadratic: {displacement_l2: 2.4}}
reference_code: {name: other_code, version: "7"}
ladders:
  - {case: tria3.yaml, reference_code: {displacement_l2: 1.75}}
  - {case: quad8.yaml}
  - {case: hexa27.yaml, levels: [1, 2, 3], problem: cube}
"""


BODY = {"faces": 4, "reference_cells": None, "reference_faces": None}


def put(folder, level, cells, dim, word="passed", **errors):
    """One verdict of a ladder with 4 macro-elements along each edge at level 1."""
    bodies = [("block", "slave", cells), ("die", "master", "QUAD4" if dim == 2 else "HEXA8")]
    verdict = {
        "verdict": word,
        "reason": "" if errors else "no mesh",
        "dofs": (4 * level) ** dim if errors else None,
        "macro_elements": (4 * level) ** (dim - 1) if errors else None,
        "bodies": [BODY | {"name": n, "role": r, "cells": {c: 9}} for n, r, c in bodies if errors],
        "errors": errors,
        "seconds": {"total": 1.0},
        "checks": [],
    }
    write(folder / str(level) / "verdict.json", verdict)


@pytest.fixture
def family(tmp_path):
    path = tmp_path / "cases" / "powers" / "orders.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(LADDERS)
    for name in ("tria3", "quad8", "hexa27"):
        (path.parent / f"{name}.yaml").touch()
    return read_ladders(path)


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results" / "powers"
    for level in (1, 2, 4, 8):
        put(folder / "tria3", level, "TRIA3", 2, displacement_l2=level**-1.5, pressure_l2=1 / level)
        put(folder / "quad8", level, "QUAD8", 2, displacement_l2=level**-3.0, pressure_l2=1e-14)
        put(folder / "quad8-swapped", level, "QUAD8", 2, displacement_l2=level**-2.5)
    for level in (1, 3):
        put(folder / "hexa27", level, "HEXA27", 3, displacement_l2=level**-3.0)
    put(folder / "hexa27", 2, "HEXA27", 3, word="refused")
    return folder.parent


@pytest.fixture
def page(family, results, tmp_path):
    return write_orders([family], results, tmp_path)


def read(path):
    with path.open() as stream:
        return list(csv.DictReader(stream))


def test_every_ladder_has_its_slopes_and_what_they_are_held_against(page, tmp_path):
    rows = {(row["ladder"], row["error"]): row for row in read(tmp_path / orders.SLOPES)}
    row = rows["tria3", "displacement_l2"]
    assert float(row["slope"]) == pytest.approx(1.5)
    assert (row["theory_least"], row["reference_code"], row["reached"]) == ("2.0", "1.75", "False")
    assert float(rows["quad8", "displacement_l2"]["slope"]) == pytest.approx(3)
    assert float(rows["quad8-swapped", "displacement_l2"]["slope"]) == pytest.approx(2.5)
    assert (rows["quad8", "pressure_l2"]["slope"], rows["quad8", "pressure_l2"]["rounding"]) == (
        "",
        "True",
    )


def test_levels_without_a_result_are_points_and_failures_too(page, tmp_path):
    points = {(row["ladder"], row["level"]): row for row in read(tmp_path / orders.POINTS)}
    assert len(points) == 4 + 4 + 4 + 3
    assert (points["hexa27", "2"]["verdict"], points["hexa27", "2"]["reason"]) == (
        "refused",
        "no mesh",
    )
    failures = (tmp_path / orders.FAILURES).read_text().splitlines()
    assert failures == [
        "powers/tria3: displacement, L2: 1.500 ± 0.000; at least 1.9 is asked for",
        "powers/hexa27: level 2: no mesh",
        "powers/hexa27: displacement, L2: not known; at least 2.4 is asked for",
    ]
    assert page.startswith("\n".join(failures))
    assert "2 of 4 slopes asked for are reached, on 4 ladders. 1 levels have no result." in page


def test_where_no_slope_is_asked_for_none_is_counted(family, results):
    asks_nothing = structs.replace(family, least={})
    curves = read_curves(asks_nothing, results)
    assert orders.outcome(curves).startswith("No slope is asked for, on 4 ladders")


def test_a_ladder_never_solved_is_missed(family, tmp_path):
    write_orders([family], tmp_path / "nothing", tmp_path)
    failures = (tmp_path / orders.FAILURES).read_text()
    assert "powers/tria3: levels 1, 2, 4, 8: not solved\n" in failures
    assert failures.count("not solved") == 3


def test_nothing_is_missed_where_all_is_reached(family, results, tmp_path):
    (tmp_path / "cases/powers/orders.yaml").write_text(
        "levels: [1, 2, 4, 8]\nleast: {quadratic: {displacement_l2: 2.4, pressure_l2: 1}}\n"
        "ladders: [{case: quad8.yaml}]\n"
    )
    family = read_ladders(tmp_path / "cases/powers/orders.yaml")
    swapped = [c for c in read_curves(family, results) if c.name == "quad8-swapped"]
    assert swapped[0].reached("pressure_l2") is False  # it has no pressure at all
    first = read_curves(family, results)[0]
    assert first.reached("pressure_l2")  # rounding is as good as any slope
    assert first.problems == []


def test_errors_at_the_finest_level_are_held_against_what_is_allowed(family, results, tmp_path):
    (tmp_path / "cases/powers/orders.yaml").write_text(
        "levels: [1, 2, 4, 8]\n"
        "ladders: [{case: tria3.yaml,"
        " finest: {pressure_l2: 0.125, displacement_l2: 0.01, peak: 1}}]"
    )
    (curve,) = read_curves(read_ladders(tmp_path / "cases/powers/orders.yaml"), results)
    assert curve.kept("pressure_l2")
    assert curve.kept("stress_l2") is None
    assert curve.problems == [
        "powers/tria3: displacement, L2: 4.4e-02; at most 0.01 is asked for at the finest level",
        "powers/tria3: peak pressure: not known; at most 1 is asked for at the finest level",
    ]


def test_levels_are_no_part_of_the_report_of_a_batch(results, tmp_path):
    put(tmp_path / "batch" / "fam", 1, "TRIA3", 2, displacement_l2=1.0)
    results.rename(tmp_path / "batch" / "orders")
    output = tmp_path / "report"
    assert main(["report", "--results", str(tmp_path / "batch"), "-o", str(output)]) == 0
    assert len(json.loads((output / "summary.json").read_text())) == 1


def test_sizes_are_those_of_macro_elements(family, results):
    curves = {curve.name: curve for curve in read_curves(family, results)}
    assert curves["tria3"].sizes == pytest.approx([1 / 4, 1 / 8, 1 / 16, 1 / 32])
    assert curves["hexa27"].sizes == pytest.approx([1 / 4, 1 / 12])


def test_problems_and_dimensions_are_drawn_apart(family, results):
    grouped = groups(read_curves(family, results))
    assert {title: len(members) for title, members in grouped.items()} == {
        "2D, slave: block": 3,
        "Cube: 3D, slave: block": 1,
    }


def test_the_pages_are_whole_and_escaped(page, tmp_path):
    overview, text = (
        (tmp_path / name).read_text() for name in (orders.PAGE, orders.page_of("powers"))
    )
    for html in (overview, text):
        assert "Powers of &lt;h&gt;" in html
        counter = Counter()
        counter.feed(html)
        assert counter.open == []
    assert 'href="summary.html"' in overview
    assert 'href="orders-powers.html"' in overview
    assert "1 without a result" in overview
    assert "2 of 4" in overview
    assert 'href="orders.html"' in text
    assert "1.500 ± 0.000" in text
    assert "other_code 1.750" in text
    charts = specifications(text)
    assert list(charts) == [
        *("powers-0-displacement_l2", "powers-0-pressure_l2"),
        "powers-1-displacement_l2",
    ]
    rows = charts["powers-0-displacement_l2"]["data"]["values"]
    found = {r["h"]: r["error"] for r in rows if r["series"] == "TRIA3"}
    assert found == pytest.approx({1 / (4 * n): n**-1.5 for n in (1, 2, 4, 8)})


def test_the_pages_of_large_families_are_small(tmp_path):
    """Twice the charts of the largest family (waves: 180), thrice its ladders (49) and levels."""
    problems, errors = range(17), list(NORMS)
    path = tmp_path / "cases" / "large" / "orders.yaml"
    path.parent.mkdir(parents=True)
    cells = ("TRIA3", "TRIA6", "QUAD4", "QUAD8", "QUAD9", "PYRA5", "HEXA8", "HEXA20", "TETRA4")
    ladders = []
    for problem in problems:
        for number, name in enumerate(cells):
            case = f"{name.lower()}-{problem}"
            (path.parent / f"{case}.yaml").touch()
            ladders.append({"case": f"{case}.yaml", "problem": f"problem {problem}"})
            for level in (1, 2, 4, 8, 16):
                found = dict.fromkeys(errors, level ** (-(1 + number / 7)))
                dim = 3 if number > 4 else 2
                put(tmp_path / "results" / "large" / case, level, name, dim, **found)
    path.write_text(json.dumps({"levels": [1, 2, 4, 8, 16], "ladders": ladders}))
    write_orders([read_ladders(path)], tmp_path / "results", tmp_path)
    text = (tmp_path / orders.page_of("large")).read_text()
    charts = specifications(text)
    assert len(charts) == 2 * len(problems) * len(errors)
    assert sum(len(chart["data"]["values"]) for chart in charts.values()) == 5 * len(errors) * len(
        ladders
    )
    sizes = [len(text.encode()), (tmp_path / orders.PAGE).stat().st_size]
    assert max(sizes) < 1_500_000


class Counter(HTMLParser):
    """Elements still open among those whose end has to be written."""

    WATCHED = ("section", "div", "table", "ul", "header", "p", "strong", "a")

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        if tag in self.WATCHED:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag in self.WATCHED:
            assert self.open.pop() == tag


def test_slopes_below_theory_are_told_with_the_reason_where_it_is_known(family, results, tmp_path):
    """Displacement 1.5 where theory has 2; 2.5 where it guarantees as much is not below."""
    below = [
        (curve.name, error)
        for curve in read_curves(family, results)
        for error in ("displacement_l2", "pressure_l2")
        if curve.below_theory(error)
    ]
    assert below == [("tria3", "displacement_l2")]
    write_orders([family], results, tmp_path)
    page = tmp_path / orders.page_of("powers")
    text = page.read_text()
    assert "1 slopes (▽) are below theory by more than their spread." in text
    assert "The reason is not known." in text
    path = tmp_path / "cases" / "powers" / "orders.yaml"
    path.write_text(LADDERS + "shortfalls: Few <levels>.\n")
    write_orders([read_ladders(path)], results, tmp_path)
    assert "Few &lt;levels&gt;.</p>" in page.read_text()


def test_a_label_tells_ladders_of_the_same_cells_apart(family, results):
    path = family.folder / "orders.yaml"
    path.write_text(LADDERS.replace("quad8.yaml", "quad8.yaml, label: QUAD8 <bent>"))
    labels = {c.name: c.label for c in read_curves(read_ladders(path), results)}
    assert (labels["tria3"], labels["quad8"]) == ("TRIA3", "QUAD8 <bent>")


def test_own_theory_takes_the_place_of_the_general_one(family, results, tmp_path):
    path = tmp_path / "cases" / "powers" / "orders.yaml"
    path.write_text(LADDERS + "theory: {quadratic: {pressure_l2: [1.5, null]}}\n")
    curve = next(c for c in read_curves(read_ladders(path), results) if c.name == "quad8")
    assert str(curve.theory("pressure_l2")) == "theory ≥ 1.5"
    assert str(curve.theory("displacement_l2")) == "theory 2.5 … 3"
    assert str(curve.theory("pressure_max")) == "theory ≤ 1"
    assert str(curve.theory("pressure_means")) == "theory –"
