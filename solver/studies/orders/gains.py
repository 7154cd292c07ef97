"""The gain of recovery on each ladder: order and error of the recovered pressure, and the goals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...mesh.catalogue import BY_NAME
from .records import Curve

_PRESSURE, _STRESS = "pressure_l2", "stress_max"
_NONE = (None, "none")


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


@dataclass(frozen=True)
class Gain:
    """A ladder with recovery beside the same one with constants, on the levels of both."""

    curve: Curve
    constants: Curve

    @property
    def cells(self) -> str:
        """The first of the slave's cell types."""
        return self.curve.slave_cells[0].name

    @property
    def form(self) -> str:
        """The recovery that the ladder asks for."""
        return self.curve.ladder.recovery or ""

    @property
    def problem(self) -> str:
        """Family and problem, without what distinguishes the ladders of constants."""
        problem = self.constants.ladder.problem.removesuffix("constant pressure").rstrip(", ")
        return ": ".join(filter(None, [self.curve.family.name, problem]))

    @property
    def pair(self) -> str:
        """The cell types of slave and master."""
        sides = self.curve.solved[-1].sides
        return "–".join(next(iter(body.cells), "rigid") for body in sides)

    @property
    def faces(self) -> int:
        """Macro-elements of the finest level."""
        return self.curve.solved[-1].verdict.macro_elements or 0

    @cached_property
    def error(self) -> float | None:
        """The error of the recovered pressure at the finest level."""
        return self.curve.at_finest(_PRESSURE)

    @cached_property
    def gain(self) -> float | None:
        """The error of constants over the error of the recovered pressure, at the finest level."""
        level = self.curve.solved[-1].folder.name
        same = [row for row in self.constants.solved if row.folder.name == level]
        constant = same[0].norms.get(_PRESSURE) if same else None
        return constant / self.error if constant and self.error else None

    @cached_property
    def order(self) -> float | None:
        """The order of the recovered pressure between the last two levels."""
        return _last_order(self.curve, _PRESSURE)

    @cached_property
    def stress_order(self) -> float | None:
        """The order of the largest nodal stress error between the last two levels."""
        return _last_order(self.curve, _STRESS)

    @cached_property
    def goal(self) -> GainGoal:
        """Goals are set for smooth pressures alone, and in 2D for ladders that are fine enough."""
        judged = self.curve.family.smooth and (self.curve.dim == 3 or self.faces >= _FACES)
        return GOALS.get((self.form, self.cells), GainGoal()) if judged else GainGoal()

    @cached_property
    def stress_goal(self) -> float | None:
        """The least order of the nodal stress, of quadratic cells in 2D."""
        quadratic = self.curve.degree == "quadratic" and self.curve.dim == 2
        return _STRESS_GOAL if self.goal.order and quadratic and self.form != "linear" else None

    @property
    def marks(self) -> dict[str, bool]:
        """Whether each goal is reached, by its name."""
        asked = {
            "order": (self.order, self.goal.order),
            "gain": (self.gain, self.goal.gain),
            "stress": (self.stress_order, self.stress_goal),
        }
        return {
            k: found is not None and found >= goal for k, (found, goal) in asked.items() if goal
        }


def _last_order(curve: Curve, error: str) -> float | None:
    sizes, values = curve.errors(error)
    if len(sizes) < 2 or not (values[-2:] > 0).all():
        return None
    return float(np.diff(np.log(values[-2:]))[0] / np.diff(np.log(sizes[-2:]))[0])


def gains(curves: Sequence[Curve]) -> list[Gain]:
    """Those of a family's ladders with recovery, by cell type of the slave and form."""
    found = []
    for curve in curves:
        if curve.ladder.recovery not in _NONE and curve.solved:
            same = [c for c in curves if c.ladder.recovery in _NONE and _same(c, curve)]
            found += [Gain(curve, constants) for constants in same[:1]]
    order = list(BY_NAME)
    return sorted(found, key=lambda one: (order.index(one.cells), one.form, one.pair))


def _same(one: Curve, other: Curve) -> bool:
    """Whether two curves are of one case, direction and cut."""

    def of(curve: Curve) -> tuple:
        ladder = curve.ladder
        return ladder.case, ladder.hexahedra, curve.name == ladder.folder(True)

    return of(one) == of(other)
