"""The map of numerical stability: digits of the pressure, a square a point, three maps abreast."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from ...report import formats
from ...report.charts import KEPT_DIGITS, ORANGE, Chart, Spec, shade_of, tooltip
from ..description import Study
from ..page import MeasuredGroup, PageSection, Shown, Table, TableRow, lost_points

Record = Mapping[str, Any]
NO_RESULT = "#b9c1c9"
MOST_DIGITS = 16
# Text is light from so many digits on.
_DARK = 8
_STEP = {"width": {"step": 44}, "height": {"step": 21}}
PANELS = {"floor": "floor of double precision", "cured": "solved", "uncured": "without safeguards"}
_TIPS = {
    "panel": "map",
    "series": "mesh",
    "value": "value",
    "digits": "digits of the pressure",
    "pressure": "error of pressure",
    "stress": "error of stress",
    "reason": "reason",
}
MEASURES = {
    "pressure": "pressure",
    "stress": "stress",
    "floor_pressure": "floor, pressure",
    "floor_stress": "floor, stress",
    "attainable": "estimate",
    "gap": "gap",
    "force": "balance, forces",
    "moment": "balance, moments",
    "residual": "residual",
}
_HEAD = [
    *("Mesh", "Value", *MEASURES.values(), "Solves", "Condition", "Inertia"),
    *("Without safeguards: pressure", "stress", "Verdict"),
]


def show(_: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """A map for each group, then its points in a table."""
    maps: list[Chart] = []
    tables: list[PageSection] = []
    problems = lost_points(groups)
    for one in groups:
        points = [point for point in one.points if "word" in point]
        maps.append(draw_map(one, points))
        rows = [_row(one, point, i, points) for i, point in enumerate(points)]
        tables.append(
            PageSection(
                one.group.name, f"{one.title}: points", one.group.text, tables=[Table(_HEAD, rows)]
            )
        )
        problems += [
            f"{one.group.name}/{point['name']}: {_why(point)}"
            for point in points
            if not point["holds"]
        ]
    every = [point for one in groups for point in one.points]
    held = sum(bool(point.get("holds")) for point in every)
    outcome = f"{held} of {len(every)} points hold, in {len(groups)} sweeps."
    legend = Markup("").join(_legend())
    overview = PageSection("maps", "Digits of the pressure, by sweep", legend, maps)
    return Shown([overview, *tables], problems, outcome)


def card(groups: Sequence[MeasuredGroup]) -> dict[str, Any]:
    """Where each quantity leaves the fewest digits of the pressure, with and without safeguards.

    Of the points that a solve has to master; None where one has no result.
    """
    quantities = {}
    for one in groups:
        worst: dict[str, list[int | None]] = {}
        for line in ("2D", "3D"):
            points = [p for p in one.points if p["line"] == line and not p.get("beyond", True)]
            if points:
                cured = [digits(point.get("pressure")) for point in points]
                uncured = [digits(point["uncured"].get("pressure")) for point in points]
                worst[line] = [_fewest(cured), _fewest(uncured)]
        if worst:
            quantities[one.title] = {"map": f"map-{one.group.name}", "digits": worst}
    return {"quantities": quantities}


def _fewest(counts: Sequence[int | None]) -> int | None:
    return None if None in counts else min(count for count in counts if count is not None)


def _legend() -> list[Markup]:
    """The colours; the number is the fewest digits that have it."""
    swatch = Markup('<span class=stage><i style="background:{}"></i>{}</span>')
    last = list(KEPT_DIGITS)[-1]
    return [
        swatch.format(color, f"{least} or more digits" if least != last else "fewer")
        for least, color in KEPT_DIGITS.items()
    ]


def _why(point: Record) -> str:
    pairs = (
        (point[name], point[f"floor_{name}"]) for name in ("pressure", "stress") if name in point
    )
    texts = [f"{formats.error(value)}, floor {formats.error(least)}" for value, least in pairs]
    return point["reason"] or f"pressure {texts[0]}; stress {texts[1]}"


def digits(error: float | None) -> int | None:
    """How many digits an error leaves, none to sixteen; None where there is no error."""
    if error is None:
        return None
    return int(np.clip(np.floor(-np.log10(error)), 0, MOST_DIGITS)) if error > 0 else MOST_DIGITS


def draw_map(group: MeasuredGroup, points: Sequence[Record]) -> Chart:
    """A sweep: values across, meshes down; each square links to its row in the table."""
    squares = [_square(group, point, name) for point in points for name in PANELS]
    labels = list(dict.fromkeys(square["value"] for square in squares))
    values = {"field": "value", "type": "ordinal", "sort": labels, "title": None}
    meshes = {"field": "series", "type": "nominal", "sort": None, "title": None}
    channels = {
        "x": values | {"axis": {"labelAngle": 0, "orient": "top", "labelOverlap": False}},
        "y": meshes | {"axis": {"labelLimit": 220}},
    }
    fill = {"field": "color", "type": "nominal", "scale": None}
    links: Spec = {"href": {"field": "url"}, "tooltip": tooltip(squares, _TIPS)}
    frame = {"condition": {"test": "datum.frame", "value": 3}, "value": 0}
    light = {"condition": {"test": f"datum.digits >= {_DARK}", "value": "#fefefe"}}
    rect = {"type": "rect", "stroke": ORANGE, "cursor": "pointer"}
    words = {"text": {"field": "text"}, "color": light | {"value": "#101418"}}
    layers = [
        {"mark": rect, "encoding": channels | links | {"color": fill, "strokeWidth": frame}},
        {"mark": {"type": "text", "fontSize": 10}, "encoding": channels | links | words},
    ]
    panels = {"field": "panel", "sort": list(PANELS.values()), "title": None}
    spec = {
        "data": {"values": squares},
        "facet": {"column": panels},
        "spec": _STEP | {"layer": layers},
    }
    return Chart(f"map-{group.group.name}", f"{group.title}: digits of the pressure", spec, 2000)


def _square(group: MeasuredGroup, point: Record, name: str) -> dict[str, Any]:
    source = point["uncured"] if name == "uncured" else point
    kinds = ("floor_pressure", "floor_stress") if name == "floor" else ("pressure", "stress")
    error, of_stress = (source.get(kind) for kind in kinds)
    count, stress = digits(error), digits(of_stress) or 0
    if count is None:
        text = formats.NOTHING if name == "floor" else source["word"]
    else:
        less = f" / {stress}" if stress < count - 1 else ""
        mark = "?" if name == "cured" and source["word"] == "unreliable" else ""
        text = f"{count}{less}{mark}"
    return {
        "panel": PANELS[name],
        "series": point["line"],
        "value": _value(point),
        "digits": count,
        "pressure": error,
        "stress": of_stress,
        "reason": source["reason"] if count is None else "",
        "text": text,
        "color": NO_RESULT if count is None else shade_of(count),
        "frame": name == "cured" and not point["holds"],
        "url": f"#{anchor(group, point)}",
    }


def _value(point: Record) -> str:
    return ", ".join(point["labels"].values())


def anchor(group: MeasuredGroup, point: Record) -> str:
    """The name of a point's row on the page."""
    return f"{group.group.name}-{group.points.index(point)}"  # type: ignore[arg-type]


def _row(group: MeasuredGroup, point: Record, number: int, points: Sequence[Record]) -> TableRow:
    uncured, inertia = point["uncured"], point.get("inertia")
    shown = (
        " ".join(map(str, inertia)) + "*" * (point["inertia_by"] == "factor") if inertia else "–"
    )
    said = point["reason"] or (
        f"without safeguards: {uncured['reason']}" if uncured["reason"] else ""
    )
    verdict = Markup('<span class="badge {0}">{0}</span><div class=said>{1}</div>').format(
        point["word"], said
    )
    first = number == 0 or points[number - 1]["line"] != point["line"]
    cells = [
        *(point["line"], _value(point), *(formats.error(point.get(name)) for name in MEASURES)),
        *(str(point.get("iterations", "–")), formats.error(point.get("condition")), shown),
        *(formats.error(uncured.get("pressure")), formats.error(uncured.get("stress")), verdict),
    ]
    kind = " ".join(["lost"] * (not point["holds"]) + ["first"] * first)
    return TableRow(cells, anchor(group, point), kind)
