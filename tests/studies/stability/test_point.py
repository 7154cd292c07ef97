"""Points of a sweep: measured, judged, and on record whatever came of them."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from solver.simulation.options import Safeguards
from solver.studies.stability import point as measuring
from solver.studies.stability.description import read_sweep
from solver.studies.stability.point import run_sweep

SWEEPS = Path(__file__).resolve().parents[3] / "cases" / "stability" / "sweeps"


def run(name, tmp_path, **changes):
    sweep = replace(read_sweep(SWEEPS / f"{name}.yaml", quick=True), **changes)
    record = run_sweep(sweep, tmp_path / "record.json")
    assert json.loads((tmp_path / "record.json").read_text())["sweep"] == name
    return record["points"]


def test_a_point_has_all_measures(tmp_path):
    low, *_ = run("stiffness", tmp_path, values=(1e-8,), labels=("low",))
    assert low["holds"]
    assert low["word"] == "passed"
    assert max(low["pressure"], low["stress"], low["force"], low["moment"]) < 1e-13
    assert low["uncured"]["pressure"] > 1e-9
    assert low["iterations"] == 1
    # two blocks, one of them 1e-8 times as stiff
    assert 1e8 < low["condition"] < 1e13
    positive, negative, zero = low["inertia"]
    assert (negative, zero) == (0, 0)
    assert positive < low["unknowns"]


def test_a_large_system_is_known_to_be_definite_by_its_factor(tmp_path, monkeypatch):
    monkeypatch.setattr(measuring, "SMALL", 10)
    first, *_ = run("stiffness", tmp_path, values=(1.0,), labels=("one",))
    assert first["condition"] is None
    assert first["inertia_by"] == "factor"


def test_what_is_refused_or_fails_is_on_record_with_its_reason(tmp_path):
    flat, solid = run("distortion", tmp_path, values=(0.8,), labels=("0.8",))
    for point in (flat, solid):
        assert point["word"] == point["uncured"]["word"] == "refused"
        assert "folds cells over" in point["reason"]
        assert point["holds"]
    flat, solid = run("distortion", tmp_path, values=(0.8,), labels=("0.8",), beyond=())
    assert not flat["holds"]
    assert not solid["holds"]
    singular, *_ = run("poisson", tmp_path, values=(0.499999999999999,), labels=("½",))
    assert singular["word"] == "failed"
    assert "singular" in singular["reason"] or "positive" in singular["reason"]


def test_a_point_holds_by_its_floor_or_beyond_by_its_own_estimate():
    measured = {"word": "passed", "pressure": 3e-9, "stress": 1e-12, "attainable": 1e-8}
    low = {**measured, "floor_pressure": 1e-10, "floor_stress": 0.0}
    high = {**measured, "floor_pressure": 2e-10, "floor_stress": 0.0}
    assert not measuring._within(low)
    assert measuring._within(high)
    assert measuring._known_to_itself(low)
    assert not measuring._known_to_itself({**low, "attainable": 1e-9})
    assert measuring._known_to_itself({"word": "failed"})


@pytest.mark.parametrize("name", ["zone", "slivers", "warp"])
def test_quick_points_hold(name, tmp_path):
    assert all(point["holds"] for point in run(name, tmp_path))


def test_the_map_without_safeguards_is_of_a_plain_implementation(tmp_path):
    """What the two columns differ by: a tiny pressure is lost in gaps that are none."""
    sweep = read_sweep(SWEEPS / "tiny-pressure.yaml")
    point = measuring._Point(sweep, sweep.series[0], 1e-12, "tiny")
    assert measuring._measured(point, Safeguards())["pressure"] < 1e-12
    without = measuring._measured(point, Safeguards(gap_threshold=False))
    assert without["pressure"] > 1e-3
