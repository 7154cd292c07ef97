"""Loads as arrows, supports as triangles, axes with the size of the mesh: drawn onto a picture."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..case.expressions import Expression, evaluate
from ..case.model import EXACT, Load, Support
from ..mechanics.fem.faces import nodal_normals
from ..mechanics.fem.stress import traction
from ..simulation.exact import ExactValues
from ..simulation.solution import Solution
from .charts import GREEN, MUTED, RED
from .layout import Placement, edge_color
from .profile import mathematics
from .svg import Drawing

# Arrows of a load and symbols of a support, at most; lengths in pixels.
_MOST, _ARROW, _HEAD, _SIDE = 6, 30.0, 6.0, 7.0
# Texts nearer than this to each other are one above the other (pixels); longer ones are cut.
_WIDE, _LINE, _LONGEST = 110.0, 11.0, 24
_UNITS = {"pressure": "stress", "traction": "stress"}

_Labels = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class View:
    """How a picture shows places: the points as drawn (n, dim), to pixels, which nodes are seen."""

    points: np.ndarray
    place: Placement
    seen: np.ndarray

    def along(self, node: int, direction: np.ndarray) -> np.ndarray:
        """A direction (dim,) at a node in pixels, shorter where it points at the eye."""
        step = 1e-3 * float(np.ptp(self.points, axis=0).max())
        ends = self.place(np.stack([self.points[node], self.points[node] + step * direction]))
        flat = self.place(np.stack([self.points[node] + step * e for e in np.eye(len(direction))]))
        unit = np.linalg.norm(flat - ends[0], axis=1).max()
        return np.asarray((ends[1] - ends[0]) / max(float(unit), 1e-300))

    def some(self, nodes: np.ndarray) -> list[int]:
        """A few of the nodes that are seen, far from each other."""
        left = nodes[self.seen[nodes]]
        if not len(left):
            return []
        places = self.points[left]
        chosen = [int(places.sum(axis=1).argmin())]
        away = np.full(len(left), np.inf)
        for _ in range(min(_MOST, len(left)) - 1):
            away = np.minimum(away, np.linalg.norm(places - places[chosen[-1]], axis=1))
            chosen.append(int(away.argmax()))
        return left[np.unique(chosen)].tolist()


def draw_symbols(
    drawing: Drawing, solution: Solution, view: View, faces: Sequence[tuple[str, np.ndarray]]
) -> None:
    """Loads and supports at the nodes of their groups; `faces` are the outer ones of the mesh."""
    points, labels = solution.mesh.points, _Labels()

    def outward(nodes: np.ndarray) -> np.ndarray:
        """The normals (n, dim) of the faces of a group; where it has none, of all faces."""
        inside = np.isin(np.arange(len(points)), nodes)
        own = [(kind, f[inside[f].all(axis=1)]) for kind, f in faces]
        return nodal_normals(points, own if any(len(f) for _, f in own) else list(faces))

    for i, support in enumerate(solution.case.supports):
        nodes = solution.acted.get(f"supports[{i}].group", np.empty(0, int))
        normals = outward(nodes)
        for node in view.some(nodes):
            for direction in _held(support, normals[node]):
                _triangle(drawing, view, node, direction)
    for i, load in enumerate(solution.case.loads):
        nodes = solution.acted.get(f"loads[{i}].group", np.empty(0, int))
        _arrows(drawing, solution, view, load, nodes, outward(nodes), labels)


def draw_axes(drawing: Drawing, screen: np.ndarray, size: np.ndarray, unit: str | None) -> None:
    """The axes (2, dim) of the picture in its lower left corner, and the extents of the mesh."""
    x, y = 22.0, drawing.height - 34.0
    for name, (right, up) in zip("xyz", 18 * screen.T, strict=False):
        tip = np.array([x + right, y - up])
        if np.hypot(right, up) > 3:
            _arrow(drawing, np.array([x, y]), tip, MUTED, 4.0)
        drawing.text(tip[0] + 5 * np.sign(right) - 3, tip[1] + (-3 if up > 1 else 9), name, size=9)
    text = " × ".join(f"{length:.3g}" for length in size)
    drawing.text(6, drawing.height - 6, f"{text} {unit or ''}".strip(), color=MUTED, size=10)


def draw_name(drawing: Drawing, solution: Solution, number: int, x: float, y: float) -> float:
    """Name of a body, what it is made of and its role; returns the y of the last line."""
    body = solution.bodies[number]
    drawing.text(x, y, body.name, weight="600")
    for line in _lines_of(solution, number):
        drawing.text(x, y := y + 14, line, color=MUTED)
    drawing.text(x, y := y + 14, body.role, color=edge_color(body))
    return y


def _lines_of(solution: Solution, number: int) -> list[str]:
    """What a picture says of a body: its cells or rigid surface, and how that moves."""
    body = solution.bodies[number]
    rigid = solution.case.rigid.get(body.name)
    if rigid is None:
        return [", ".join(body.cells)]
    given = [("moved", rigid.move), ("force", rigid.force)]
    motion = [f"{what} {k} {v:.4g}" for what, values in given for k, v in values.items()]
    flat = solution.mesh.points.shape[1] == 2 and not solution.case.axisymmetric
    shape = {"plane": "line", "sphere": "circle"}.get(rigid.surface) if flat else None
    return [f"rigid {shape or rigid.surface}".strip(), *motion]


def _held(support: Support, normal: np.ndarray) -> Iterator[np.ndarray]:
    """The directions that a support holds or springs resist, turned out of the body."""
    for name in dict.fromkeys([*support.fix, *support.spring]):
        axis = normal if name == "normal" else np.eye(len(normal))["xyz".index(name)]
        yield axis if axis @ normal > 0.3 else -axis


def _triangle(drawing: Drawing, view: View, node: int, direction: np.ndarray) -> None:
    """A triangle with its tip at a node, its base away from the body."""
    tip, way = view.place(view.points[node][None])[0], view.along(node, direction)
    if (length := float(np.linalg.norm(way))) < 0.25:
        return
    way = _SIDE * way / length
    side = 0.6 * np.array([-way[1], way[0]])
    corners = np.stack([tip, tip + way + side, tip + way - side])
    drawing.polygons(corners[None], fill="#ffffff", stroke=GREEN, stroke_width=1.1)
    drawing.polygons(
        np.stack([tip + 1.3 * way + side, tip + 1.3 * way - side])[None],
        closed=False,
        stroke=GREEN,
        stroke_width=1.1,
    )


def _arrows(
    drawing: Drawing,
    solution: Solution,
    view: View,
    load: Load,
    nodes: np.ndarray,
    outward: np.ndarray,
    labels: _Labels,
) -> None:
    """Arrows along a load at some nodes, as long as it is large; its value at one of them."""
    chosen = view.some(nodes)
    if not chosen:
        return
    vectors = _vectors(solution, load, np.array(chosen), outward[chosen])
    size = np.linalg.norm(vectors, axis=1)
    if not (most := float(size.max())):
        return
    for node, vector, length in zip(chosen, vectors, size, strict=True):
        if length < 0.05 * most:
            continue
        way = _ARROW * (length / most) * view.along(node, vector / length)
        at = view.place(view.points[node][None])[0]
        start = at if vector @ outward[node] > 0 else at - way
        _arrow(drawing, start, start + way, RED, _HEAD)
    places = view.place(view.points[chosen])
    x, y = places[places[:, 0].argmax()]
    _label(drawing, labels, float(x) + 8, float(y) - _ARROW + 4, _title(solution, load))


def _label(drawing: Drawing, labels: _Labels, x: float, y: float, text: str) -> None:
    """A text once, above those that are there already."""
    if text in labels:
        return
    while any(abs(x - left) < _WIDE and abs(y - line) < _LINE for left, line in labels.values()):
        y -= _LINE
    labels[text] = (x, y)
    drawing.text(x, y, text, color=RED, size=10)


def _vectors(solution: Solution, load: Load, nodes: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """The load (k, dim) at nodes: a traction, or a force."""
    points, value = solution.mesh.points[nodes], load.value
    if value is EXACT:
        assert solution.case.solution
        stress = ExactValues(solution, solution.case.solution).stress(nodes)
        return traction(stress, outward)
    if isinstance(value, tuple):
        return np.stack([evaluate(part, points) for part in value], axis=1)
    assert isinstance(value, float | Expression)
    return -evaluate(value, points)[:, None] * outward


def _title(solution: Solution, load: Load) -> str:
    parts = load.value if isinstance(load.value, tuple) else (load.value,)
    words = [
        mathematics(part.text) if isinstance(part, Expression) else f"{part:g}"
        for part in parts
        if isinstance(part, float | Expression)
    ]
    if not words:
        return f"{load.kind} of the exact solution"
    value = words[0] if len(words) == 1 else f"({', '.join(words)})"
    if len(value) > _LONGEST:
        value = f"f({', '.join('xyz'[: solution.mesh.points.shape[1]])})"
    unit = solution.case.units.get(_UNITS.get(load.kind, ""), "")
    return f"{load.kind} {value} {unit}".strip()


def _arrow(drawing: Drawing, start: np.ndarray, end: np.ndarray, color: str, head: float) -> None:
    way = end - start
    if (length := float(np.linalg.norm(way))) < 1.0:
        return
    way = way / length
    side = 0.45 * head * np.array([-way[1], way[0]])
    drawing.polygons(np.stack([start, end])[None], closed=False, stroke=color, stroke_width=1.3)
    tip = np.stack([end, end - head * way + side, end - head * way - side])
    drawing.polygons(tip[None], fill=color)
