"""The page of growth with size, on records whose costs are chosen powers of the size."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from solver.studies.scaling.description import read_scaling
from solver.studies.scaling.page import write_scaling
from solver.studies.scaling.records import (
    OTHER,
    failures,
    reached,
    read_series,
    speed_ups,
)
from tests.browser import MISSING, browser
from tests.report.test_charts import specifications

ROOT = Path(__file__).parents[3]


@pytest.fixture
def scaling():
    """Two series of the project's family; the second one meets a reason with markup in it."""
    full = read_scaling(ROOT / "cases/scaling/scaling.yaml")
    chosen = [s for s in full.series if s.name in ("hexa8", "quad4")]
    return replace(full, series=tuple(chosen))


def record(point, **more):
    """Time grows with exponent 1.3, pairing with 1 over faces, memory in proportion."""
    n, faces = point.size, round(point.size ** (2 / 3))
    stages = {"read": 1e-6 * n, "pairing": 1e-4 * faces, "solve": 1e-6 * n**1.3}
    process = {"wall": 1.0, "cpu": 2 * sum(stages.values()), "peak_memory_mb": 0.01 * n}
    return {
        "point": point.name,
        "outcome": "solved",
        "reason": "",
        "verdict": "passed",
        "dofs": n,
        "faces": faces,
        "macro_elements": faces // 2,
        "matrix_entries": 80 * n,
        "iterations": 1,
        "linear_iterations": 40,
        "linear_solver": "multigrid",
        "seconds": stages,
        "stage_cpu_seconds": stages,
        "process": process,
        "meshing": process,
        "errors": {"pressure_max": 1e-12},
        "threads": 2,
        "load": 0.5,
        "memory_free_gb": 20.0,
        "machine": {"cpu": "A machine", "time_utc": "2026-01-02T03:04:05+00:00"},
        **more,
    }


@pytest.fixture
def results(scaling, tmp_path):
    for point in scaling.points:
        path = tmp_path / "records" / f"{point.name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        lost = {"outcome": "refused", "reason": "memory: <more> & more", "process": {}}
        last = point.name == "quad4/1000000"
        path.write_text(json.dumps(record(point, **(lost if last else {}))))
    return tmp_path / "records"


def test_exponents_are_those_of_the_records(scaling, results):
    hexa, quad = read_series(scaling, results)
    assert hexa.growth("solve").value == pytest.approx(1.3)
    assert hexa.growth("pairing").value == pytest.approx(1.0, abs=1e-3)
    assert hexa.growth("memory").value == pytest.approx(1.0)
    assert (hexa.growth("whole").low, hexa.growth("whole").high) == (1e5, 1e6)
    # The time outside all stages equals theirs: it grows as the whole.
    assert hexa.growth(OTHER).value == pytest.approx(hexa.growth("whole").value)
    assert [m.point.size for m in quad.fitted] == [100_000, 300_000]


def test_goals_are_compared_with_what_was_measured(scaling, results):
    lines = read_series(scaling, results)
    found = {(r.goal.series, r.goal.what, r.goal.size): r for r in reached(scaling, lines)}
    memory = found["hexa8", "memory", 100_000]
    assert (memory.value, memory.good) == (pytest.approx(1.0), True)
    cpu = found["hexa8", "cpu", 1_000_000]
    assert cpu.value == pytest.approx(2 * (1 + 1 + 1e-6 * 1e6**1.3))
    assert not found["hexa8", "growth of whole", None].good
    assert found["hexa8", "growth of pairing", None].good
    assert found["fine-slave", "growth of pairing", None].value is None


def test_a_goal_may_be_a_ratio_to_another_series(scaling, results):
    """A sphere that takes six statuses and 2.5 times the time of the blocks."""
    full = read_scaling(scaling.path)
    sphere = next(s for s in full.series if s.name == "sphere")
    both = replace(scaling, series=(*scaling.series, sphere))
    (results / "sphere").mkdir()
    goals = {("cpu", "hexa8"): (2.5, True), ("statuses", None): (6, True)}
    for point in [p for p in both.points if p.series is sphere]:
        slow = record(point, iterations=6)
        slow["process"] = slow["process"] | {"cpu": 2.5 * slow["process"]["cpu"]}
        (results / f"{point.name}.json").write_text(json.dumps(slow))
    found = [r for r in reached(both, read_series(both, results)) if r.goal.series == "sphere"]
    assert {(r.goal.what, r.goal.over): (pytest.approx(r.value), r.good) for r in found} == goals
    (results / "hexa8" / "300000.json").unlink()
    found = [r for r in reached(both, read_series(both, results)) if r.goal.over == "hexa8"]
    assert [(r.value, r.why) for r in found] == [(None, "missing: not measured")]


def test_an_exponent_of_small_sizes_answers_no_goal(scaling, results):
    series = tuple(structs.replace(s, sizes=s.sizes[:2]) for s in scaling.series)
    small = replace(scaling, series=series)
    growth = [r for r in reached(small, read_series(small, results)) if "growth" in r.goal.what]
    assert all(r.value is None for r in growth)


