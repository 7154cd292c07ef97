"""The points of the scaling family as the page shows them: costs of each, growth of each series."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from solver.studies.scaling.description import GROWTH, Goal, Point, Scaling, Series
from solver.studies.scaling.growth import BY_FACES, Growth, fit_growth, window
from solver.studies.scaling.point import SOLVED

WHOLE, OTHER = "whole", "start-up"


@dataclass(frozen=True)
class Measured:
    """One point with its record."""

    point: Point
    record: Mapping[str, Any]

    @property
    def solved(self) -> bool:
        """Whether there is a solve to show."""
        return self.record["outcome"] == SOLVED

    @property
    def why_not(self) -> str:
        """Why there is none."""
        return f"{self.record['outcome']}: {self.record['reason']}"

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
        """Processor seconds by stage; the last one is what the stages do not tell."""
        stages = dict(self.record["stage_cpu_seconds"])
        return stages | {OTHER: max(self.cpu - sum(stages.values()), 0.0)}

    def cost(self, stage: str) -> float:
        """Processor seconds of a stage, or of the whole process."""
        return self.cpu if stage == WHOLE else self.stages.get(stage, 0.0)

    def work(self, stage: str) -> int:
        """What a stage grows with: faces of the interface, or unknowns."""
        return self.record["faces" if stage in BY_FACES else "dofs"]

    @property
    def pressure(self) -> float:
        """The largest error of the pressure, relative."""
        return self.record["errors"]["pressure_max"]

    def answer(self, what: str) -> float:
        """What a goal asks of one point."""
        if what == "wall":
            return self.record["process"]["wall"]
        return {"cpu": self.cpu, "memory": self.memory, "pressure": self.pressure}[what]


@dataclass(frozen=True)
class Line:
    """The points of a series, smallest first."""

    series: Series
    points: Sequence[Measured]

    @cached_property
    def solved(self) -> list[Measured]:
        """The points that have a solve."""
        return [m for m in self.points if m.solved]

    @cached_property
    def fitted(self) -> list[Measured]:
        """The points that exponents are fitted to."""
        chosen = window([m.point.size for m in self.solved], *self.series.fit)
        return [self.solved[i] for i in chosen]

    @property
    def on_large(self) -> bool:
        """Whether exponents are those of the sizes asked for, to the largest one."""
        sizes = [m.point.size for m in self.fitted]
        low, high = self.series.fit
        return bool(sizes) and min(sizes) >= low and max(sizes) >= high

    def growth(self, stage: str) -> Growth | None:
        """The exponent of a stage, or of the whole process; None where it cannot be told."""
        found = self.fitted
        return fit_growth([m.work(stage) for m in found], [m.cost(stage) for m in found])

    @property
    def memory_growth(self) -> Growth | None:
        """The exponent of the peak memory over unknowns."""
        found = self.fitted
        return fit_growth([m.record["dofs"] for m in found], [m.memory for m in found])


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


def read_lines(scaling: Scaling, folder: Path) -> list[Line]:
    """All series with the records of their points in `folder`; one without a record says so."""
    found = [Measured(point, _read(folder / f"{point.name}.json")) for point in scaling.points]
    return [
        Line(series, [m for m in found if m.point.series is series]) for series in scaling.series
    ]


def _read(path: Path) -> Mapping[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {"outcome": "missing", "reason": "there is no record of this point"}


def reached(scaling: Scaling, lines: Sequence[Line]) -> list[Reached]:
    """Every goal with its measured number."""
    known = {line.series.name: line for line in lines}
    return [_reached(goal, known.get(goal.series)) for goal in scaling.goals]


def _reached(goal: Goal, line: Line | None) -> Reached:
    if line is None:
        return Reached(goal, None, "not in this part of the family")
    if goal.what.startswith(GROWTH):
        growth = line.growth(goal.what.removeprefix(GROWTH))
        if growth is None or not line.on_large:
            return Reached(goal, None, "too few of the large sizes are measured")
        return Reached(goal, growth.value, "")
    m = next((m for m in line.points if m.point.size == goal.size), None)
    if m is None:
        return Reached(goal, None, "not in this part of the family")
    if not m.solved:
        return Reached(goal, None, m.why_not)
    return Reached(goal, m.answer(goal.what), "")


def failures(lines: Sequence[Line]) -> list[tuple[str, str]]:
    """Points without a solve, and points whose checks do not hold: (name, why)."""
    lost = []
    for m in (m for line in lines for m in line.points):
        if not m.solved:
            lost.append((m.point.name, m.why_not))
        elif m.record["verdict"] != "passed":
            lost.append((m.point.name, f"{m.record['verdict']}: {m.record['reason']}"))
    return lost
