"""Orders of convergence: error against size of the macro-elements, and fitted slopes.

The gain of recovery is the order and the error of the recovered pressure, beside the goals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from markupsafe import Markup

from ...case.checks import ERRORS
from ...lac.cells.catalogue import BY_NAME
from ...report.charts import (
    CROSS,
    EPSILON,
    INK,
    LOOKS,
    Axis,
    Chart,
    Look,
    distinct,
    look_of,
    series_chart,
    slopes,
)
from ...report.formats import error as shown_error
from ..description import Series, Study
from ..page import MeasuredGroup, PageSection, Shown, Table, TableRow, why_not
from ..theory import (
    DEGREES,
    LAST,
    RECOVERED,
    THEORY,
    UNKNOWN,
    Fit,
    Order,
    element_size,
    fit_order,
    is_rounding,
)

_PRESSURE, _STRESS = "pressure_l2", "stress_max"


@dataclass(frozen=True)
class GainGoal:
    """The least order between the last two levels, and the least gain; None: no goal."""

    order: float | None = None
    gain: float | None = None


# By form of the recovery and cells of the slave: goals of smooth problems, in 2D on `_FACES` faces.
GOALS: Mapping[tuple[str, str], GainGoal] = (
    {("automatic", cells): GainGoal(2.8, 400) for cells in ("TRIA6", "QUAD9")}
    | {("automatic", "QUAD8"): GainGoal(2.2, 300)}
    | {("linear", cells): GainGoal(2.1, 50) for cells in ("TRIA6", "QUAD8", "QUAD9")}
    | {("automatic", cells): GainGoal(2.0, 12) for cells in ("TETRA10", "HEXA20", "HEXA27")}
    | {
        ("automatic", cells): GainGoal(1.2, 2.5)
        for cells in ("TRIA3", "QUAD4", "HEXA8", "PENTA6", "PYRA5")
    }
)
_STRESS_GOAL = 1.8
_FACES = 40


def gains_table(study: Study, curves: Sequence["Curve"]) -> Table:
    """A row for each ladder with recovery that has one with constants beside it."""
    rows = []
    order = list(BY_NAME)
    for curve in curves:
        constants = next((c for c in curves if c.recovery == "none" and _same(c, curve)), None)
        if curve.recovery != "none" and curve.solved and constants:
            rows.append((order.index(curve.solved[-1]["slave"][0]), _row(study, curve, constants)))
    head = [
        "Slave’s cells",
        "Recovery",
        "Problem",
        "Macro-elements",
        "Error",
        "Order",
        "Gain",
        "Stress",
    ]
    return Table(head, [row for _, row in sorted(rows, key=lambda item: item[0])], left=3)


def _row(study: Study, curve: "Curve", constants: "Curve") -> TableRow:
    last = curve.solved[-1]
    cells, faces = last["slave"][0], last["macro_elements"]
    judged = study.smooth and (curve.dim == 3 or faces >= _FACES)
    goal = GOALS.get((curve.recovery, cells), GainGoal()) if judged else GainGoal()
    quadratic = curve.degree == "quadratic" and curve.dim == 2 and curve.recovery != "linear"
    stress_goal = _STRESS_GOAL if goal.order and quadratic else None
    marked = [
        _marked(last_order(curve, _PRESSURE), goal.order, "{:.2f}"),
        _marked(gain(curve, constants), goal.gain, "{:.3g}"),
        _marked(last_order(curve, _STRESS), stress_goal, "{:.2f}"),
    ]
    error = shown_error(curve.at_finest(_PRESSURE))
    return TableRow([cells, curve.recovery, constants.group.title, str(faces), error, *marked])


def _marked(value: float | None, goal: float | None, form: str) -> Markup:
    text = "–" if value is None else form.format(value)
    if goal is None:
        return Markup("{}").format(text)
    kind = "reached" if value is not None and value >= goal else "low"
    return Markup("<span class={}>{}</span><span class=under>goal ≥ {:g}</span>").format(
        kind, text, goal
    )


def gain(curve: "Curve", constants: "Curve") -> float | None:
    """The error of constants over the error of the recovered pressure, at the finest level."""
    level, error = curve.solved[-1]["labels"], curve.at_finest(_PRESSURE)
    same = [point for point in constants.solved if point["labels"] == level]
    constant = same[0]["errors"].get(_PRESSURE) if same else None
    return constant / error if constant and error else None


def last_order(curve: "Curve", error: str) -> float | None:
    """The order of an error between the last two levels."""
    sizes, values = curve.errors(error)
    if len(sizes) < 2 or not (values[-2:] > 0).all():
        return None
    return float(np.diff(np.log(values[-2:]))[0] / np.diff(np.log(sizes[-2:]))[0])


def _same(one: "Curve", other: "Curve") -> bool:
    """Whether two curves are of one case, direction and cut."""
    mine, its = ((c.series.case, c.series.change, c.points[0]["swapped"]) for c in (one, other))
    return mine == its


# Errors of the pressure as a field, which a recovery makes smaller.
_OF_FIELD = ("pressure_l2", "pressure_max")
_GAINS = """L2 error of the pressure at the finest level, its order between the last two levels, and
the gain: the error of constants over that of the recovered pressure on the same mesh. Stress: order
of the largest error at nodes. Goals are set for smooth pressures, in 2D on 40 faces or more;
✓ reached, ▽ not, for reasons given above."""
# A slope this much below an order is still that order: levels are few, and not yet the limit.
LEEWAY = 0.1
# QUAD9 and HEXA27 have a look of their own here, beside QUAD8 and HEXA20.
_LOOKS = {"QUAD9": Look(INK, CROSS), "HEXA27": Look(INK, CROSS), **LOOKS}


@dataclass(frozen=True)
class Curve:
    """One line of a group: its points level by level, coarsest first."""

    study: Study
    group: MeasuredGroup
    series: Series
    label: str
    points: Sequence[dict[str, Any]]

    @property
    def name(self) -> str:
        """As in the list of what does not hold."""
        return f"{self.group.group.name}/{self.label}"

    @cached_property
    def solved(self) -> list[dict[str, Any]]:
        """The points that have errors."""
        return [p for p in self.points if p["outcome"] == "solved" and p["errors"]]

    @cached_property
    def recovery(self) -> str:
        """The recovery that the line asks for."""
        return str(self.points[0]["choices"].get("recovery", "none"))

    @cached_property
    def degree(self) -> str:
        """Linear or quadratic: the lowest degree of the slave's cells."""
        cells = self.solved[-1]["slave"] if self.solved else []
        return DEGREES[min(BY_NAME[name].order for name in cells)] if cells else ""

    @property
    def dim(self) -> int:
        """The dimension of the mesh; 0 where nothing is solved."""
        return int(self.solved[-1]["dim"]) if self.solved else 0

    def errors(self, error: str) -> tuple[np.ndarray, np.ndarray]:
        """Sizes (k,) and errors (k,) of the levels that have this error."""
        pairs = [
            (element_size(p["macro_elements"], self.dim), p["errors"][error])
            for p in self.solved
            if error in p["errors"]
        ]
        sizes, values = np.array(pairs, dtype=float).reshape(-1, 2).T
        return sizes, values

    def slope(self, error: str) -> Fit | None:
        """The slope over the finest levels."""
        return fit_order(*self.errors(error))

    def theory(self, error: str) -> Order:
        """The order of the slope by theory."""
        own = self.study.theory.get(self.degree, {}).get(error)
        known = Order(*own) if own else THEORY.get(self.degree, {}).get(error, UNKNOWN)
        best = RECOVERED.get((self.recovery, self.degree))
        return replace(known, best=best) if best and error in _OF_FIELD else known

    def least(self, error: str) -> float | None:
        """The slope that has to be reached, if any."""
        general = self.study.least.get(self.degree, {})
        return self.series.least.get(error, general.get(error))

    def reached(self, error: str) -> bool | None:
        """Whether the slope asked for is reached; None where none is asked for."""
        least, slope = self.least(error), self.slope(error)
        if least is None:
            return None
        return is_rounding(*self.errors(error)) or (slope is not None and slope.value >= least)

    def at_finest(self, error: str) -> float | None:
        """The error at the finest level that has it."""
        sizes, values = self.errors(error)
        return float(values[sizes.argmin()]) if len(sizes) else None

    def kept(self, error: str) -> bool | None:
        """Whether the error at the finest level is as small as asked; None where none is asked."""
        bound, value = self.series.finest.get(error), self.at_finest(error)
        return None if bound is None else value is not None and value <= bound

    @cached_property
    def effectivity(self) -> float | None:
        """The estimated over the true error of constant pressures at the finest level."""
        if not self.solved or self.recovery != "none":
            return None
        finest = max(self.solved, key=lambda point: point["macro_elements"])
        estimate, true = finest["pressure_error_estimate"], finest["errors"].get("pressure_l2")
        return estimate / true if estimate is not None and true else None

    def is_below_theory(self, error: str) -> bool:
        """Whether the slope is less than theory guarantees, by more than its spread explains."""
        slope, least = self.slope(error), self.theory(error).least
        if slope is None or least is None:
            return False
        return slope.value + max(2 * slope.spread, LEEWAY) < least

    @cached_property
    def problems(self) -> list[str]:
        """Levels without a result, slopes and finest errors that are not reached, one line each."""
        lines = [f"{p['name']}: {why_not(p)}" for p in self.points if p["outcome"] != "solved"]
        if not self.solved and not lines:
            lines.append("no errors against an exact solution")
        for error, what in ERRORS.items():
            if self.reached(error) is False:
                slope = self.slope(error)
                value = f"{slope.value:.3f} ± {slope.spread:.3f}" if slope else "not known"
                lines.append(f"{what}: {value}; at least {self.least(error):g} is asked for")
            if self.kept(error) is False:
                bound = f"at most {self.series.finest[error]:g} is asked for at the finest level"
                lines.append(f"{what}: {shown_error(self.at_finest(error))}; {bound}")
        return [f"{self.name}: {line}" for line in lines]


