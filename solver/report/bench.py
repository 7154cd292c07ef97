"""The page of all codes: cases in rows, codes in columns, and the pressure along each interface."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from ..codes.recorded import recorded_verdicts
from ..codes.verdicts import PRESSURE, read_pressures
from ..simulation.results.solution import Solution
from ..system.errors import InputError
from ..system.files import write_text
from ..verification.results import read_result
from ..verification.verdict import REFUSED
from . import formats
from .charts import (
    BLUE,
    CROSS,
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
)
from .families import page_name
from .formats import TEMPLATES, render
from .profile import PRESSED, expected, position
from .rows import Row, natural
from .tables import as_csv, to_junit
from .tables import to_json as rows_to_json

PAGE = "bench.html"
OURS, _REFERENCE = "this project", "reference"
# Pressures below this share of the largest count as zero for the part of the interface shown.
_NOTHING = 1e-6
# A pressure that varies by a smaller share is drawn as constant.
_ROUND_OFF = 1e-3
# Digits of a number in double precision; an error of zero has all of them.
_MOST = 16.0
_COLORS = (ORANGE, GREEN, PURPLE, RED, "#000000", "#e69f00")
# The errors that give the digits: the first one that exists.
PRESSURES = ("multiplier", "pressure_l2", "pressure_means", "pressure_max", "peak")
STRESSES = ("nodal_stress", "stress_components", "surface_stress_slave", "stress_max", "stress_l2")


@dataclass(frozen=True)
class Cell:
    """The result of one code on one case."""

    row: Row

    @property
    def code(self) -> str:
        """The name of the column."""
        return self.row.verdict.foreign.code or OURS

    @property
    def recorded(self) -> bool:
        """Whether the figures are stated elsewhere, not computed here."""
        return bool(self.row.verdict.foreign.recorded)

    def _error(self, names: Iterable[str]) -> float | None:
        """The error of the first check, or norm, that exists."""
        for name in names:
            if found := self.row.errors([name]):
                return found[0][0]
            if name in self.row.norms:
                return self.row.norms[name]
        return None

    def _digits(self, names: Iterable[str]) -> float | None:
        """The digits of these checks, no more than the result has."""
        found, printed = digits(self._error(names)), self.row.verdict.foreign.printed_digits
        return found if found is None or printed is None else min(found, printed)

    @property
    def pressure(self) -> float | None:
        """Digits of the contact pressure."""
        return self._digits(PRESSURES)

    @property
    def stress(self) -> float | None:
        """Digits of the stress."""
        return self._digits(STRESSES)

    @property
    def reason(self) -> str:
        """Why there are no digits, or what is wrong; empty where all checks hold."""
        return "" if self.row.sound else self.row.why

    @property
    def brief(self) -> str:
        """The reason in a few words: of several checks that fail, the one that is furthest off."""
        failed = [check for check in self.row.verdict.checks if not check.passed]
        if self.row.sound or not failed or not math.isfinite(sum(c.error for c in failed)):
            return self.reason
        worst = max(failed, key=lambda check: check.error / check.tolerance)
        name = worst.name.replace("_", " ")
        return f"{name}: error {worst.error:.1e}, allowed {worst.tolerance:.1e}"

    @property
    def seconds(self) -> float | None:
        """Wall time of the run, a whole process; None where there was none.

        Ours are forks of a process that has loaded all packages, which would be no fair measure.
        """
        return None if self.row.word == REFUSED or self.code == OURS else self.row.total

    @property
    def record(self) -> dict[str, Any]:
        """The cell as a record for spreadsheets and programs."""
        verdict = self.row.verdict
        return {
            "family": verdict.problem.family,
            "case": self.row.case,
            "code": self.code,
            "version": verdict.foreign.code_version,
            "verdict": self.row.word,
            "pressure_digits": self.pressure,
            "stress_digits": self.stress,
            "pressure_error": self._error(PRESSURES),
            "stress_error": self._error(STRESSES),
            "seconds": self.seconds,
            "cpu_seconds": verdict.cost.cpu_seconds,
            "peak_memory_mb": verdict.cost.peak_memory_mb,
            "recorded": verdict.foreign.recorded.get("source", ""),
            "reason": self.row.why,
        }


def digits(error: float | None) -> float | None:
    """How many decimal digits a relative error leaves: 1e-3 is 3."""
    if error is None or math.isnan(error):
        return None
    return _MOST if error <= 10**-_MOST else max(0.0, -math.log10(error))


@dataclass(frozen=True)
class Bench:
    """All codes side by side; `rows` are the rows of a report, and recorded results."""

    rows: Sequence[Row]

    @cached_property
    def cells(self) -> dict[tuple[str, str], dict[str, Cell]]:
        """By family and case, by code: the cases that another code has a result of."""
        found: dict[tuple[str, str], dict[str, Cell]] = {}
        for row in self.rows:
            cell = Cell(row)
            found.setdefault((row.group, row.case), {})[cell.code] = cell
        others = {key: of for key, of in found.items() if of.keys() - {OURS}}
        return dict(sorted(others.items(), key=lambda item: (item[0][0], natural(item[0][1]))))

    @cached_property
    def codes(self) -> list[str]:
        """The columns: ours, then the others; recorded ones last."""
        names = {code: of.recorded for cells in self.cells.values() for code, of in cells.items()}
        return sorted(names, key=lambda name: (name != OURS, names[name], natural(name)))

    @property
    def columns(self) -> list[tuple[str, Cell, dict[str, str]]]:
        """Name, any cell, and all settings of each code."""
        found = []
        for code in self.codes:
            of = [cells[code] for cells in self.cells.values() if code in cells]
            settings = {k: v for cell in of for k, v in cell.row.verdict.foreign.settings.items()}
            found.append((code, of[0], settings))
        return found

    @property
    def outcome(self) -> str:
        """How many cases each code passes, of those that it can express."""
        words = []
        for code in self.codes:
            cells_of = [cells[code] for cells in self.cells.values() if code in cells]
            of = [cell.row for cell in cells_of]
            if cells_of[0].recorded:
                words.append(f"{code}: recorded values of {len(of)} cases")
                continue
            refused = sum(row.word == REFUSED for row in of)
            passes = f"{code} passes {sum(row.sound for row in of)} of {len(of) - refused}"
            words.append(passes + (f" and cannot express {refused}" if refused else ""))
        outcome = "; ".join(words)
        return f"{outcome[:1].upper()}{outcome[1:]}."

    @property
    def records(self) -> list[dict[str, Any]]:
        """All cells, one after the other."""
        return [cell.record for of in self.cells.values() for cell in of.values()]

    def chart(self, case: tuple[str, str]) -> Chart | None:
        """The pressure along the interface of a case by all codes; None where none is known."""
        cells = self.cells[case]
        known = {code: rows for code, cell in cells.items() if len(rows := _pressures(cell.row))}
        if not known.keys():
            return None
        own = _solution(cells[OURS].row) if OURS in cells else None
        if own is not None and own.zones:
            known = {OURS: _of_solution(own), **known}
            where, place = position(own, own.zones[0], None)
            if all((means := expected(own, zone)) is not None for zone in own.zones):
                means = np.concatenate([expected(own, zone) for zone in own.zones])
                known[_REFERENCE] = np.column_stack([known[OURS][:, :-1], means])
        else:
            axis = int(np.ptp(np.concatenate(list(known.values()))[:, :-1], axis=0).argmax())
            where, place = "xyz"[axis], lambda points: points[:, axis]
        flat = next(iter(known.values())).shape[1] == 3
        records = [
            {"series": code, "place": float(at), "pressure": float(f"{pressure:.7g}")}
            for code, rows in known.items()
            for at, pressure in sorted(zip(place(rows[:, :-1]), rows[:, -1], strict=True))
        ]
        return series_chart(
            f"pressure-{case[1]}",
            f"{case[1]}: contact pressure along the interface",
            _pressed(records),
            Axis("place", where),
            Axis("pressure", "contact pressure", domain=_nearly_constant(records)),
            {code: self._look(code) for code in known},
            lines=flat,
            height=200,
        )

    def _look(self, code: str) -> Look:
        if code in (OURS, _REFERENCE):
            return Look(BLUE) if code == OURS else Look(INK, CROSS, (4, 3))
        number = [name for name in self.codes if name != OURS].index(code)
        return Look(_COLORS[number % len(_COLORS)], SHAPES[1 + number % (len(SHAPES) - 1)])


def _pressures(row: Row) -> np.ndarray:
    """Place and pressure (k, dim + 1) that another code has; empty where they are not known."""
    file = row.folder / PRESSURE
    if not row.verdict.foreign.code or row.verdict.foreign.recorded or not file.is_file():
        return np.empty((0, 3))
    return read_pressures(file)


def _solution(row: Row) -> Solution | None:
    """The solution of our own solver; None without a result that can be read."""
    if row.result_file is None:
        return None
    try:
        return read_result(row.result_file).solution
    except (InputError, OSError):
        return None


def _of_solution(solution: Solution) -> np.ndarray:
    """Place and pressure (k, dim + 1) by macro-element."""
    parts = [np.column_stack([zone.centre, zone.multiplier]) for zone in solution.zones]
    return np.concatenate(parts)


def _pressed(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The records where little is pressed: of that part and what is next to it."""
    at = np.array([record["place"] for record in records])
    size = np.abs([record["pressure"] for record in records])
    pressed = at[size > _NOTHING * size.max(initial=0.0)]
    if not len(pressed) or np.ptp(pressed) > PRESSED * np.ptp(at):
        return records
    more = 0.25 * np.ptp(pressed)
    low, high = pressed.min() - more, pressed.max() + more
    return [r for r, place in zip(records, at, strict=True) if low <= place <= high]


