"""Error against size of the macro-elements, log–log: a panel for each error, a line per ladder."""

from collections.abc import Sequence
from dataclasses import replace

from ...report.charts import (
    CROSS,
    EPSILON,
    INK,
    LOOKS,
    Axis,
    Chart,
    Look,
    distinct,
    look_of,
    series_chart,
    slopes,
)
from .records import ERRORS, Curve

# QUAD9 and HEXA27 have a look of their own here, beside QUAD8 and HEXA20.
_LOOKS = {"QUAD9": Look(INK, CROSS), "HEXA27": Look(INK, CROSS), **LOOKS}


def draw_panel(name: str, error: str, curves: Sequence[Curve]) -> Chart:
    """One error of all curves, with the orders that theory knows drawn beside."""
    records = [
        {"series": curve.label, "h": size, "error": max(value, EPSILON / 4)}
        for curve in curves
        for size, value in zip(*curve.errors(error), strict=True)
    ]
    found = {record["series"] for record in records}
    known = [curve.theory(error) for curve in curves]
    orders = {order for theory in known for order in (theory.least, theory.best) if order}
    return series_chart(
        f"{name}-{error}",
        f"Error of {ERRORS[error]}, against macro-element size",
        records,
        Axis("h", "macro-element / interface", log=True),
        Axis("error", f"relative error: {ERRORS[error]}", log=True),
        distinct({curve.label: _look(curve) for curve in curves if curve.label in found}),
        layers=slopes(records, "h", "error", sorted(orders) or [1.0, 2.0]),
        width=460,
    )


def _look(curve: Curve) -> Look:
    """Linear cells dashed, quadratic ones solid."""
    look = look_of(curve.slave_cells[0].name, _LOOKS)
    return replace(look, dashes=(6.0, 3.0) if curve.degree == "linear" else ())
