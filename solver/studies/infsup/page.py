"""Stability in the sense of theory: the inf-sup test and the half-loaded block, plots and tables.

`sections` gives both as HTML for a page of another's; `write_page` writes a page of their own.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from markupsafe import Markup

from solver.report.html import environment
from solver.report.tables import as_csv
from solver.studies.infsup.description import LEVEL, Ladder
from solver.studies.infsup.figure import draw_constants, draw_key, draw_profiles
from solver.studies.infsup.half_loaded import COARSER, Profile
from solver.system.files import write_text

PAGE, TABLE, FAILURES = "infsup.html", "infsup.csv", "infsup-failures.txt"
OSCILLATION = 0.15
"""Second difference, over the pressure, that the cut has to stay below; an edge of contact has one
of 0.1 of its own."""
Record = tuple[list[Ladder], list[Profile]]


def write_record(path: Path, ladders: Sequence[Ladder], profiles: Sequence[Profile]) -> None:
    """Write what was run as JSON."""
    content = {
        "ladders": [asdict(ladder) for ladder in ladders],
        "profiles": [asdict(profile) for profile in profiles],
    }
    write_text(path, json.dumps(content))


def read_record(path: Path) -> Record:
    """Read it back."""
    content = json.loads(path.read_text(encoding="utf-8"))
    ladders = [Ladder(**each) for each in content["ladders"]]
    return ladders, [Profile(**each) for each in content["profiles"]]


def failures(record: Record) -> list[str]:
    """Where the method with the cut does not hold, a line each."""
    ladders, profiles = record
    lines = [
        f"{ladder.name}: {ladder.reason or f'β_h falls with order {ladder.order:.2f}'}"
        for ladder in ladders
        if ladder.reason or (ladder.cut and not ladder.levels_off)
    ]
    return lines + [
        f"half-loaded block, {profile.cells}: the pressure oscillates by {profile.oscillation:.2f}"
        for profile in profiles
        if profile.cut and profile.oscillation > OSCILLATION
    ]


def sections(record: Record) -> Markup:
    """Both sections as HTML, from <h2> on, in the style of the report's pages."""
    ladders, profiles = record
    template = environment().get_template("infsup-sections.html.jinja")
    html = template.render(
        panels=[draw_constants(title, members) for title, members in _panels(ladders)],
        keys=[(kind, draw_key(kind)) for kind in dict.fromkeys(each.kind for each in ladders)],
        levels=_tables(ladders),
        profiles=[(cells, draw_profiles(members)) for cells, members in _by_cells(profiles)],
        oscillations=_oscillations(profiles),
        faces=max((len(profile.place) for profile in profiles), default=0),
        coarser=COARSER,
        allowed=OSCILLATION,
        level=LEVEL,
        failures=failures(record),
    )
    return Markup(html)


def write_page(record: Record, folder: Path, log: Callable[[str], Any] = print) -> None:
    """Write the page, its table and what does not hold into `folder`."""
    ladders, _ = record
    complaints = failures(record)
    page = environment().get_template("infsup.html.jinja")
    contents = {
        PAGE: page.render(sections=sections(record), complaints=complaints),
        TABLE: as_csv(_rows(ladders)),
        FAILURES: "".join(f"{line}\n" for line in complaints),
    }
    for name, content in contents.items():
        write_text(folder / name, content)
    log("\n".join([*complaints, f"Report: {folder / PAGE}"]))


def _panels(ladders: Sequence[Ladder]) -> list[tuple[str, list[Ladder]]]:
    """Ladders that are drawn into one plot, with its title."""
    panels: dict[str, list[Ladder]] = {}
    for each in ladders:
        held = "clamped" if each.clamped else "floating"
        master = "as coarse" if each.coarser == 1 else f"{each.coarser} times as coarse"
        panels.setdefault(f"{each.dim}D, {held}, master {master}", []).append(each)
    return list(panels.items())


def _tables(ladders: Sequence[Ladder]) -> list[dict[str, Any]]:
    """One table for each list of levels, with a row a ladder."""
    tables: dict[tuple[int, ...], list[Ladder]] = {}
    for each in ladders:
        tables.setdefault(tuple(each.levels), []).append(each)
    return [{"levels": levels, "ladders": members} for levels, members in tables.items()]


def _by_cells(profiles: Sequence[Profile]) -> list[tuple[str, list[Profile]]]:
    cells = dict.fromkeys(profile.cells for profile in profiles)
    return [(name, [p for p in profiles if p.cells == name]) for name in cells]


def _oscillations(profiles: Sequence[Profile]) -> list[tuple[str, dict[tuple[bool, bool], float]]]:
    """By cells the oscillation by (cut, bilateral)."""
    return [
        (cells, {(p.cut, p.bilateral): p.oscillation for p in members})
        for cells, members in _by_cells(profiles)
    ]


def _rows(ladders: Sequence[Ladder]) -> list[dict[str, Any]]:
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
