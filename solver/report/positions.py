"""Contact over the steps of a path: its largest pressure, and its mean, the force over the area."""

from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np

from ..verification.units import with_unit
from ..verification.verdict import Force
from .charts import BLUE, MANY, ORANGE, SHAPES, Axis, Chart, Look, series_chart
from .rows import Row

# Fewer steps are no path.
_FEWEST = 3
_ZONE = "zone "
_LOOKS = {"largest pressure": Look(BLUE), "normal force / area": Look(ORANGE, "square")}


def _of_zones(row: Row) -> Iterator[Force]:
    """The forces of contact of a solve in all steps."""
    return (one for one in row.verdict.values.forces if one.name.startswith(_ZONE))


def positions(row: Row) -> Chart | str:
    """The chart of one solve's zones over its steps; empty where there are few."""
    records = []
    for one in _of_zones(row):
        if not one.area or not one.pressure:
            continue
        normal = np.array(one.force) - np.array(one.friction or 0.0)
        zone, area = one.name.removeprefix(_ZONE), one.area[0]
        values = max(one.pressure), float(np.linalg.norm(normal)) / area if area else 0.0
        for series, value in zip(_LOOKS, values, strict=True):
            records.append({"series": series, "step": one.step, "value": value, "zone": zone})
    if len({record["step"] for record in records}) < _FEWEST:
        return ""
    unit = row.verdict.problem.units.get("stress")
    return series_chart(
        f"positions-{row.name}",
        f"{row.name}: contact over the steps",
        records,
        Axis("step", "step"),
        Axis("value", with_unit("pressure", unit), zero=True),
        _LOOKS,
        tips={"zone": "zone"},
        height=200,
    )


def side_by_side(rows: Sequence[Row], name: str) -> Chart | str:
    """The largest pressures of solves over their steps; empty where none has a path."""
    records = [
        {"series": row.verdict.problem.title, "step": one.step, "value": max(one.pressure)}
        for row in rows
        for one in _of_zones(row)
        if one.pressure
    ]
    if not records:
        return ""
    unit = rows[0].verdict.problem.units.get("stress")
    titles = dict.fromkeys(str(record["series"]) for record in records)
    pairs = zip(titles, cycle(zip(MANY, SHAPES, strict=False)), strict=False)
    looks = {title: Look(*look) for title, look in pairs}
    value = Axis("value", with_unit("largest pressure", unit))
    return series_chart(name, "Largest pressure", records, Axis("step", "step"), value, looks)
