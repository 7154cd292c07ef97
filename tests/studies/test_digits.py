"""Digits that are left: points measured, judged, and drawn whatever came of them."""

import pytest

from solver.report.charts import shade_of
from solver.simulation.options import Safeguards
from solver.studies import digits
from solver.studies.description import read_study
from solver.studies.figures import digits as figure
from solver.studies.points import points_of
from tests.studies.measured import STABILITY, group, point, study


def measured(name, series="2D", **values):
    return digits.measure(point(STABILITY, name, series, **values))


def test_a_point_has_all_measures():
    low = measured("stiffness", x=1e-8)
    assert low["holds"]
    assert low["word"] == "passed"
    assert max(low["pressure"], low["stress"], low["force"], low["moment"]) < 1e-13
    assert low["uncured"]["pressure"] > 1e-9
    assert low["iterations"] == 1
    # two blocks, one of them 1e-8 times as stiff
    assert 1e8 < low["condition"] < 1e13
    positive, negative, zero = low["inertia"]
    assert (negative, zero) == (0, 0)
    assert positive < low["dofs"]


def test_a_large_system_is_known_to_be_definite_by_its_factor(monkeypatch):
    monkeypatch.setattr(digits, "SMALL", 10)
    one = measured("stiffness", x=1.0)
    assert (one["condition"], one["inertia_by"]) == (None, "factor")


@pytest.mark.parametrize("series", ["2D", "3D"])
def test_what_is_refused_or_fails_is_on_record_with_its_reason(series):
    folded = measured("distortion", series, x=0.8)
    assert folded["word"] == folded["uncured"]["word"] == "refused"
    assert "folds cells over" in folded["reason"]
    assert folded["holds"]
    assert not measured("distortion", series, x=0.85)["holds"]  # not among those beyond the end


def test_a_singular_system_fails():
    singular = measured("poisson", "2D, displacement", x=0.499999999999999)
    assert singular["word"] == "failed"
    assert "singular" in singular["reason"] or "positive" in singular["reason"]


def test_a_point_holds_by_its_floor_or_beyond_by_its_own_estimate():
    record = {"word": "passed", "pressure": 3e-9, "stress": 1e-12, "attainable": 1e-8}
    low = {**record, "floor_pressure": 1e-10, "floor_stress": 0.0}
    assert not digits.is_within(low)
    assert digits.is_within({**record, "floor_pressure": 2e-10, "floor_stress": 0.0})
    assert digits.knows_itself(low)
    assert not digits.knows_itself({**low, "attainable": 1e-9})
    assert digits.knows_itself({"word": "failed"})


@pytest.mark.parametrize("name", ["zone", "slivers", "warp"])
def test_quick_points_hold(name):
    quick = read_study(STABILITY, "quick")
    assert all(digits.measure(p)["holds"] for p in points_of(quick, quick.group(name)))


def test_the_map_without_safeguards_is_of_a_plain_implementation():
    """What the two columns differ by: a tiny pressure is lost in gaps that are none."""
    tiny = point(STABILITY, "tiny-pressure", "2D", x=1e-12)
    assert digits._measured(tiny, Safeguards())["pressure"] < 1e-12
    assert digits._measured(tiny, Safeguards(gap_threshold=False))["pressure"] > 1e-3


def record(error, word="passed", holds=True, reason="", **more):
    known = {"floor_pressure": 1e-15, "floor_stress": 1e-15, "pressure": error, "stress": error}
    uncured = {"word": "passed", "reason": "", "pressure": 1e-3, "stress": 1e-2}
    told = {"word": word, "holds": holds, "reason": reason, "beyond": False, "uncured": uncured}
    return known | told | more


REFUSED = {"word": "refused", "reason": "folds <cells> over"}
RECORDS = [
    record(2e-14),
    record(None, holds=False, floor_pressure=None, floor_stress=None, uncured=REFUSED, **REFUSED),
    record(3e-5, holds=False),
    record(1e-3, "unreliable", reason="rounding alone", stress=0.5),
]
PULL = """
{name: s, title: Digits, figure: digits, measure: digits, groups: [{name: pull, title: A pull,
 vary: {x: [1, 2, 3, 4]}, series: [{name: 2D, case: quad4.yaml}]}]}
"""


def test_every_point_has_three_squares_that_lead_to_its_row():
    records = iter(RECORDS)
    of = study(PULL)
    pull = group(of, lambda _: next(records))
    shown = figure.show(of, [pull])
    [chart] = shown.sections[0].figures
    squares = chart.spec["data"]["values"]
    assert len(squares) == 12
    names = {f"#{row.name}" for row in shown.sections[1].tables[0].rows}
    assert {square["url"] for square in squares} == names
    texts = {(s["value"], s["panel"]): s["text"] for s in squares}
    solved = figure.PANELS["cured"]
    assert [texts[value, solved] for value in "1234"] == ["13", "refused", "4", "3 / 0?"]
    assert [s["frame"] for s in squares if s["panel"] == solved] == [False, True, True, False]
    assert shown.problems == [
        "pull/2D/2: folds <cells> over",
        "pull/2D/3: pressure 3.0e-05, floor 1.0e-15; stress 3.0e-05, floor 1.0e-15",
    ]
    assert shown.outcome == "2 of 4 points hold, in 1 sweeps."


def test_digits_and_their_shades():
    assert [figure.digits(e) for e in (0.0, 1e-20, 2e-14, 0.5, 7.0)] == [16, 16, 13, 0, 0]
    assert figure.digits(None) is None
    assert shade_of(16) != shade_of(11) != shade_of(0)