def curves_of(study: Study, group: MeasuredGroup) -> list[Curve]:
    """The curves of a group, one for each line."""
    series = {one.name: one for one in group.group.series}
    return [
        Curve(study, group, series[points[0]["series"]], line, points)
        for line, points in group.lines.items()
    ]


def show(study: Study, groups: Sequence[MeasuredGroup]) -> Shown:
    """A section for each group, and the gains of recovery."""
    curves = {one.group.name: curves_of(study, one) for one in groups}
    every = [curve for members in curves.values() for curve in members]
    sections = [_section(one, curves[one.group.name]) for one in groups]
    gains = gains_table(study, every)
    if gains.rows:
        title = "Recovered pressure: order and gain"
        sections.append(PageSection("recovery", title, _GAINS, tables=[gains]))
    below = sum(curve.is_below_theory(error) for curve in every for error in ERRORS)
    if below or study.shortfalls:
        text = f"{below} slopes (▽) are below theory by more than their spread. " * bool(below)
        sections.insert(0, PageSection("shortfalls", "Below theory", text + study.shortfalls))
    return Shown(sections, [line for curve in every for line in curve.problems], _outcome(every))


def _outcome(curves: Sequence[Curve]) -> str:
    """How many slopes and errors at the finest levels were asked for and reached."""
    reached = [r for c in curves for e in ERRORS if (r := c.reached(e)) is not None]
    kept = [r for c in curves for e in ERRORS if (r := c.kept(e)) is not None]
    lost = sum(len(curve.points) - len(curve.solved) for curve in curves)
    text = (
        f"{sum(reached)} of {len(reached)} slopes asked for are reached"
        if reached
        else "No slope is asked for"
    )
    text += f", on {len(curves)} ladders"
    text += f"; {sum(kept)} of {len(kept)} errors at finest levels." if kept else "."
    return text + (f" {lost} levels have no result." if lost else "")


