"""The results of refined meshes as text, as JSON and as a page with a chart for each quantity."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...report.charts import BLUE, INK, ORANGE, Axis, Chart, Look, level, series_chart, write_script
from ...report.formats import error
from ...report.html import render
from ...system.files import write_text
from ...verification.verdict import to_json
from .richardson import REASONS
from .run import Converged, Convergence, contained

HEAD = ("order", "limit", "± band", "factor", "exact", "")
_COMPUTED, _LIMIT = "computed", "limit and band"
_LOOKS = {_COMPUTED: Look(BLUE), _LIMIT: Look(ORANGE, "diamond")}


def outcome(found: Sequence[Convergence]) -> str:
    """How many bands have the exact value."""
    inside, bands, known = contained(found)
    same, all_of_them, _ = contained(found, exact=True)
    parts = []
    if bands:
        parts.append(f"{inside} of {bands} bands have the exact value")
    if known > bands:
        parts.append(f"{known - bands} of {known} known values have no band")
    if all_of_them:
        parts.append(f"{same} of {all_of_them} that do not depend on the mesh are exact")
    return "; ".join(parts or ["No exact value is known"]) + "."


def as_text(found: Convergence) -> str:
    """A table: a line for each quantity."""
    rows = [["unknowns", *map(str, found.unknowns), *HEAD], *table(found)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *rest in rows:
        numbers = [text.rjust(width) for text, width in zip(rest[:-1], widths[1:], strict=False)]
        lines.append("  ".join([first.ljust(widths[0]), *numbers, rest[-1]]).rstrip())
    return "\n".join([found.job, *lines])


def table(found: Convergence) -> list[list[str]]:
    """Name, value on each mesh, then the cells of `HEAD`, of each quantity and of the estimate."""
    rows = [_row(one) for one in found.quantities]
    if found.estimate:
        order = "" if found.estimate_order is None else f"{found.estimate_order:.2f}"
        values = map(error, found.estimate)
        rows.append(["estimated pressure error", *values, order, *[""] * (len(HEAD) - 1)])
    return rows


def _row(one: Converged) -> list[str]:
    result = one.found
    inside = {None: "", True: "in the band", False: "outside the band"}[one.contained]
    return [
        one.name,
        *map(_digits, one.values),
        "" if result.order is None else f"{result.order:.2f}",
        "" if result.value is None else _digits(result.value),
        "" if result.band is None else error(result.band),
        "" if result.factor is None else f"{result.factor:g}",
        "" if one.known is None else _digits(one.known),
        "; ".join(filter(None, [REASONS[result.kind], inside])),
    ]


def _digits(value: float) -> str:
    return f"{value:.8g}"


def write_convergence(found: Sequence[Convergence], file: Path) -> Path:
    """Write all numbers as JSON into `file`, and the page beside it; the path of the page."""
    page = file.with_suffix(".html")
    write_text(file, to_json([asdict(one) for one in found]) + "\n")
    sections = [
        {"found": one, "table": table(one), "charts": _charts(f"case-{number}", one)}
        for number, one in enumerate(found)
    ]
    content = render(
        Path(__file__).with_name("page.html.jinja"),
        charts=True,
        title="Results of refined meshes",
        outcome=outcome(found),
        good=all(one.contained is not False for each in found for one in each.quantities),
        sections=sections,
        head=HEAD,
        data=file.name,
    )
    write_text(page, content)
    write_script(page.parent)
    return page


def _charts(name: str, found: Convergence) -> list[Chart]:
    """A chart for each quantity that changes with the mesh."""
    sizes = [1 / one for one in found.levels]
    return [
        _chart(f"{name}-{number}", one, sizes)
        for number, one in enumerate(found.quantities)
        if one.found.kind != "exact"
    ]


def _chart(name: str, one: Converged, sizes: Sequence[float]) -> Chart:
    """Values over the size of cells; the limit at size zero, and the band around the last value."""
    records: list[dict[str, Any]] = [
        {"series": _COMPUTED, "h": size, "value": value}
        for size, value in zip(sizes, one.values, strict=True)
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
