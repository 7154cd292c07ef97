"""Refinement ladders as the report shows them: the verdicts of every ladder, and fitted slopes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...mesh.catalogue import BY_NAME, CellType
from ...report.html import NORMS
from ...report.rows import Row, read_rows
from ..fits import Fit, fit_order, is_rounding
from .description import Ladder, LadderFamily
from .theory import DEGREES, RECOVERED, THEORY, UNKNOWN, Order, element_size

VERDICT = "verdict.json"
# The errors of ladders in the order in which they are shown.
ERRORS = NORMS
# Errors of the pressure as a field, which a recovery makes smaller.
_OF_FIELD = ("pressure_l2", "pressure_max")
# A slope this much below an order is still that order: levels are few, and not yet the limit.
LEEWAY = 0.1


@dataclass(frozen=True)
class Curve:
    """One ladder in one direction: its rows by level, coarsest first, also those without a result.

    `name` is the folder's name.
    """

    name: str
    family: LadderFamily
    ladder: Ladder
    rows: Sequence[Row]

    @cached_property
    def solved(self) -> list[Row]:
        """The rows that have errors, and therefore a point in the plots."""
        return [row for row in self.rows if row.norms and row.verdict.macro_elements]

    @cached_property
    def missing(self) -> list[str]:
        """Why levels have no point: a line for each reason, naming the levels."""
        levels: dict[str, list[str]] = {}
        for row in self.rows:
            if row not in self.solved:
                levels.setdefault(_reason(row), []).append(row.folder.name)
        return [
            f"level{'s' * (len(names) > 1)} {', '.join(names)}: {reason}"
            for reason, names in levels.items()
        ]

    @cached_property
    def slave_cells(self) -> list[CellType]:
        """The cell types of the slave's cells; none where nothing is solved."""
        bodies = self.solved[-1].sides if self.solved else []
        slaves = [body for body in bodies if body.role in ("slave", "both")]
        return [BY_NAME[name] for body in slaves for name in body.cells]

    @cached_property
    def label(self) -> str:
        """The ladder's own label, or the slave's cells, and how they are cut where it is chosen."""
        if self.ladder.label:
            return self.ladder.label
        names = " + ".join(dict.fromkeys(cell.name for cell in self.slave_cells))
        cut = f" cut into {self.ladder.hexahedra}" if self.ladder.hexahedra else ""
        recovery = self.ladder.recovery or "none"
        with_ = f", {recovery}" if recovery != "none" else ""
        return (names or self.name) + cut + with_

    @cached_property
    def degree(self) -> str:
        """Linear or quadratic: the lowest degree of the slave's cells."""
        return DEGREES[min(cell.order for cell in self.slave_cells)] if self.slave_cells else ""

    @cached_property
    def dim(self) -> int:
        """The dimension of the mesh; 0 where nothing is solved."""
        return self.slave_cells[0].dim if self.slave_cells else 0

    @cached_property
    def sizes(self) -> list[float]:
        """The mean size of a macro-element over the interface's, level by level."""
        return [element_size(row.verdict.macro_elements or 0, self.dim) for row in self.solved]

    def errors(self, error: str) -> tuple[np.ndarray, np.ndarray]:
        """Sizes (k,) and errors (k,) of the levels that have this error."""
        pairs = [
            (size, value)
            for size, row in zip(self.sizes, self.solved, strict=True)
            if (value := row.norms.get(error)) is not None
        ]
        sizes, values = np.array(pairs, dtype=float).reshape(-1, 2).T
        return sizes, values

    def slope(self, error: str) -> Fit | None:
        """The slope over the finest levels."""
        return fit_order(*self.errors(error))

    def rounding(self, error: str) -> bool:
        """Whether the finest levels are exact up to rounding, so that there is no slope."""
        return is_rounding(*self.errors(error))

    def theory(self, error: str) -> Order:
        """The order of the slope by theory."""
        own = self.family.theory.get(self.degree, {}).get(error)
        known = Order(*own) if own else THEORY.get(self.degree, {}).get(error, UNKNOWN)
        best = RECOVERED.get((self.ladder.recovery or "none", self.degree))
        return replace(known, best=best) if best and error in _OF_FIELD else known

    def least(self, error: str) -> float | None:
        """The slope that has to be reached, if any."""
        return self.ladder.least.get(error, self.family.least.get(self.degree, {}).get(error))

    def reached(self, error: str) -> bool | None:
        """Whether the slope asked for is reached; None where none is asked for."""
        least, slope = self.least(error), self.slope(error)
        if least is None:
            return None
        return self.rounding(error) or (slope is not None and slope.value >= least)

    def at_finest(self, error: str) -> float | None:
        """The error at the finest level that has it."""
        sizes, values = self.errors(error)
        return float(values[sizes.argmin()]) if len(sizes) else None

    def kept(self, error: str) -> bool | None:
        """Whether the error at the finest level is as small as asked; None where none is asked."""
        bound, found = self.ladder.finest.get(error), self.at_finest(error)
        return None if bound is None else found is not None and found <= bound

    @cached_property
    def effectivity(self) -> float | None:
        """The estimated over the true error of constant pressures at the finest level.

        None where the pressure is recovered, or not constant, or has no error.
        """
        finest = max(self.solved, key=lambda row: row.verdict.macro_elements or 0, default=None)
        if finest is None or (self.ladder.recovery or "none") != "none":
            return None
        estimate, true = finest.verdict.pressure_error_estimate, finest.norms.get("pressure_l2")
        return estimate / true if estimate is not None and true else None

    def below_theory(self, error: str) -> bool:
        """Whether the slope is less than theory guarantees, by more than its spread explains."""
        slope, least = self.slope(error), self.theory(error).least
        if slope is None or least is None:
            return False
        return slope.value + max(2 * slope.spread, LEEWAY) < least

    @cached_property
    def problems(self) -> list[str]:
        """Levels without a result, slopes and finest errors that are not reached, one line each."""
        lines = [f"{self.family.name}/{self.name}: {line}" for line in self.missing]
        for error, what in ERRORS.items():
            if self.reached(error) is False:
                slope = self.slope(error)
                shown = f"{slope.value:.3f} ± {slope.spread:.3f}" if slope else "not known"
                asked = f"at least {self.least(error):g} is asked for"
                lines.append(f"{self.family.name}/{self.name}: {what}: {shown}; {asked}")
            if self.kept(error) is False:
                found = self.at_finest(error)
                shown = "not known" if found is None else f"{found:.1e}"
                asked = f"at most {self.ladder.finest[error]:g} is asked for at the finest level"
                lines.append(f"{self.family.name}/{self.name}: {what}: {shown}; {asked}")
        return lines


