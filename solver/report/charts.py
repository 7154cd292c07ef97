"""Charts as Vega-Lite specifications: records, and how they are shown.

A page embeds the specification, and one script beside the pages draws it without a network: values
under the pointer, series switched in the legend, zoom, saving. `Chart.svg` draws it for print.
Source of the grammar: Satyanarayan, Moritz, Wongsuphasawat, Heer, Vega-Lite: A Grammar of
Interactive Graphics, IEEE TVCG 23 (2017) 341–350.
"""

import json
import math
import re
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from ..system.files import write_text
from ..system.package import PROJECT

SCRIPT = "charts.js"
# Beside the packages that its content comes from.
KEPT = Path(sys.prefix, "share", PROJECT, "vega.js")
_SCHEMA = "https://vega.github.io/schema/vega-lite/v6.json"
_TEMPLATES = Path(__file__).with_name("templates")
EPSILON = float(np.finfo(float).eps)
INK, MUTED, PAPER, FLOOR = "#1f2933", "#66727f", "#ffffff", "#e6eaee"
# Colours that colour-blind readers can distinguish (Okabe and Ito).
BLUE, ORANGE, GREEN, RED, PURPLE = "#0072b2", "#d55e00", "#009e73", "#c1121f", "#aa5588"
# A cross with a surface: marks without lines are filled, and have no stroke.
CROSS = "M-1,-.6L-.6,-1L0,-.4L.6,-1L1,-.6L.4,0L1,.6L.6,1L0,.4L-.6,1L-1,.6L-.4,0Z"
SHAPES = ("circle", "square", "triangle-up", "triangle-down", "diamond", CROSS)
# The fewest digits kept that have a colour: dark is good, bad is told by its hue.
KEPT_DIGITS = {12: "#0b5d57", 10: "#1d7a74", 8: "#3f8f8a", 6: "#9cc7b8", 4: "#f3d28b", 0: "#e8794b"}
# Colours of series that no meaning sets apart; Okabe and Ito's yellow is left out, which paper does
# not show.
MANY = (BLUE, ORANGE, PURPLE, INK, GREEN, "#e69f00", "#56b4e9")
# Digits of a number in a page.
DIGITS = 10
# The values of a mark under the pointer: powers of ten as 1.2e-10.
_FORMAT = ".4~g"
# A logarithmic axis of at most so many times has labels at these multiples of powers of ten.
_LABELS = {5.0: "units", 300.0: "halves", math.inf: "decades"}

Spec = dict[str, Any]
Record = Mapping[str, Any]


@dataclass(frozen=True)
class Look:
    """How a series is drawn, on every page the same: colour, shape of its marks, dashes."""

    color: str
    shape: str = "circle"
    dashes: tuple[float, ...] = ()


# Colour and mark by the shape of cells.
LOOKS = {
    "TRIA": Look(BLUE),
    "TETRA": Look(BLUE),
    "QUAD": Look(ORANGE, "square"),
    "HEXA": Look(ORANGE, "square"),
    "PENTA": Look(GREEN, "triangle-up"),
    "PYRA": Look(PURPLE, "diamond"),
}


def shade_of(digits: int) -> str:
    """The colour of so many digits kept."""
    return next(color for least, color in KEPT_DIGITS.items() if digits >= least)


def look_of(cells: str, looks: Mapping[str, Look] = LOOKS) -> Look:
    """The look of a cell type: the first of `looks` whose key its name begins with."""
    return next(look for shape, look in looks.items() if cells.startswith(shape))


def distinct(looks: Mapping[str, Look]) -> dict[str, Look]:
    """The looks, with another mark where one is taken."""
    found: dict[str, Look] = {}
    for name, look in looks.items():
        others = (replace(look, shape=shape) for shape in (look.shape, *SHAPES))
        found[name] = next((other for other in others if other not in found.values()), look)
    return found


@dataclass(frozen=True)
class Axis:
    """A field along an axis: its title, logarithmic or with zero, its range if given."""

    field: str
    title: str
    log: bool = False
    domain: tuple[float, float] | None = None
    zero: bool = False

    def over(self, records: Sequence[Record]) -> "Axis":
        """The axis with a range for logarithms that holds all records."""
        values = [record[self.field] for record in records if record[self.field] is not None]
        if not self.log or self.domain or not values:
            return self
        return replace(self, domain=(min(values) / 1.2, max(values) * 1.2))

    def channel(self, **more: Any) -> Spec:
        """The channel of an encoding."""
        scale: Spec = {"zero": self.zero, "nice": False, "padding": 8}
        if self.log:
            scale = {"type": "log", "nice": False, "padding": 8}
        if self.domain:
            scale |= {"domain": list(self.domain), "padding": 0}
        times = self.domain[1] / self.domain[0] if self.domain and self.log else math.inf
        style = next(s for most, s in _LABELS.items() if times <= most) if self.log else "plain"
        return {
            "field": self.field,
            "type": "quantitative",
            "title": self.title,
            "scale": scale,
            "axis": {"style": style},
        } | more


