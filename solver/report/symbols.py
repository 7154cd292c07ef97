"""Loads as arrows, supports as what they do, axes with the size of the mesh: drawn onto a view."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ..case.acting import Load, Support
from ..case.expressions import EXACT, Expression, evaluate
from ..lac.cells.faces import nodal_normals
from ..mechanics.fem.stress import traction
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution
from .charts import GREEN, INK, MUTED, RED
from .layout import Drawing, edge_color
from .parts import three
from .profile import mathematics
from .view import Label, View

# Arrows of a load and symbols of a support, at most; lengths in pixels.
_MOST, _ARROW, _HEAD, _SIDE = 6, 30.0, 6.0, 7.0
# Longer values of loads and supports are not written out.
_LONGEST = 24
_UNITS = {"pressure": "stress", "traction": "stress"}
# Shapes in pixels: along the direction that is held, and across; the ground behind them.
_TRIANGLE = np.array([[0, 0], [7, 4.2], [7, -4.2]])
_SPRING = np.array([[0, 0], [2, 0], [3, 3], [5, -3], [7, 3], [9, -3], [10, 0], [12, 0]])
_DIAMOND = 2.5 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])


@dataclass(frozen=True)
class Symbols:
    """Draws onto a view of a solution with its points as drawn (n, 3); some nodes (n,) are seen.

    `faces`: the outer ones, by type.
    """

    solution: Solution
    view: View
    points: np.ndarray
    seen: np.ndarray
    faces: list[tuple[str, np.ndarray]]

    def draw(self) -> list[Label]:
        """Draw all loads and supports; returns their labels, each text once."""
        case, labels = self.solution.case, dict[str, Label]()
        for i, support in enumerate(case.supports):
            at = self._support(f"supports[{i}]", support)
            if (text := self._words(support)) and at is not None:
                labels.setdefault(text, Label([(text, GREEN)], at))
        for i, load in enumerate(case.loads):
            at, text = self._load(f"loads[{i}]", load), self._words(load)
            if load.of_cells or at is not None:
                labels.setdefault(text, Label([(text, RED)], at))
        return list(labels.values())

    def _nodes(self, key: str) -> np.ndarray:
        return self.solution.places.acted.get(key, np.empty(0, int))

    def _outward(self, nodes: np.ndarray) -> np.ndarray:
        """The normals (n, 3) of the faces of a group; where it has none, of all faces."""
        points = self.solution.mesh.points
        inside = np.isin(np.arange(len(points)), nodes)
        own = [(kind, f[inside[f].all(axis=1)]) for kind, f in self.faces]
        return three(nodal_normals(points, own if any(len(f) for _, f in own) else self.faces))

    def _some(self, nodes: np.ndarray) -> np.ndarray:
        """A few of the nodes that are seen, far from each other."""
        left = nodes[self.seen[nodes]]
        places = self.points[left]
        chosen = [int(places.sum(axis=1).argmin())] if len(left) else []
        away = np.full(len(left), np.inf)
        for _ in range(min(_MOST, len(left)) - 1):
            away = np.minimum(away, np.linalg.norm(places - places[chosen[-1]], axis=1))
            chosen.append(int(away.argmax()))
        return left[np.unique(np.array(chosen, dtype=int))]

    def _support(self, key: str, support: Support) -> np.ndarray | None:
        """The symbols of a support; returns the place of its rightmost one, in pixels."""
        nodes = self._nodes(f"{key}.group")
        chosen = self._some(nodes)
        if not len(chosen):
            return None
        outward, at = self._outward(nodes), self.view(self.points[chosen])
        if support.cyclic:
            both = np.append(chosen, self._some(self._nodes(f"{key}.cyclic.of")))
            marks = self.view(self.points[both])[:, None] + _DIAMOND
            self.view.drawing.polygons(marks, fill=GREEN)
        if support.together:  # spokes to a hub beside the nodes
            hub = at.mean(axis=0) + 14 * self.view.along(outward[chosen].mean(axis=0))
            self._draw_lines(np.stack([at, np.broadcast_to(hub, at.shape)], axis=1))
            self.view.drawing.polygons((hub + _DIAMOND)[None], fill=GREEN)
        shape = _SPRING if support.spring else _TRIANGLE
        for place, normal in zip(at, outward[chosen], strict=True):
            for direction in _held(support, normal):
                self._fixed(place, self.view.along(direction), shape)
        return np.asarray(at[at[:, 0].argmax()])

    def _draw_lines(self, ends: np.ndarray) -> None:
        self.view.drawing.polygons(ends, closed=False, stroke=GREEN, stroke_width=1.1)

    def _fixed(self, tip: np.ndarray, way: np.ndarray, shape: np.ndarray) -> None:
        """A triangle, or a spring, with its tip at a node and the ground away from the body."""
        if (length := float(np.linalg.norm(way))) < 0.25:
            return
        axes = np.stack([way, [-way[1], way[0]]]) / length
        closed = len(shape) == len(_TRIANGLE)
        style = {"fill": "#ffffff"} if closed else {}
        outline = (tip + shape @ axes)[None]
        self.view.drawing.polygons(outline, closed, stroke=GREEN, stroke_width=1.1, **style)
        ground = np.array([[1.0, 4.2], [1.0, -4.2]]) * [shape[:, 0].max() + 2 * closed, 1]
        self._draw_lines((tip + ground @ axes)[None])

    def _load(self, key: str, load: Load) -> np.ndarray | None:
        """Arrows along a load at some nodes, as long as it is large; returns a tail, in pixels."""
        nodes = self._nodes(f"{key}.group")
        chosen = self._some(nodes)
        if not len(chosen):
            return None
        outward = self._outward(nodes)[chosen]
        vectors = three(_vectors(self.solution, load, chosen, outward))
        size = np.linalg.norm(vectors, axis=1)
        arrows = _ARROW * self.view.along(vectors / max(size.max(), 1e-300))
        large = size > 0.05 * size.max()
        ends, pulls = self.view(self.points[chosen]), (vectors * outward).sum(axis=1) > 0
        tails = np.where(pulls[:, None], ends, ends - arrows)[large]
        for tail, arrow in zip(tails, arrows[large], strict=True):
            draw_arrow(self.view.drawing, tail, tail + arrow, RED, _HEAD)
        return max(tails, key=lambda tail: float(tail[0]), default=None)

    def _words(self, entry: Load | Support) -> str:
        """What a load or a support is, in words; empty where its symbol says it."""
        units, dim = self.solution.case.about.units, self.solution.mesh.points.shape[1]
        if isinstance(entry, Load):
            where = f" in {entry.group}" if entry.of_cells else ""
            kind, unit = entry.kind.replace("_", " "), units.get(_UNITS.get(entry.kind, ""), "")
            if isinstance(entry.value, dict) and entry.kind in entry.value:
                return f"{kind} {_value(entry.value[entry.kind], dim)}{where}"
            if entry.value is EXACT:
                return f"exact {kind}{where}"
            return f"{kind} {_value(entry.value, dim)} {unit}".strip() + where
        if cyclic := entry.cyclic:
            given = f"{cyclic.angle:g}°" if cyclic.angle is not None else _value(cyclic.shift, dim)
            return f"cyclic {given}"
        if entry.together:
            return f"moves together in {', '.join(entry.together)}"
        if entry.spring:
            return f"springs {_value(entry.spring, dim)}"
        moved = {name: value for name, value in entry.fix.items() if value != 0.0}
        if EXACT in moved.values():
            return f"exact displacement {', '.join(moved)}"
        return f"moved {_value(moved, dim)} {units.get('length', '')}".strip() if moved else ""


def draw_axes(view: View, size: np.ndarray, unit: str | None) -> None:
    """The axes of the picture in its lower left corner, and the extents (dim,) of the mesh."""
    drawing = view.drawing
    corner = np.array([22.0, drawing.height - 34.0])
    for name, step in zip("xyz"[: len(size)], view.along(np.eye(3)), strict=False):
        way = 18 * step
        if np.hypot(*way) > 3:
            draw_arrow(drawing, corner, corner + way, MUTED, 4.0)
        x, y = corner + way
        drawing.text(x + 5 * np.sign(way[0]) - 3, y + (-3 if way[1] < -1 else 9), name, size=9)
    text = " × ".join(f"{length:.3g}" for length in size)
    drawing.text(6, drawing.height - 6, f"{text} {unit or ''}".strip(), color=MUTED, size=10)


def body_label(solution: Solution, number: int, at: np.ndarray) -> Label:
    """Name of a body, its cells or its rigid surface and how that moves, and its role."""
    body = solution.bodies[number]
    lines = [", ".join(body.cells)]
    if rigid := solution.case.rigid.get(body.name):
        given = [("moved", rigid.move), ("force", rigid.force)]
        flat = solution.mesh.points.shape[1] == 2 and not solution.case.axisymmetric
        shape = {"plane": "line", "sphere": "circle"}.get(rigid.surface) if flat else None
        lines = [f"rigid {shape or rigid.surface}".strip()]
        lines += [f"{what} {k} {v:.4g}" for what, values in given for k, v in values.items()]
    texts = [(body.name, INK), *((line, MUTED) for line in lines), (body.role, edge_color(body))]
    return Label(texts, at, bold=True)


def _held(support: Support, normal: np.ndarray) -> Iterator[np.ndarray]:
    """The directions that a support holds or springs resist, turned out of the body."""
    for name in support.components:
        axis = normal if name == "normal" else np.eye(3)["xyz".index(name)]
        yield axis if axis @ normal > 0.3 else -axis


def _vectors(solution: Solution, load: Load, nodes: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """The load (k, dim) at nodes: a traction, or a force; `outward` normals (k, 3)."""
    points, value = solution.mesh.points[nodes], load.value
    outward = outward[:, : points.shape[1]]
    if value is EXACT:
        assert solution.case.reference.exact
        stress = ExactValues(solution, solution.case.reference.exact).stress(nodes)
        return traction(stress, outward)
    if isinstance(value, tuple):
        return np.stack([evaluate(part, points) for part in value], axis=1)
    assert isinstance(value, float | Expression)
    return -evaluate(value, points)[:, None] * outward


def _value(value: object, dim: int) -> str:
    """A value of the case file in words: a number, an expression, a vector, components by name."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_value(part, dim)}" for key, part in value.items())
    parts = value if isinstance(value, tuple) else (value,)
    words = [mathematics(p.text) if isinstance(p, Expression) else f"{p:g}" for p in parts]
    text = words[0] if len(words) == 1 else f"({', '.join(words)})"
    return text if len(text) <= _LONGEST else f"f({', '.join('xyz'[:dim])})"


def draw_arrow(
    drawing: Drawing, start: np.ndarray, end: np.ndarray, color: str, head: float
) -> None:
    """An arrow from one place to another, in pixels."""
    way = end - start
    if (length := float(np.linalg.norm(way))) < 1.0:
        return
    way = way / length
    side = 0.45 * head * np.array([-way[1], way[0]])
    drawing.polygons(np.stack([start, end])[None], closed=False, stroke=color, stroke_width=1.3)
    tip = np.stack([end, end - head * way + side, end - head * way - side])
    drawing.polygons(tip[None], fill=color)