def read_curves(family: LadderFamily, results: Path) -> list[Curve]:
    """The curves of a family, from `results/<family>/<ladder>/<level>/verdict.json`.

    A ladder's first direction always has one; the other where it has been solved.
    """
    curves = []
    for ladder in family.ladders:
        for swapped in (False, True):
            folder = results / family.name / ladder.folder(swapped)
            if swapped and not folder.is_dir():
                continue
            found = read_rows(folder / str(k) / VERDICT for k in ladder.levels)
            rows = sorted(found, key=lambda row: int(row.folder.name))
            curves.append(Curve(folder.name, family, ladder, rows))
    return curves


def _reason(row: Row) -> str:
    """Why a row has no errors."""
    if not (row.folder / VERDICT).is_file():
        return "not solved"
    return row.why or "no errors against an exact solution"


def groups(curves: Sequence[Curve]) -> dict[str, list[Curve]]:
    """Curves that are drawn into the same plots: of one problem, dimension and choice of slave."""
    found: dict[str, list[Curve]] = {}
    for curve in curves:
        if curve.solved:
            title = f"{curve.dim}D, slave: {curve.solved[-1].slave}"
            title = ": ".join(filter(None, [curve.ladder.problem.capitalize(), title]))
            found.setdefault(title, []).append(curve)
    return found


def shown_errors(curves: Sequence[Curve]) -> list[str]:
    """The errors that any of the curves has, in their order."""
    return [error for error in ERRORS if any(len(curve.errors(error)[0]) for curve in curves)]
