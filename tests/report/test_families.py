"""The page of a family: what its file says, and kinds of reference that are kept apart."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from solver.case.reader import load_case
from solver.commands.cli import main
from solver.report import formats, write_report
from solver.report.families import FILE_NAME, page_name, paragraphs, read_family
from solver.report.profile import (
    CONSTANT,
    MASTER,
    MEANS,
    NODES,
    RECOVERED,
    REFERENCE,
    Arc,
    draw_profile,
    mathematics,
    position,
)
from solver.simulation.results.solution import NodalContact, RecoveredPressure
from solver.verification.results import write_result
from tests import handmade
from tests.report.test_report import CHECK, Page, verdict
from tests.report.verdicts import put

FAMILY = """\
title: Blocks & <b>more</b>
description: Two blocks.
problem: |
  Pressed from above.

      p_0 = 25,
      q^d < 3

  Without friction.
reference: It is uniform.
figures:
  - {job: two-blocks, along: 2*x, caption: As it should be}
  - {job: not-solved}
reference_code:
  - {name: other, version: "7", error: 1.0e-9}
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "blocks" / FILE_NAME
    path.parent.mkdir()
    path.write_text(FAMILY)
    return path


def test_a_family_as_its_file_tells_it(file):
    family = read_family(file)
    assert (family.name, family.title) == ("blocks", "Blocks & <b>more</b>")
    assert family.reference == "It is uniform."
    assert [figure.job for figure in family.figures] == ["two-blocks", "not-solved"]
    assert family.figures[0].expression(np.array([[3.0, 0.0]])) == 6.0
    assert family.refusal == ""


def test_paragraphs_that_are_indented_are_formulas(file):
    assert paragraphs(read_family(file).problem) == [
        (False, "Pressed from above."),
        (True, "p_0 = 25,\nq^d < 3"),
        (False, "Without friction."),
    ]
    assert formats.formula("q^d < p_rr") == "q<sup>d</sup> &lt; p<sub>rr</sub>"
    symbols = formats.symbols("c_n r^(n+1) < σ_θθ: surface_stress, 1e-3_x")
    assert symbols == ("c<sub>n</sub> r<sup>n+1</sup> &lt; σ<sub>θθ</sub>: surface_stress, 1e-3_x")
    assert formats.formula("r^(1/3)") == "r<sup>1/3</sup>"
    assert formats.formula("ν_1²/E_1") == "ν<sub>1</sub>²/E<sub>1</sub>"


def test_a_family_without_a_file_has_its_folder_s_name(tmp_path):
    family = read_family(tmp_path / "mine" / FILE_NAME)
    assert (family.name, family.title, family.refusal) == ("mine", "mine", "")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("description:", "descripton:", "descripton = 'Two blocks.': unknown key; did you mean"),
        ("2*x", "2*open(x)", "figures[0].along = '2*open(x)': `open(x)` is not allowed"),
        ('"7"', "7", "reference_code[0].version = 7: must be text (in quotes if it is a number)"),
        ("1.0e-9", "-1", "reference_code[0].error = -1: must be a positive number"),
        ("job: not-solved", "jobs: [a]", "figures[1].jobs = ['a']: unknown key; did you mean job?"),
        ("title:", "title", "file"),
    ],
)
def test_a_file_that_is_refused_is_told_and_the_report_is_written(
    file, tmp_path, old, new, message
):
    file.write_text(FAMILY.replace(old, new, 1))
    assert message in read_family(file).refusal
    logged = report(tmp_path, [verdict("a", "passed", family="blocks")], file)
    assert message in logged
    assert str(file) in Page(tmp_path / "blocks.html").text
    assert str(file) in Page(tmp_path / "summary.html").text


OURS = sorted(Path("cases").glob("*/family.yaml"))


@pytest.mark.parametrize("file", OURS, ids=lambda file: file.parent.name)
def test_every_family_of_ours_tells_problem_and_reference_and_draws_solves_it_has(file):
    family = read_family(file)
    assert family.refusal == ""
    assert all(text.strip() for text in (family.description, family.problem, family.reference))
    jobs = set()
    for path in set(file.parent.glob("*.yaml")) - {file, file.with_name("orders.yaml")}:
        case = load_case(path)
        jobs |= {case.name} | (
            {f"{case.name}-swapped"} if case.about.directions == "both" else set()
        )
    assert {figure.job for figure in family.figures} <= jobs


