"""The figure of a panel: log–log error against time, a plot for each pair, a line per treatment."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from markupsafe import Markup

from ...report.axes import (
    EPSILON,
    FLOOR,
    Scale,
    draw_axes,
    draw_floor,
    draw_level,
    round_off,
)
from ...report.html import NORMS
from ...report.marks import MARKS
from ...report.svg import INK, MUTED, RED, Drawing
from ..plots import PlotLine
from .records import LevelLine, Panel, TimedSolve, shown

PLOT, HEIGHT, LEFT, RIGHT, APART = 268, 340, 58, 112, 14
# A row of the legend, about the width of a letter in it, the height of a label.
_ROW, _LETTER, _LABEL = 18, 5.5, 13
# The strip under a plot that does not reach down to round-off.
_STRIP = 16
_BOTTOM = HEIGHT - 48
_NEAR = 1e-11
LIMIT = 1e-3
# Okabe and Ito's colours; yellow is left out, which paper does not show.
_COLORS = ("#0072b2", "#d55e00", "#cc79a7", "#000000", "#009e73", "#e69f00", "#56b4e9")
_DASHES: tuple[tuple[float, ...], ...] = ((), (6, 3), (1.5, 3), (7, 2, 1.5, 2))


class Looks:
    """The look of every line: one colour a kind of treatment, one mark a line."""

    def __init__(self, lines: Sequence[LevelLine]):
        self._looks: dict[str, PlotLine] = {}
        kinds: dict[str, int] = {}
        for line in lines:
            if line.title not in self._looks:
                kind = f"{line.treatment.zone.get('treatment')} {line.linear_solver}"
                variant = kinds[kind] = kinds.get(kind, -1) + 1
                self._looks[line.title] = PlotLine(
                    line.title,
                    np.empty(0),
                    np.empty(0),
                    color=_COLORS[list(kinds).index(kind) % len(_COLORS)],
                    mark=MARKS[len(self._looks) % len(MARKS)],
                    dashes=_DASHES[variant % len(_DASHES)],
                    filled=not variant,
                    width=1.7,
                )

    def __getitem__(self, title: str) -> PlotLine:
        """A line of a treatment's look, without points."""
        return self._looks[title]


def draw_figure(panel: Panel, looks: Looks) -> Markup:
    """All pairs of a panel side by side, with the same scales."""
    pairs = panel.pairs
    width = LEFT + len(pairs) * (PLOT + APART) - APART + RIGHT
    name = NORMS[panel.error]
    legend = _legend(panel, width)
    drawing = Drawing(
        width,
        HEIGHT + _ROW * (1 + legend[-1][2]),
        f"{panel.problem.title}: error of {name}, against run time",
    )
    drawing.text(LEFT, HEIGHT + 10, panel.problem.title, weight="bold")
    for title, at, row in legend:
        level = HEIGHT + 6 + _ROW * row
        looks[title].draw_key(drawing, at, level, 38)
        drawing.text(at + 44, level + 4, title, color=INK)
    points = [m for line in panel.lines for m in line.having(panel.error)]
    times = np.array([[m.time.low, m.time.high] for m in points])
    errors = np.array([shown(m.error(panel.error) or 0) for m in points])
    values = np.append(errors, panel.uncertainty or errors[0])
    unknowns = max(m.record["dofs"] for m in points)
    low, high = times.min() / 1.3, times.max() * 1.3
    for number, pair in enumerate(pairs):
        start = LEFT + number * (PLOT + APART)
        x = Scale(low, high, start, start + PLOT, log=True)
        last = number == len(pairs) - 1
        y = _heights(drawing, x, values, unknowns, last)
        label = f"relative error: {name}" if number == 0 else ""
        draw_axes(drawing, x, y, "time of a warm solve, s", label, number == 0, _BOTTOM)
        draw_level(drawing, x, y, LIMIT, "0.1 %" if last else "", RED)
        if panel.uncertainty:
            label = "reference ±" if last else ""
            # Its label must not cover the label of the limit.
            below = float(y(panel.uncertainty) - y(LIMIT))
            lowered = math.copysign(max(0.0, _LABEL - abs(below)), below)
            draw_level(drawing, x, y, panel.uncertainty, label, MUTED, (6, 4), lowered)
        drawing.text(start + PLOT, 14, pair, "end", color=INK, weight="bold")
        for line in panel.lines:
            if line.pair == pair:
                for run in _runs(line, panel.error, looks[line.title]):
                    run.draw(drawing, x, y)
    return drawing.svg()


