"""The page of orders of convergence, its tables for machines, and what was not reached."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from solver.report import formats
from solver.report.families import FILE_NAME, read_family
from solver.report.formats import ERROR_LABELS
from solver.report.html import environment
from solver.report.tables import as_csv
from solver.studies.fits import DEGREES, LAST, Order
from solver.studies.orders.description import Family
from solver.studies.orders.figure import draw_key, draw_panel
from solver.studies.orders.records import Curve, groups, read_curves, shown_errors

PAGE, SLOPES, POINTS, FAILURES = (
    "orders.html",
    "orders.csv",
    "orders-points.csv",
    "orders-failures.txt",
)
# The errors that the sentence above a family's plots is about.
_TOLD = {"displacement_l2": "displacement in L2", "pressure_l2": "pressure in L2"}


def write_orders(
    families: Sequence[Family], results: Path, folder: Path, log: Callable[[str], Any] = print
) -> None:
    """Write the page, the tables and the failures of the ladders into `folder`.

    `results` holds a folder a family, a ladder, a level, each with its verdict. Logs one line for
    each level without a result and each slope that is not reached.
    """
    from solver.system.files import write_text

    curves = {family.name: read_curves(family, results) for family in families}
    every = [curve for members in curves.values() for curve in members]
    complaints = "".join(f"{line}\n" for curve in every for line in curve.complaints)
    contents = {
        PAGE: _to_html(families, curves),
        SLOPES: as_csv(_slope_rows(every)),
        POINTS: as_csv(_point_rows(every)),
        FAILURES: complaints,
    }
    for name, content in contents.items():
        write_text(folder / name, content)
    log(f"{complaints}{outcome(every)} Report: {folder / PAGE}")


def outcome(curves: Sequence[Curve]) -> str:
    """How many slopes and errors at the finest levels were asked for and reached."""
    slopes = [r for c in curves for e in ERROR_LABELS if (r := c.reached(e)) is not None]
    finest = [r for c in curves for e in ERROR_LABELS if (r := c.kept(e)) is not None]
    lost = sum(len(curve.rows) - len(curve.solved) for curve in curves)
    reached = f"{sum(slopes)} of {len(slopes)} slopes asked for are reached"
    text = f"{reached if slopes else 'No slope is asked for'}, on {len(curves)} ladders"
    text += f"; {sum(finest)} of {len(finest)} errors at finest levels." if finest else "."
    return text + (f" {lost} levels have no result." if lost else "")


def sentence(curves: Sequence[Curve]) -> str:
    """What the slopes of a family say, in one sentence; empty where there are none."""
    parts = []
    for error, name in _TOLD.items():
        told = []
        for degree in DEGREES.values():
            members = [c for c in curves if c.degree == degree and c.slope(error)]
            values = [c.slope(error).value for c in members]  # type: ignore[union-attr]
            if values:
                span = " … ".join(dict.fromkeys(f"{v:.2f}" for v in (min(values), max(values))))
                theory = theory_text(members[0].theory(error))
                told.append(f"{span} on {degree} cells ({theory})")
        if told:
            parts.append(f"the {name} falls with slope {' and '.join(told)}")
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def below_theory(curves: Sequence[Curve]) -> list[str]:
    """The slopes that are less than theory guarantees, in words."""
    return [
        f"{title}, {curve.label}: {ERROR_LABELS[error]} {slope.value:.2f} ± {slope.spread:.2f}, "
        f"{theory_text(curve.theory(error))}"
        for title, members in groups(curves).items()
        for curve in members
        for error in ERROR_LABELS
        if curve.below_theory(error) and (slope := curve.slope(error))
    ]


def theory_text(order: Order | None) -> str:
    """What theory says: the order guaranteed … the best there can be, or the one that is known."""
    least, best = (order.least, order.best) if order else (None, None)
    if least is None or best is None:
        bounds = [f"{sign} {v:g}" for sign, v in (("≥", least), ("≤", best)) if v is not None]
        return f"theory {''.join(bounds) or formats.NOTHING}"
    return "theory " + " … ".join(dict.fromkeys([f"{least:g}", f"{best:g}"]))


def _to_html(families: Sequence[Family], curves: dict[str, list[Curve]]) -> str:
    every = [curve for members in curves.values() for curve in members]
    return (
        environment()
        .get_template("orders.html.jinja")
        .render(
            sections=[_section(family, curves[family.name]) for family in families],
            outcome=outcome(every),
            complaints=[line for curve in every for line in curve.complaints],
            names=ERROR_LABELS,
            last=LAST,
            theory_text=theory_text,
            key=draw_key,
        )
    )


def _section(family: Family, curves: Sequence[Curve]) -> dict[str, Any]:
    """One family: its words, and its panels and tables by group."""
    described = read_family(family.folder / FILE_NAME)
    parts = []
    for title, members in groups(curves).items():
        shown = shown_errors(members)
        panels = [draw_panel(error, members) for error in shown]
        parts.append({"title": title, "curves": members, "errors": shown, "panels": panels})
    return {
        "family": family,
        "title": family.title or described.title,
        "description": family.description or described.description,
        "sentence": sentence(curves),
        "below": below_theory(curves),
        "groups": parts,
    }


def _slope_rows(curves: Sequence[Curve]) -> list[dict[str, Any]]:
    """One row for each ladder and error: the slope, its spread, and what it is held against."""
    return [
        {
            "family": curve.family.name,
            "ladder": curve.name,
            "cells": curve.label,
            "error": error,
            "slope": slope.value if slope else None,
            "spread": slope.spread if slope else None,
            "rounding": curve.rounding(error),
            "least": curve.least(error),
            "reached": curve.reached(error),
            "theory_least": theory.least if theory else None,
            "theory_best": theory.best if theory else None,
            "reference_code": curve.ladder.observed.get(error),
        }
        for curve in curves
        for error in shown_errors([curve])
        for slope, theory in [(curve.slope(error), curve.theory(error))]
    ]


def _point_rows(curves: Sequence[Curve]) -> list[dict[str, Any]]:
    """One row for each level of each ladder, those without a result too."""
    return [
        {
            "family": curve.family.name,
            "ladder": curve.name,
            "cells": curve.label,
            "level": row.folder.name,
            "verdict": row.word,
            "reason": row.why,
            "unknowns": row.verdict.dofs,
            "macro_elements": row.verdict.macro_elements,
            "seconds": row.total,
            **{error: row.norms.get(error) for error in ERROR_LABELS},
        }
        for curve in curves
        for row in curve.rows
    ]
