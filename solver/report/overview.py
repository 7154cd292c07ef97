"""The first screen of the report: how well, error against run time, digits kept, work left out."""

import csv
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..verification.savings import Savings, read_savings
from . import formats
from .charts import (
    BLUE,
    EPSILON,
    MUTED,
    ORANGE,
    RED,
    Axis,
    Chart,
    Look,
    Spec,
    floor_band,
    level,
    series_chart,
    tooltip,
)
from .errors import address, against_time, drawn, mark, unknowns
from .rows import Row, families, ours

_DIMENSIONS = {2: "2D", 3: "3D"}
_DIGITS_OF_DOUBLE = -math.log10(EPSILON)
# With fewer digits a result is unreliable (`solver.simulation.equilibrium.state`).
_FEWEST = 4
_WORST = 10
# What may cost the digits of a solve, by the keys of `Verdict.accuracy`.
CAUSES = {
    "forces": "forces: terms far larger than their sum",
    "gap": "gap: a difference of rounded displacements",
    "coordinates": "coordinates far from the origin",
    "stress": "strain: a difference of rounded displacements",
    "slender": "small faces of slender cells",
    "sums": "cells with many nodes",
}
# What each switch of `Shortcuts` leaves out, in a few words.
WORK = {
    "quadrature": "more Gauss points",
    "unloaded": "bodies that nothing moves",
    "status": "further solves",
}


def in_words(rows: Sequence[Row]) -> str:
    """What was verified and how well, in one sentence."""
    said = []
    for judged, text in (
        ("exact", "{} reach an exact answer, with errors up to {}"),
        ("expected error", "{} have the error that refined meshes predict, at most {}"),
        ("stated tolerance", "{} keep a stated tolerance, with errors up to {}"),
    ):
        mine = [row for row in ours(rows) if row.sound and row.verdict.judged == judged]
        errors = [row.accuracy[0] for row in mine if row.accuracy]
        if errors:
            said.append(text.format(len(mine), formats.error(max(errors))))
    types = {name for row in ours(rows) for body in row.sides for name in body.cells}
    on = f" on {len(types)} cell types" if types else ""
    return f"Of {len(ours(rows))} solves{on}, {'; '.join(said)}." if said else ""


def error_chart(rows: Sequence[Row]) -> Chart | None:
    """The worst error of every solve over its run time; family and cell type to be picked."""
    shown = drawn(rows)
    if not shown:
        return None
    records = [mark(row) for row in shown]
    errors = [record["error"] for record in records]
    chart = against_time(
        records,
        domain=(min(errors) / 3, max(errors) * 3),
        tips=("case", "check", "family", "cells"),
        layers=[floor_band(unknowns(shown))],
        size=(1200, 330),
    )
    families = list(dict.fromkeys(str(record["family"]) for record in records))
    cells = sorted({name for row in shown for name in row.tags["cells"]})
    picks = [_pick("family", families), _pick("cells", cells)]
    wanted = " && ".join(
        f"(!pick_{field} || indexof(split(datum.{field}, ' '), pick_{field}) >= 0)"
        for field in ("family", "cells")
    )
    layers = [dict(layer) for layer in chart.spec["layer"]]
    layers[-1]["transform"] = [{"filter": wanted}]
    return replace(chart, spec=chart.spec | {"params": picks, "layer": layers})


def digit_chart(rows: Sequence[Row]) -> Chart | None:
    """The digits that rounding leaves, as each solve estimates them, over its unknowns."""
    known = [row for row in ours(rows) if row.verdict.attainable and row.verdict.dofs]
    if not known:
        return None
    records: list[dict[str, Any]] = [
        {
            "series": _DIMENSIONS.get(row.dim, "other"),
            "case": row.name,
            "unknowns": row.verdict.dofs,
            "digits": digits_kept(row),
            "cause": cause(row),
            "url": address(row),
        }
        for row in known
    ]
    looks = {"2D": Look(BLUE), "3D": Look(ORANGE, "square"), "other": Look(MUTED)}
    found = {record["series"] for record in records}
    return series_chart(
        "digits-kept",
        "Digits that rounding leaves in each solve",
        records,
        Axis("unknowns", "unknowns", log=True),
        Axis("digits", "digits kept", domain=(0.0, _DIGITS_OF_DOUBLE)),
        {name: look for name, look in looks.items() if name in found},
        lines=False,
        tips={"case": "case", "cause": "lost by"},
        layers=[level(_FEWEST, "fewer: unreliable", RED)],
        width=560,
        height=230,
    )


