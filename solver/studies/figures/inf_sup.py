"""Inf-sup constants level by level: they must level off above zero as the mesh is refined."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...report.charts import Axis, distinct, look_of, series_chart
from ..description import Study
from ..page import MeasuredGroup, PageSection, Shown, Table, TableRow, lost_points
from ..theory import fit_power

LEVEL = 0.4
"""β_h falls with the size of the faces to this power at most."""
ZERO = 1e-6
"""β_h below is zero up to round-off."""
# β_h below is drawn at the foot of the chart.
_RANGE = 0.02, 2.0
UNCUT = "uncut"


def falls_with(points: Sequence[Mapping[str, Any]]) -> float:
    """The power of the face size with which β_h falls over the last two levels.

    Not a number where it is zero: some multiplier acts on no displacement at all.
    """
    last = [(point["numbers"]["level"], point["constant"]) for point in points][-2:]
    if min((constant for _, constant in last), default=0.0) < ZERO:
        return math.nan
    fit = fit_power(*zip(*last, strict=True))
    return -fit.value if fit else math.nan


def levels_off(points: Sequence[Mapping[str, Any]]) -> bool:
    """Whether β_h stays above zero, by these levels."""
    return bool(falls_with(points) <= LEVEL)


def show(_: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """A chart and a table for each group; only the method with its cut has to hold."""
    problems = lost_points(groups)
    for one in groups:
        for line, points in one.lines.items():
            solved = [point for point in points if point["outcome"] == "solved"]
            if solved and not _is_uncut(points) and not levels_off(solved):
                problems.append(
                    f"{one.group.name}/{line}: β_h falls with order {falls_with(solved):.2f}"
                )
    outcome = "The method with its cut is stable on every mesh."
    return Shown(list(map(_section, groups)), problems, outcome if not problems else "")


def _is_uncut(points: Sequence[Mapping[str, Any]]) -> bool:
    return points[0]["choices"].get("cut") == UNCUT


def _section(group: MeasuredGroup) -> PageSection:
    lines = dict(sorted(group.lines.items(), key=lambda item: _is_uncut(item[1])))
    records = [
        {
            "series": line,
            "faces": point["numbers"]["level"],
            "constant": max(point["constant"], _RANGE[0]),
        }
        for line, points in lines.items()
        for point in points
        if point["outcome"] == "solved"
    ]
    looks = {
        line: replace(look_of(line), dashes=(5.0, 3.0) if _is_uncut(points) else ())
        for line, points in lines.items()
        if any(record["series"] == line for record in records)
    }
    chart = series_chart(
        f"infsup-{group.group.name}",
        f"Inf-sup constant by level: {group.title}",
        records,
        Axis("faces", "slave faces along an edge of the interface", log=True),
        Axis("constant", f"βₕ, {group.title}", log=True, domain=_RANGE),
        distinct(looks),
        width=460,
    )
    levels = list(dict.fromkeys(label for p in group.points for label in p["labels"].values()))
    head = ["Cells", *(f"βₕ, {level}" for level in levels), "Power", ""]
    rows = [TableRow(_cells(line, points, levels)) for line, points in lines.items()]
    return PageSection(
        group.group.name, group.title, group.group.text, [chart], [Table(head, rows)]
    )


def _cells(line: str, points: Sequence[Mapping[str, Any]], levels: Sequence[str]) -> list[str]:
    solved = [point for point in points if point["outcome"] == "solved"]
    constants = {point["labels"]["level"]: f"{point['constant']:.3f}" for point in solved}
    power = falls_with(solved) if len(solved) > 1 else math.nan
    word = "levels off" if power <= LEVEL else "falls" if not math.isnan(power) else "zero"
    shown = "–" if math.isnan(power) else f"{power:.2f}"
    return [line, *(constants.get(level, "–") for level in levels), shown, word]
