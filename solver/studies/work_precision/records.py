"""The study's points as the page shows them: their records, lines of levels, the cheapest way."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from solver.mechanics.linear.backends import BACKENDS
from solver.report.axes import EPSILON
from solver.studies.fits import ROUND_OFF, Slope, fit_slope
from solver.studies.timing import TOTAL, Spread, medians, spread
from solver.studies.work_precision.description import AUTO, Point, Problem, Study, Treatment
from solver.studies.work_precision.point import SOLVED

# Errors in the order in which they are shown, with what they are errors of.
ERRORS = {
    "pressure_l2": "pressure, L2",
    "pressure_means": "pressure, macro-element means",
    "pressure_max": "pressure, maximum",
    "pressure_oscillation": "pressure, oscillation",
    "displacement_l2": "displacement, L2",
    "displacement_h1": "displacement, H1",
    "stress_l2": "stress, L2",
    "stress_max": "stress, maximum",
}
_NUMBER = re.compile(r"\b\d[\d.e+-]*")
TARGETS = {1e-2: "1 %", 1e-3: "0.1 %", 1e-4: "0.01 %", 1e-6: "10⁻⁶"}


@dataclass(frozen=True)
class Measured:
    """One point of the study with its record."""

    point: Point
    record: Mapping[str, Any]

    @property
    def solved(self) -> bool:
        """Whether there is a solve to show."""
        return self.record["outcome"] == SOLVED

    @cached_property
    def time(self) -> Spread:
        """Wall time of a warm solve, seconds."""
        return spread(self.record["times"][TOTAL]["wall"])

    @cached_property
    def cpu(self) -> Spread:
        """Processor time of a warm solve, seconds."""
        return spread(self.record["times"][TOTAL]["cpu"])

    @cached_property
    def stages(self) -> dict[str, float]:
        """Median wall time by stage."""
        times = {k: v for k, v in self.record["times"].items() if k != TOTAL}
        return medians(times, "wall")

    def error(self, name: str) -> float | None:
        """An error against the exact solution; None where there is none."""
        return self.record["errors"].get(name)

    @property
    def label(self) -> str:
        """Pair and level."""
        return f"{self.point.pair}, level {self.point.level}"


@dataclass(frozen=True)
class Line:
    """The levels of one problem, pair, treatment and linear solver, coarsest first."""

    problem: Problem
    pair: str
    treatment: Treatment
    linear_solver: str
    levels: Sequence[Measured]

    @property
    def title(self) -> str:
        """Its treatment, and the linear solver where that is chosen."""
        if self.linear_solver == AUTO:
            return self.treatment.title
        return f"{self.treatment.title}, {BACKENDS[self.linear_solver].name}"

    def having(self, error: str) -> list[Measured]:
        """The levels that are solved and have this error."""
        return [m for m in self.levels if m.solved and m.error(error) is not None]

    def reaching(self, error: str, target: float) -> list[Measured]:
        """The levels from which on no error is above the target: one by accident does not count."""
        found: list[Measured] = []
        for m in reversed(self.having(error)):
            if not (m.error(error) or 0) <= target:
                break
            found.append(m)
        return found

    def order(self, error: str) -> Slope | None:
        """The observed order over the finest levels."""
        found = self.having(error)
        return fit_slope([1 / m.point.level for m in found], [m.error(error) or 0 for m in found])

    def at_round_off(self, error: str) -> bool:
        """Whether every level is solved and its error rounding."""
        found = self.having(error)
        return len(found) == len(self.levels) and all(
            (m.error(error) or 0) <= ROUND_OFF for m in found
        )


@dataclass(frozen=True)
class Panel:
    """One error of one problem: the lines of all pairs and treatments that have it."""

    problem: Problem
    error: str
    lines: Sequence[Line]

    @property
    def name(self) -> str:
        """The name of its files."""
        return f"{self.problem.name}-{self.error.replace('_', '-')}"

    @property
    def uncertainty(self) -> float | None:
        """How far the reference may be off in this error; None where it is exact."""
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

    def of(self, title: str) -> list[Line]:
        """The lines of a treatment, pair by pair."""
        return [line for line in self.lines if line.title == title]

    def cheapest(self, title: str, target: float) -> Measured | None:
        """The quickest solve of a treatment that reaches the target; None: never."""
        good = [m for line in self.of(title) for m in line.reaching(self.error, target)]
        return min(good, key=lambda m: m.time.median, default=None)

    def ranked(self, target: float) -> list[tuple[str, Measured]]:
        """The treatments that reach the target with their quickest solves, quickest first."""
        found = [(title, self.cheapest(title, target)) for title in self.titles]
        reached = [(title, m) for title, m in found if m is not None]
        return sorted(reached, key=lambda pair: pair[1].time.median)

    def finest(self, title: str) -> float | None:
        """The smallest error of a treatment on the finest mesh of a pair; None without a solve."""
        found = [x.having(self.error)[-1] for x in self.of(title) if x.having(self.error)]
        return min((m.error(self.error) or 0.0 for m in found), default=None)


def shown(error: float) -> float:
    """An error as it is drawn: one far below the unit round-off would stretch the plot."""
    return max(error, EPSILON / 4)


def read_points(study: Study, folder: Path) -> list[Measured]:
    """All points of a study with their records in `folder`; one without a record says so."""
    return [Measured(point, _read(folder / f"{point.name}.json")) for point in study.points]


def _read(path: Path) -> Mapping[str, Any]:
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        record["outcome"], record["errors"], record["times"], record["reason"]
    except OSError:
        return _nothing("not measured")
    except (ValueError, KeyError, TypeError):
        return _nothing("the record cannot be read")
    return record


def _nothing(reason: str) -> dict[str, Any]:
    return {"outcome": "missing", "reason": reason, "errors": {}, "times": {}}


def lines(points: Iterable[Measured]) -> list[Line]:
    """Points of one problem, pair, treatment and linear solver together."""
    found: dict[tuple, list[Measured]] = {}
    for m in points:
        p = m.point
        key = (p.problem.name, p.slave, p.master, p.treatment.name, p.linear_solver)
        found.setdefault(key, []).append(m)
    return [
        Line(first.problem, first.pair, first.treatment, first.linear_solver, members)
        for members in found.values()
        for first in [members[0].point]
    ]


def panels(problem: Problem, found: Sequence[Line]) -> list[Panel]:
    """A panel for each error that any of a problem's lines has."""
    return [
        Panel(problem, error, found)
        for error in ERRORS
        if any(line.having(error) for line in found)
    ]


def failures(points: Sequence[Measured]) -> list[tuple[str, str, str]]:
    """Points without a solve: (outcome and reason, treatment, where) for each reason.

    Reasons that differ in numbers alone are told once.
    """
    found: dict[tuple[str, str, str], list[str]] = {}
    told: dict[str, str] = {}
    for m in points:
        if not m.solved:
            p = m.point
            why = f"{m.record['outcome']}: {m.record['reason']}"
            why = told.setdefault(_NUMBER.sub("#", why), why)
            solver = "" if p.linear_solver == AUTO else f", {BACKENDS[p.linear_solver].name}"
            what = f"{p.treatment.title}{solver}"
            place = f"{p.problem.title}, {p.pair}"
            found.setdefault((why, what, place), []).append(str(p.level))
    merged: dict[tuple[str, str], list[str]] = {}
    for (why, what, place), levels in found.items():
        merged.setdefault((why, what), []).append(f"{place}: level {', '.join(levels)}")
    return [(why, what, "; ".join(places)) for (why, what), places in merged.items()]