def extreme_cases(folder: Path) -> Chart | None:
    """The digits of the pressure in each stiff or extreme case, where the study is in `folder`."""
    file = folder / "stability.csv"
    if not file.is_file():
        return None
    with file.open(encoding="utf-8", newline="") as stream:
        points = [point for point in csv.DictReader(stream) if point["pressure"]]
    records = [
        {
            "quantity": point["group"].replace("-", " "),
            "digits": _digits(float(point["pressure"])),
            "mesh": point["line"],
            "value": point["labels_x"],
            "url": f"stability.html#map-{point['group']}",
        }
        for point in points
    ]
    titles = {"quantity": "varied", "value": "value", "mesh": "mesh", "digits": "digits kept"}
    names: Spec = {"field": "quantity", "type": "nominal", "sort": None, "title": None}
    x = Axis("digits", "digits of the pressure", domain=(0.0, _DIGITS_OF_DOUBLE)).channel()
    marks = {"type": "tick", "thickness": 2, "color": BLUE, "cursor": "pointer"}
    channels: Spec = {"x": x, "y": names | {"axis": {"labelLimit": 260, "grid": True}}}
    channels |= {"href": {"field": "url"}, "tooltip": tooltip(records, titles)}
    height = 15 * len({record["quantity"] for record in records})
    spec = {"width": 420, "height": height, "data": {"values": records}, "mark": marks}
    spec |= {"encoding": channels}
    return Chart("extreme-cases", "Digits in stiff and extreme cases", spec, 700)


def digits_kept(row: Row) -> float:
    """How many decimal digits rounding leaves in the pressure, by the estimate of the solve."""
    return _digits(row.verdict.attainable or 1.0)


def _digits(error: float) -> float:
    return min(max(-math.log10(error or EPSILON), 0.0), _DIGITS_OF_DOUBLE)


def cause(row: Row) -> str:
    """What costs a solve most of its digits."""
    name, _ = max(row.verdict.accuracy.items(), key=lambda item: item[1], default=("", 0.0))
    return CAUSES.get(name, name)


def fewest_digits(rows: Sequence[Row]) -> list[Row]:
    """The ten solves that keep the fewest digits."""
    known = [row for row in ours(rows) if row.verdict.attainable]
    return sorted(known, key=lambda row: (digits_kept(row), row.anchor))[:_WORST]


def left_out_by_family(
    rows: Sequence[Row], folder: Path, switches: Sequence[str] = tuple(WORK)
) -> dict[str, tuple[int, list[int], Savings | None]]:
    """By family: how many solves, how many of them left out the work of each switch, time saved.

    The times are in `folder`, that of the report.
    """
    found: dict[str, tuple[int, list[int], Savings | None]] = {}
    solved = [row for row in ours(rows) if row.verdict.dofs]
    for family, mine in families(solved).items():
        counts = [sum(switch in row.verdict.switches for row in mine) for switch in switches]
        found[family] = len(mine), counts, read_savings(folder / "saved" / f"{family}.json")
    return found


def _pick(field: str, names: Sequence[str]) -> dict[str, object]:
    """A list above the chart from which one value of a field is chosen."""
    choice = {"input": "select", "options": ["", *names], "labels": ["all", *names]}
    return {"name": f"pick_{field}", "value": "", "bind": choice | {"name": f"{field}: "}}
