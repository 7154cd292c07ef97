"""The rows of the report: one for each verdict, failures first, with what every format shows."""

import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..lac.cells.catalogue import BY_NAME
from ..system.errors import InputError
from ..verification.stored import read_verdict, unbound
from ..verification.verdict import (
    CRASHED,
    NUMBERS,
    VECTORS,
    WORDS,
    Body,
    CheckResult,
    Problem,
    Verdict,
)

# Checks of the contact pressure, the one on every macro-element first.
_OF_PRESSURE = "multiplier", "covered_pressure", "element_pressure", "pressure_means", "peak"


@dataclass(frozen=True)
class Row:
    """One verdict, and its folder."""

    verdict: Verdict
    folder: Path

    @property
    def name(self) -> str:
        """The name of the solve."""
        return self.verdict.problem.job

    @property
    def case(self) -> str:
        """The name of the solve without the code's name."""
        code = self.verdict.foreign.code
        return self.name.removesuffix(f"@{code}") if code else self.name

    @property
    def group(self) -> str:
        """The family's name."""
        return self.verdict.problem.family

    @property
    def anchor(self) -> str:
        """The solve's own anchor on the page, also where families share names."""
        return f"{self.group}/{self.name}"

    @property
    def word(self) -> str:
        """The verdict in one word; an unknown one counts as crashed."""
        return self.verdict.verdict if self.verdict.verdict in WORDS else CRASHED

    @property
    def sound(self) -> bool:
        """Whether nothing is wrong: it passed, or has no reference to be verified against."""
        return self.verdict.sound

    @cached_property
    def plain(self) -> dict[str, Any]:
        """The verdict as plain values."""
        return self.verdict.plain()

    @cached_property
    def why(self) -> str:
        """The reason where it did not pass, in one line that is safe to print."""
        if self.verdict.passed:
            return ""
        reason = " ".join((self.verdict.reason or "no reason given").split())
        return "".join(c if c.isprintable() else "�" for c in reason)

    @cached_property
    def stored(self) -> Path | None:
        """The file with the fields, if there is one."""
        name = self.verdict.files.result
        path = self.folder / name if name else None
        return path if path and path.is_file() else None

    @property
    def result_file(self) -> Path | None:
        """The result of our own solver, from which pictures can be drawn."""
        return None if self.verdict.foreign.code else self.stored

    def errors(self, names: Iterable[str]) -> list[tuple[float, str]]:
        """Errors of the checks of these names, largest first, with the checks' names."""
        wanted = set(names)
        found = [(check.error, check.name) for check in self.verdict.checks]
        known = [(e, n) for e, n in found if n in wanted and not math.isnan(e)]
        return sorted(known, reverse=True)

    @cached_property
    def pressure_check(self) -> CheckResult | None:
        """The check of the pressure against its reference: that of multipliers, else of means."""
        checks = {check.name: check for check in self.verdict.checks if check.verifies}
        return next((checks[name] for name in _OF_PRESSURE if name in checks), None)

    @property
    def accuracy(self) -> tuple[float, str] | None:
        """The worst relative error and its check; None where it is not a number."""
        worst = self.verdict.worst
        return None if worst is None or math.isnan(worst.error) else (worst.error, worst.name)

    @cached_property
    def allowed(self) -> float | None:
        """The tolerance of that check."""
        names = self.accuracy[1:] if self.accuracy else ()
        return next((c.tolerance for c in self.verdict.checks if c.name in names), None)

    @cached_property
    def expected(self) -> float | None:
        """The expected error of that check."""
        names = self.accuracy[1:] if self.accuracy else ()
        return next((c.expected for c in self.verdict.checks if c.name in names), None)

    @cached_property
    def norms(self) -> Mapping[str, float]:
        """Errors against the exact solution by their names in `solver.verification.norms`."""
        errors = self.verdict.estimates.errors.items()
        return {name: value for name, value in errors if not math.isnan(value)}

    def origin(self, kinds: Mapping[str, str]) -> str:
        """The origin of the reference, with the kinds in words; empty without a reference.

        Where numbers alone are compared, these numbers: they make no exact solution.
        """
        compared = [check for check in self.verdict.checks if check.verifies]
        if compared and all(check.name in NUMBERS for check in compared):
            return "; ".join(
                f"{c.name} compared with a stated vector"
                if c.name in VECTORS
                else f"{c.name} compared with {c.reference:g}"
                for c in compared
            )
        kind, code = self.verdict.reference.kind or "", self.verdict.reference.code
        named = f": {code.get('name')} {code.get('version')}" if code else ""
        return f"{kinds.get(kind, kind)}{named}"

    def files(self, folder: Path) -> list[tuple[str, str]]:
        """The files in the solve's folder: names, and paths relative to `folder`."""
        found = {"result": self.stored, "verdict": self.folder / "verdict.json"}
        found["log"] = self.folder / "log"
        return [
            (name, os.path.relpath(path, folder))
            for name, path in found.items()
            if path and path.is_file()
        ]

    @property
    def total(self) -> float | None:
        """Wall time of the solve, seconds."""
        return self.verdict.cost.seconds.get("total")

    @property
    def stages(self) -> dict[str, float]:
        """Wall time by stage, seconds."""
        seconds = self.verdict.cost.seconds.items()
        return {stage: s for stage, s in seconds if stage != "total" and s}

    @property
    def tags(self) -> dict[str, list[str]]:
        """Filters of rows: family, cell types, verdict, kind of reference."""
        return {
            "family": [self.group.replace(" ", "_")],
            "cells": sorted({name for body in self.sides for name in body.cells}),
            "verdict": [self.word],
            "judged": [self.verdict.judged.replace(" ", "_") or "none"],
            "reference": [self.verdict.reference.kind or "none"],
        }

    @property
    def slave(self) -> str:
        """The names of the slave bodies."""
        return ", ".join(b.name for b in self.sides if b.role in ("slave", "both"))

    @cached_property
    def dim(self) -> int:
        """The dimension of the bodies; 0 where it is not known."""
        names = [name for body in self.sides for name in body.cells]
        return BY_NAME[names[0]].dim if names and names[0] in BY_NAME else 0

    @cached_property
    def sides(self) -> list[Body]:
        """The bodies, slave first."""
        order = {"slave": 0, "both": 1, "master": 2}
        return sorted(self.verdict.problem.bodies, key=lambda body: order.get(body.role, 3))