@dataclass(frozen=True)
class Chart:
    """A chart: `name` is its anchor and the name of saved files, `width` its largest in pixels."""

    name: str
    title: str
    spec: Spec
    width: int = 560

    @property
    def full(self) -> Spec:
        """The specification that stands alone, in the colours of the report."""
        return {"$schema": _SCHEMA, "config": theme()["config"]} | self.spec

    def __html__(self) -> Markup:
        """Its place in a page that has the script; without it, a line that says what is missing."""
        brief = _short(self.spec | {"data": _tables(self.spec["data"]["values"])})
        spec = json.dumps(brief, ensure_ascii=False, separators=(",", ":"), default=float)
        return Markup(
            '<div class=chart id="{}" role=img aria-label="{}" style="max-width:{}px">'
            '<script type="application/json">{}</script><div class=drawn></div><p class=none>This '
            "chart needs JavaScript and the file {} beside this page.</p></div>"
        ).format(
            re.sub(r"[^\w*-]+", "-", self.name),
            self.title,
            self.width,
            Markup(spec.replace("<", "\\u003c")),
            SCRIPT,
        )

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        return {"application/vnd.vegalite.v6+json": self.full}

    def svg(self) -> str:
        """The chart as SVG, drawn without a browser."""
        import vl_convert

        return str(vl_convert.vegalite_to_svg(json.dumps(self.full, default=float)))


def _tables(records: Sequence[Record]) -> list[Spec]:
    """Records in tables of the same series and fields, which are named once in each.

    The script makes them records again.
    """

    def kind(record: Record) -> tuple[Any, ...]:
        return record.get("series"), *(field for field in record if field != "series")

    return [
        {"series": name, "fields": fields, "rows": [[r[f] for f in fields] for r in members]}
        for (name, *fields), members in groupby(records, kind)
    ]


