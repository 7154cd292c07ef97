"""Plots of the studies: lines with marks in a log–log frame, their keys, shares as a bar."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from markupsafe import Markup

from ..report.axes import Scale, draw_axes
from ..report.marks import draw_marks
from ..report.svg import MUTED, Drawing, Style

SIZE, SMALL = (420, 330), (320, 270)
Range = tuple[float, float]


@dataclass(frozen=True)
class PlotLine:
    """A line of a plot: its name, places (n,) and values (n,), looks, and a tip for each mark.

    `sizes` of the marks: one, or one for each; no marks where it is zero. `spans` (n, 2): ranges of
    x, drawn across the marks.
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    color: str
    mark: str = "circle"
    dashes: tuple[float, ...] = ()
    filled: bool = True
    width: float = 1.6
    tips: Sequence[str] = ()
    sizes: float | Sequence[float] = 3.5
    spans: np.ndarray | None = None

    def draw(self, drawing: Drawing, x: Scale, y: Scale) -> None:
        """Draw it with these scales."""
        at = np.column_stack([x(self.x), y(self.y)])
        self._stroke(drawing, at)
        for i, size in enumerate(np.broadcast_to(self.sizes, len(at))):
            if self.tips:
                drawing.open_link("#", self.tips[i])
            if size:
                draw_marks(drawing, self.mark, at[i : i + 1], self.color, self.filled, float(size))
            if self.tips:
                drawing.close_link()
        if self.spans is not None:
            ends = np.stack([x(self.spans), np.repeat(at[:, 1:], 2, axis=1)], axis=2)
            drawing.polygons(ends, closed=False, stroke=self.color, stroke_width=1)

    def _stroke(self, drawing: Drawing, at: np.ndarray) -> None:
        style: dict[str, Style] = {"stroke": self.color, "stroke_width": self.width}
        if self.dashes:
            style["stroke_dasharray"] = self.dashes
        drawing.polygons(at[None], closed=False, **style)

    def draw_key(self, drawing: Drawing, x: float, y: float, length: float) -> None:
        """Draw a piece of the line with its mark in the middle."""
        ends = np.array([[x, y], [x + length, y]])
        self._stroke(drawing, ends)
        draw_marks(drawing, self.mark, ends.mean(axis=0)[None], self.color, self.filled)

    def key(self) -> Markup:
        """A piece of the line with its mark, for a legend."""
        drawing = Drawing(44, 14, self.name)
        self.draw_key(drawing, 2, 7, 40)
        return drawing.svg()


def draw_lines(
    title: str,
    x_label: str,
    y_label: str,
    lines: Sequence[PlotLine],
    slopes: Sequence[float] = (),
    size: tuple[int, int] = SIZE,
    y_range: Range | None = None,
) -> Markup:
    """Lines in one frame, both axes logarithmic; beside them the directions of `slopes`.

    Values below `y_range` are drawn at its lower end.
    """
    width, height = size
    drawing = Drawing(width, height, title)
    x = Scale(*_range([line.x for line in lines], 1.2), 58, width - 14, log=True)
    low, high = y_range or _range([line.y for line in lines], 1.6)
    y = Scale(low, high, height - 48, 34, log=True)
    draw_axes(drawing, x, y, x_label, y_label)
    _draw_slopes(drawing, x, y, slopes)
    for line in lines:
        replace(line, y=np.maximum(line.y, low)).draw(drawing, x, y)
    return drawing.svg()


def _range(values: Sequence[np.ndarray], factor: float) -> Range:
    joined = np.concatenate(values)
    return float(joined.min() / factor), float(joined.max() * factor)


def _draw_slopes(drawing: Drawing, x: Scale, y: Scale, slopes: Sequence[float]) -> None:
    """A fan of slopes in the lower right corner, which errors and costs leave free."""
    start = np.array([x.end - 0.36 * (x.end - x.start), y.start - 12])
    decades = 0.27 * np.log10(x.high / x.low)
    pixels = (y.start - y.end) / np.log10(y.high / y.low)
    lowest = start[1]  # of the labels, which must not cover one another
    for slope in slopes:
        end = start + np.array([0.27 * (x.end - x.start), -slope * decades * pixels])
        drawing.line(*start, *end, stroke=MUTED, stroke_width=1)
        lowest = min(lowest - 10, end[1] + 4)
        drawing.text(end[0] + 4, lowest, f"{slope:g}", size=10, color=MUTED)


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