def _section(group: MeasuredGroup, curves: Sequence[Curve]) -> PageSection:
    errors = [error for error in ERRORS if any(len(curve.errors(error)[0]) for curve in curves)]
    head = ["Slave’s cells", "Levels", "Unknowns, finest", "Macro-elements, finest"]
    head += [ERRORS[error] for error in errors] + ["Estimated over true error, finest"]
    solved = [curve for curve in curves if curve.solved]
    rows = [
        TableRow([*_head_cells(curve), *(_slope(curve, e) for e in errors), _effectivity(curve)])
        for curve in solved
    ]
    table = Table(head, rows, f"Slopes over the {LAST} finest levels; theory: guaranteed … best")
    charts = [_panel(group.group.name, error, curves) for error in errors]
    code = curves[0].study.reference_code
    stated = f"{code.name}: {code.version}; {code.remark}." if code.version else ""
    text = f"{group.group.text} {stated}"
    return PageSection(group.group.name, group.title, text.strip(), charts, [table] if rows else [])


def _head_cells(curve: Curve) -> list[str]:
    last, count = curve.solved[-1], len(curve.solved)
    levels = f"{count}" if count == len(curve.points) else f"{count} of {len(curve.points)}"
    return [curve.label, levels, str(last["dofs"]), str(last["macro_elements"])]