def test_families_come_in_the_order_they_ask_for(tmp_path):
    for name, order in {"a": "", "b": "order: 2", "c": "", "d": "order: 1"}.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / FILE_NAME).write_text(f"title: {name}\n{order}\n")
    verdicts = [verdict(f"{name}1", "passed", family=name) for name in "abcd"]
    logged = report(tmp_path, verdicts, *(tmp_path / name / FILE_NAME for name in "abcd"))
    assert re.findall(r"(\w) \S+ s \(1\)", logged) == ["d", "b", "a", "c"]
    listed = json.loads((tmp_path / "summary.json").read_text())
    assert [row["family"] for row in listed] == ["d", "b", "a", "c"]


def test_pages_of_the_report_are_no_family_s():
    assert page_name("lame") == "lame.html"
    assert page_name("summary") == "family-summary.html"
    assert page_name("orders-waves") == "family-orders-waves.html"
    assert page_name("bench") == "family-bench.html"
    assert "/" not in page_name("a/b")


def report(folder, verdicts, *families):
    """Write a report of verdicts into the folder; what was logged."""
    paths = []
    for content in verdicts:
        path = folder / "results" / content["family"] / content["job"] / "verdict.json"
        paths.append(put(path, content))
    return write_report(paths, folder, families)


REFINED = {"reference_kind": "refined", "reference_uncertainty": 2e-3}
OTHER = {"reference_kind": "other_code", "reference_code": {"name": "solver", "version": "14.6"}}


def test_kinds_of_reference_are_kept_apart_with_uncertainty_code_and_version(tmp_path):
    verdicts = [
        verdict("a", "passed", reference_solution="nested_cylinders"),
        verdict("b", "passed", **REFINED),
        verdict("c", "passed", **OTHER),
        verdict("d", "passed", reference_kind="manufactured"),
        verdict("e", "passed", **OTHER),
    ]
    report(tmp_path, verdicts)
    rows = Page(tmp_path / "fam.html").rows
    first = [row[0] for row in rows]
    heads = [cell for cell in first if cell.startswith("Reference: ")]
    assert heads == [
        "Reference: values that are known exactly",
        "Reference: our own result on a much finer mesh",
        "Reference: another code's result: solver 14.6",
        "Reference: a solution chosen first, with loads derived from it",
    ]
    html = (tmp_path / "fam.html").read_text()
    heads = [html.index(f"Reference: {what}") for what in ("values", "our own", "another", "a sol")]
    at = [html.index(f'href="#fam/{name}"') for name in "abced"]
    assert heads[0] < at[0] < heads[1] < at[1] < heads[2] < at[2] < at[3] < heads[3] < at[4]
    kinds = {row[0]: row[1:] for row in rows if row and row[0] in ("refined", "other code")}
    assert kinds["refined"] == ["our own result on a much finer mesh", "–", "1", "± 2.0e-03"]
    assert kinds["other code"] == ["another code's result: solver 14.6", "–", "2", "–"]
    assert ["analytical", "values that are known exactly", "nested_cylinders", "1", "exact"] in rows


def test_the_page_goes_from_problem_to_figure_to_verdict(file, tmp_path):
    solution = handmade.plane(tmp_path)
    sha256 = write_result(tmp_path / "results/blocks/two-blocks/result.vtkhdf", solution, [], {})
    bound = {"result": "result.vtkhdf", "result_sha256": sha256}
    content = verdict("two-blocks", "passed", family="blocks", **bound)
    put(tmp_path / "results/blocks/two-blocks/verdict.json", content)
    (tmp_path / "results/blocks/two-blocks/log").write_text("")
    command = ["report", str(tmp_path / "results"), "-o", str(tmp_path), "--families", str(file)]
    assert main(command) == 0
    html = (tmp_path / "blocks.html").read_text()
    parts = ['id="solves"', "id=pressure", "id=problem", "id=reference", "id=time", "<article"]
    assert [html.count(part) for part in parts] == [1] * len(parts)
    assert sorted(parts, key=html.index) == parts
    assert "<h1>Blocks &amp; &lt;b&gt;more&lt;/b&gt;</h1>" in html
    assert "<p class=formula>p<sub>0</sub> = 25,\nq<sup>d</sup> &lt; 3</p>" in html
    assert "As it should be" in html
    for name in ("result.vtkhdf", "verdict.json", "log"):
        assert f'href="results/blocks/two-blocks/{name}"' in html
    assert 'href="blocks.html"' in (tmp_path / "summary.html").read_text()


