"""The map of numerical stability: digits of the pressure, a square a point, three maps abreast."""

from typing import Any

import numpy as np

from ...report import formats
from ...report.charts import ORANGE, Chart, Spec, tooltip
from ..points import Record

# Fewest digits and colour, dark is good, also in greyscale (viridis; van der Walt and Smith).
COLORS = {
    12: "#440154",
    10: "#3b528b",
    8: "#21728c",
    6: "#27ad81",
    4: "#aadc32",
    0: "#fde725",
}
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


def digits(error: float | None) -> int | None:
    """How many digits an error leaves, none to sixteen; None where there is no error."""
    if error is None:
        return None
    return int(np.clip(np.floor(-np.log10(error)), 0, MOST_DIGITS)) if error > 0 else MOST_DIGITS


def shade(found: int) -> str:
    """The colour of so many digits."""
    return next(color for least, color in COLORS.items() if found >= least)


def draw_map(record: Record) -> Chart:
    """A sweep: values across, meshes down; each square links to its row in the table."""
    squares = [_square(record, point, name) for point in record["points"] for name in PANELS]
    values = {"field": "value", "type": "ordinal", "sort": list(record["values"]), "title": None}
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
    return Chart(f"map-{record['sweep']}", f"{record['title']}: digits of the pressure", spec, 2000)


def _square(record: Record, point: Record, name: str) -> dict[str, Any]:
    source = point["uncured"] if name == "uncured" else point
    kinds = ("floor_pressure", "floor_stress") if name == "floor" else ("pressure", "stress")
    error, of_stress = (source.get(kind) for kind in kinds)
    found, stress = digits(error), digits(of_stress) or 0
    if found is None:
        text = formats.NOTHING if name == "floor" else source["word"]
    else:
        less = f" / {stress}" if stress < found - 1 else ""
        mark = "?" if name == "cured" and source["word"] == "unreliable" else ""
        text = f"{found}{less}{mark}"
    return {
        "panel": PANELS[name],
        "series": point["series"],
        "value": point["label"],
        "digits": found,
        "pressure": error,
        "stress": of_stress,
        "reason": source["reason"] if found is None else "",
        "text": text,
        "color": NO_RESULT if found is None else shade(found),
        "frame": name == "cured" and not point["holds"],
        "url": f"#{anchor(record, point)}",
    }


def anchor(record: Record, point: Record) -> str:
    """The name of a point's row on the page."""
    number = list(record["values"]).index(point["label"])
    return f"{record['sweep']}-{point['series'].replace(', ', '-').replace(' ', '-')}-{number}"
