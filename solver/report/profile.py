"""Contact pressure along an interface against its reference, and how far it deviates."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from ..case.expressions import Expression, evaluate
from ..mechanics.fem.faces import surface_points
from ..simulation.exact import ExactValues
from ..simulation.solution import NodalContact, Solution, ZoneResult
from ..verification.samples import expected_pressure
from ..verification.units import with_unit
from .axes import Scale, draw_axes
from .layout import extents, plan_axes, tangent
from .svg import BLUE, INK, PAPER, Drawing, mixed

WIDTH, HEIGHT = 470, 372
# Where less than this share of the interface is pressed, only that and what is next to it is drawn.
_PRESSED = 0.6


def draw_profile(
    solution: Solution, zone: ZoneResult, title: str, along: Expression | None = None
) -> Markup:
    """The pressure of each macro-element over its place, with the reference; below, the deviation.

    The place is the distance along the interface, or what `along` says. The deviation is taken over
    the largest pressure of the reference. Multipliers at nodes are drawn there, over their means.
    """
    drawing = Drawing(WIDTH, HEIGHT, title)
    means = expected(solution, zone)
    elements = _elements(solution, zone, along, means)
    nodal = np.empty(0) if zone.nodal is None else zone.nodal.multiplier
    pressures = np.concatenate([zone.multiplier, nodal, [0.0] if means is None else means])
    x = Scale(elements.low, elements.high, 64, WIDTH - 14)
    low = min(0.0, float(pressures.min()))
    y = Scale(low, 1.12 * max(float(pressures.max()), 1e-300), 290 if means is None else 196, 30)
    pressure = with_unit("contact pressure", solution.case.units.get("stress"))
    draw_axes(drawing, x, y, elements.name if means is None else "", pressure)
    elements.draw(drawing, x, y, zone.multiplier)
    if zone.nodal:
        _draw_nodes(drawing, x, y, elements, elements.place(solution.mesh.points), zone.nodal)
    if means is not None:
        _draw_reference(drawing, x, y, elements, means, _curve(solution, zone))
        deviation = (zone.multiplier - means) / (np.abs(means).max() or 1.0)
        most = 1.25 * max(float(np.abs(deviation[elements.shown]).max(initial=0.0)), 1e-17)
        below = Scale(-most, most, 302, 242)
        draw_axes(drawing, x, below, elements.name, "deviation, over the largest reference")
        elements.draw(drawing, x, below, deviation)
    _draw_legend(drawing, elements.steps, zone.nodal is not None, means is not None)
    return drawing.svg()


def expected(solution: Solution, zone: ZoneResult) -> np.ndarray | None:
    """The pressure (m,) that the reference has on every macro-element; None where it has none."""
    reference = _reference(solution)
    return None if reference is None else expected_pressure(zone, reference)


def _reference(solution: Solution) -> float | Expression | ExactValues | None:
    """The reference pressure, checked or not."""
    given, exact = solution.case.reference.get("contact_pressure"), solution.case.solution
    if isinstance(given, float | Expression):
        return given
    if exact and "contact_pressure" in exact.quantities:
        return ExactValues(solution, exact)
    return None


def _curve(solution: Solution, zone: ZoneResult) -> tuple[np.ndarray, np.ndarray]:
    """Places (k, dim) all over the slave surface, and the reference's pressure (k,) there."""
    place = surface_points(solution.mesh.points, zone.faces).place
    reference = _reference(solution)
    if isinstance(reference, ExactValues):
        return place, reference.exact.contact_pressure(place)
    return place, evaluate(reference, place)  # type: ignore[arg-type]


@dataclass(frozen=True)
class _Elements:
    """Where the macro-elements of a zone are drawn: from `first` to `last` (m,), `centre` (m,).

    `place` gives the position (n,) of points (n, dim); `shown` (m,) are those between `low` and
    `high`; `steps` says whether an element is drawn over its extent, or as a mark at its centre.
    """

    name: str
    place: Callable[[np.ndarray], np.ndarray]
    first: np.ndarray
    last: np.ndarray
    centre: np.ndarray
    low: float
    high: float
    steps: bool

    @property
    def shown(self) -> np.ndarray:
        """Which macro-elements (m,) are drawn: partly within, or as marks centred within."""
        first, last = (self.first, self.last) if self.steps else (self.centre, self.centre)
        return (last >= self.low) & (first <= self.high)

    def draw(self, drawing: Drawing, x: Scale, y: Scale, values: np.ndarray) -> None:
        """One value (m,) of each macro-element."""
        values, centre = values[self.shown], self.centre[self.shown]
        if not self.steps:
            at = np.column_stack([x(centre), y(values)])
            drawing.circles(at, 2.6, stroke=BLUE, stroke_width=1.2)
            return
        ends = [np.clip(e[self.shown], self.low, self.high) for e in (self.first, self.last)]
        lines = np.stack([np.stack([x(end), y(values)], axis=-1) for end in ends], axis=1)
        ground = lines[:, ::-1].copy()
        ground[:, :, 1] = y(0.0)
        drawing.polygons(np.concatenate([lines, ground], axis=1), fill=mixed(BLUE, PAPER, 0.85))
        drawing.polygons(lines, closed=False, stroke=BLUE, stroke_width=2)