def test_the_page_says_what_the_records_do(scaling, results, tmp_path):
    logged = write_scaling(scaling, results, tmp_path / "page")
    page = (tmp_path / "page" / "scaling.html").read_text()
    assert "9 of 10 points are measured. 1 have no solve" in page
    assert "memory: &lt;more&gt; &amp; more" in page
    assert "<more>" not in page
    assert "<td class=n>1,000,000</td>" in page
    assert "1.30" in page
    charts = specifications(page)
    solved = [line for line in read_series(scaling, results) if line.solved]
    assert len(charts) == 3 * len({line.series.dim for line in solved}) + 1 + len(solved)
    whole = charts["3D-processor-time-of-the-whole-process-s"]["data"]["values"]
    assert {(r["series"], r["size"]) for r in whole} >= {("HEXA8", 10_000), ("HEXA8", 1_000_000)}
    assert logged.endswith("scaling.html")
    with (tmp_path / "page" / "scaling.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(scaling.points)
    assert [r["reason"] for r in rows if r["outcome"] != "solved"] == ["memory: <more> & more"]
    with (tmp_path / "page" / "scaling-exponents.csv").open() as stream:
        exponents = {(r["series"], r["cost"]): r for r in csv.DictReader(stream)}
    assert float(exponents["hexa8", "solve"]["exponent"]) == pytest.approx(1.3)
    assert exponents["hexa8", "pairing"]["over"] == "faces"


def test_speed_up_is_wall_time_on_few_threads_over_that_on_many(scaling, results, tmp_path):
    hexa = next(s for s in scaling.series if s.name == "hexa8")
    one = structs.replace(hexa, name="hexa8-one", title="HEXA8 on one thread", threads=1)
    both = replace(scaling, series=(*scaling.series, one))
    (results / "hexa8-one").mkdir()
    for point in [p for p in both.points if p.series is one]:
        slow = record(point, threads=1)
        slow["seconds"] = slow["seconds"] | {"solve": 1.8 * slow["seconds"]["solve"]}
        slow["process"] = slow["process"] | {"wall": 1.5}
        (results / f"{point.name}.json").write_text(json.dumps(slow))
    found = speed_ups(read_series(both, results))
    assert [(u.one.point.series.name, u.other.point.size) for u in found] == [
        ("hexa8-one", size) for size in hexa.sizes
    ]
    assert [u.of("whole") for u in found] == pytest.approx([1.5] * len(found))
    assert found[-1].of("solve") == pytest.approx(1.8)
    assert found[0].of("read") is None
    write_scaling(both, results, tmp_path / "page")
    page = (tmp_path / "page" / "scaling.html").read_text()
    assert "Speed-up over threads" in page
    assert "1 → 2" in page
    assert ">1.80<" in page
    # 0.01 MB for each unknown.
    assert "<td class=n>10.00</td>" in page
    write_scaling(scaling, results, tmp_path / "page")
    assert "Speed-up" not in (tmp_path / "page" / "scaling.html").read_text()


def test_points_whose_checks_fail_are_listed(scaling, results):
    path = results / "hexa8" / "10000.json"
    path.write_text(
        json.dumps(json.loads(path.read_text()) | {"verdict": "failed", "reason": "pressure"})
    )
    assert ("hexa8/10000", "failed: pressure") in failures(read_series(scaling, results))


def test_a_family_without_any_record_still_has_a_page(scaling, tmp_path):
    write_scaling(scaling, tmp_path / "nothing", tmp_path)
    page = (tmp_path / "scaling.html").read_text()
    assert "not measured" in page
    assert "These sizes answer no goal" in page


def test_bytes_are_written_out_in_full(scaling, results, tmp_path):
    part = {"seconds": 2.0, "bytes": 1.5e11, "cpu": 2.0}
    products = {"outcome": "solved", "bandwidth": 1e10, "threads": 2, "dofs": 10_000}
    path = results / "hexa8" / "1000000.json"
    moved = {"products": products | {"parts": {"solve": part, "read": part | {"bytes": 3e6}}}}
    path.write_text(json.dumps(json.loads(path.read_text()) | moved))
    write_scaling(scaling, results, tmp_path / "page")
    page = (tmp_path / "page" / "scaling.html").read_text()
    for cells in ("150 GB</td><td class=n>75 GB/s<", "3 MB</td><td class=n>1.5 MB/s<"):
        assert cells in page


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_the_table_of_goals_fits_a_window(scaling, results, tmp_path):
    """Also beside the longest reason in place of a number."""
    write_scaling(scaling, results, tmp_path)
    with browser() as window:
        window.open(tmp_path / "scaling.html", 1280)
        wide = "document.querySelector('#goals .wide')"
        assert window.run(f"{wide}.scrollWidth - {wide}.clientWidth") == 0
