"""Charts: what a specification holds, what a page embeds, and what a browser makes of it."""

import json
import re
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import unquote

import pytest

from solver.report import charts
from solver.report.charts import (
    BLUE,
    EPSILON,
    ORANGE,
    SCRIPT,
    Axis,
    Look,
    distinct,
    floor_band,
    level,
    series_chart,
    slopes,
    write_script,
)
from tests.browser import MISSING, browser

RECORDS = [
    {"series": "one </script>", "x": 1.0, "y": 1e-3, "cells": "QUAD4"},
    {"series": "one </script>", "x": 10.0, "y": 1e-5, "cells": "QUAD4"},
    {"series": "two", "x": 2.0, "y": 1e-4, "cells": "TRIA3", "url": "#there"},
]
LOOKS = {"one </script>": Look(BLUE), "two": Look(ORANGE, "square", (6, 3))}


def specifications(html):
    """The specifications of a page's charts, by their anchors."""
    found = re.findall(r'<div class=chart id="([^"]+)".*?json">(.*?)</script>', html, re.DOTALL)
    assert len(found) == len(dict(found))
    return {name: expanded(json.loads(text)) for name, text in found}


def expanded(spec):
    """A page's specification with its records as the script restores them."""
    records = [
        ({} if table["series"] is None else {"series": table["series"]})
        | dict(zip(table["fields"], row, strict=True))
        for table in spec["data"]
        for row in table["rows"]
    ]
    return spec | {"data": {"values": records}}


def chart():
    x, y = Axis("x", "size", log=True), Axis("y", "error", log=True)
    layers = [floor_band(100), level(1e-4, "limit", ORANGE), *slopes(RECORDS, "x", "y", [1, 2])]
    return series_chart("a", "Title", RECORDS, x, y, LOOKS, tips={"cells": "cells"}, layers=layers)


def test_a_chart_is_its_records():
    spec = chart().spec
    assert spec["data"]["values"] == RECORDS
    series = spec["layer"][-1]
    assert series["encoding"]["color"]["scale"] == {"domain": list(LOOKS), "range": [BLUE, ORANGE]}
    marks = series["layer"][-1]["encoding"]
    assert [t["title"] for t in marks["tooltip"]] == ["series", "size", "error", "cells"]
    assert [t["type"] for t in marks["tooltip"]] == ["nominal", *["quantitative"] * 2, "nominal"]
    assert marks["href"] == {"field": "url"}


def test_a_page_holds_the_specification_and_says_what_it_needs():
    html = str(chart().__html__())
    ten = json.loads(
        json.dumps(chart().spec), parse_float=lambda digits: float(f"{float(digits):.10g}")
    )
    assert specifications(html) == {"a": ten}
    assert html.count('"cells"') == 4, "once for each series; field and title under the pointer"
    assert f"needs JavaScript and the file {SCRIPT} beside this page" in html


def test_slopes_are_powers():
    for order in (1, 2):
        rows = [
            r
            for r in slopes(RECORDS, "x", "y", [1, 2])[0]["data"]["values"]
            if r["order"] == f"{order}"
        ]
        (low, high) = rows
        assert high["y"] / low["y"] == pytest.approx((high["x"] / low["x"]) ** order)


def test_a_logarithmic_axis_has_labels_wherever_it_begins():
    """At powers of ten, at 2, 3 and 5 times these, or at every tick, by the length of the axis."""
    styles = {
        span: Axis("x", "x", log=True, domain=(7.0, 7.0 * span)).channel()["axis"]["style"]
        for span in (3, 100, 1e4)
    }
    assert styles == {3: "units", 100: "halves", 1e4: "decades"}
    assert Axis("x", "x", domain=(7.0, 21.0)).channel()["axis"]["style"] == "plain"


def test_no_two_series_look_the_same():
    same = dict.fromkeys("abc", Look(BLUE)) | {"d": Look(ORANGE)}
    looks = distinct(same)
    assert len(set(looks.values())) == 4
    assert (looks["a"], looks["d"]) == (Look(BLUE), Look(ORANGE))
    assert {look.color for look in looks.values()} == {BLUE, ORANGE}