def _elements(
    solution: Solution, zone: ZoneResult, along: Expression | None, means: np.ndarray | None
) -> _Elements:
    points = solution.mesh.points
    name, place = _position(zone, along)
    if along is None:
        name = with_unit(name, solution.case.units.get("length"))
    first, last = extents(zone, place(points))
    pressed = (zone.multiplier > 0) | (means is not None and np.asarray(means) > 0)
    low, high = _range(first, last, pressed)
    steps = points.shape[1] == 2 and along is None
    return _Elements(name, place, first, last, place(zone.centre), low, high, steps)


def _position(
    zone: ZoneResult, along: Expression | None
) -> tuple[str, Callable[[np.ndarray], np.ndarray]]:
    """What the pressure is drawn over: its name, and its value (n,) at points (n, dim)."""
    if along is not None:
        return along.text, along
    if zone.centre.shape[1] == 3:
        (direction, _), (name, _) = plan_axes(zone)
    else:
        direction = tangent(zone)
        name = next(("xy"[i] for i in (0, 1) if direction[i] > 1 - 1e-9), "along the interface")
    return name, lambda points: points @ direction


def _range(first: np.ndarray, last: np.ndarray, pressed: np.ndarray) -> tuple[float, float]:
    """The part of the interface that is drawn: all, or where little is pressed, that and some."""
    low, high = float(first.min()), float(last.max())
    if pressed.any():
        start, end = float(first[pressed].min()), float(last[pressed].max())
        if end - start < _PRESSED * (high - low):
            more = 0.25 * (end - start)
            low, high = max(low, start - more), min(high, end + more)
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _draw_nodes(
    drawing: Drawing,
    x: Scale,
    y: Scale,
    elements: _Elements,
    position: np.ndarray,
    nodal: NodalContact,
) -> None:
    """The multipliers at their nodes, in the plane joined by the lines between them."""
    place = position[nodal.nodes]
    order = np.argsort(place, kind="stable")
    order = order[(place[order] >= elements.low) & (place[order] <= elements.high)]
    at = np.column_stack([x(place[order]), y(nodal.multiplier[order])])
    if elements.steps:
        drawing.polygons(at[None], closed=False, stroke=BLUE, stroke_width=1)
    drawing.circles(at, 1.8, fill=BLUE, stroke=BLUE, stroke_width=0.5)


def _draw_reference(
    drawing: Drawing,
    x: Scale,
    y: Scale,
    elements: _Elements,
    means: np.ndarray,
    curve: tuple[np.ndarray, np.ndarray],
) -> None:
    """A curve over steps; over marks, a cross for each macro-element."""
    if not elements.steps:
        shown = elements.shown
        at = np.column_stack([x(elements.centre[shown]), y(means[shown])])
        drawing.crosses(at, 2.2, stroke=INK, stroke_width=0.9)
        return
    position, values = elements.place(curve[0]), curve[1]
    order = np.argsort(position, kind="stable")
    order = order[(position[order] >= elements.low) & (position[order] <= elements.high)]
    line = np.column_stack([x(position[order]), y(values[order])])
    drawing.polygons(line[None], closed=False, stroke=INK, stroke_width=1.1)


def _draw_legend(drawing: Drawing, steps: bool, nodal: bool, reference: bool) -> None:
    left, base = 64.0, HEIGHT - 12.0
    if steps:
        drawing.line(left, base - 4, left + 16, base - 4, stroke=BLUE, stroke_width=2)
    else:
        drawing.circles(np.array([[left + 8, base - 4]]), 2.6, stroke=BLUE, stroke_width=1.2)
    computed = "computed at nodes (dots), means of faces" if nodal else ""
    drawing.text(left + 22, base, computed or "computed, one constant per macro-element")
    if reference:
        at = left + 290
        if steps:
            drawing.line(at, base - 4, at + 16, base - 4, stroke=INK, stroke_width=1.1)
        else:
            drawing.crosses(np.array([[at + 8, base - 4]]), 2.2, stroke=INK, stroke_width=0.9)
        drawing.text(at + 22, base, "reference")