def _short(value: Any) -> Any:
    """A part of a specification with numbers to `DIGITS` digits: more cannot be seen."""
    if isinstance(value, dict):
        return {key: _short(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_short(part) for part in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def write_script(folder: Path) -> None:
    """Write the script that draws charts into `folder`, unless it is there already."""
    own = (_TEMPLATES / SCRIPT).read_text(encoding="utf-8")
    head = _head()
    tail = f"\nconst THEME = {json.dumps(theme())};\n{own}"
    file = folder / SCRIPT
    there = file.read_text(encoding="utf-8") if file.is_file() else ""
    if not (there.startswith(head) and there.endswith(tail)):
        script = head + _libraries() + tail
        with suppress(FileNotFoundError):  # a page written at the same time wrote the same script
            write_text(file, script)


def _head() -> str:
    import vl_convert

    versions = vl_convert.get_vega_version(), vl_convert.get_vega_embed_version()
    return "// Vega {} and Vega-Embed {} (BSD-3-Clause)\n".format(*versions)


@cache
def _libraries() -> str:
    """Vega, Vega-Lite and Vega-Embed as one script; made in more than a second, so it is kept."""
    import vl_convert

    kept = KEPT.read_text(encoding="utf-8") if KEPT.is_file() else ""
    if kept.startswith(_head()):
        return kept.removeprefix(_head())
    script = str(vl_convert.javascript_bundle("window.vegaEmbed = vegaEmbed;"))
    with suppress(OSError):  # an environment that is not the user's
        write_text(KEPT, _head() + script)
    return script


@cache
def theme() -> Spec:
    """Fonts and colours of all charts, and the colours that replace them on a dark page."""
    return dict(json.loads((_TEMPLATES / "charts.json").read_text(encoding="utf-8")))


def series_chart(
    name: str,
    title: str,
    records: Sequence[Record],
    x: Axis,
    y: Axis,
    looks: Mapping[str, Look],
    *,
    lines: bool = True,
    tips: Mapping[str, str] | None = None,
    layers: Sequence[Spec] = (),
    marks: int = 45,
    order: str = "",
    span: tuple[str, str] | None = None,
    width: int = 560,
    height: int = 260,
) -> Chart:
    """Records by their `series` as marks, joined by lines, in the looks of these series.

    `tips` maps fields to their titles under the pointer, besides series, x and y; a `url` in a
    record makes its mark a link. `layers` are drawn below. `marks` is their area in pixels; they
    grow with the field `order`, by which lines go instead of by x. `span` names the fields of a
    range across a mark. Where a value of y is None, a line is broken.
    """
    x, y = x.over(records), y.over(records)
    shared = {"x": x.channel(), "y": y.channel()} | series(looks)
    shape, dash = shared.pop("shape"), shared.pop("strokeDash")
    titles = {"series": "series", x.field: x.title, y.field: y.title, **(tips or {})}
    of_marks: Spec = {"shape": shape, "tooltip": tooltip(records, titles)}
    of_lines: Spec = {"strokeDash": dash} if any(look.dashes for look in looks.values()) else {}
    if order:
        rank = {"field": order, "type": "quantitative"}
        of_lines["order"] = rank
        of_marks["size"] = rank | {"legend": None, "scale": {"range": [marks / 2, 3 * marks]}}
    if any("url" in record for record in records):
        of_marks["href"] = {"field": "url"}
    drawn: list[Spec] = []
    if lines:
        drawn.append({"mark": {"type": "line", "strokeWidth": 1.8}, "encoding": of_lines})
    if span:
        low = {"field": span[0], "type": "quantitative", "title": x.title}
        ends = {"x": low, "x2": {"field": span[1]}}
        drawn.append({"mark": "rule", "encoding": ends})
    point = {"type": "point", "filled": not lines, "size": marks, "strokeWidth": 1.8}
    drawn.append({"mark": point, "encoding": of_marks, "params": interaction()})
    layer = [*layers, {"encoding": shared, "layer": drawn}]
    spec = {"data": {"values": list(records)}, "width": width, "height": height, "layer": layer}
    return Chart(name, title, spec, width)


def series(looks: Mapping[str, Look], field: str = "series") -> Spec:
    """The channels of series in their looks, faint where the legend switches them off."""
    domain = list(looks)

    def channel(values: list[Any]) -> Spec:
        return {"field": field, "type": "nominal", "scale": {"domain": domain, "range": values}}

    return {
        "color": channel([look.color for look in looks.values()]),
        "shape": channel([look.shape for look in looks.values()]),
        "strokeDash": channel([list(look.dashes) or [1, 0] for look in looks.values()]),
        "opacity": {"condition": {"param": "shown", "value": 1}, "value": 0.08},
    }


def interaction(field: str = "series") -> list[Spec]:
    """Zoom by wheel with Ctrl, which alone scrolls the page, move by drag; series by the legend."""
    return [
        {
            "name": "zoom",
            "select": {"type": "interval", "zoom": "wheel![event.ctrlKey]"},
            "bind": "scales",
        },
        {"name": "shown", "select": {"type": "point", "fields": [field]}, "bind": "legend"},
    ]


def tooltip(records: Sequence[Record], titles: Mapping[str, str]) -> list[Spec]:
    """Tooltips: fields that records have, numbers to four digits."""
    found = []
    for field, title in titles.items():
        values = [record[field] for record in records if record.get(field) is not None]
        number = values and not isinstance(values[0], str)
        style = {"format": _FORMAT, "type": "quantitative"} if number else {"type": "nominal"}
        found.append({"field": field, "title": title} | style)
    return found


def level(
    value: float, label: str, color: str, dashes: Sequence[float] = (), left: bool = False
) -> Spec:
    """A line across the chart at a value of y, its label above, at the right or left end."""
    words = {"type": "text", "text": label, "dy": -6}
    words |= {"align": "left", "dx": 3} if left else {"align": "right", "dx": -3}
    end = {"x": {"value": 0 if left else "width"}}
    return {
        "data": {"values": [{}]},
        "encoding": {"y": {"datum": value}, "color": {"value": color}},
        "layer": [
            {"mark": {"type": "rule", "strokeDash": list(dashes)}},
            {"mark": words, "encoding": end},
        ],
    }


def floor_band(unknowns: int) -> Spec:
    """The band of round-off from ε to ε√N, N `unknowns`."""
    low, high = round_off(unknowns)
    return {
        "data": {"values": [{}]},
        "mark": {"type": "rect", "color": FLOOR},
        "encoding": {"y": {"datum": low}, "y2": {"datum": high}},
    }


def round_off(unknowns: int) -> tuple[float, float]:
    """The round-off floor: the unit round-off ε, and ε√N for N unknowns."""
    return EPSILON, EPSILON * max(1, unknowns) ** 0.5


def slopes(records: Sequence[Record], x: str, y: str, orders: Sequence[float]) -> list[Spec]:
    """The directions of orders in a log–log chart, in its lower right corner."""
    if len({record[x] for record in records}) < 2:
        return []
    low, high = (f(r[x] for r in records) for f in (min, max))
    foot = min(r[y] for r in records)
    start, end = (high / (high / low) ** share for share in (0.35, 0.08))
    rows = [
        {"x": at, "y": foot * (at / start) ** order, "order": f"{order:g}"}
        for order in orders
        for at in (start, end)
    ]
    place = {axis: {"field": axis, "type": "quantitative"} for axis in "xy"}
    order = {"field": "order", "type": "nominal"}
    label = {"type": "text", "align": "left", "dx": 4, "fontSize": 10}
    at_end = {"filter": f"datum.x > {start * 1.0001:.7g}"}
    return [
        {
            "data": {"values": rows},
            "encoding": place | {"color": {"value": MUTED}, "detail": order},
            "layer": [
                {"mark": {"type": "line", "strokeWidth": 1}},
                {"mark": label, "encoding": {"text": order}, "transform": [at_end]},
            ],
        }
    ]
