"""The gain of recovery on each ladder: order and error of the recovered pressure, and the goals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from ...lac.cells.catalogue import BY_NAME
from ...report.formats import error as shown_error
from ..description import Study
from ..shown import Table, TableRow

if TYPE_CHECKING:
    from .orders import Curve

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
