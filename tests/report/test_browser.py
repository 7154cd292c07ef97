"""The pages in headless Chromium: narrow and wide, light and dark, with filters and links."""

import re
from pathlib import Path
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest

from solver.report import formats, write_report
from solver.report.charts import RED
from solver.verification.results import write_result
from tests import handmade
from tests.browser import MISSING, browser
from tests.report.test_report import CHECK, verdict
from tests.report.verdicts import put

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)
MANY = 40
# All that folds: menus, tables and groups of solves.
FOLDS = "document.querySelectorAll('details')"
WIDTH = "document.documentElement.scrollWidth"


@pytest.fixture(scope="module")
def window():
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """A report of two results, a failure and many further verdicts."""
    folder = tmp_path_factory.mktemp("pages")
    good = CHECK | {"error": 1e-5, "passed": True}
    contents = [
        verdict(f"many-{n}", "passed", family="many", checks=[good], worst=good)
        for n in range(MANY - 3)
    ]
    bad = CHECK | {"name": "nodal_stress"}
    contents.append(verdict("bad", "failed", "nodal_stress: 4e-3", checks=[bad], worst=bad))
    for make in (handmade.plane, handmade.solid):
        name = make.__name__
        path = folder / "fam" / name / "result.vtkhdf"
        sha256 = write_result(path, make(tmp_path_factory.mktemp(name)), [], {})
        bodies = [
            {"name": body.name, "role": body.role, "cells": body.cells, "faces": body.faces}
            | {"reference_cells": None, "reference_faces": None}
            for body in make(tmp_path_factory.mktemp(name)).bodies
        ]
        bound = {"result": "result.vtkhdf", "result_sha256": sha256, "bodies": bodies}
        contents.append(verdict(name, "passed", checks=[good], worst=good, **bound))
    files = []
    for content in contents:
        files.append(folder / content["family"] / content["job"] / "verdict.json")
        put(files[-1], content)
    many = folder / "cases" / "many" / "family.yaml"
    many.parent.mkdir(parents=True)
    many.write_text("title: Many\ngroup: Many solves\n")
    write_report(files, folder / "report", [many])
    return folder / "report"


@pytest.mark.parametrize("name", ["summary", "fam", "many"])
def test_a_page_fits_every_width_in_light_and_dark(pages, window, name):
    for width, dark in ((390, True), (1280, False), (1600, False)):
        window.open(pages / f"{name}.html", width, dark)
        assert window.run(WIDTH) <= width
        window.run(f"{FOLDS}.forEach((one) => {{ one.open = true; }})")
        assert window.run(WIDTH) <= width
        paper = window.run("getComputedStyle(document.body).backgroundColor")
        assert paper == ("rgb(20, 25, 31)" if dark else "rgb(255, 255, 255)")
    assert window.complaints() == []
    assert (pages / f"{name}.html").stat().st_size < 1_500_000


@pytest.mark.parametrize("name", ["summary", "fam"])
def test_every_link_of_a_page_leads_somewhere(pages, window, name):
    window.open(pages / f"{name}.html")
    links = window.run("[...document.querySelectorAll('a[href]')].map((a) => a.href)")
    assert len(links) > 5
    texts = {}
    for link in dict.fromkeys(links):
        address = urlsplit(link)
        if address.scheme != "file":
            continue
        file = Path(unquote(address.path))
        text = texts.setdefault(file, file.read_text(encoding="utf-8", errors="ignore"))
        assert not address.fragment or f'id="{unquote(address.fragment)}"' in text, link


def test_the_charts_of_a_family_are_drawn_and_say_what_they_show(pages, window):
    window.open(pages / "fam.html")
    window.run("document.querySelector('.chart').scrollIntoView({block: 'center'})")
    window.wait("document.querySelector('.chart svg')")
    step = "document.querySelector('.mark-rule.role-mark line')"
    place = f"(({{x, y, width}}) => [x + width / 4, y])({step}.getBoundingClientRect())"
    window.point(*window.run(place))
    tip = window.wait("document.querySelector('#vg-tooltip-element.visible')?.innerText")
    assert "contact pressure" in tip
    assert "25" in tip
    assert window.complaints() == []