def test_a_solve_that_is_held_against_norms_alone_shows_the_largest(tmp_path):
    checks = [
        CHECK | {"name": name, "error": error, "tolerance": 0.5, "passed": True}
        for name, error in (("peak", 0.25), ("pressure_means", 0.125), ("balance", 0.4))
    ]
    errors = {"pressure_means": 0.125, "peak": 0.25, "pressure_l2": 0.3}
    worst = {"name": "peak", "error": 0.25}
    report(tmp_path, [verdict("a", "passed", checks=checks, errors=errors, worst=worst)])
    rows = Page(tmp_path / "fam.html").rows
    assert any("25 %" in cell for row in rows for cell in row)
    assert ["a", "3.0e-01", "1.2e-01"] in [row[:3] for row in rows]  # in L2, and at means
    assert "Not drawn" not in Page(tmp_path / "fam.html").text


def test_the_cost_of_each_family_is_printed_before_the_outcome(tmp_path):
    verdicts = [verdict("a", "passed"), verdict("b", "passed", family="other", cpu_seconds=2.0)]
    logged = report(tmp_path, verdicts)
    first, *_, last = logged.splitlines()
    assert first == "Processor time by family (solves): fam 0.7 s (1), other 2.0 s (1)."
    assert last.startswith("All 2 solves passed. Report: ")
    assert "2.00 s" in Page(tmp_path / "summary.html").text


def drawn(solution, along=None):
    """Records of the profile by series, and its axes' titles."""
    chart = draw_profile(solution, solution.zones[0], "p", "pressure", along)
    found = {}
    for record in chart.spec["data"]["values"]:
        found.setdefault(record["series"], []).append(record)
    views = [view["encoding"] for view in chart.spec["vconcat"]]
    return found, [view["y"]["title"] for view in views], views[0]["x"]["title"]


def test_a_profile_shows_every_macro_element_and_its_deviation(tmp_path):
    solution = handmade.plane(tmp_path)
    solution.zones[0].multiplier[:] = 25.0, 26.0
    found, titles, x = drawn(solution)
    steps = [(r["s"], r["end"], r["p"], r["deviation"]) for r in found[CONSTANT]]
    assert steps == [(0, 25, 25, 0), (25, 50, 26, 0.04)]
    assert (titles, x) == (["contact pressure", "Δp / max p"], "x")
    assert {r["p"] for r in found[REFERENCE]} == {25.0}
    assert {r["p"] for r in found[MASTER]} == {25.0}


def test_the_reference_of_a_profile_is_zero_where_nothing_is_covered(tmp_path):
    key = "  contact_pressure: 25.0\n"
    text = handmade.PLANE.replace(key, f"{key}  coverage: max(0, min(1, 26 - x))\n")
    solution = handmade.plane(tmp_path, text)
    solution.zones[0].multiplier[1] = 0.0
    found, _, _ = drawn(solution)
    assert [r["deviation"] for r in found[CONSTANT]] == [0, 0]
    assert {(r["s"] > 25, r["p"]) for r in found[REFERENCE]} == {(False, 25.0), (True, 0.0)}


def test_a_profile_without_a_reference_shows_no_deviation(tmp_path):
    text = handmade.PLANE.replace("  contact_pressure: 25.0\n", "")
    found, titles, _ = drawn(handmade.plane(tmp_path, text))
    assert titles == ["contact pressure"]
    assert REFERENCE not in found


def test_a_profile_in_space_has_two_marks_for_each_macro_element(tmp_path):
    found, titles, _ = drawn(handmade.solid(tmp_path))
    assert {name: len(records) for name, records in found.items()} == {CONSTANT: 2, REFERENCE: 2}
    assert all("deviation" in record for record in found[CONSTANT])
    assert len(titles) == 2


def test_a_profile_of_multipliers_at_nodes_has_a_mark_for_each(tmp_path):
    solution = handmade.plane(tmp_path)
    zone = solution.zones[0]
    nodes = zone.surfaces.slave_nodes
    n = len(nodes)
    zone.nodal = NodalContact(nodes, np.linspace(24.0, 29.0, n), *np.zeros((2, n)))
    found, _, _ = drawn(solution)
    assert sorted(r["p"] for r in found[NODES]) == pytest.approx(np.linspace(24.0, 29.0, n))
    assert len(found[MEANS]) == 2


