"""The pages in headless Chromium: narrow and wide, light and dark, with filters and links."""

from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from solver.report import write_report
from solver.verification.results import write_result
from tests import handmade
from tests.browser import MISSING, browser
from tests.report.test_report import CHECK, verdict
from tests.report.verdicts import put

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)
MANY = 40


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
    write_report(files, folder / "report")
    return folder / "report"


@pytest.mark.parametrize("name", ["summary", "fam", "many"])
def test_a_page_fits_every_width_in_light_and_dark(pages, window, name):
    for width, dark in ((390, True), (1280, False), (1600, False)):
        window.open(pages / f"{name}.html", width, dark)
        assert window.run("document.documentElement.scrollWidth <= innerWidth"), width
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
    rows = "[...document.querySelectorAll('tr[data-verdict]:not([hidden])')]"
    shown = f"{rows}.map((row) => row.cells[0].innerText.split('\\n')[0])"
    assert len(window.run(shown)) == MANY
    window.run(
        """((field) => { field.value = "many-3";
        field.dispatchEvent(new Event("input", {bubbles: true}));
        })(document.querySelector("[name=text]"))"""
    )
    assert len(window.run(shown)) == 1 + 7  # 3, 30 … 36
    assert window.run("location.search") == "?text=many-3"
    assert window.run("document.querySelector('output').value") == f"8 of {MANY} solves"
    window.open((pages / "summary.html").resolve().as_uri() + "?verdict=failed")
    assert window.run(shown) == ["bad"]
    window.run("document.querySelector('[type=reset]').click()")
    window.wait(f"{shown}.length === {MANY}")
    assert window.complaints() == []


def test_failures_are_grouped_by_check_and_cause(pages, window):
    window.open(pages / "summary.html")
    heads = window.run("[...document.querySelectorAll('#failures h3')].map((h) => h.innerText)")
    assert heads == ["nodal stress: above its tolerance (1)"]


def test_print_keeps_checks_and_provenance(pages, window):
    window.open(pages / "fam.html")
    assert not window.run("[...document.querySelectorAll('article > details')].some((d) => d.open)")
    window.run("dispatchEvent(new Event('beforeprint'))")
    assert window.run("[...document.querySelectorAll('article > details')].every((d) => d.open)")