def test_a_filter_chooses_rows_at_once_and_stays_in_the_address(pages, window):
    window.open(pages / "summary.html")
    rows = "[...document.querySelectorAll('[data-verdict]:not([hidden])')]"
    shown = f"{rows}.map((row) => row.textContent)"
    assert len(window.run(shown)) == MANY
    window.run(
        """((field) => { field.value = "many-3";
        field.dispatchEvent(new Event("input", {bubbles: true}));
        })(document.querySelector("[name=text]"))"""
    )
    assert len(window.run(shown)) == 1 + 7  # 3, 30 … 36
    assert window.run("location.search") == "?text=many-3"
    assert window.run("document.querySelector('output').value") == f"8 of {MANY} solves"
    tiles = "[...document.querySelectorAll('a.tile:not([hidden])')].map((tile) => tile.dataset.of)"
    assert window.run(tiles) == ["many"]
    assert window.run("document.querySelector('a.tile:not([hidden]) [data-word]').innerText") == (
        "8 passed"
    )
    window.run(
        """((field) => { field.value = "many-3 passed";
        field.dispatchEvent(new Event("input", {bubbles: true}));
        })(document.querySelector("[name=text]"))"""
    )
    assert len(window.run(shown)) == 8, "both words"
    window.open((pages / "summary.html").resolve().as_uri() + "?verdict=failed")
    assert window.run(shown) == ["bad"]
    window.run("document.querySelector('[type=reset]').click()")
    window.wait(f"{shown}.length === {MANY}")
    assert window.complaints() == []


def test_the_chart_of_all_solves_shows_the_family_picked(pages, window):
    window.open(pages / "summary.html")
    window.run("document.querySelector('#error-against-time').scrollIntoView({block: 'center'})")
    marks = "document.querySelectorAll('#error-against-time .mark-symbol.role-mark path').length"
    window.wait(f"{marks} >= {MANY}")
    window.run(
        """((field) => { field.value = "fam"; field.dispatchEvent(new Event("change")); })(
        document.querySelector("#error-against-time [name=pick_family]"))"""
    )
    assert 0 < window.wait(f"{marks} < {MANY} ? {marks} : 0") < 10
    assert window.complaints() == []


def test_a_solve_that_failed_is_painted_on_top_and_in_the_legend(pages, window):
    """A cross has a surface: its own colour is under the pointer at its middle."""
    window.open(pages / "summary.html")
    window.run("document.querySelector('#error-against-time').scrollIntoView({block: 'center'})")
    window.wait("document.querySelector('#error-against-time svg .mark-symbol.role-mark path')")
    marks = "[...document.querySelectorAll('#error-against-time svg .mark-symbol path')]"
    red = window.run(f"{marks}.filter((mark) => mark.getAttribute('fill') === '{RED}').length")
    assert red == 2, "the mark and its entry in the legend"
    last = f"{marks}.filter((mark) => mark.closest('.role-mark')).at(-1).getAttribute('fill')"
    assert window.run(last) == RED


def test_a_name_opens_its_solve_in_a_panel_and_closes_it(pages, window):
    window.open(pages / "fam.html")
    shown = "[...document.querySelectorAll('article')].filter((one) => one.offsetHeight).length"
    assert window.run(shown) == 0
    window.run("document.querySelector('.summary td a').click()")
    assert window.run(shown) == 1
    window.run("[...document.querySelectorAll('a.close')].find((one) => one.offsetHeight).click()")
    assert window.run(shown) == 0


def test_the_rows_of_a_family_have_one_line(pages, window):
    window.open(pages / "fam.html", 1300)
    rows = "[...document.querySelectorAll('.summary tbody tr:not(.kind, .why)')]"
    assert max(window.run(f"{rows}.map((row) => row.offsetHeight)")) <= 28


def test_the_wheel_scrolls_the_page_and_zooms_with_ctrl(pages, window):
    window.open(pages / "summary.html")
    window.run("document.querySelector('#error-against-time').scrollIntoView({block: 'center'})")
    window.wait("document.querySelector('#error-against-time svg')")
    window.run("document.querySelector('#error-against-time').scrollIntoView({block: 'center'})")
    ticks = """[...document.querySelectorAll('#error-against-time .role-axis-label text')]
        .map((text) => text.textContent).join()"""
    middle = """(({x, y, width, height}) => [x + width / 2, y + height / 3])(
        document.querySelector('#error-against-time svg').getBoundingClientRect())"""
    before, top = window.run(ticks), window.run("scrollY")
    window.wheel(*window.run(middle), ctrl=True)
    window.wait(f"{ticks} !== {before!r}")
    assert window.run("scrollY") == top
    zoomed = window.run(ticks)
    window.wheel(*window.run(middle))
    window.wait(f"scrollY > {top}")
    assert window.run(ticks) == zoomed


