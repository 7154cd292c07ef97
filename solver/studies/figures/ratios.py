"""The same work done in several ways: time of each, its ratio to the first, memory and error."""

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from ...report.formats import error as shown_error
from ..description import Study
from ..page import (
    MeasuredGroup,
    PageSection,
    Shown,
    Table,
    TableRow,
    lost_points,
    measured,
    why_not,
)
from ..timing import TOTAL

_HEAD = ["Way", "Linear solver", "Time", "Ratio", "Memory", "kB per unknown", "Pressure error"]


def seconds(point: Mapping[str, Any]) -> float | None:
    """The median time of warm repetitions, else that of the whole process; processor seconds."""
    if point["outcome"] != "solved":
        return None
    times = point.get("times", {}).get(TOTAL)
    return float(statistics.median(times["cpu"]) if times else point["process"]["cpu"])


def show(_: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """A table for each group. What is not installed here is no failure."""
    sections = [
        PageSection(one.group.name, one.title, one.group.text, tables=[table(one)])
        for one in groups
    ]
    return Shown(sections, lost_points(groups, allowed=("missing",)), measured(groups))


def table(group: MeasuredGroup) -> Table:
    """The ways of a group, ratios to the first."""
    first = seconds(group.points[0])
    dofs = next((point["dofs"] for point in group.solved if "dofs" in point), None)
    rows = []
    for point in group.points:
        time = seconds(point)
        if time is None:
            rows.append(TableRow([point["line"], why_not(point)], kind="lost"))
            continue
        memory, iterations = point["process"]["peak_memory_mb"], point.get("linear_iterations")
        solver = point["linear_solver"] + (f", {iterations} iterations" if iterations else "")
        rows.append(
            TableRow(
                [
                    *(
                        point["line"],
                        solver,
                        f"{time:.2f} s",
                        f"{time / first:.2f}" if first else "–",
                    ),
                    f"{memory / 1000:.2f} GB",
                    f"{1000 * memory / dofs:.2f}" if dofs else "–",
                    shown_error(point["errors"].get("pressure_max")),
                ]
            )
        )
    size = f"{dofs:,} unknowns; " if dofs else ""
    warm = any("times" in point for point in group.solved)
    what = "a warm solve" if warm else "the whole process"
    return Table(
        _HEAD, rows, f"{group.title}: {size}{what}, processor seconds of all threads", left=2
    )
