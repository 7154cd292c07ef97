"""Growth with size: cost of processes on ever finer meshes, with fitted exponents and goals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from markupsafe import Markup

from ...report import formats
from ...report.charts import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    RED,
    SHAPES,
    Axis,
    Chart,
    Look,
    series_chart,
    slopes,
)
from ...report.formats import count, duration
from ...report.formats import error as shown_error
from ..description import Goal, Study
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
from ..theory import Fit, fit_power

Record = Mapping[str, Any]
WHOLE, OTHER, GROWTH = "whole", "start-up", "growth of "
BY_FACES = ("cut", "pairing")
"""Stages whose work is the interface: they grow with its faces, not with the unknowns."""
_COLORS = (BLUE, ORANGE, GREEN, PURPLE, INK, RED)
_TIPS = {"memory": "peak memory, GB", "solver": "linear solver"}
_PLOTS = {
    "cpu": "processor time of the whole process, s",
    "memory": "peak memory, GB",
    "solve": "processor time of the linear solve, s",
}
_SHORT = 0.05  # seconds, of which no speed-up is stated


def stages_of(point: Record) -> dict[str, float]:
    """Processor seconds by stage; the last one is the time outside all stages."""
    spent = dict(point["stage_cpu_seconds"])
    return spent | {OTHER: max(point["process"]["cpu"] - sum(spent.values()), 0.0)}


def cost(point: Record, what: str) -> float:
    """The quantity of a goal at one point, or the processor seconds of a stage."""
    process = point["process"]
    known = {
        "cpu": process["cpu"],
        WHOLE: process["cpu"],
        "wall": process["wall"],
        "memory": process["peak_memory_mb"] / 1000,
        "iterations": point["iterations"],
        "pressure": point["errors"].get("pressure_max", 0.0),
    }
    return float(known[what] if what in known else stages_of(point).get(what, 0.0))


@dataclass(frozen=True)
class SizeLine:
    """The solved points of a series, smallest first, and the unknowns between which is fitted."""

    name: str
    points: Sequence[dict[str, Any]]
    fit: tuple[float, float]

    @cached_property
    def fitted(self) -> list[dict[str, Any]]:
        """The points between the sizes asked for, at least the last two.

        Small sizes are mostly start-up, which does not grow.
        """
        low, high = self.fit
        inside = [p for p in self.points if low <= p["dofs"] <= 1.5 * high]
        return inside if len(inside) > 1 else list(self.points[-2:])

    @property
    def is_large(self) -> bool:
        """Whether exponents cover the sizes asked for, up to the largest."""
        sizes = [point["dofs"] for point in self.fitted]
        return bool(sizes) and min(sizes) >= self.fit[0] and max(sizes) >= self.fit[1]

    def growth(self, what: str) -> Fit | None:
        """The exponent of a stage, of the whole process or of memory; None where unknown."""
        work = "faces" if what in BY_FACES else "dofs"
        return fit_power([p[work] for p in self.fitted], [cost(p, what) for p in self.fitted])


def show(study: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """Goals, cost of all series with exponents and speed-ups, and every point."""
    lines = {
        name: SizeLine(name, [p for p in points if p["outcome"] == "solved"], study.fit)
        for one in groups
        for name, points in one.lines.items()
    }
    goals = [_goal(goal, groups, lines) for goal in study.goals]
    names = list(
        formats.colors(s for line in lines.values() for p in line.points for s in stages_of(p))
    )
    sections = (
        [PageSection("goals", "Goals", tables=[_goals_table(study.goals, goals)])] if goals else []
    )
    solved = [line for line in lines.values() if line.points]
    if solved:
        plots = [_chart(solved, what, label) for what, label in _PLOTS.items()]
        tables = [_exponents(solved, names), *_speed_ups(solved, names)]
        sections.append(PageSection("cost", "Cost against size", "", plots, tables))
    sections += [
        PageSection(one.group.name, one.title, one.group.text, tables=[_points_table(one, names)])
        for one in groups
    ]
    wrong = [
        f"{one.group.name}/{p['name']}: {p['verdict']}: {p['reason']}"
        for one in groups
        for p in one.solved
        if p["verdict"] != "passed"
    ]
    known = [
        value <= goal.most
        for goal, (value, _) in zip(study.goals, goals, strict=True)
        if value is not None
    ]
    said = f"{sum(known)} of {len(known)} goals measured here are reached." if known else ""
    return Shown(sections, lost_points(groups) + wrong, f"{measured(groups)} {said}".strip())


def _goal(
    goal: Goal, groups: Sequence[MeasuredGroup], lines: Mapping[str, SizeLine]
) -> tuple[float | None, str]:
    """What was measured of a goal; None where that is missing, with the reason."""
    line = lines.get(goal.series)
    if goal.what.startswith(GROWTH):
        growth = line.growth(goal.what.removeprefix(GROWTH)) if line else None
        if growth is None or line is None or not line.is_large:
            return None, "too few of the large sizes are measured"
        return growth.value, ""
    values = []
    for name in filter(None, (goal.series, goal.over)):
        same = (
            p
            for one in groups
            for p in one.points
            if p["line"] == name and goal.at in p["labels"].values()
        )
        point = next(same, None)
        if point is None:
            return None, "not in this part of the study"
        if point["outcome"] != "solved":
            return None, why_not(point)
        values.append(cost(point, goal.what))
    return values[0] / values[1] if goal.over else values[0], ""


def _goals_table(goals: Sequence[Goal], found: Sequence[tuple[float | None, str]]) -> Table:
    rows = []
    for goal, (value, why) in zip(goals, found, strict=True):
        kind = "reached" if value is not None and value <= goal.most else "short"
        shown = (
            Markup("<span class={}>{:.3g} {}</span>").format(kind, value, goal.unit)
            if value is not None
            else why
        )
        others = "; ".join(
            f"{code}: {number:g} {goal.unit}" for code, number in goal.others.items()
        )
        rows.append(TableRow([goal.title, others, f"{goal.most:g} {goal.unit}", shown]))
    return Table(["Work", "Other codes", "Goal", "Measured"], rows, left=2)


def _chart(lines: Sequence[SizeLine], what: str, label: str) -> Chart:
    """A line for each series: a cost against the unknowns; grey: cost in proportion to size."""
    looks = {
        line.name: Look(_COLORS[i % len(_COLORS)], SHAPES[(i + i // len(_COLORS)) % len(SHAPES)])
        for i, line in enumerate(lines)
    }
    records = [
        {
            "series": line.name,
            "size": point["dofs"],
            "cost": max(cost(point, what), 1e-3),
            "memory": cost(point, "memory"),
            "solver": point["linear_solver"],
        }
        for line in lines
        for point in line.points
    ]
    x, y = Axis("size", "unknowns", log=True), Axis("cost", label, log=True)
    fan = slopes(records, "size", "cost", [1.0])
    return series_chart(label, label, records, x, y, looks, tips=_TIPS, layers=fan, width=460)


def _exponents(lines: Sequence[SizeLine], names: Sequence[str]) -> Table:
    rows = []
    for line in lines:
        sizes = [point["dofs"] for point in line.fitted]
        growths = [str(line.growth(name) or "–") for name in (WHOLE, *names, "memory")]
        rows.append(TableRow([line.name, f"{count(min(sizes))} … {count(max(sizes))}", *growths]))
    heads = [f"{name}*" if name in BY_FACES else name for name in names]
    caption = "Exponents over unknowns; * over faces of both sides of the interface"
    return Table(["Series", "Fitted from … to", WHOLE, *heads, "memory"], rows, caption)


def _points_table(group: MeasuredGroup, names: Sequence[str]) -> Table:
    rows = []
    for point in group.points:
        if point["outcome"] != "solved":
            rows.append(TableRow([point["name"], why_not(point)], kind="lost"))
            continue
        process = point["process"]
        rows.append(
            TableRow(
                [
                    *(
                        point["name"],
                        point["linear_solver"],
                        count(point["dofs"]),
                        count(point["faces"]),
                    ),
                    *(str(point["iterations"]), str(point["linear_iterations"] or "–")),
                    *(duration(process["cpu"]), duration(process["wall"])),
                    f"{cost(point, 'memory'):.2f} GB",
                    f"{1000 * process['peak_memory_mb'] / point['dofs']:.2f}",
                    shown_error(cost(point, "pressure")),
                    *(f"{cost(point, name):.2f}" for name in names),
                    duration(point["meshing"]["wall"]),
                ]
            )
        )
    head = [
        "Point",
        "Linear solver",
        "Unknowns",
        "Faces",
        "Contact solves",
        "Iterations",
        "Processor",
        "Wall",
    ]
    head += [
        "Memory",
        "kB per unknown",
        "Pressure error",
        *(f"{name}, cpu s" for name in names),
        "Meshing, separate",
    ]
    return Table(head, rows, "Point by point", left=2)


def _speed_ups(lines: Sequence[SizeLine], names: Sequence[str]) -> list[Table]:
    """Solved points of series that differ in their threads alone, few threads first."""
    points = [point for line in lines for point in line.points]
    rows = []
    for one in points:
        for other in points:
            same = (one["case"], one["numbers"]) == (other["case"], other["numbers"])
            if same and one["dofs"] == other["dofs"] and one["threads"] < other["threads"]:
                ratios = [_ratio(one["seconds"], other["seconds"], name) for name in names]
                whole = one["process"]["wall"] / other["process"]["wall"]
                threads = f"{one['threads']} → {other['threads']}"
                rows.append(TableRow([other["name"], threads, f"{whole:.2f}", *ratios]))
    caption = "Speed-up over threads: wall time on few over wall time on many"
    return [Table(["Point", "Threads", WHOLE, *names], rows, caption)] if rows else []


def _ratio(one: Mapping[str, float], other: Mapping[str, float], stage: str) -> str:
    before, after = one.get(stage, 0.0), other.get(stage, 0.0)
    return f"{before / after:.2f}" if min(before, after) > _SHORT else "–"
