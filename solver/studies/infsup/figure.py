"""Plots of the inf-sup constants level by level, and of the half-loaded block's pressure."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from solver.mesh.catalogue import BY_NAME
from solver.report.axes import Scale, draw_axes
from solver.report.marks import draw_marks, look_of
from solver.report.svg import INK, MUTED, ORANGE, Drawing, Style
from solver.studies.infsup.description import InfSupLadder
from solver.studies.infsup.half_loaded import CELLS, PressureProfile

WIDTH, HEIGHT = 400, 320
# β_h below is drawn at the foot of the plot.
_LEAST, _MOST = 0.02, 2.0


def draw_constants(title: str, ladders: Sequence[InfSupLadder]) -> Markup:
    """β_h against the slave divisions, log–log; without the cut dashed."""
    drawing = Drawing(WIDTH, HEIGHT, f"Inf-sup constant by level: {title}")
    levels = np.array([level for each in ladders for level in each.levels])
    x = Scale(levels.min() / 1.15, levels.max() * 1.15, 52, WIDTH - 12, log=True)
    y = Scale(_LEAST, _MOST, HEIGHT - 46, 34, log=True)
    draw_axes(drawing, x, y, "slave faces along an edge of the interface", f"β_h, {title}")
    for each in sorted(ladders, key=lambda one: one.cut):
        if each.constants:
            constants = np.maximum(each.constants, _LEAST)
            at = np.column_stack([x(each.levels[: len(constants)]), y(constants)])
            _draw_line(drawing, each.kind, at)
    return drawing.svg()


def draw_key(kind: tuple[str, bool]) -> Markup:
    """The line and mark of cells, cut or uncut, for the legend."""
    drawing = Drawing(44, 14, _words(kind))
    ends = np.array([[2.0, 7.0], [22.0, 7.0], [42.0, 7.0]])
    _draw_line(drawing, kind, ends)
    return drawing.svg()


def _draw_line(drawing: Drawing, kind: tuple[str, bool], at: np.ndarray) -> None:
    """Marks are hollow on linear cells; lines dashed, and faint, without the cut."""
    cells, cut = kind
    color, mark = look_of(cells)
    style: dict[str, Style] = {"stroke": color, "stroke_width": 1.6 if cut else 1.0}
    if not cut:
        style["stroke_dasharray"] = (5, 3)
    drawing.polygons(at[None], closed=False, **style)
    draw_marks(drawing, mark, at, color, filled=BY_NAME[cells].order == 2, size=2.8)


def _words(kind: tuple[str, bool]) -> str:
    return kind[0] if kind[1] else f"{kind[0]}, uncut"


def draw_profiles(profiles: Sequence[PressureProfile]) -> Markup:
    """The pressure along the interface: cut and uncut, bilateral left and opening right."""
    drawing = Drawing(2 * WIDTH, 260, f"Pressure under a half-loaded block, {profiles[0].cells}")
    values = np.concatenate([profile.pressure for profile in profiles])
    low, high = min(-0.2, values.min() - 0.1), max(1.4, values.max() + 0.1)
    for k, bilateral in enumerate((True, False)):
        left = 52 + k * WIDTH
        x = Scale(0, 2, left, left + WIDTH - 70)
        y = Scale(low, high, 214, 34)
        what = "bilateral" if bilateral else "opening"
        draw_axes(drawing, x, y, "x", f"p / 25, {profiles[0].cells}, {what}")
        for profile in sorted(profiles, key=lambda one: one.cut):
            if profile.bilateral is bilateral:
                at = np.column_stack([x(profile.place), y(profile.pressure)])
                color = INK if profile.cut else ORANGE
                width = 1.6 if profile.cut else 1.0
                drawing.polygons(at[None], closed=False, stroke=color, stroke_width=width)
    method = "with the cut" if CELLS[profiles[0].cells] else "needs no cut"
    for k, (word, color) in enumerate(((method, INK), ("without", ORANGE))):
        if any(profile.cut is (k == 0) for profile in profiles):
            drawing.text(WIDTH - 30, 50 + 16 * k, word, "end", color=color)
    drawing.line(WIDTH - 4, 34, WIDTH - 4, 214, stroke=MUTED, stroke_width=0.4)
    return drawing.svg()
