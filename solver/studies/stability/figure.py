"""The map of numerical stability: digits of the pressure, a square a point, three maps abreast."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from ...report import formats
from ...report.svg import INK, MUTED, RULE, Drawing
from ..points import Record

# Dark is good, also in greyscale (viridis; van der Walt and Smith).
_COLORS = (
    (12, "#440154"),
    (10, "#3b528b"),
    (8, "#21728c"),
    (6, "#27ad81"),
    (4, "#aadc32"),
    (-np.inf, "#fde725"),
)
NO_RESULT = "#e3e7eb"
MOST_DIGITS = 16
# Columns that a panel's title needs.
_FEWEST = 5
_WIDTH, _HEIGHT, _GAP, _LABEL = 37.0, 19.0, 34.0, 250.0
_PANELS = {"floor": "floor of double precision", "cured": "solved", "uncured": "without safeguards"}


def digits(error: float | None) -> int | None:
    """How many digits an error leaves, none to sixteen; None where there is no error."""
    if error is None:
        return None
    return int(np.clip(np.floor(-np.log10(error)), 0, MOST_DIGITS)) if error > 0 else MOST_DIGITS


def shade(found: int) -> str:
    """The colour of so many digits."""
    return next(color for least, color in _COLORS if found >= least)


def draw_key() -> Markup:
    """What the colours mean."""
    drawing = Drawing(640, 24, "Digits by colour")
    x = 0.0
    for low, high in ((12, 16), (10, 11), (8, 9), (6, 7), (4, 5), (0, 3)):
        _square(drawing, x, 2, f"{low} – {high}", shade(low), 62)
        x += 66
    _square(drawing, x, 2, "none", NO_RESULT, 62)
    drawing.text(x + 70, 16, "digits of the pressure", size=11, color=MUTED)
    return drawing.svg()


def draw_map(records: Sequence[Record]) -> Markup:
    """Sweeps down, values across; each point links to its row in the table."""
    columns = max((len(record["values"]) for record in records), default=0)
    panel = max(columns, _FEWEST) * _WIDTH + _GAP
    rows = sum(2 + len(_series(record)) for record in records)
    drawing = Drawing(_LABEL + 3 * panel, 30 + rows * _HEIGHT, "Digits of the pressure")
    for k, title in enumerate(_PANELS.values()):
        drawing.text(_LABEL + k * panel, 16, title, size=13, weight="600")
    y = 30.0
    for record in records:
        y = _draw_record(drawing, record, y, panel)
    return drawing.svg()


def _draw_record(drawing: Drawing, record: Record, y: float, panel: float) -> float:
    """One sweep: a line with its title, one with its values, one for each series."""
    drawing.line(0, y, drawing.width, y, stroke=RULE, stroke_width=0.8)
    drawing.text(0, y + 14, record["title"], size=11.5, weight="600")
    for k in range(len(_PANELS)):
        for column, label in enumerate(record["values"]):
            x = _LABEL + k * panel + (column + 0.5) * _WIDTH
            drawing.text(x, y + 1.68 * _HEIGHT, label, "middle", size=8, color=MUTED)
    y += 2 * _HEIGHT - 3
    for series in _series(record):
        drawing.text(_LABEL - 12, y + 13, series, "end", size=11, color=INK)
        points = [point for point in record["points"] if point["series"] == series]
        for column, point in enumerate(points):
            for k, name in enumerate(_PANELS):
                x = _LABEL + k * panel + column * _WIDTH
                _draw_point(drawing, record, point, name, (x, y))
        y += _HEIGHT
    return y + 3


def _draw_point(
    drawing: Drawing, record: Record, point: Record, name: str, place: tuple[float, float]
) -> None:
    source = point["uncured"] if name == "uncured" else point
    kinds = ("floor_pressure", "floor_stress") if name == "floor" else ("pressure", "stress")
    error, of_stress = (source.get(kind) for kind in kinds)
    found = digits(error)
    text = source["reason"] or "no floor"
    if error is not None:
        text = f"error of pressure {formats.error(error)}, of stress {formats.error(of_stress)}"
    where = f"{record['title']}: {point['label']}, {point['series']}"
    drawing.open_link(f"#{anchor(record, point)}", f"{where}: {_PANELS[name]}: {text}")
    if found is None:
        _square(drawing, *place, "–" if name == "floor" else source["word"], NO_RESULT, size=8)
    else:
        mark = "?" if name == "cured" and source["word"] == "unreliable" else ""
        stress = digits(of_stress) or 0
        less = f" / {stress}" if stress < found - 1 else ""
        size = 8.5 if less else 10
        _square(drawing, *place, f"{found}{less}{mark}", shade(found), size=size)
    if name == "cured" and not point["holds"]:
        x, y = place
        drawing.rectangle(
            x + 1.5, y + 1.5, _WIDTH - 5, _HEIGHT - 5, stroke="#d55e00", stroke_width=3.0
        )
    drawing.close_link()


def _square(
    drawing: Drawing,
    x: float,
    y: float,
    text: str,
    color: str,
    width: float = _WIDTH - 2,
    size: float = 10,
) -> None:
    drawing.rectangle(x, y, width, _HEIGHT - 2, fill=color)
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    light = 0.299 * red + 0.587 * green + 0.114 * blue > 140
    ink = INK if light else "#ffffff"
    drawing.text(x + width / 2, y + 12.5, text, "middle", size=size, color=ink)


def anchor(record: Record, point: Record) -> str:
    """The name of a point's row on the page."""
    number = list(record["values"]).index(point["label"])
    return f"{record['sweep']}-{point['series'].replace(', ', '-').replace(' ', '-')}-{number}"


def _series(record: Record) -> list[str]:
    return list(dict.fromkeys(point["series"] for point in record["points"]))