def read_rows(verdicts: Iterable[Path]) -> list[Row]:
    """All verdicts as rows, ours before other codes', failures first.

    A file that is not a verdict as it was written, or belongs to another folder or result, is a row
    of a crashed solve.
    """
    rows = [Row(_read(path), path.parent) for path in verdicts]
    return sorted(rows, key=_place)


def _place(row: Row) -> tuple[str, bool, int, list[tuple[int, int | str]]]:
    """Where a row is in the tables: ours before other codes'."""
    return row.group, bool(row.verdict.foreign.code), WORDS.index(row.word), natural(row.name)


def natural(name: str) -> list[tuple[int, int | str]]:
    """A key that sorts z2 before z10."""
    parts = re.findall(r"\d+|\D+", name)
    return [(0, int(p)) if p.isdecimal() else (1, p) for p in parts]


def _read(path: Path) -> Verdict:
    try:
        verdict = read_verdict(path)
        fault = unbound(verdict, path)
    except InputError as error:
        fault = error.detail
    if not fault:
        return verdict
    *_, family, job = ("", "", *path.absolute().parts[:-1])
    reason = f"{fault}; solve again"
    problem = Problem(case=job, family=family, job=job)
    return Verdict(problem=problem, verdict=CRASHED, reason=reason, transient=True)


def ours(rows: Sequence[Row]) -> list[Row]:
    """Our own solves; all solves without any of our own."""
    return [row for row in rows if not row.verdict.foreign.code] or list(rows)


def choices(rows: Sequence[Row]) -> dict[str, list[str]]:
    """The values of each tag that occur."""
    found: dict[str, set[str]] = {}
    for row in rows:
        for name, values in row.tags.items():
            found.setdefault(name, set()).update(values)
    return {name: sorted(values) for name, values in found.items()}


def causes(rows: Sequence[Row]) -> dict[tuple[str, str], list[Row]]:
    """Rows that did not pass by what is wrong: a check and how, or a verdict and its reason.

    Reasons that differ in numbers alone are the same.
    """
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        failing = [check for check in row.verdict.checks if not check.passed]
        keys = [
            (c.name, "accepted value changed" if c.error <= c.tolerance else "above its tolerance")
            for c in failing
        ]
        other = [(row.word, re.sub(r"\d[\d.e+-]*", "…", row.why))]
        for key in dict.fromkeys(keys or other):
            found.setdefault(key, []).append(row)
    return found


def families(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows by family, in their order."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.group, []).append(row)
    return found


def counted(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows there are of each verdict, those that occur."""
    counts = {word: sum(row.word == word for row in rows) for word in WORDS}
    return {word: n for word, n in counts.items() if n}
