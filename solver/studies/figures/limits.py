"""Results on refined meshes: order, limit and band of each quantity, and the exact value.

Order, Richardson value and uncertainty band of a value on three or more meshes.

With f1, f2, f3 on sizes h1 < h2 < h3 the law f = a + c h^p gives the order p and the value a; the
band f1 ± F |a - f1| has the safety factor F (ASME V&V 20-2009, section 2-4; Roache, Verification
and Validation in Computational Science and Engineering, 1998, chapter 5). F is 1.25 where the order
is credible: within a tenth of the order of theory; else it is 3. An order above that of theory is
replaced by it, since it would make the band too narrow (Oberkampf and Roy, Verification and
Validation in Scientific Computing, 2010, section 8.7.3). With more than three meshes the order of
each three neighbours must be credible. Values that are not monotone have no band, nor have those
whose order is below 0.1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq

from ...report.charts import BLUE, INK, ORANGE, Axis, Chart, Look, level, series_chart
from ...report.formats import error as shown_error
from ...simulation.judgement.validity import NOTED_DEPTH
from ..description import Study
from ..page import MeasuredGroup, PageSection, Shown, Table, TableRow, lost_points
from ..theory import ROUND_OFF

CREDIBLE, DOUBTFUL = 1.25, 3.0
# An order is credible if it is within this part of the one of theory.
LEEWAY = 0.1
# Values that grow without limit, but slowly, like a logarithm, look like an order below this one.
_NONE = 0.1
# The largest order that is sought: values of meshes cannot distinguish higher ones.
_HIGHEST = 20.0

Kind = Literal["monotone", "exact", "oscillatory", "divergent", "stalled"]
REASONS: dict[Kind, str] = {
    "monotone": "",
    "exact": "does not depend on the mesh",
    "oscillatory": "oscillates: no band",
    "divergent": "does not converge, or too slowly: no band",
    "stalled": "equal on the two finest meshes alone: no band",
}


@dataclass(frozen=True, kw_only=True)
class Extrapolation:
    """What three or more values say about their limit; None where it is unknown.

    `order` is the observed one, `used` the one that `value` and `band` (half its width, around the
    value of the finest mesh) follow from, with the safety `factor`.
    """

    kind: Kind
    order: float | None = None
    used: float | None = None
    factor: float | None = None
    value: float | None = None
    band: float | None = None


def extrapolate(
    sizes: Sequence[float], values: Sequence[float], theory: float, scale: float = 0.0
) -> Extrapolation:
    """The limit of values (n,) on meshes of sizes (n,), coarsest first, n ≥ 3.

    `theory`: the order of smooth solutions. Changes of `ROUND_OFF` times the largest value,
    or `scale` where that is larger, are rounding.

    >>> found = extrapolate([4, 2, 1], [10 + 16, 10 + 4, 10 + 1], theory=2)
    >>> found.order, found.value, found.factor, found.band
    (2.0, 10.0, 1.25, 1.25)
    """
    rounding = ROUND_OFF * max(scale, *np.abs(values))
    if np.ptp(values) <= rounding:
        return Extrapolation(kind="exact", value=values[-1], band=rounding)
    (h3, h2, h1), (f3, f2, f1) = sizes[-3:], values[-3:]
    if abs(f2 - f1) <= rounding:
        return Extrapolation(kind="stalled")
    order = observed_order((h3, h2, h1), (f3, f2, f1))
    if order is None:
        return Extrapolation(kind="oscillatory")
    if order < _NONE:
        return Extrapolation(kind="divergent", order=order)
    orders = [observed_order(sizes[i : i + 3], values[i : i + 3]) for i in range(len(values) - 2)]
    credible = all(one is not None and abs(one - theory) <= LEEWAY * theory for one in orders)
    factor, used = CREDIBLE if credible else DOUBTFUL, min(order, theory)
    rest = (f1 - f2) / ((h2 / h1) ** used - 1)
    return Extrapolation(
        kind="monotone",
        order=order,
        used=used,
        factor=factor,
        value=f1 + rest,
        band=factor * abs(rest),
    )


def observed_order(sizes: Sequence[float], values: Sequence[float]) -> float | None:
    """The order p of f = a + c h^p through three values, coarsest first; None if not monotone.

    At most 20 in size. An order of zero or less is the one of values that run away.

    >>> observed_order([9, 3, 1], [9, 3, 1])
    1.0
    """
    (h3, h2, h1), (f3, f2, f1) = sizes, values
    if not (f3 - f2) * (f2 - f1) > 0:
        return None
    ratio, coarse, fine = (f3 - f2) / (f2 - f1), np.log(h3 / h2), np.log(h2 / h1)

    def excess(order: float) -> float:
        if order == 0:
            return float(coarse / fine - ratio)
        return float(np.expm1(order * coarse) / -np.expm1(-order * fine) - ratio)

    if excess(_HIGHEST) <= 0:
        return _HIGHEST
    if excess(-_HIGHEST) >= 0:
        return -_HIGHEST
    return round(float(brentq(excess, -_HIGHEST, _HIGHEST, xtol=1e-14)), 12)


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
    depths = [point.get("facet_depth", 0.0) for point in points]
    if max(depths) > NOTED_DEPTH:
        row = ["depth of facets, in closings", *(f"{depth:.2g}" for depth in depths)]
        rows.append(
            TableRow([*row, *[""] * 5, "a mesh file keeps its facets: the limit is theirs"])
        )
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
