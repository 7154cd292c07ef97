"""Orders of convergence: an overview, a page for each family, tables, and what was not reached."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...mesh.catalogue import BY_NAME
from ...report.charts import write_script
from ...report.families import FILE_NAME, read_family
from ...report.html import render
from ...report.tables import as_csv
from ...system.files import write_text
from ..fits import LAST
from .description import LadderFamily
from .figure import draw_panel
from .gains import Gain, gains
from .records import ERRORS, Curve, groups, read_curves, shown_errors

CELLS = list(BY_NAME)
PAGE, SLOPES, POINTS, GAINS, FAILURES = (
    "orders.html",
    "orders.csv",
    "orders-points.csv",
    "orders-recovery.csv",
    "orders-failures.txt",
)


def write_orders(families: Sequence[LadderFamily], results: Path, folder: Path) -> str:
    """Write the pages, the tables and the failures of the ladders into `folder`.

    `results` holds a folder a family, a ladder, a level, each with its verdict. Returns a line for
    each level without a result and each slope that is not reached, and the outcome.
    """
    curves = {family.name: read_curves(family, results) for family in families}
    every = [curve for members in curves.values() for curve in members]
    problems = [line for curve in every for line in curve.problems]
    found = [gain for members in curves.values() for gain in gains(members)]
    found.sort(key=lambda gain: (CELLS.index(gain.cells), gain.form))
    overview = render(
        Path(__file__).with_name("page.html.jinja"),
        sortable=True,
        title="Orders of convergence",
        families=[_summary(family, curves[family.name]) for family in families],
        gains=found,
        outcome=outcome(every),
        good=bool(families) and not problems,
        problems=problems,
        last=LAST,
    )
    pages = {page_of(f.name): _family_page(f, curves[f.name]) for f in families}
    failures = "".join(f"{line}\n" for line in problems)
    tables = {SLOPES: _slope_rows(every), POINTS: _point_rows(every), GAINS: _gain_rows(found)}
    contents = {PAGE: overview, FAILURES: failures} | pages
    contents |= {name: as_csv(rows) for name, rows in tables.items()}
    for name, content in contents.items():
        write_text(folder / name, content)
    write_script(folder)
    return f"{failures}{outcome(every)} Report: {folder / PAGE}"


def page_of(family: str) -> str:
    """The file name of a family's page."""
    return f"orders-{family}.html"


def outcome(curves: Sequence[Curve]) -> str:
    """How many slopes and errors at the finest levels were asked for and reached."""
    reached, asked, kept, bounds, lost = _counts(curves)
    text = (
        f"{reached} of {asked} slopes asked for are reached" if asked else "No slope is asked for"
    )
    text += f", on {len(curves)} ladders"
    text += f"; {kept} of {bounds} errors at finest levels." if bounds else "."
    return text + (f" {lost} levels have no result." if lost else "")


def _counts(curves: Sequence[Curve]) -> tuple[int, int, int, int, int]:
    """Slopes reached and asked for, errors kept and bounded, levels without a result."""
    slopes = [r for c in curves for e in ERRORS if (r := c.reached(e)) is not None]
    finest = [r for c in curves for e in ERRORS if (r := c.kept(e)) is not None]
    lost = sum(len(curve.rows) - len(curve.solved) for curve in curves)
    return sum(slopes), len(slopes), sum(finest), len(finest), lost


def _summary(family: LadderFamily, curves: Sequence[Curve]) -> dict[str, Any]:
    """A family's line in the overview."""
    return {
        "title": _title(family),
        "page": page_of(family.name),
        "ladders": len(curves),
        "levels": sum(len(curve.solved) for curve in curves),
        "counts": _counts(curves),
        "below": _below(curves),
    }


def _title(family: LadderFamily) -> str:
    return family.title or read_family(family.folder / FILE_NAME).title


def _below(curves: Sequence[Curve]) -> int:
    """How many slopes are below theory."""
    return sum(curve.below_theory(error) for curve in curves for error in ERRORS)


def _family_page(family: LadderFamily, curves: Sequence[Curve]) -> str:
    """The page of a family: its words, and its panels and tables by group."""
    parts: list[dict[str, Any]] = []
    for title, members in groups(curves).items():
        shown = shown_errors(members)
        panels = [draw_panel(f"{family.name}-{len(parts)}", error, members) for error in shown]
        parts.append({"title": title, "curves": members, "errors": shown, "panels": panels})
    problems = [line for curve in curves for line in curve.problems]
    return render(
        Path(__file__).with_name("family.html.jinja"),
        charts=True,
        title=f"Orders of convergence: {_title(family)}",
        family=family,
        description=family.description or read_family(family.folder / FILE_NAME).description,
        groups=parts,
        below=_below(curves),
        outcome=outcome(curves),
        good=not problems,
        problems=problems,
        overview=PAGE,
        names=ERRORS,
        last=LAST,
    )


def _slope_rows(curves: Sequence[Curve]) -> list[dict[str, Any]]:
    """One row for each ladder and error: the slope, its spread, and what it is compared with."""
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
            "theory_least": curve.theory(error).least,
            "theory_best": curve.theory(error).best,
            "reference_code": curve.ladder.observed.get(error),
        }
        for curve in curves
        for error in shown_errors([curve])
        for slope in [curve.slope(error)]
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
            "pressure_error_estimate": row.verdict.pressure_error_estimate,
            **{error: row.norms.get(error) for error in ERRORS},
        }
        for curve in curves
        for row in curve.rows
    ]


def _gain_rows(found: Sequence[Gain]) -> list[dict[str, Any]]:
    """One row for each ladder with recovery: its gain, and the goals."""
    return [
        {
            "family": gain.curve.family.name,
            "ladder": gain.curve.name,
            "cells": gain.pair,
            "recovery": gain.form,
            "macro_elements": gain.faces,
            "error": gain.error,
            "order": gain.order,
            "gain": gain.gain,
            "stress_order": gain.stress_order,
            "order_goal": gain.goal.order,
            "gain_goal": gain.goal.gain,
            "stress_order_goal": gain.stress_goal,
            "reached": all(gain.marks.values()) if gain.marks else None,
        }
        for gain in found
    ]
