"""Error against run time: charts of each pair of cells, and the fastest way to an accuracy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from markupsafe import Markup

from ...case.checks import ERRORS as WORDS
from ...report import formats
from ...report.charts import (
    EPSILON,
    MANY,
    RED,
    SHAPES,
    Axis,
    Chart,
    Look,
    floor_band,
    level,
    series_chart,
)
from ...report.formats import duration
from ...report.formats import error as shown_error
from ..description import Study
from ..page import (
    REFUSED,
    MeasuredGroup,
    PageSection,
    Shown,
    Table,
    TableRow,
    grouped,
    lost_points,
    measured,
)
from ..theory import ROUND_OFF, fit_order
from ..timing import TOTAL, Spread, medians, spread

Record = Mapping[str, Any]
# Errors in the order in which they are shown; the table at the top has the first ones of each kind.
ERRORS = (
    *("pressure_l2", "pressure_means", "pressure_max", "pressure_oscillation"),
    *("displacement_l2", "displacement_h1", "stress_l2", "stress_max"),
)
_OVERVIEW = ("pressure_l2", "pressure_means", "displacement_l2", "stress_l2")
TARGETS = {1e-2: "1 %", 1e-3: "0.1 %", 1e-4: "0.01 %", 1e-6: "10⁻⁶"}
TIE = 1.1
"""Times of two treatments that differ by less than this factor are equal within noise."""
LIMIT = 1e-3
_NEAR = 1e-11
_DASHES: tuple[tuple[float, ...], ...] = ((), (6, 3), (1.5, 3), (7, 2, 1.5, 2))
_TIPS = {
    "level": "level",
    "low": "shortest time, s",
    "high": "longest time, s",
    "unknowns": "unknowns",
}


def time_of(point: Record) -> Spread:
    """Time of a warm solve, seconds: processor time where it has one core, else wall time."""
    return spread(point["times"][TOTAL]["cpu" if point["threads"] == 1 else "wall"])


def treatment_of(point: Record) -> str:
    """What a point varies beside its series: the treatment or the linear solver."""
    return str(point["line"].removeprefix(point["series"]).lstrip(", ") or point["line"])


@dataclass(frozen=True)
class Panel:
    """One error of one group: its points by line."""

    group: MeasuredGroup
    error: str

    @cached_property
    def lines(self) -> dict[str, list[dict[str, Any]]]:
        """The points of each line that have the error, coarsest first."""
        having = (p for p in self.group.solved if self.error in p["errors"])
        return grouped(having, lambda point: str(point["line"]))

    def title_of(self, line: str) -> str:
        """The treatment of a line, or its linear solver."""
        return treatment_of(self.lines[line][0])

    def reaching(self, line: str, target: float) -> list[dict[str, Any]]:
        """The levels from which on no error is above the target: one by accident does not count."""
        found: list[dict[str, Any]] = []
        for point in reversed(self.lines[line]):
            if not point["errors"][self.error] <= target:
                break
            found.append(point)
        return found

    def cheapest(self, title: str, target: float) -> dict[str, Any] | None:
        """The quickest solve of a treatment that reaches the target; None: never."""
        mine = [line for line in self.lines if self.title_of(line) == title]
        good = [point for line in mine for point in self.reaching(line, target)]
        return min(good, key=lambda point: time_of(point).median, default=None)

    def quickest(self, target: float) -> dict[str, dict[str, Any]]:
        """The treatments that reach the target soonest, with their solves, quickest first.

        More than one where ranges of repetitions overlap, or medians differ by less than `TIE`.
        """
        found = {title: p for title in self.titles if (p := self.cheapest(title, target))}
        ranked = dict(sorted(found.items(), key=lambda item: time_of(item[1]).median))
        best = [time_of(point) for point in ranked.values()][:1]
        return {
            title: point
            for title, point in ranked.items()
            if time_of(point).low <= best[0].high or time_of(point).median < TIE * best[0].median
        }

    @property
    def titles(self) -> list[str]:
        """The treatments."""
        return list(dict.fromkeys(map(self.title_of, self.lines)))


def show(_: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """An overview, and a section for each group; refused points are no failure."""
    panels = {
        one.group.name: [panel for error in ERRORS if (panel := Panel(one, error)).lines]
        for one in groups
    }
    overview = Table(
        ["Problem", "Error", *TARGETS.values()],
        [_overview(p) for parts in panels.values() for p in parts if p.error in _OVERVIEW],
        left=6,
    )
    text = (
        "★: the fastest treatment, and those whose times overlap with its times or are less than "
        f"{100 * (TIE - 1):.0f} % longer. An accuracy counts as reached if all finer meshes "
        "reach it too."
    )
    sections = [
        PageSection("overview", "The fastest treatments for an accuracy", text, tables=[overview])
    ]
    sections += [_section(one, panels[one.group.name]) for one in groups]
    lost = lost_points(groups)
    rows = [TableRow(line.split(": ", 1)) for line in lost]
    if rows:
        table = Table(["Point", "Reason"], rows, left=2)
        sections.append(PageSection("lost", "Points without a solve", tables=[table]))
    return Shown(sections, lost_points(groups, allowed=(REFUSED, "failed")), measured(groups))


# What the first screen of the report shows: an error, the accuracies, and the problem of its chart.
_FIRST, _FIRST_TARGETS, _FIRST_CHART = "pressure_means", (1e-2, 1e-3, 1e-4), "manufactured-2d"


def card(groups: Sequence[MeasuredGroup]) -> dict[str, Any]:
    """The fastest way to each accuracy by problem, and the curves of one of them."""
    panels = [panel for one in groups if (panel := Panel(one, _FIRST)).lines]
    problems = {}
    for panel in panels:
        found = [panel.quickest(target) for target in _FIRST_TARGETS]
        problems[panel.group.title] = [
            [" or ".join(ways), time_of(next(iter(ways.values()))).median] if ways else None
            for ways in found
        ]
    curves = [panel for panel in panels if panel.group.group.name == _FIRST_CHART] or panels[:1]
    pairs = [grouped(panel.group.solved, lambda point: point["series"]) for panel in curves]
    pair, points = max(pairs[0].items(), key=lambda item: len(item[1])) if pairs else ("", [])
    return {
        "accuracies": [TARGETS[target] for target in _FIRST_TARGETS],
        "problems": problems,
        "chart": f"{curves[0].group.title}, {pair}" if curves else "",
        "curves": [_record(curves[0], point) for point in points if _FIRST in point["errors"]],
    }


def _overview(panel: Panel) -> TableRow:
    cells = [panel.group.title, WORDS[panel.error]]
    for target in TARGETS:
        ways = [
            Markup("<strong>{}</strong> {}<span class=under>{}</span>").format(
                title,
                duration(time_of(point).median),
                f"{point['series']}, level {point['labels']['level']}",
            )
            for title, point in panel.quickest(target).items()
        ]
        cells.append(Markup("").join(ways) or "none")
    return TableRow(cells)


def _section(group: MeasuredGroup, panels: Sequence[Panel]) -> PageSection:
    looks = looks_of(group)
    charts = [chart for panel in panels for chart in draw(panel, looks)]
    tables = [_ways(panel) for panel in panels] + [
        _levels(p) for p in panels if p.error in _OVERVIEW
    ]
    legend = (
        "Marks grow with the level. Red line: 0.1 %. Grey band: the round-off floor, from ε to ε√N "
        "for the largest number N of unknowns."
    )
    return PageSection(
        group.group.name,
        group.title,
        f"{group.group.text} {legend}",
        charts,
        [*tables, _costs(group)],
    )


def looks_of(group: MeasuredGroup) -> dict[str, Look]:
    """The look of every line by its title: one colour a kind of treatment, one mark a line."""
    looks: dict[str, Look] = {}
    kinds: dict[str, int] = {}
    for point, *_ in group.lines.values():
        title = treatment_of(point)
        if title not in looks:
            kind = " ".join(name.split("-")[0] for name in point["choices"].values())
            variant = kinds[kind] = kinds.get(kind, -1) + 1
            color = MANY[list(kinds).index(kind) % len(MANY)]
            looks[title] = Look(
                color, SHAPES[len(looks) % len(SHAPES)], _DASHES[variant % len(_DASHES)]
            )
    return looks


def draw(panel: Panel, looks: Mapping[str, Look]) -> list[Chart]:
    """A chart for each series of a panel, with the same scales."""
    points = [point for members in panel.lines.values() for point in members]
    times = [t for point in points for t in (time_of(point).low, time_of(point).high)]
    errors = [max(point["errors"][panel.error], EPSILON / 4) for point in points]
    close = min(errors) < _NEAR
    low = EPSILON / 8 if close else min(LIMIT, *errors) / 2
    name = WORDS[panel.error]
    x = Axis("time", "time of a warm solve, s", True, (min(times) / 1.3, max(times) * 1.3))
    y = Axis("error", f"relative error: {name}", True, (low, max(1.0, 2 * max(errors))))
    unknowns = max(point["dofs"] for point in points)
    layers = [level(LIMIT, "0.1 %", RED), *([floor_band(unknowns)] if close else [])]
    charts = []
    for pair, members in grouped(panel.group.points, lambda point: point["series"]).items():
        records = [_record(panel, point) for point in members]
        shown = {record["series"]: looks[record["series"]] for record in records}
        charts.append(
            series_chart(
                f"{panel.group.group.name}-{panel.error}-{pair}",
                f"{panel.group.title}, {pair}: error of {name}, against run time",
                records,
                x,
                y,
                shown,
                tips=_TIPS,
                layers=layers,
                order="level",
                span=("low", "high"),
                width=460,
            )
        )
    return charts


def _record(panel: Panel, point: Record) -> dict[str, Any]:
    """A record for each level; one without a solve has no error, and breaks the line."""
    title = treatment_of(point)
    record = {"series": title, "level": point["numbers"]["level"]}
    if point["outcome"] != "solved" or panel.error not in point["errors"]:
        return record | {"time": None, "error": None}
    time = time_of(point)
    numbers = {"time": time.median, "low": time.low, "high": time.high}
    numbers["error"] = max(point["errors"][panel.error], EPSILON / 4)
    # Four digits, as under the pointer: the page holds thousands of numbers.
    return record | {k: float(f"{v:.4g}") for k, v in numbers.items()} | {"unknowns": point["dofs"]}


def _ways(panel: Panel) -> Table:
    rows = []
    for title in panel.titles:
        cells: list[str | Markup] = [title]
        for target in TARGETS:
            point = panel.cheapest(title, target)
            best = (
                Markup("<span class=best>{}</span>")
                if title in panel.quickest(target)
                else Markup("{}")
            )
            cells.append(best.format(duration(time_of(point).median)) if point else "never")
        rows.append(TableRow(cells))
    caption = f"{WORDS[panel.error]}: shortest time to an error of at most …"
    return Table(["Treatment", *TARGETS.values()], rows, caption)


def _levels(panel: Panel) -> Table:
    """Errors by level, with observed orders."""
    levels = list(dict.fromkeys(p["labels"]["level"] for p in panel.group.points))
    rows = []
    for line, points in panel.lines.items():
        errors = {point["labels"]["level"]: point["errors"][panel.error] for point in points}
        order = fit_order([1 / p["numbers"]["level"] for p in points], list(errors.values()))
        exact = len(errors) == len(levels) and all(value <= ROUND_OFF for value in errors.values())
        cells = [shown_error(errors[k]) if k in errors else "–" for k in levels]
        rows.append(TableRow([line, *cells, str(order or ("rounding" if exact else "–"))]))
    return Table(
        ["Line", *levels, "order"], rows, f"{WORDS[panel.error]}: error by level, observed order"
    )


def _costs(group: MeasuredGroup) -> Table:
    """Where the time goes, on the finest meshes."""
    finest = [points[-1] for points in grouped(group.solved, lambda p: p["line"]).values()]
    names = [n for n in formats.colors(s for p in finest for s in p["times"]) if n != TOTAL]
    rows = []
    for point in finest:
        kind = "cpu" if point["threads"] == 1 else "wall"
        spent, time = medians(point["times"], kind), time_of(point)
        cells = [duration(spent[name]) if name in spent else "–" for name in names]
        rows.append(
            TableRow(
                [
                    *(
                        point["line"],
                        str(point["dofs"]),
                        point["linear_solver"],
                        duration(time.median),
                    ),
                    *(f"{duration(time.low)} … {duration(time.high)}", *cells),
                    formats.bar({n: spent[n] for n in names if n in spent}, time.median),
                    f"{point['process']['peak_memory_mb']:.0f} MB",
                ]
            )
        )
    head = [
        "Line",
        "Unknowns",
        "Linear solver",
        "Time",
        "Least … greatest",
        *names,
        "Stages",
        "Peak memory",
    ]
    return Table(head, rows, "Where the time goes, on the finest meshes")