def test_groups_of_families_fold_and_failures_are_open(pages, window):
    window.open(pages / "summary.html")
    groups = "[...document.querySelectorAll('.group > summary')].map((group) => group.innerText)"
    assert window.run(groups) == ["Other families", "Many solves"]
    folds = "[...document.querySelectorAll('details.fold')].map((fold) => fold.open)"
    assert window.run(folds) == [True, False]  # the first group has failures
    window.open((pages / "summary.html").resolve().as_uri() + "?text=many-3")
    assert window.run(folds) == [True, True]
    hidden = "[...document.querySelectorAll('details.group')].map((group) => group.hidden)"
    assert window.run(hidden) == [True, False]


def test_a_tile_shows_the_problem_with_its_pressure(pages, window):
    window.open(pages / "summary.html")
    window.run("document.querySelector('.tile img').scrollIntoView()")
    window.wait("document.querySelector('.tile img').naturalWidth > 0")
    alt = "[...document.querySelectorAll('.tile')].map((t) => t.querySelector('.under').innerText)"
    assert any("largest error" in text for text in window.run(alt))


def test_failures_are_grouped_by_check_and_cause(pages, window):
    window.open(pages / "summary.html")
    heads = window.run("[...document.querySelectorAll('#failures h3')].map((h) => h.innerText)")
    assert heads == ["nodal stress: above its tolerance (1)"]


def test_print_keeps_checks_and_provenance(pages, window):
    window.open(pages / "fam.html")
    assert not window.run("[...document.querySelectorAll('article > details')].some((d) => d.open)")
    window.run("dispatchEvent(new Event('beforeprint'))")
    assert window.run("[...document.querySelectorAll('article > details')].every((d) => d.open)")


def test_charts_are_light_on_paper_also_where_the_screen_is_dark(pages, window):
    window.open(pages / "fam.html", dark=True)
    window.run("document.querySelector('.chart').scrollIntoView()")
    paper = "document.querySelector('.chart svg.marks')?.style.backgroundColor"
    window.wait(f"{paper} === 'rgb(20, 25, 31)'")
    window.run("dispatchEvent(new Event('beforeprint'))")
    window.wait(f"{paper} === 'rgb(255, 255, 255)'")
    window.run("dispatchEvent(new Event('afterprint'))")
    window.wait(f"{paper} === 'rgb(20, 25, 31)'")


CANVAS, CHOICE = (f"document.querySelector('.turned {tag}')" for tag in ("canvas", "select"))
BOX = f"{CANVAS}.getBoundingClientRect()"
# How many colours the result has, a sum over its pixels, and how many colours are frequent.
SHADES = (
    "(({width, height}, canvas) => { const size = {width, height};"
    """
const copy = Object.assign(document.createElement('canvas'), size);
const brush = copy.getContext('2d'); brush.drawImage(canvas, 0, 0);
const pixels = new Uint32Array(brush.getImageData(0, 0, copy.width, copy.height).data.buffer);
let sum = 0; const counts = new Map();
for (const p of pixels) { sum = (31 * sum + p) % 1000003; counts.set(p, (counts.get(p) ?? 0) + 1); }
return [counts.size, sum, [...counts].filter(([, n]) => n > 500).length]; })"""
    f"""(
{CANVAS}, {CANVAS})"""
)


def turned(window, page, number, **look):
    """Open a page and its result of that number in turn; whether it is drawn."""
    window.open(page, **look)
    button = f"document.querySelectorAll('[data-surfaces]')[{number}]"
    window.run(f"(location.hash = {button}.closest('article')?.id ?? '', 0)")
    window.run(f"{button}.click()")
    window.wait("document.querySelector('.turned canvas')?.width > 100")
    window.wait(f"{SHADES}[0] > 3")


@pytest.mark.parametrize("number", [-1, -2], ids=["3D", "2D"])
def test_a_result_is_turned_and_its_maps_change(pages, window, number):
    buttons = (pages / "fam.html").read_text().count("data-surfaces=")
    turned(window, pages / "fam.html", buttons + number)
    first = window.run(SHADES)
    assert first[2] >= 3, "background, slave, master"
    window.run(f"{CANVAS}.scrollIntoView({{block: 'center'}})")
    window.run(f"{CANVAS}.dispatchEvent(new KeyboardEvent('keydown', {{key: 'ArrowRight'}}))")
    window.wait(f"{SHADES}[1] !== {first[1]}")
    second = window.run(SHADES)
    window.run(
        """((choice) => { const error = [...choice.options].find((o) => o.text.includes('|Δu|'));
        choice.value = error.value; choice.onchange(); })"""
        f"({CHOICE})"
    )
    window.wait(f"{SHADES}[1] !== {second[1]}")
    third = window.run(SHADES)
    window.run(
        """((slider) => { slider.value = slider.max; slider.oninput(); })(
        document.querySelector('.turned input[type=range]'))"""
    )
    window.wait(f"{SHADES}[1] !== {third[1]}")
    assert window.complaints() == []


