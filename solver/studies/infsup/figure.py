"""Plots of the inf-sup constants level by level, and of the half-loaded block's pressure."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from ...mesh.catalogue import BY_NAME
from ...report.axes import Scale, draw_axes
from ...report.marks import look_of
from ...report.svg import INK, MUTED, ORANGE, Drawing
from ..plots import PlotLine, draw_lines
from .description import InfSupLadder
from .half_loaded import CELLS, PressureProfile

WIDTH = 400
# β_h below is drawn at the foot of the plot.
_RANGE = 0.02, 2.0
_NOTHING = np.empty(0)


def draw_constants(title: str, ladders: Sequence[InfSupLadder]) -> Markup:
    """β_h against the slave divisions, log–log; without the cut dashed."""
    lines = [
        _line(each.kind, np.array(each.levels[: len(each.constants)]), np.array(each.constants))
        for each in sorted(ladders, key=lambda one: one.cut)
    ]
    label = "slave faces along an edge of the interface"
    full = f"Inf-sup constant by level: {title}"
    return draw_lines(full, label, f"β_h, {title}", lines, y_range=_RANGE)


def draw_key(kind: tuple[str, bool]) -> Markup:
    """The line and mark of cells, cut or uncut, for the legend."""
    return _line(kind, _NOTHING, _NOTHING).key()


def _line(kind: tuple[str, bool], levels: np.ndarray, constants: np.ndarray) -> PlotLine:
    """Marks are hollow on linear cells; lines dashed, and faint, without the cut."""
    cells, cut = kind
    color, mark = look_of(cells)
    name = cells if cut else f"{cells}, uncut"
    dashes, width = ((), 1.6) if cut else ((5, 3), 1.0)
    filled = BY_NAME[cells].order == 2
    return PlotLine(name, levels, constants, color, mark, dashes, filled, width, sizes=2.8)


def draw_profiles(profiles: Sequence[PressureProfile]) -> Markup:
    """The pressure along the interface: cut and uncut, bilateral left and opening right."""
    cells = profiles[0].cells
    drawing = Drawing(2 * WIDTH, 260, f"Pressure under a half-loaded block, {cells}")
    values = np.concatenate([profile.pressure for profile in profiles])
    low, high = min(-0.2, values.min() - 0.1), max(1.4, values.max() + 0.1)
    names = {True: "with the cut" if CELLS[cells] else "needs no cut", False: "without"}
    colors = {True: INK, False: ORANGE}
    for cut in {profile.cut for profile in profiles}:
        drawing.text(WIDTH - 30, 66 - 16 * cut, names[cut], "end", color=colors[cut])
    for k, what in enumerate(("bilateral", "opening")):
        left = 52 + k * WIDTH
        x, y = Scale(0, 2, left, left + WIDTH - 70), Scale(low, high, 214, 34)
        draw_axes(drawing, x, y, "x", f"p / 25, {cells}, {what}")
        for profile in sorted(profiles, key=lambda one: one.cut):
            if profile.bilateral is (what == "bilateral"):
                at = np.array(profile.place), np.array(profile.pressure)
                width = 1.6 if profile.cut else 1.0
                PlotLine(what, *at, colors[profile.cut], width=width, sizes=0.0).draw(drawing, x, y)
    drawing.line(WIDTH - 4, 34, WIDTH - 4, 214, stroke=MUTED, stroke_width=0.4)
    return drawing.svg()
