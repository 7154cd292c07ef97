"""The page of the inf-sup test and the half-loaded block, plots and tables.

`sections` gives both as HTML for the page of another study; `write_page` writes one of their own.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from ...report.charts import write_script
from ...report.html import render
from ...report.tables import as_csv
from ...system.files import write_text
from .description import LEVEL, InfSupLadder
from .figure import draw_constants, draw_profiles
from .half_loaded import COARSER
from .records import OSCILLATION, InfSupRecord, failures

PAGE, TABLE, FAILURES = "infsup.html", "infsup.csv", "infsup-failures.txt"


def sections(record: InfSupRecord) -> Markup:
    """Both sections as HTML, from <h2> on, in the style of the report's pages."""
    ladders, profiles = record
    by_cells = _grouped(profiles, lambda profile: profile.cells)
    return Markup(
        render(
            Path(__file__).with_name("sections.html.jinja"),
            panels=[draw_constants(*panel) for panel in _grouped(ladders, _panel).items()],
            tables=_grouped(ladders, lambda ladder: tuple(ladder.levels)),
            profiles=[one for members in by_cells.values() for one in draw_profiles(members)],
            oscillations={
                cells: {(p.cut, p.bilateral): p.oscillation for p in members}
                for cells, members in by_cells.items()
            },
            faces=max((len(profile.place) for profile in profiles), default=0),
            coarser=COARSER,
            allowed=OSCILLATION,
            level=LEVEL,
            failures=failures(record),
        )
    )


def write_page(record: InfSupRecord, folder: Path) -> str:
    """Write the page, its table and what does not hold into `folder`; returns that."""
    problems = failures(record)
    page = render(
        Path(__file__).with_name("page.html.jinja"),
        charts=True,
        title="Stability of the contact pressure",
        good=not problems,
        outcome=f"{len(problems)} do not hold."
        if problems
        else "The method with its cut is stable on every mesh of the table.",
        sections=sections(record),
    )
    write_text(folder / PAGE, page)
    write_script(folder)
    write_text(folder / TABLE, as_csv(_rows(record[0])))
    write_text(folder / FAILURES, "".join(f"{line}\n" for line in problems))
    return "\n".join([*problems, f"Report: {folder / PAGE}"])


def _panel(ladder: InfSupLadder) -> str:
    """The title of the plot that a ladder is drawn into."""
    held = "clamped" if ladder.clamped else "floating"
    master = "as coarse" if ladder.coarser == 1 else f"{ladder.coarser} times as coarse"
    return f"{ladder.dim}D, {held}, master {master}"


def _grouped(items: Sequence[Any], key: Callable[[Any], Any]) -> dict[Any, list[Any]]:
    """Items of equal keys together, in their order."""
    found: dict[Any, list[Any]] = {}
    for item in items:
        found.setdefault(key(item), []).append(item)
    return found


def _rows(ladders: Sequence[InfSupLadder]) -> list[dict[str, Any]]:
    return [
        {
            "cells": each.cells,
            "contact": each.contact,
            "hexahedra": each.hexahedra,
            "cut": each.cut,
            "clamped": each.clamped,
            "coarser": each.coarser,
            "divisions": level,
            "macro_elements": macro,
            "unknowns": unknowns,
            "constant": constant,
        }
        for each in ladders
        for level, constant, macro, unknowns in zip(
            each.levels, each.constants, each.macro_elements, each.unknowns, strict=False
        )
    ]
