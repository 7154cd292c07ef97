"""The pressure along the interface: does it oscillate where it should be smooth?

The largest second difference |p₋ − 2 p + p₊| of neighbouring macro-elements, over the load, is
small where the pressure is controlled; without the cut it is of the order of the pressure itself.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...report.charts import INK, ORANGE, Axis, Chart, Look, series_chart
from ..description import Study
from ..page import MeasuredGroup, PageSection, Shown, Table, TableRow, grouped, lost_points
from .inf_sup import UNCUT

OSCILLATION = 0.15
"""Second difference, over the load, that the cut has to stay below; an edge of contact has one of
0.1 of its own."""
LOAD = 25.0


def oscillation(point: Mapping[str, Any]) -> float:
    """The largest second difference of neighbours over the load."""
    return float(np.abs(np.diff(point["pressure"], 2)).max()) / LOAD


def show(_: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """A table of oscillations, and a chart for each series and kind of contact."""
    problems, sections = lost_points(groups), []
    for one in groups:
        cut = [point for point in one.solved if point["choices"]["cut"] != UNCUT]
        problems += [
            f"{one.group.name}/{point['name']}: the pressure oscillates by {oscillation(point):.2f}"
            for point in cut
            if oscillation(point) > OSCILLATION
        ]
        rows = [TableRow([point["line"], f"{oscillation(point):.2f}"]) for point in one.solved]
        table = Table(["Cells, cut, contact", "Oscillation over the load"], rows)
        pairs = grouped(one.solved, lambda point: (point["series"], point["choices"]["contact"]))
        charts = [_chart(cells, contact, points) for (cells, contact), points in pairs.items()]
        sections.append(PageSection(one.group.name, one.title, one.group.text, charts, [table]))
    return Shown(sections, problems)


def _chart(cells: str, contact: str, points: Sequence[Mapping[str, Any]]) -> Chart:
    looks = {"lac": Look(INK), UNCUT: Look(ORANGE, "square", (5.0, 3.0))}
    records = [
        {"series": point["choices"]["cut"], "x": x, "p": p / LOAD}
        for point in points
        for x, p in zip(point["place"], point["pressure"], strict=True)
    ]
    return series_chart(
        f"half-loaded-{cells}-{contact}",
        f"Pressure under a half-loaded block, {cells}, {contact}",
        records,
        Axis("x", "x, length units"),
        Axis("p", f"p / {LOAD:g}, {cells}, {contact}", zero=True),
        {name: look for name, look in looks.items() if any(r["series"] == name for r in records)},
        marks=12,
        width=460,
    )
