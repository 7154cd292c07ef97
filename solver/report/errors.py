"""Error against run time of all solves of a family, log–log, with what to compare them with."""

from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

from . import formats
from .charts import (
    BLUE,
    CROSS,
    EPSILON,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    RED,
    Axis,
    Chart,
    Look,
    Spec,
    floor_band,
    level,
    round_off,
    series_chart,
)
from .families import CodeError, page_name
from .rows import Row

# How strictly a solve is judged: what an error may be compared with.
LOOKS = {
    "exact": Look(GREEN),
    "expected error": Look(BLUE, "square"),
    "stated tolerance": Look(ORANGE, "diamond"),
    "no reference": Look(INK, "triangle-up"),
    "not passed": Look(RED, CROSS),
}
# The chart goes down to round-off where an error is below this one.
_NEAR = 1e-9
# A line has a label where the next one is this share of the chart's height above it, at least.
_APART = 0.05


def drawn(rows: Sequence[Row]) -> list[Row]:
    """The solves of our own that have both an error and a time."""
    known = (row for row in rows if row.accuracy is not None and row.total)
    return [row for row in known if not row.verdict.foreign.code]


def floor(rows: Sequence[Row]) -> tuple[float, float] | None:
    """The round-off floor, ε and ε√N for the largest N unknowns; None where no solve is near it."""
    near = any(row.accuracy and row.accuracy[0] < _NEAR for row in rows)
    return round_off(unknowns(rows)) if near else None


def unknowns(rows: Sequence[Row]) -> int:
    """The unknowns of the largest of these solves."""
    return max((row.verdict.cost.dofs or 1 for row in rows), default=1)


def draw_errors(rows: Sequence[Row], reference_code: Sequence[CodeError]) -> Chart:
    """Marks of all solves with lines for the tolerance, the reference code and round-off."""
    shown = drawn(rows)
    records = [mark(row) for row in shown]
    allowed = sorted({row.allowed for row in shown if row.allowed})
    shares = [*(record["error"] for record in records), *allowed]
    low = EPSILON / 8 if floor(shown) else min(shares) / 3
    top = max(1e-2, 3 * max(shares))
    levels: list[Spec] = [floor_band(unknowns(shown))] if floor(shown) else []
    for value, above in zip(allowed, [*allowed[1:], float("inf")], strict=bool(allowed)):
        apart = above > value * (top / low) ** _APART
        levels.append(level(value, f"tolerance {formats.error(value)}" if apart else "", RED))
    for code in reference_code:
        label = f"{code.name} {code.version}: {formats.error(code.error)}"
        levels.append(level(code.error, label, MUTED, (6, 4)))
    return against_time(
        records,
        domain=(low, top),
        tips=("case", "check", "verdict", "stages"),
        layers=levels,
        size=(900, 400),
    )


def against_time(
    records: Sequence[dict[str, Any]],
    domain: tuple[float, float],
    tips: Sequence[str],
    layers: Sequence[Spec],
    size: tuple[int, int],
) -> Chart:
    """The errors of `mark`s over their run times; pointed at, each shows the fields of `tips`."""
    found = {record["series"] for record in records}
    return series_chart(
        "error-against-time",
        "Worst error of every solve against its run time",
        sorted(records, key=lambda record: record["series"] == "not passed"),  # on top
        Axis("seconds", "wall time of the solve, s", log=True),
        Axis("error", "worst relative error", log=True, domain=domain),
        {name: look for name, look in LOOKS.items() if name in found},
        lines=False,
        tips={name: name for name in tips},
        layers=layers,
        width=size[0],
        height=size[1],
    )


def mark(row: Row) -> dict[str, Any]:
    """What a chart shows of a solve that has both an error and a time."""
    error, check = row.accuracy  # type: ignore[misc]
    return {
        "case": row.name,
        "series": (row.verdict.judged or "no reference") if row.sound else "not passed",
        "seconds": row.total,
        "error": max(error, EPSILON / 4),
        "check": check,
        "verdict": row.word,
        "stages": formats.in_words(row.stages),
        "family": row.group,
        "cells": " ".join(row.tags["cells"]),
        "url": address(row),
    }


def address(row: Row) -> str:
    """Where a page of the report shows a solve."""
    return f"{page_name(row.group)}#{quote(row.anchor)}"
