"""Plots of cost over size, log–log: a line for each series, or for each stage of one series."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from solver.report.axes import Scale, draw_axes
from solver.report.marks import MARKS, draw_marks
from solver.report.svg import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, RED, Drawing, Style

WIDTH, HEIGHT = 420, 330
SMALL = 320, 270
_COLORS = (BLUE, ORANGE, GREEN, PURPLE, INK, RED)


@dataclass(frozen=True)
class PlotLine:
    """A line of a plot: its name, places (n,) and values (n,), colour, mark, and tips."""

    name: str
    x: np.ndarray
    y: np.ndarray
    color: str
    mark: str
    tips: Sequence[str] = ()
    dashed: bool = False


def look(number: int) -> tuple[str, str]:
    """Colour and mark of the line of this number: either tells it from the others."""
    return _COLORS[number % len(_COLORS)], MARKS[number % len(MARKS)]


def draw_plot(
    title: str,
    x_label: str,
    y_label: str,
    lines: Sequence[PlotLine],
    slope: float = 1.0,
    size: tuple[int, int] = (WIDTH, HEIGHT),
) -> Markup:
    """The lines in one frame, with the direction of `slope` drawn as a dotted line."""
    width, height = size
    drawing = Drawing(width, height, title)
    places = np.concatenate([line.x for line in lines])
    values = np.concatenate([line.y for line in lines])
    x = Scale(places.min() / 1.3, places.max() * 1.3, 58, width - 14, log=True)
    y = Scale(values.min() / 1.6, values.max() * 1.6, height - 48, 34, log=True)
    draw_axes(drawing, x, y, x_label, y_label)
    _draw_guide(drawing, x, y, slope)
    for line in lines:
        _draw_line(drawing, x, y, line)
    return drawing.svg()


def draw_key(line: PlotLine) -> Markup:
    """The line and mark of a line, for the legend."""
    drawing = Drawing(44, 14, line.name)
    drawing.line(2, 7, 42, 7, **_style(line))
    draw_marks(drawing, line.mark, np.array([[22.0, 7.0]]), line.color, not line.dashed)
    return drawing.svg()


def draw_bar(parts: Mapping[str, float], colors: Mapping[str, str]) -> Markup:
    """Shares of a whole as one bar, its parts named under the pointer."""
    drawing, at, whole = Drawing(220, 12, "share of each stage"), 0.0, sum(parts.values())
    for name, value in parts.items():
        width = 220 * value / whole
        drawing.open_link("#", f"{name} {100 * value / whole:.0f} %")
        drawing.rectangle(at, 0, width, 12, fill=colors[name])
        drawing.close_link()
        at += width
    return drawing.svg()


def _style(line: PlotLine) -> dict[str, Style]:
    style: dict[str, Style] = {"stroke": line.color, "stroke_width": 1.6}
    return style | ({"stroke_dasharray": (5, 3)} if line.dashed else {})


def _draw_line(drawing: Drawing, x: Scale, y: Scale, line: PlotLine) -> None:
    at = np.column_stack([x(line.x), y(line.y)])
    drawing.polygons(at[None], closed=False, **_style(line))
    for place, tip in zip(at, line.tips or [""] * len(at), strict=True):
        if tip:
            drawing.open_link("#", tip)
        draw_marks(drawing, line.mark, place[None], line.color, filled=not line.dashed)
        if tip:
            drawing.close_link()


def _draw_guide(drawing: Drawing, x: Scale, y: Scale, slope: float) -> None:
    """A dotted line of the slope through the middle of the frame, as far as the frame reaches."""
    wide, high = np.log10(x.high / x.low), np.log10(y.high / y.low)
    reach = min(wide / 2, high / 2 / slope)
    ends = 10.0 ** np.array([-reach, reach])
    middle = np.sqrt(x.low * x.high), np.sqrt(y.low * y.high)
    (x1, x2), (y1, y2) = x(middle[0] * ends), y(middle[1] * ends**slope)
    drawing.line(x1, y1, x2, y2, stroke=MUTED, stroke_width=1, stroke_dasharray=(1.5, 3))
    drawing.text(x2 - 6, y2 + 14, f"∝ N^{slope:g}".removesuffix("^1"), "end", 10, MUTED)