def _effectivity(curve: Curve) -> str:
    return "–" if curve.effectivity is None else f"{curve.effectivity:.2f}"


def _slope(curve: Curve, error: str) -> Markup:
    """A slope with its theory, and what is asked for and observed elsewhere."""
    slope, least = curve.slope(error), curve.least(error)
    kind = (
        "short" if curve.reached(error) is False else "low" if curve.is_below_theory(error) else ""
    )
    value = f"{slope.value:.3f} ± {slope.spread:.3f}" if slope else "–"
    if not slope and is_rounding(*curve.errors(error)):
        value = "rounding"
    under = [str(curve.theory(error))]
    if least is not None:
        under.append(f"asked ≥ {least:g}")
    if error in curve.series.finest:
        bound = curve.series.finest[error]
        under.append(f"finest {shown_error(curve.at_finest(error))}, asked ≤ {bound:g}")
    if error in curve.series.observed:
        under.append(f"{curve.study.reference_code.name} {curve.series.observed[error]:.3f}")
    lines = Markup("").join(Markup("<span class=under>{}</span>").format(line) for line in under)
    return Markup('<span class="{}">{}</span>{}').format(kind, value, lines)


def _panel(name: str, error: str, curves: Sequence[Curve]) -> Chart:
    """One error of all curves, with the orders that theory knows drawn beside."""
    records = [
        {"series": curve.label, "h": size, "error": max(value, EPSILON / 4)}
        for curve in curves
        for size, value in zip(*curve.errors(error), strict=True)
    ]
    names = {record["series"] for record in records}
    known = [curve.theory(error) for curve in curves]
    orders = {order for theory in known for order in (theory.least, theory.best) if order}
    return series_chart(
        f"{name}-{error}",
        f"Error of {ERRORS[error]}, against macro-element size",
        records,
        Axis("h", "macro-element / interface", log=True),
        Axis("error", f"relative error: {ERRORS[error]}", log=True),
        distinct({curve.label: _look(curve) for curve in curves if curve.label in names}),
        layers=slopes(records, "h", "error", sorted(orders) or [1.0, 2.0]),
        width=460,
    )


def _look(curve: Curve) -> Look:
    """Linear cells dashed, quadratic ones solid."""
    look = look_of(curve.solved[-1]["slave"][0], _LOOKS)
    return replace(look, dashes=(6.0, 3.0) if curve.degree == "linear" else ())