def test_pointing_at_a_face_says_its_value(pages, window):
    turned(window, pages / "fam.html", 0)
    window.run(f"{CANVAS}.scrollIntoView({{block: 'center'}})")
    window.run(f"((choice) => {{ choice.value = 3; choice.onchange(); }})({CHOICE})")
    assert window.run("document.querySelector('.turned select').selectedOptions[0].text") == (
        "displacement |u|"
    )
    x, y = window.run(f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2])({BOX})")
    found = []
    for step in range(-100, 101, 20):
        window.point(x, y + step)
        found.append(window.run("document.querySelector('.turned output').innerText"))
    values = [
        re.fullmatch(r"(\w+): displacement \|u\| = (\S+), at \((\S+), (\S+)\)", t) for t in found
    ]
    assert {m[1] for m in values if m} == {"bottom", "top"}
    for m in filter(None, values):
        at_x, at_y = float(m[3]), float(m[4])
        # Linear between the corners of triangles; the height of the root is less than 1 % of it.
        assert float(m[2]) == pytest.approx(
            np.hypot(0.004875 * at_x, 0.011375 * (at_y + 50)), rel=0.15
        )


@pytest.mark.parametrize(("width", "dark"), [(390, True), (1280, False), (1600, False)])
def test_a_turned_result_fits_every_width(pages, window, width, dark):
    turned(window, pages / "fam.html", 0, width=width, dark=dark)
    assert window.run(WIDTH) <= width
    box = window.run(f"(({{width, height}}) => [width, height])({BOX})")
    assert 250 < box[0] <= width
    assert window.complaints() == []


def test_one_result_is_open_at_a_time(pages, window):
    buttons = "document.querySelectorAll('[data-surfaces]')"
    turned(window, pages / "fam.html", 0)
    whole = window.run(f"{buttons}.length")
    window.run(f"(location.hash = {buttons}[0].closest('article')?.id ?? '', 0)")
    window.run(f"{buttons}[0].click()")
    window.wait(
        f"document.querySelectorAll('.turned').length === 1 && {buttons}.length === {whole}"
    )
    window.wait(f"{SHADES}[0] > 3")
    assert window.complaints() == []


def test_without_javascript_there_is_the_picture(pages):
    text = (pages / "fam.html").read_text()
    assert text.count("<img class=mesh") == text.count("data-surfaces=") > 1
    assert all("hidden" in part[:120] for part in text.split("data-surfaces=")[1:])
    files = [path for path in pages.glob("pictures/*.js") if path.name in text]
    assert len(files) == 2


CHOOSE = """((form) => {
  form.elements["%s"].value = "%s";
  form.dispatchEvent(new Event("input"));
})(document.querySelector("form.filters"))"""


@pytest.fixture(scope="module")
def thousand(tmp_path_factory):
    """The report of a thousand solves in twenty families."""
    folder = tmp_path_factory.mktemp("thousand")
    good = CHECK | {"error": 1e-5, "passed": True}
    checks = [good | {"name": name} for name in ("multiplier", "nodal_stress", "coverage")] * 4
    seconds = dict.fromkeys(formats.COLORS, 0.123) | {"total": 1.234}
    files = []
    for number in range(1000):
        family, name = f"family {number % 20}", f"long-name-of-a-block-{number}"
        content = verdict(name, "passed", family=family, checks=checks, worst=good, seconds=seconds)
        files.append(folder / family / name / "verdict.json")
        put(files[-1], content)
    write_report(files, folder / "report")
    return folder / "report"


def test_a_summary_of_a_thousand_solves_stays_small_and_can_be_searched(thousand, window):
    window.open(thousand / "summary.html")
    shown = "document.querySelectorAll('[data-verdict]:not([hidden])').length"
    assert window.run(shown) == 1000
    window.run(CHOOSE % ("text", "block-77"))
    assert window.run(shown) == 1 + 10  # 77, 770 … 779
    window.run(CHOOSE % ("text", ""))
    window.run(CHOOSE % ("family", "family_3"))
    assert window.run(shown) == 50
    window.run(CHOOSE % ("family", ""))
    assert window.run(shown) == 1000
    assert window.complaints() == []
    for page in thousand.glob("*.html"):
        assert page.stat().st_size < 1_500_000, page
