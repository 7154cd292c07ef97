"""The study's points as the page shows them: their records, lines of levels, the cheapest way."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ...mechanics.linear.backends import BACKENDS
from ...report.charts import EPSILON
from ..fits import ROUND_OFF, Fit, fit_order
from ..points import MeasuredPoint, read_record
from ..timing import TOTAL, Spread, medians, spread
from .description import (
    AUTO,
    Problem,
    Study,
    StudyPoint,
    StudyTreatment,
)

# Errors in the order in which they are shown.
ERRORS = (
    *("pressure_l2", "pressure_means", "pressure_max", "pressure_oscillation"),
    *("displacement_l2", "displacement_h1", "stress_l2", "stress_max"),
)
TARGETS = {1e-2: "1 %", 1e-3: "0.1 %", 1e-4: "0.01 %", 1e-6: "10⁻⁶"}
TIE = 1.1
"""Times of two treatments that differ by less than this factor are equal within noise."""
_NUMBER = re.compile(r"\b\d[\d.e+-]*")


@dataclass(frozen=True)
class TimedSolve(MeasuredPoint):
    """One point of the study with its record."""

    point: StudyPoint

    @property
    def _kind(self) -> str:
        """Processor time on one core, which other work on the machine hardly changes; else wall."""
        return "cpu" if self.record["threads"] == 1 else "wall"

    @cached_property
    def time(self) -> Spread:
        """Time of a warm solve, seconds: processor time where it has one core."""
        return spread(self.record["times"][TOTAL][self._kind])

    @cached_property
    def wall(self) -> Spread:
        """Wall time of a warm solve, seconds."""
        return spread(self.record["times"][TOTAL]["wall"])

    @cached_property
    def stages(self) -> dict[str, float]:
        """Median time by stage."""
        times = {k: v for k, v in self.record["times"].items() if k != TOTAL}
        return medians(times, self._kind)

    def error(self, name: str) -> float | None:
        """An error against the exact solution; None without such a solution."""
        return self.record["errors"].get(name) if self.solved else None

    @property
    def label(self) -> str:
        """Pair and level."""
        return f"{self.point.pair}, level {self.point.level}"


@dataclass(frozen=True)
class LevelLine:
    """The levels of one problem, pair, treatment and linear solver, coarsest first."""

    problem: Problem
    pair: str
    treatment: StudyTreatment
    linear_solver: str
    levels: Sequence[TimedSolve]

    @property
    def title(self) -> str:
        """Its treatment, and the linear solver where that is chosen."""
        return _title(self.treatment, self.linear_solver)

    def having(self, error: str) -> list[TimedSolve]:
        """The levels that are solved and have this error."""
        return [m for m in self.levels if m.error(error) is not None]

    def values(self, error: str) -> list[float]:
        """The errors of these levels."""
        return [m.error(error) or 0.0 for m in self.having(error)]

    def reaching(self, error: str, target: float) -> list[TimedSolve]:
        """The levels from which on no error is above the target: one by accident does not count."""
        found: list[TimedSolve] = []
        for m, value in zip(
            reversed(self.having(error)), reversed(self.values(error)), strict=True
        ):
            if not value <= target:
                break
            found.append(m)
        return found

    def order(self, error: str) -> Fit | None:
        """The observed order over the finest levels."""
        return fit_order([1 / m.point.level for m in self.having(error)], self.values(error))

    def at_round_off(self, error: str) -> bool:
        """Whether every level is solved and its error rounding."""
        found = self.values(error)
        return len(found) == len(self.levels) and all(value <= ROUND_OFF for value in found)


@dataclass(frozen=True)
class Panel:
    """One error of one problem: the lines of all pairs and treatments that have it."""

    problem: Problem
    error: str
    lines: Sequence[LevelLine]

    @property
    def name(self) -> str:
        """The name of its files."""
        return f"{self.problem.name}-{self.error.replace('_', '-')}"

    @property
    def uncertainty(self) -> float | None:
        """The possible error of the reference; None if it is exact."""
        reference = self.problem.reference
        return reference.uncertainty.get(self.error) if reference else None

    @property
    def pairs(self) -> list[str]:
        """The pairs of cell types, slave first."""
        return list(dict.fromkeys(line.pair for line in self.lines))

    @property
    def titles(self) -> list[str]:
        """The treatments."""
        return list(dict.fromkeys(line.title for line in self.lines))

    def of(self, title: str) -> list[LevelLine]:
        """The lines of a treatment, pair by pair."""
        return [line for line in self.lines if line.title == title]

    def cheapest(self, title: str, target: float) -> TimedSolve | None:
        """The quickest solve of a treatment that reaches the target; None: never."""
        good = [m for line in self.of(title) for m in line.reaching(self.error, target)]
        return min(good, key=lambda m: m.time.median, default=None)

    def quickest(self, target: float) -> dict[str, TimedSolve]:
        """The treatments that reach the target soonest, with their solves, quickest first.

        More than one where ranges of repetitions overlap, or medians differ by less than `TIE`.
        """
        found = {title: m for title in self.titles if (m := self.cheapest(title, target))}
        ranked = dict(sorted(found.items(), key=lambda item: item[1].time.median))
        best = [m.time for m in ranked.values()][:1]
        return {
            title: m
            for title, m in ranked.items()
            if m.time.low <= best[0].high or m.time.median < TIE * best[0].median
        }

    def solved(self, title: str) -> bool:
        """Whether a treatment has a solve at all."""
        return any(line.having(self.error) for line in self.of(title))


def shown(error: float) -> float:
    """An error as it is drawn: one far below the unit round-off would stretch the plot."""
    return max(error, EPSILON / 4)


def read_points(study: Study, folder: Path) -> list[TimedSolve]:
    """All points of a study with their records in `folder`; one without a record says so."""
    files = ((p, folder / f"{p.name}.json") for p in study.points)
    return [TimedSolve(read_record(file, "errors", "times", "threads"), p) for p, file in files]


def lines(points: Iterable[TimedSolve]) -> list[LevelLine]:
    """Points of one problem, pair, treatment and linear solver together."""
    found: dict[tuple, list[TimedSolve]] = {}
    for m in points:
        p = m.point
        key = (p.problem.name, p.slave, p.master, p.treatment.name, p.linear_solver)
        found.setdefault(key, []).append(m)
    return [
        LevelLine(first.problem, first.pair, first.treatment, first.linear_solver, members)
        for members in found.values()
        for first in [members[0].point]
    ]


def panels(problem: Problem, found: Sequence[LevelLine]) -> list[Panel]:
    """A panel for each error that any of a problem's lines has."""
    return [
        Panel(problem, error, found)
        for error in ERRORS
        if any(line.having(error) for line in found)
    ]


def failures(points: Sequence[TimedSolve]) -> list[tuple[str, str, str]]:
    """Points without a solve: (outcome and reason, treatment, where) for each reason.

    Reasons that differ in numbers alone are shown once.
    """
    found: dict[tuple[str, str], dict[str, list[str]]] = {}
    shown: dict[str, str] = {}
    for m in points:
        if not m.solved:
            p = m.point
            why = shown.setdefault(_NUMBER.sub("#", m.why_not), m.why_not)
            places = found.setdefault((why, _title(p.treatment, p.linear_solver)), {})
            places.setdefault(f"{p.problem.title}, {p.pair}", []).append(str(p.level))
    return [
        (why, what, "; ".join(f"{place}: level {', '.join(k)}" for place, k in places.items()))
        for (why, what), places in found.items()
    ]


def _title(treatment: StudyTreatment, linear_solver: str) -> str:
    if linear_solver == AUTO:
        return treatment.title
    return f"{treatment.title}, {BACKENDS[linear_solver].name}"
