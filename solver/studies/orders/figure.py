"""Error against size of the macro-elements, log–log: a panel for each error, a line per ladder."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from solver.report import formats
from solver.report.axes import EPSILON, Scale, draw_axes
from solver.report.marks import LOOKS, draw_marks, look_of
from solver.report.svg import INK, MUTED, Drawing, Style
from solver.studies.orders.records import ERRORS, Curve

WIDTH, HEIGHT = 400, 330
# QUAD9 and HEXA27 have a look of their own here, where they stand beside QUAD8 and HEXA20.
_LOOKS = {"QUAD9": (INK, "cross"), "HEXA27": (INK, "cross"), **LOOKS}


def draw_panel(error: str, curves: Sequence[Curve]) -> Markup:
    """One error of all curves, with the slopes that theory knows drawn beside."""
    drawing = Drawing(WIDTH, HEIGHT, f"Error of {ERRORS[error]}, against macro-element size")
    shown = [curve for curve in curves if len(curve.errors(error)[0])]
    sizes = [curve.errors(error)[0] for curve in shown]
    errors = [np.maximum(curve.errors(error)[1], EPSILON / 4) for curve in shown]
    x = Scale(*_range(sizes, 1.12), 58, WIDTH - 14, log=True)
    y = Scale(*_range(errors, 1.6), HEIGHT - 48, 34, log=True)
    draw_axes(drawing, x, y, "macro-element / interface", f"relative error: {ERRORS[error]}")
    _draw_guides(drawing, x, y, _guides(error, curves))
    for curve, h, e in zip(shown, sizes, errors, strict=True):
        at = np.column_stack([x(h), y(e)])
        drawing.polygons(at[None], closed=False, **_line(curve))
        _draw_marks(drawing, curve, at)
    return drawing.svg()


def draw_key(curve: Curve) -> Markup:
    """The line and mark of a curve, for the legend."""
    drawing = Drawing(44, 14, curve.label)
    drawing.line(2, 7, 42, 7, **_line(curve))
    _draw_marks(drawing, curve, np.array([[22.0, 7.0]]))
    return drawing.svg()


def _range(values: Sequence[np.ndarray], factor: float) -> tuple[float, float]:
    joined = np.concatenate(values)
    return float(joined.min() / factor), float(joined.max() * factor)


def _look(curve: Curve) -> tuple[str, str]:
    return look_of(curve.slave_cells[0].name, _LOOKS)


def _line(curve: Curve) -> dict[str, Style]:
    """Linear cells dashed, quadratic ones solid; a variant (cut, label of its own) is dotted."""
    style: dict[str, Style] = {"stroke": _look(curve)[0], "stroke_width": 1.6}
    if curve.ladder.hexahedra or curve.ladder.label:
        return style | {"stroke_dasharray": (1.5, 3)}
    return style | ({"stroke_dasharray": (6, 3)} if curve.degree == "linear" else {})


def _draw_marks(drawing: Drawing, curve: Curve, at: np.ndarray) -> None:
    """Marks hollow on linear cells, filled on quadratic ones."""
    color, mark = _look(curve)
    draw_marks(drawing, mark, at, color, filled=curve.degree != "linear")


def _guides(error: str, curves: Sequence[Curve]) -> list[float]:
    """The orders that theory knows of for these curves; 1 and 2 where it knows of none."""
    known = [curve.theory(error) for curve in curves]
    orders = {order for theory in known for order in (theory.least, theory.best) if order}
    return sorted(orders) or [1.0, 2.0]


def _draw_guides(drawing: Drawing, x: Scale, y: Scale, orders: Sequence[float]) -> None:
    """A fan of slopes in the lower right corner, which falling errors leave free."""
    start = np.array([x.end - 0.36 * (x.end - x.start), y.start - 12])
    decades = 0.27 * np.log10(x.high / x.low)
    pixels = (y.start - y.end) / np.log10(y.high / y.low)
    lowest = start[1]  # of the labels, which must not cover one another
    for order in orders:
        end = start + np.array([0.27 * (x.end - x.start), -order * decades * pixels])
        drawing.line(*start, *end, stroke=MUTED, stroke_width=1)
        lowest = min(lowest - 10, end[1] + 4)
        drawing.text(end[0] + 4, lowest, formats.number(order), size=10, color=MUTED)
