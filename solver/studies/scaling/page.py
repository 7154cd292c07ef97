"""The page of growth with size, and its tables for machines."""

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

from ...report import stages
from ...report.charts import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    RED,
    SHAPES,
    Axis,
    Chart,
    Look,
    series_chart,
    slopes,
    write_script,
)
from ...report.html import render
from ...report.tables import as_csv
from ...system.files import write_text
from ..bandwidth import table
from ..points import disturbed, facts, outcome, page_name
from .description import Scaling
from .records import (
    BY_FACES,
    OTHER,
    WHOLE,
    Reached,
    ScaledSolve,
    SeriesSolves,
    failures,
    reached,
    read_series,
    speed_ups,
)

# Colour and mark by the number of a line: either shows which it is.
_COLORS = (BLUE, ORANGE, GREEN, PURPLE, INK, RED)
# The slope of cost in proportion to size.
_LINEAR = [1.0]
_SIDES = {3: "3D", 2: "2D"}
_TIPS = {"memory": "peak memory, GB", "solver": "linear solver"}
_PLOTS = {
    "cpu": "processor time of the whole process, s",
    "memory": "peak memory, GB",
    "solve": "processor time of the linear solve, s",
}


def write_scaling(scaling: Scaling, results: Path, folder: Path) -> str:
    """Write page and tables into `folder`; `results` holds the records. Returns the outcome."""
    lines, name = read_series(scaling, results), page_name("scaling", scaling.size)
    write_text(folder / f"{name}.html", _to_html(scaling, lines, name))
    write_script(folder)
    write_text(folder / f"{name}.csv", as_csv(point_rows(lines)))
    write_text(folder / f"{name}-exponents.csv", as_csv(exponent_rows(lines)))
    goals, points = reached(scaling, lines), [m for line in lines for m in line.points]
    return f"{outcome(points)} {goals_reached(goals)} Page: {folder / name}.html"


def goals_reached(goals: Sequence[Reached]) -> str:
    """How many goals are reached, of those that the measured sizes can answer."""
    known = [one.good for one in goals if one.value is not None]
    if not known:
        return "These sizes answer no goal."
    return f"{sum(known)} of {len(known)} goals measured here are reached."


def stage_names(lines: Sequence[SeriesSolves]) -> list[str]:
    """The stages of all solves in the order of the work, then the time outside all of them."""
    found = [stage for line in lines for m in line.solved for stage in m.stages]
    return [s for s in stages.colors(found) if s != OTHER] + [OTHER] * bool(found)


def point_rows(lines: Sequence[SeriesSolves]) -> list[dict[str, Any]]:
    """One row for each point, those without a solve too."""
    names = stage_names(lines)
    return [_row(m, names) for line in lines for m in line.points]


def _row(m: ScaledSolve, names: Sequence[str]) -> dict[str, Any]:
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
    row["bytes_per_unknown"] = m.bytes_per_unknown if m.solved else None
    for stage in names:
        row[f"{stage}_wall"] = (record.get("seconds") or {}).get(stage)
        row[f"{stage}_cpu"] = m.stages.get(stage) if m.solved else None
    row |= {key: errors.get(key) for key in ("pressure_max", "pressure_l2", "stress_max")}
    row |= {f"meshing_{k}": (record.get("meshing") or {}).get(k) for k in ("wall", "cpu")}
    return row | {key: record.get(key) for key in ("threads", "load")}


def exponent_rows(lines: Sequence[SeriesSolves]) -> list[dict[str, Any]]:
    """The exponents of every series: whole process, stages, memory, with what they grow with."""
    return [
        {
            "series": line.series.name,
            "cost": name,
            "over": "faces" if name in BY_FACES else "unknowns",
            "exponent": growth.value,
            "spread": growth.spread,
            "from": growth.low,
            "to": growth.high,
        }
        for line in lines
        for name in (WHOLE, *stage_names(lines), "memory")
        if (growth := line.growth(name))
    ]


def _to_html(scaling: Scaling, lines: Sequence[SeriesSolves], name: str) -> str:
    points = [m for line in lines for m in line.points]
    colors, goals, lost = (
        stages.colors(stage_names(lines)),
        reached(scaling, lines),
        failures(lines),
    )
    return render(
        Path(__file__).with_name("page.html.jinja"),
        charts=True,
        title=scaling.title + f" ({scaling.size})" * (name != "scaling"),
        name=name,
        outcome=f"{outcome(points)} {goals_reached(goals)}",
        good=not lost,
        goals=goals,
        sections=[_section(title, lines, dim) for dim, title in _SIDES.items()],
        pairing=_pairing(lines),
        lines=lines,
        speed_ups=speed_ups(lines),
        products=[(m.point.series.title, table(m.record.get("products"))) for m in points],
        stages=colors,
        bars=[(line, _stage_chart(line, colors), line.solved[-1]) for line in lines if line.solved],
        failures=lost,
        facts=facts(points),
        disturbed=disturbed(points),
        whole=WHOLE,
        by_faces=BY_FACES,
    )


def _chart(lines: Sequence[SeriesSolves], what: str, over: str, title: str, label: str) -> Chart:
    """A line for each series: a cost, as `ScaledSolve.cost` names it."""
    records, looks = [], {}
    for number, line in enumerate(lines):
        color, shape = _COLORS[number % len(_COLORS)], SHAPES[number % len(SHAPES)]
        looks[line.series.title] = Look(color, shape, (5.0, 3.0) if line.series.slab else ())
        records += [_record(line, m, what, over) for m in line.solved]
    x = Axis("size", "unknowns" if over == "dofs" else "faces of both sides", log=True)
    y = Axis("cost", label, log=True)
    fan = slopes(records, "size", "cost", _LINEAR)
    return series_chart(title, title, records, x, y, looks, tips=_TIPS, layers=fan, width=460)


def _record(line: SeriesSolves, m: ScaledSolve, what: str, over: str) -> dict[str, Any]:
    return {
        "series": line.series.title,
        "size": m.record[over],
        "cost": max(m.cost(what), 1e-3),
        "memory": m.memory,
        "solver": m.record["linear_solver"],
    }


def _section(title: str, lines: Sequence[SeriesSolves], dim: int) -> dict[str, Any]:
    """Time and memory of the series of one dimension."""
    mine = [line for line in lines if line.series.dim == dim and line.solved]
    plots = [
        _chart(mine, what, "dofs", f"{title}: {label}", label)
        for what, label in (_PLOTS if mine else {}).items()
    ]
    return {"title": title, "plots": plots}


def _pairing(lines: Sequence[SeriesSolves]) -> Chart | str:
    """Pairing and intersection over the faces of both sides, in 3D."""
    mine = [line for line in lines if line.series.dim == 3 and line.solved]
    label = "pairing and intersection, processor time, s"
    return _chart(mine, "pairing", "faces", label, label) if mine else ""


def _stage_chart(line: SeriesSolves, colors: dict[str, str]) -> Chart:
    """All stages of a series over its unknowns."""
    records = [
        {"series": stage, "size": m.record["dofs"], "cost": max(m.cost(stage), 1e-3)}
        for stage in colors
        for m in line.solved
    ]
    title = f"{line.series.title}: stages"
    x, y = Axis("size", "unknowns", log=True), Axis("cost", "processor time, s", log=True)
    # On dark paper some colours are close: marks differ too.
    marks = zip(colors.items(), cycle(SHAPES), strict=False)
    looks = {stage: Look(color, shape) for (stage, color), shape in marks}
    fan = slopes(records, "size", "cost", _LINEAR)
    return series_chart(title, title, records, x, y, looks, layers=fan, width=380, height=200)