def test_a_recovered_pressure_is_a_line_within_each_face(tmp_path):
    """p* = 25 + 3 y with y from −1/2 to 1/2 on each macro-element of 25, three faces each."""
    solution = handmade.plane(tmp_path)
    zone = solution.zones[0]
    zone.closed[:] = True
    zone.recovered = RecoveredPressure(
        form="linear",
        coefficients=np.full((2, 1), 3.0),
        degree=np.ones(2, dtype=int),
        centre=zone.centre,
        axes=np.tile([[[1 / 25, 0.0]]], (2, 1, 1)),
        spread=np.full((2, 1, 1), 1 / 12),
        nodes=zone.surfaces.slave_nodes,
        at_nodes=np.zeros(len(zone.surfaces.slave_nodes)),
    )
    records = drawn(solution)[0][RECOVERED]
    assert len({r["face"] for r in records}) == 6
    for r in records:
        middle = 12.5 if r["face"] < 3 else 37.5
        assert r["p"] == pytest.approx(25 + 3 * (r["s"] - middle) / 25, abs=1e-5)
    assert min(r["p"] for r in records) == pytest.approx(23.5)
    zone.closed[1] = False
    assert len({r["face"] for r in drawn(solution)[0][RECOVERED]}) == 3


def test_a_curved_interface_is_drawn_over_its_arc_length():
    """A quarter circle in 90 chords: places on it have the length of the chords before them."""
    angles = np.radians(np.arange(91))
    points = 2 * np.column_stack([np.cos(angles), np.sin(angles)])
    pairs = np.column_stack([np.arange(90), np.arange(1, 91)])
    zone = SimpleNamespace(faces=[("SEG2", pairs[::-1], np.arange(90))])
    arc = Arc.of(points, zone)
    chord = 4 * np.sin(np.radians(0.5))
    assert arc(points) == pytest.approx(chord * np.arange(91))
    assert arc((points[:1] + points[1:2]) / 2) == pytest.approx(chord / 2)


def test_a_closed_ring_starts_at_its_largest_x_and_the_axis_says_so(tmp_path):
    angles = np.radians(np.arange(360) * 1.0)
    points = 2 * np.column_stack([np.cos(angles), np.sin(angles)])
    pairs = np.roll(np.column_stack([np.arange(360), np.roll(np.arange(360), -1)]), 77, axis=0)
    arc = Arc.of(points, SimpleNamespace(faces=[("SEG2", pairs, np.arange(360))]))
    assert arc.ends[0, 0].tolist() == [2.0, 0.0]
    assert arc(points[[1, 90]]) == pytest.approx(4 * np.sin(np.radians(0.5)) * np.array([1, 90]))
    solution = handmade.plane(tmp_path)
    zone = solution.zones[0]
    zone.normal[0], zone.multiplier[:] = (1.0, 0.0), 1.0
    name, _ = position(solution, zone, None)
    assert name.startswith("arc length s from (")


def test_an_expression_is_shown_as_mathematics():
    assert mathematics("sqrt(x**2 + y**2)") == "√(x² + y²)"
    assert mathematics("2*pi*r**12 - (x - 0.5)**2") == "2·π·r^12 − (x − 0.5)²"


CASES = Path(__file__).parents[2] / "cases"


@pytest.mark.parametrize("file", sorted(CASES.glob(f"*/{FILE_NAME}")), ids=lambda f: f.parent.name)
def test_each_family_says_what_its_tolerances_are_made_of(file):
    family = read_family(file)
    assert not family.refusal
    assert family.tolerance or "tolerance" in family.reference


def test_the_page_has_the_text_on_tolerances(tmp_path):
    (tmp_path / "fam").mkdir()
    (tmp_path / "fam" / FILE_NAME).write_text("title: A family\ntolerance: Round-off, 1e-10.\n")
    path = put(tmp_path / "results" / "a" / "verdict.json", verdict("a", "passed"))
    out = tmp_path / "report"
    write_report([path], out, [tmp_path / "fam" / FILE_NAME])
    page = " ".join((out / "fam.html").read_text().split())
    assert "<h3>The tolerances</h3> <p>Round-off, 1e-10.</p>" in page
