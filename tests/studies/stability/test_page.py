"""The page of numerical stability: a square a point, a reason where the solve failed."""

import re

import pytest

from solver.studies.stability.figure import PANELS, digits, shade
from solver.studies.stability.page import read_records, write_stability
from solver.system.errors import InputError
from solver.verification.verdict import to_json
from tests.report.test_charts import specifications

PAGE, TABLE, FAILURES = (f"stability-quick{end}" for end in (".html", ".csv", "-failures.txt"))


def point(series, label, error, **more):
    measured = {
        "series": series,
        "label": label,
        "value": 1.0,
        "beyond": False,
        "holds": True,
        "word": "passed",
        "reason": "",
        "pressure": error,
        "stress": error,
        "floor_pressure": 1e-15,
        "floor_stress": 1e-15,
        "condition": 1e3,
        "inertia": [7, 0, 0],
        "inertia_by": "factor",
        "uncured": {"word": "passed", "reason": "", "pressure": 1e-3, "stress": 1e-2},
    }
    return measured | more


REFUSED = {"word": "refused", "reason": "folds <cells> over"}
RECORD = {
    "sweep": "pull",
    "title": "A pull & more",
    "breaks": "Breaks at 2.",
    "order": 2,
    "values": ["1", "2"],
    "cpu_seconds": 1.5,
    "points": [
        point("2D", "1", 2e-14),
        {**point("2D", "2", None, holds=False), **REFUSED, "uncured": REFUSED}
        | {"pressure": None, "stress": None, "floor_pressure": None},
        point("3D", "1", 3e-5, holds=False),
        point("3D", "2", 1e-3, word="unreliable", reason="rounding alone", stress=0.5),
    ],
}


@pytest.fixture
def written(tmp_path):
    for name, order in (("later", 3), ("pull", 2)):
        path = tmp_path / f"{name}.json"
        path.write_text(to_json(RECORD | {"sweep": name, "order": order}))
    records = read_records([tmp_path / "later.json", tmp_path / "pull.json"])
    return tmp_path, write_stability(records, tmp_path, quick=True)


def squares_of(page):
    """The squares of all maps, a map a sweep."""
    charts = specifications(page)
    assert sorted(charts) == ["map-later", "map-pull"]
    squares = [r for chart in charts.values() for r in chart["data"]["values"]]
    assert {r["panel"] for r in squares} == set(PANELS.values())
    framed = [(r["series"], r["value"]) for r in charts["map-pull"]["data"]["values"] if r["frame"]]
    assert framed == [("2D", "2"), ("3D", "1")]
    return squares


def test_every_point_has_three_squares_that_lead_to_its_row(written):
    folder, _ = written
    page = (folder / PAGE).read_text()
    squares = [r["url"].removeprefix("#") for r in squares_of(page)]
    rows = re.findall(r'<tr class="point[^"]*" id="([^"]+)"', page)
    assert len(rows) == len(set(rows)) == 8
    assert sorted(squares) == sorted(rows * 3)
    assert page.index("pull-2D-0") < page.index("later-2D-0")
    assert "Quick version" in page


def test_squares_say_digits_and_words(written):
    page = (written[0] / PAGE).read_text()
    texts = [r["text"] for r in squares_of(page)]
    assert texts.count("13") == 2  # 2e-14 leaves 13 digits, in two sweeps
    assert texts.count("4") == 2
    assert texts.count("refused") == 4  # with cures and without
    assert texts.count("3 / 0?") == 2
    assert "folds &lt;cells&gt; over" in page
    assert "A pull &amp; more" in page


def test_what_does_not_hold_is_told_and_the_rest_is_in_the_table(written):
    folder, logged = written
    lines = (folder / FAILURES).read_text().splitlines()
    assert lines[0] == "pull/2D/2: folds <cells> over"
    assert lines[1] == "pull/3D/1: pressure 3.0e-05, floor 1.0e-15; stress 3.0e-05, floor 1.0e-15"
    assert len(lines) == 4
    assert "4 of 8 points hold, in 2 sweeps." in logged
    assert len((folder / TABLE).read_text().splitlines()) == 9


def test_digits_and_their_shades():
    assert [digits(e) for e in (0.0, 1e-20, 9e-5, 1.0, 7.0, None)] == [16, 16, 4, 0, 0, None]
    shades = [shade(found) for found in range(17)]
    assert len(set(shades)) == 6
    # Lightness falls with every step, so that the shades differ without their hue.
    light = [sum(int(s[i : i + 2], 16) * w for i, w in ((1, 2), (3, 5), (5, 1))) for s in shades]
    assert light == sorted(light, reverse=True)


def test_a_file_that_is_no_record_is_refused(tmp_path):
    path = tmp_path / "odd.json"
    path.write_text("[1]")
    with pytest.raises(InputError, match=r"odd\.json: file: must be a record"):
        read_records([path])
