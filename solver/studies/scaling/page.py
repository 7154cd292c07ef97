"""The page of growth with size, and its tables for machines."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from solver.report import measured, stages
from solver.report.html import environment
from solver.report.tables import as_csv
from solver.studies.scaling import FULL, words
from solver.studies.scaling.description import Scaling
from solver.studies.scaling.figure import SMALL, Drawn, draw_bar, draw_key, draw_plot, look
from solver.studies.scaling.growth import BY_FACES
from solver.studies.scaling.records import (
    OTHER,
    WHOLE,
    Line,
    Measured,
    failures,
    reached,
    read_lines,
)
from solver.system.files import write_text

_SIDES = {3: "Space", 2: "Plane"}


def page_name(scaling: Scaling) -> str:
    """The name of the page and of its tables."""
    return "scaling" if scaling.size == FULL else f"scaling-{scaling.size}"


def write_scaling(
    scaling: Scaling, results: Path, folder: Path, log: Callable[[str], Any] = print
) -> None:
    """Write page and tables into `folder`; `results` holds the records. Logs what was found."""
    lines, name = read_lines(scaling, results), page_name(scaling)
    write_text(folder / f"{name}.html", _to_html(scaling, lines))
    write_text(folder / f"{name}.csv", as_csv(point_rows(lines)))
    write_text(folder / f"{name}-exponents.csv", as_csv(exponent_rows(lines)))
    for line in lines:
        log(words.largest(line))
    log(f"{words.goals(reached(scaling, lines))} {outcome(lines)} Page: {folder / name}.html")


def outcome(lines: Sequence[Line]) -> str:
    """How many points are solved."""
    points = [m for line in lines for m in line.points]
    lost = sum(not m.solved for m in points)
    text = f"{len(points) - lost} of {len(points)} points are solved."
    return text + (f" {lost} have no solve, each with its reason." if lost else "")


def stage_names(lines: Sequence[Line]) -> list[str]:
    """The stages of all solves in the order of the work, what they do not tell at the end."""
    found = [stage for line in lines for m in line.solved for stage in m.stages]
    return [s for s in stages.colors(found) if s != OTHER] + [OTHER] * bool(found)


def point_rows(lines: Sequence[Line]) -> list[dict[str, Any]]:
    """One row for each point, those without a solve too."""
    names = stage_names(lines)
    return [_row(m, names) for line in lines for m in line.points]


def _row(m: Measured, names: Sequence[str]) -> dict[str, Any]:
    record = m.record
    row: dict[str, Any] = {
        "series": m.point.series.name,
        "cells": m.point.series.cells,
        "size": m.point.size,
        "outcome": record["outcome"],
        "reason": record["reason"],
        "verdict": record.get("verdict"),
    }
    keys = ("dofs", "macro_elements", "faces", "matrix_entries", "iterations")
    row |= {key: record.get(key) for key in (*keys, "linear_iterations", "linear_solver")}
    process, errors = record.get("process") or {}, record.get("errors") or {}
    row |= {f"process_{key}": process.get(key) for key in ("wall", "cpu", "peak_memory_mb")}
    for stage in names:
        row[f"{stage}_wall"] = (record.get("seconds") or {}).get(stage)
        row[f"{stage}_cpu"] = m.stages.get(stage) if m.solved else None
    row |= {key: errors.get(key) for key in ("pressure_max", "pressure_l2", "stress_max")}
    row |= {f"meshing_{k}": (record.get("meshing") or {}).get(k) for k in ("wall", "cpu")}
    return row | {key: record.get(key) for key in ("threads", "load")}


def exponent_rows(lines: Sequence[Line]) -> list[dict[str, Any]]:
    """The exponents of every series: whole process, stages, memory, with what they grow with."""
    rows = []
    for line in lines:
        fits = {name: line.growth(name) for name in (WHOLE, *stage_names(lines))}
        for name, growth in (fits | {"memory": line.memory_growth}).items():
            if growth:
                over = "faces" if name in BY_FACES else "unknowns"
                row: dict[str, Any] = {"series": line.series.name, "cost": name, "over": over}
                row |= {"exponent": growth.value, "spread": growth.spread}
                rows.append(row | {"from": growth.low, "to": growth.high})
    return rows


def _to_html(scaling: Scaling, lines: Sequence[Line]) -> str:
    names = stage_names(lines)
    solved = [m.record for line in lines for m in line.solved]
    colors = stages.colors(names)
    return (
        environment()
        .get_template("scaling.html.jinja")
        .render(
            scaling=scaling,
            name=page_name(scaling),
            outcome=outcome(lines),
            good=not failures(lines),
            goals=reached(scaling, lines),
            sections=[_section(title, lines, dim) for dim, title in _SIDES.items()],
            pairing=_pairing(lines),
            lines=lines,
            stages=colors,
            bars=[(line, _stage_plot(line, colors), _bar(line, colors)) for line in lines],
            failures=failures(lines),
            facts=measured.facts(solved),
            disturbed=measured.disturbed(solved),
            words=words,
            whole=WHOLE,
            by_faces=BY_FACES,
        )
    )


def _drawn(lines: Sequence[Line], what: str, over: str) -> list[Drawn]:
    """A line for each series that has solves: `what` of `Measured.answer` or a stage."""
    drawn = []
    for number, line in enumerate(lines):
        if line.solved:
            color, mark = look(number)
            x = np.array([m.record[over] for m in line.solved], dtype=float)
            cost = [
                m.answer(what) if what in ("cpu", "memory") else m.cost(what) for m in line.solved
            ]
            y = np.maximum(np.array(cost, dtype=float), 1e-3)
            tips = [_tip(line, m) for m in line.solved]
            drawn.append(Drawn(line.series.title, x, y, color, mark, tips, line.series.slab))
    return drawn


def _tip(line: Line, m: Measured) -> str:
    return (
        f"{line.series.title}: {words.count(m.record['dofs'])} unknowns, {m.cpu:.3g} s of "
        f"processor time, {m.memory:.2g} GB, {m.record['linear_solver']}"
    )


def _section(title: str, lines: Sequence[Line], dim: int) -> dict[str, Any]:
    """Time and memory of the series of one dimension."""
    mine = [line for line in lines if line.series.dim == dim and line.solved]
    if not mine:
        return {"title": title, "plots": [], "keys": [], "sentences": []}
    plots = [
        draw_plot(
            f"{title}: {label}",
            "unknowns",
            label,
            _drawn(mine, what, "dofs"),
        )
        for what, label in (
            ("cpu", "processor time of the whole process, s"),
            ("memory", "peak memory, GB"),
            ("solve", "processor time of the linear solve, s"),
        )
    ]
    keys = [(draw_key(one), one.name) for one in _drawn(mine, "cpu", "dofs")]
    return {
        "title": title,
        "plots": plots,
        "keys": keys,
        "sentences": [words.largest(line) for line in mine],
    }


def _pairing(lines: Sequence[Line]) -> Any:
    """Pairing and intersection over the faces of both sides, in space."""
    mine = [line for line in lines if line.series.dim == 3 and line.solved]
    if not mine:
        return ""
    label = "pairing and intersection, processor time, s"
    return draw_plot(label, "faces of both sides", label, _drawn(mine, "pairing", "faces"))


def _stage_plot(line: Line, colors: dict[str, str]) -> Any:
    """All stages of a series over its unknowns."""
    if not line.solved:
        return ""
    x = np.array([m.record["dofs"] for m in line.solved], dtype=float)
    drawn = [
        Drawn(stage, x, np.maximum([m.cost(stage) for m in line.solved], 1e-3), color, "circle")
        for stage, color in colors.items()
    ]
    return draw_plot(line.series.title, "unknowns", "processor time, s", drawn, size=SMALL)


def _bar(line: Line, colors: dict[str, str]) -> Any:
    """The share of each stage in the largest solve."""
    if not line.solved:
        return ""
    largest = line.solved[-1]
    return draw_bar({stage: largest.cost(stage) for stage in colors}, colors)
