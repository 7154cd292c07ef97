"""The points of the scaling family as the page shows them: costs of each, growth of each series."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ..fits import Fit, fit_power
from ..points import MeasuredPoint, read_record
from .description import GROWTH, Goal, Scaling, ScalingPoint, SizeSeries

WHOLE, OTHER = "whole", "start-up"
BY_FACES = ("cut", "pairing")
"""Stages whose work is the interface: they grow with its faces, not with the unknowns."""
_SHORT = 0.05  # seconds, of which no speed-up is stated


@dataclass(frozen=True)
class ScaledSolve(MeasuredPoint):
    """One point with its record."""

    point: ScalingPoint

    @property
    def cpu(self) -> float:
        """Processor seconds of the whole process."""
        return self.record["process"]["cpu"]

    @property
    def memory(self) -> float:
        """Peak memory of the whole process, GB."""
        return self.record["process"]["peak_memory_mb"] / 1000

    @cached_property
    def stages(self) -> dict[str, float]:
        """Processor seconds by stage; the last one is the time outside all stages."""
        stages = dict(self.record["stage_cpu_seconds"])
        return stages | {OTHER: max(self.cpu - sum(stages.values()), 0.0)}

    @property
    def bytes_per_unknown(self) -> float:
        """Peak memory over unknowns."""
        return 1e9 * self.memory / self.record["dofs"]

    @property
    def wall(self) -> dict[str, float]:
        """Wall seconds of the whole process and by stage."""
        stages = {k: v for k, v in self.record["seconds"].items() if k in self.stages}
        return {WHOLE: self.record["process"]["wall"]} | stages

    def work(self, stage: str) -> int:
        """The measure of a stage's work: faces of the interface, or unknowns."""
        return self.record["faces" if stage in BY_FACES else "dofs"]

    @property
    def pressure(self) -> float:
        """The largest error of the pressure, relative."""
        return self.record["errors"]["pressure_max"]

    def cost(self, what: str) -> float:
        """The quantity of a goal at one point, or the processor seconds of a stage."""
        if what == "wall":
            return self.record["process"]["wall"]
        if what == "statuses":
            return self.record["iterations"]
        whole = {"cpu": self.cpu, WHOLE: self.cpu, "memory": self.memory, "pressure": self.pressure}
        return whole[what] if what in whole else self.stages.get(what, 0.0)


@dataclass(frozen=True)
class SeriesSolves:
    """The points of a series, smallest first."""

    series: SizeSeries
    points: Sequence[ScaledSolve]

    @cached_property
    def solved(self) -> list[ScaledSolve]:
        """The points that have a solve."""
        return [m for m in self.points if m.solved]

    @cached_property
    def fitted(self) -> list[ScaledSolve]:
        """The points that exponents are fitted to: those between the sizes asked for.

        At least the last two. Small sizes are mostly start-up, which does not grow.
        """
        low, high = self.series.fit
        inside = [m for m in self.solved if low <= m.point.size <= high]
        return inside if len(inside) > 1 else self.solved[-2:]

    @property
    def on_large(self) -> bool:
        """Whether exponents cover the sizes asked for, up to the largest."""
        sizes = [m.point.size for m in self.fitted]
        low, high = self.series.fit
        return bool(sizes) and min(sizes) >= low and max(sizes) >= high

    def growth(self, what: str) -> Fit | None:
        """The exponent of a stage, of the whole process or of memory; None where unknown."""
        found = self.fitted
        return fit_power([m.work(what) for m in found], [m.cost(what) for m in found])

    @property
    def span(self) -> tuple[int, int] | None:
        """The unknowns between which exponents are fitted."""
        sizes = [m.record["dofs"] for m in self.fitted]
        return (min(sizes), max(sizes)) if sizes else None


@dataclass(frozen=True)
class SolvedTwice:
    """The same mesh solved in two ways: `one` on few threads, and the `other`."""

    one: ScaledSolve
    other: ScaledSolve

    def of(self, stage: str) -> float | None:
        """Wall time of one over that of the other; None for a stage of no measurable time."""
        before, after = (m.wall.get(stage, 0.0) for m in (self.one, self.other))
        return before / after if min(before, after) > _SHORT else None

    @property
    def threads(self) -> tuple[int, int]:
        """Of the one and of the other."""
        return self.one.record["threads"], self.other.record["threads"]


def speed_ups(lines: Sequence[SeriesSolves]) -> list[SolvedTwice]:
    """Solved points of series that differ in their threads alone, few threads first."""
    pairs = [(pair, *pair.threads) for pair in _solved_twice(lines)]
    return [pair for pair, few, many in pairs if few < many]


def _solved_twice(lines: Sequence[SeriesSolves]) -> list[SolvedTwice]:
    """All pairs of solves of the same mesh, both ways round."""
    solved = [m for line in lines for m in line.solved]
    return [
        SolvedTwice(one, other)
        for one in solved
        for other in solved
        if one.point.size == other.point.size
        and one.point.series.problem == other.point.series.problem
    ]


@dataclass(frozen=True)
class Reached:
    """A goal with what was measured; None where that is missing, with the reason."""

    goal: Goal
    value: float | None
    why: str

    @property
    def good(self) -> bool:
        """Whether the goal is reached."""
        return self.value is not None and self.value <= self.goal.most


def read_series(scaling: Scaling, folder: Path) -> list[SeriesSolves]:
    """All series with the records of their points in `folder`; one without a record says so."""
    files = ((p, folder / f"{p.name}.json") for p in scaling.points)
    found = [ScaledSolve(read_record(file, "process", "dofs"), p) for p, file in files]
    return [
        SeriesSolves(series, [m for m in found if m.point.series is series])
        for series in scaling.series
    ]


def reached(scaling: Scaling, lines: Sequence[SeriesSolves]) -> list[Reached]:
    """Every goal with its measured number."""
    known = {line.series.name: line for line in lines}
    return [_reached(goal, known) for goal in scaling.goals]


def _reached(goal: Goal, known: Mapping[str, SeriesSolves]) -> Reached:
    line = known.get(goal.series)
    if line and goal.what.startswith(GROWTH):
        growth = line.growth(goal.what.removeprefix(GROWTH))
        if growth is None or not line.on_large:
            return Reached(goal, None, "too few of the large sizes are measured")
        return Reached(goal, growth.value, "")
    values = []
    for name in (goal.series,) if goal.over is None else (goal.series, goal.over):
        points = known[name].points if name in known else ()
        m = next((m for m in points if m.point.size == goal.size), None)
        if m is None:
            return Reached(goal, None, "not in this part of the family")
        if not m.solved:
            return Reached(goal, None, m.why_not)
        values.append(m.cost(goal.what))
    return Reached(goal, values[0] / values[1] if goal.over else values[0], "")


def failures(lines: Sequence[SeriesSolves]) -> list[tuple[str, str]]:
    """Points without a solve, and points whose checks do not hold: (name, why)."""
    lost = []
    for m in (m for line in lines for m in line.points):
        if not m.solved:
            lost.append((m.point.name, m.why_not))
        elif m.record["verdict"] != "passed":
            lost.append((m.point.name, f"{m.record['verdict']}: {m.record['reason']}"))
    return lost