def _nearly_constant(records: list[dict[str, Any]]) -> tuple[float, float] | None:
    """The range of an axis on which round-off is not seen; None where values vary."""
    values = np.array([record["pressure"] for record in records])
    low, high = float(values.min()), float(values.max())
    if high <= 0 or high - low > _ROUND_OFF * high:
        return None
    return (1 - _ROUND_OFF) * low, (1 + _ROUND_OFF) * high


def write_bench(rows: Sequence[Row], folder: Path, families: Iterable[Path] = ()) -> None:
    """Write the page and its tables into `folder`; nothing where no other code has a result.

    `families` are the folders of families, for what is recorded in them. Raises InputError for a
    recorded file that is not valid.
    """
    there = {(row.group, row.case) for row in rows}
    recorded = [
        Row(verdict, folder)
        for family in families
        for verdict in recorded_verdicts(family)
        if (verdict.problem.family, verdict.problem.case) in there
    ]
    bench = Bench([*rows, *recorded])
    if not bench.cells:
        return
    computed = [row for row in rows if row.verdict.foreign.code]
    contents = {
        PAGE: to_html(bench),
        "bench.json": rows_to_json([c.row for of in bench.cells.values() for c in of.values()]),
        "bench.csv": as_csv(bench.records),
        "bench-junit.xml": to_junit(computed),
    }
    for name, content in contents.items():
        write_text(folder / name, content)


def to_html(bench: Bench) -> str:
    """The page."""
    charts = {case: chart for case in bench.cells if (chart := bench.chart(case))}
    return render(
        TEMPLATES / "bench.html.jinja",
        title="Codes side by side",
        **({"charts": True} if charts else {}),
        sortable=True,
        outcome=bench.outcome,
        good=True,
        bench=bench,
        drawn=charts,
        shown=lambda value: formats.NOTHING if value is None else f"{value:.1f}",
        link=lambda row: f"{quote(page_name(row.group))}#{quote(row.anchor)}",
        ours=OURS,
    )
