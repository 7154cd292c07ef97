"""Results on refined meshes: order, limit and band of each quantity, and the exact value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...report.charts import BLUE, INK, ORANGE, Axis, Chart, Look, level, series_chart
from ...report.formats import error as shown_error
from ..description import Study
from ..fits import ROUND_OFF
from ..richardson import REASONS, Extrapolation, extrapolate, observed_order
from ..shown import MeasuredGroup, PageSection, Shown, Table, TableRow, lost_points

_COMPUTED, _LIMIT = "computed", "limit and band"
_LOOKS = {_COMPUTED: Look(BLUE), _LIMIT: Look(ORANGE, "diamond")}
# An exact value that is integrated on the mesh counts where it changes less than so much of what
# the computed one does.
_SETTLED = 0.1
Quantity = Mapping[str, Any]


@dataclass(frozen=True)
class Limit:
    """A quantity on all meshes, coarsest first, and what follows for its limit.

    `known` is the exact value, None where it is unknown.
    """

    name: str
    sizes: Sequence[float]
    values: Sequence[float]
    found: Extrapolation
    known: float | None

    @property
    def contained(self) -> bool | None:
        """Whether the band has the exact value; None without either."""
        if self.known is None or self.found.band is None:
            return None
        return abs(self.values[-1] - self.known) <= self.found.band


def limits(points: Sequence[Mapping[str, Any]]) -> list[Limit]:
    """The quantities of a line of three points or more, its levels coarsest first."""
    sizes = [1 / point["numbers"]["level"] for point in points]
    rows = zip(*(point["quantities"] for point in points), strict=True)
    return [_limit(sizes, row) for row in rows]


def _limit(sizes: Sequence[float], row: Sequence[Quantity]) -> Limit:
    values, scale = [one["value"] for one in row], max(one["scale"] for one in row)
    found = extrapolate(sizes, values, row[-1]["theory"], scale)
    return Limit(row[-1]["name"], sizes, values, found, settled(row))


def settled(row: Sequence[Quantity]) -> float | None:
    """The exact value on the finest mesh, where it depends little enough on the mesh."""
    *_, before, last = row
    if before["known"] is None or last["known"] is None:
        return None
    change = abs(last["value"] - before["value"])
    allowed = max(_SETTLED * change, ROUND_OFF * max(last["scale"], abs(last["value"])))
    return float(last["known"]) if abs(last["known"] - before["known"]) <= allowed else None


def show(_: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """A table for each line, and a chart for each quantity that changes with the mesh."""
    sections, every = [], []
    for one in groups:
        for line, points in one.lines.items():
            if any(point["outcome"] != "solved" for point in points):
                continue
            found = limits(points)
            every += found
            charts = [
                _chart(f"{one.group.name}-{i}", x)
                for i, x in enumerate(found)
                if x.found.kind != "exact"
            ]
            table = _table(points, found)
            sections.append(
                PageSection(one.group.name, f"{one.title}, {line}", "", charts, [table])
            )
    problems = lost_points(groups)
    problems += [
        f"{one.name}: the exact value is outside the band"
        for one in every
        if one.contained is False
    ]
    return Shown(sections, problems, outcome(every))


def outcome(found: Sequence[Limit]) -> str:
    """How many bands have the exact value; apart from these, values that no mesh changes."""
    parts = []
    for exact, text in (
        (False, "bands have the exact value"),
        (True, "that do not depend on the mesh are exact"),
    ):
        known = [x for x in found if x.known is not None and (x.found.kind == "exact") is exact]
        bands = [x.contained for x in known if x.contained is not None]
        if bands:
            parts.append(f"{sum(bands)} of {len(bands)} {text}")
        if len(known) > len(bands):
            parts.append(f"{len(known) - len(bands)} of {len(known)} known values have no band")
    return "; ".join(parts or ["No exact value is known"]) + "."


def _table(points: Sequence[Mapping[str, Any]], found: Sequence[Limit]) -> Table:
    rows = [_row(one) for one in found]
    estimates = [point["pressure_error_estimate"] for point in points]
    if None not in estimates and min(estimates) > ROUND_OFF:
        order = observed_order(found[0].sizes[-3:], estimates[-3:]) if found else None
        shown = "" if order is None else f"{order:.2f}"
        rows.append(TableRow(["estimated pressure error", *map(shown_error, estimates), shown]))
    head = ["Unknowns", *(str(point["dofs"]) for point in points)]
    return Table(
        [*head, "order", "limit", "± band", "factor", "exact", ""], rows, points[-1]["job"]
    )


def _row(one: Limit) -> TableRow:
    result = one.found
    inside = {None: "", True: "in the band", False: "outside the band"}[one.contained]
    return TableRow(
        [
            *(one.name, *(f"{value:.8g}" for value in one.values)),
            "" if result.order is None else f"{result.order:.2f}",
            "" if result.value is None else f"{result.value:.8g}",
            "" if result.band is None else shown_error(result.band),
            "" if result.factor is None else f"{result.factor:g}",
            "" if one.known is None else f"{one.known:.8g}",
            "; ".join(filter(None, [REASONS[result.kind], inside])),
        ]
    )


def _chart(name: str, one: Limit) -> Chart:
    """Values over the size of cells; the limit at size zero, and the band around the last value."""
    records: list[dict[str, Any]] = [
        {"series": _COMPUTED, "h": size, "value": value}
        for size, value in zip(one.sizes, one.values, strict=True)
    ]
    layers = []
    if one.found.band is not None and one.found.kind == "monotone":
        records.append({"series": _LIMIT, "h": 0.0, "value": one.found.value})
        low, high = (one.values[-1] + sign * one.found.band for sign in (-1, 1))
        ends = {"y": {"datum": low}, "y2": {"datum": high}}
        mark = {"type": "rect", "color": ORANGE, "opacity": 0.15}
        layers.append({"data": {"values": [{}]}, "mark": mark, "encoding": ends})
    if one.known is not None:
        layers.append(level(one.known, "exact", INK, (4.0, 3.0)))
    return series_chart(
        name,
        f"{one.name.capitalize()} against the size of cells",
        records,
        Axis("h", "size of cells / size in the case", zero=True),
        Axis("value", one.name),
        {record["series"]: _LOOKS[record["series"]] for record in records},
        layers=layers,
        width=400,
        height=220,
    )