def test_the_floor_grows_with_the_root_of_the_unknowns():
    place = floor_band(10_000)["encoding"]
    assert (place["y"]["datum"], place["y2"]["datum"]) == (EPSILON, 100 * EPSILON)


def test_a_chart_is_drawn_without_a_browser():
    root = ET.fromstring(chart().svg())
    words = {text.text for text in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"size", "error", "two", "limit", "one </script>"} <= words


def test_the_script_is_written_where_it_is_missing_or_another(tmp_path, monkeypatch):
    written = []
    monkeypatch.setattr("solver.report.charts._libraries", lambda: written.append(1) or "vega;")
    write_script(tmp_path)
    text = (tmp_path / SCRIPT).read_text(encoding="utf-8")
    write_script(tmp_path)
    assert len(written) == 1
    (tmp_path / SCRIPT).write_text(text.replace("Vega ", "Vega 0"), encoding="utf-8")
    write_script(tmp_path)
    assert len(written) == 2
    assert (tmp_path / SCRIPT).read_text(encoding="utf-8") == text


def test_pages_that_are_written_at_once_share_the_script(tmp_path):
    with ThreadPoolExecutor(4) as pages:
        for folder in map(str, range(20)):
            list(pages.map(write_script, [tmp_path / folder] * 4))
            text = (tmp_path / folder / SCRIPT).read_text(encoding="utf-8")
            assert text.endswith(charts._TEMPLATES.joinpath(SCRIPT).read_text(encoding="utf-8"))


def test_the_libraries_are_kept_with_the_packages_that_they_come_from(tmp_path, monkeypatch):
    made = []
    bundle = "vl_convert.javascript_bundle"
    monkeypatch.setattr(bundle, lambda snippet: made.append(snippet) or "vega;")
    monkeypatch.setattr("solver.report.charts.KEPT", tmp_path / "share" / "vega.js")
    charts._libraries.cache_clear()
    for folder, file in (("first", None), ("again", None), ("other", "// Vega 0\nold;")):
        if file:
            charts.KEPT.write_text(file)
        charts._libraries.cache_clear()
        write_script(tmp_path / folder)
    texts = {(tmp_path / folder / SCRIPT).read_text() for folder in ("first", "again", "other")}
    charts._libraries.cache_clear()
    assert len(made) == 2  # not again, but for a file of other versions
    assert len(texts) == 1
    assert "\nvega;\n" in texts.pop()


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_a_browser_draws_the_chart_and_shows_its_values(tmp_path):
    write_script(tmp_path)
    page = tmp_path / "page.html"
    page.write_text(
        f"<!DOCTYPE html><meta charset=utf-8><script src={SCRIPT} defer></script>"
        f"<body style='margin:0'>{chart().__html__()}<p id=there style='margin-top:2000px'>there",
        encoding="utf-8",
    )
    mark = "document.querySelector('.mark-symbol path[aria-label*=\"series: two\"]')"
    with browser() as window:
        for dark, paper in ((False, "rgb(255, 255, 255)"), (True, "rgb(20, 25, 31)")):
            window.open(page, dark=dark)
            window.wait("!!document.querySelector('.drawn svg')")
            assert not window.run("!!document.querySelector('.chart .none')")
            drawn = "getComputedStyle(document.querySelector('.drawn svg'))"
            assert window.run(f"{drawn}.backgroundColor") == paper
        place = "(({x, y, width, height}) => [x + width / 2, y + height / 2])"
        window.point(*window.run(f"{place}({mark}.getBoundingClientRect())"))
        tip = window.wait("document.querySelector('#vg-tooltip-element.visible')?.innerText")
        assert "two" in tip
        assert "0.0001" in tip
        assert "TRIA3" in tip
        saved = window.run("document.querySelector('.vega-actions a[download$=csv]').href")
        assert "one </script>,1,0.001,QUAD4" in unquote(saved)
        window.point(*window.run(f"{place}({mark}.getBoundingClientRect())"), press=True)
        window.wait("location.hash === '#there'")
        assert window.complaints() == []
