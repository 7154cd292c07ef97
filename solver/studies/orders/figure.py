"""Error against size of the macro-elements, log–log: a panel for each error, a line per ladder."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from ...report.axes import EPSILON
from ...report.marks import LOOKS, look_of
from ...report.svg import INK
from ..plots import PlotLine, draw_lines
from .records import ERRORS, Curve

# QUAD9 and HEXA27 have a look of their own here, beside QUAD8 and HEXA20.
_LOOKS = {"QUAD9": (INK, "cross"), "HEXA27": (INK, "cross"), **LOOKS}


def draw_panel(error: str, curves: Sequence[Curve]) -> Markup:
    """One error of all curves, with the orders that theory knows drawn beside."""
    lines = [_line(curve, *curve.errors(error)) for curve in curves]
    known = [curve.theory(error) for curve in curves]
    orders = {order for theory in known for order in (theory.least, theory.best) if order}
    return draw_lines(
        f"Error of {ERRORS[error]}, against macro-element size",
        "macro-element / interface",
        f"relative error: {ERRORS[error]}",
        [line for line in lines if len(line.x)],
        sorted(orders) or [1.0, 2.0],
    )


def draw_key(curve: Curve) -> Markup:
    """The line and mark of a curve, for the legend."""
    return _line(curve, np.empty(0), np.empty(0)).key()


def _line(curve: Curve, sizes: np.ndarray, errors: np.ndarray) -> PlotLine:
    """Linear cells dashed with hollow marks, quadratic ones solid; a variant is dotted."""
    color, mark = look_of(curve.slave_cells[0].name, _LOOKS)
    linear = curve.degree == "linear"
    variant = curve.ladder.hexahedra or curve.ladder.recovery or curve.ladder.label
    dashes: tuple[float, ...] = (1.5, 3) if variant else (6, 3) if linear else ()
    errors = np.maximum(errors, EPSILON / 4)
    return PlotLine(curve.label, sizes, errors, color, mark, dashes, filled=not linear)