def _legend(panel: Panel, width: float) -> list[tuple[str, float, int]]:
    """The treatments' places under the plots, behind the problem's name: title, x, row."""
    at, row, places = LEFT + 24 + 1.2 * _LETTER * len(panel.problem.title), 0, []
    for title in panel.titles:
        length = 60 + _LETTER * len(title)
        if at + length > width:
            at, row = float(LEFT), row + 1
        places.append((title, at, row))
        at += length
    return places


def _heights(
    drawing: Drawing, x: Scale, errors: np.ndarray, unknowns: int, labelled: bool
) -> Scale:
    """The scale of errors, the round-off floor drawn.

    Where no error comes near round-off, the axis is broken above the floor: the plot would be empty
    for the most part.
    """
    top, bottom = max(1.0, 2 * errors.max()), _BOTTOM
    if errors.min() < _NEAR:
        y = Scale(EPSILON / 8, top, bottom, 42, log=True)
        draw_floor(drawing, x, y, unknowns, labelled)
        return y
    drawing.rectangle(x.start, bottom - _STRIP + 6, x.end - x.start, _STRIP - 6, fill=FLOOR)
    for at in (x.start - 4, x.end - 4):
        slashes = np.array([[[0, 3], [8, -1]], [[0, 7], [8, 3]]]) + np.array([at, bottom - _STRIP])
        drawing.polygons(slashes, closed=False, stroke=MUTED, stroke_width=1)
    if labelled:
        floor = f"ε√N = {round_off(unknowns)[1]:.0e}"
        drawing.text(x.end + 8, bottom - 1, floor, color=MUTED)
    low = min(LIMIT, errors.min()) / 2
    return Scale(low, top, bottom - _STRIP, 42, log=True)


def _runs(line: LevelLine, error: str, look: PlotLine) -> list[PlotLine]:
    """A line through its levels, with the range of times; larger marks on finer levels.

    It is broken where a level between has no solve.
    """
    return [
        replace(
            look,
            x=np.array([m.time.median for m in run]),
            y=np.array([shown(m.error(error) or 0) for m in run]),
            spans=np.array([[m.time.low, m.time.high] for m in run]),
            sizes=[2.3 + 0.6 * line.levels.index(m) for m in run],
            tips=[_tip(line, m, error) for m in run],
        )
        for run in _unbroken(line, error)
    ]


def _tip(line: LevelLine, m: TimedSolve, error: str) -> str:
    return (
        f"{line.title}, {m.label}: error {m.error(error):.2g}, {m.time.median:.3g} s "
        f"({m.time.low:.3g} … {m.time.high:.3g} s), {m.record['dofs']} unknowns"
    )


def _unbroken(line: LevelLine, error: str) -> list[list[TimedSolve]]:
    """Runs of neighbouring levels that have this error."""
    having = line.having(error)
    runs: list[list[TimedSolve]] = [[]]
    for m in line.levels:
        if m in having:
            runs[-1].append(m)
        elif runs[-1]:
            runs.append([])
    return [run for run in runs if run]


def draw_note(panel: Panel) -> str:
    """How the marks show the levels, in words."""
    levels = ", ".join(map(str, panel.problem.levels))
    return f"Marks grow with the level: {levels} times the divisions of the coarsest mesh."
