"""The picture of a 2D case: both blocks with the cut, and the pressure along each interface."""

import numpy as np
from markupsafe import Markup

from ..simulation.solution import Solution, ZoneResult
from ..verification.units import with_unit
from .axes import Scale, draw_axes
from .geometry import plane_cells
from .layout import Frame, apart, edge_color, extents, fit, tangent, tint
from .profile import expected
from .svg import BLUE, INK, MUTED, ORANGE, PAPER, Drawing, mixed

WIDTH, HEIGHT = 760, 330


def draw_plane(solution: Solution, title: str) -> Markup:
    """Blocks on the left, the first zones' pressure on the right."""
    drawing = Drawing(WIDTH, HEIGHT, title)
    _blocks(drawing, solution, (4, 10, 190, HEIGHT - 20))
    zones = solution.zones[:3]
    each = HEIGHT / max(1, len(zones))
    for i, zone in enumerate(zones):
        _interface(drawing, solution, zone, (324, i * each, WIDTH - 340, each))
    return drawing.svg()


def _blocks(drawing: Drawing, solution: Solution, frame: Frame) -> None:
    """The cells of every body, the bodies drawn a little apart, each with its name beside it."""
    points = apart(solution, 0.03)
    place = fit(points, frame)
    for polygons, node in plane_cells(points, solution.mesh):
        for number, body in enumerate(solution.bodies):
            drawing.polygons(
                place(polygons[solution.body[node] == number]),
                fill=tint(body),
                stroke=mixed(edge_color(body), PAPER, 0.25),
                stroke_width=0.6,
            )
    _names(drawing, solution, place(points))


def _names(drawing: Drawing, solution: Solution, pixels: np.ndarray) -> None:
    """Name, cells and role of every body beside it, one below the other where they would meet."""
    right, free = float(pixels[:, 0].max()) + 12, 0.0
    heights = [pixels[solution.body == number, 1] for number in range(len(solution.bodies))]
    middles = [float((own.min() + own.max()) / 2) for own in heights]
    for number in np.argsort(middles):
        body, middle = solution.bodies[number], max(middles[number], free)
        drawing.text(right, middle - 4, body.name, weight="600")
        drawing.text(right, middle + 10, ", ".join(body.cells), color=MUTED)
        drawing.text(right, middle + 24, body.role, color=edge_color(body))
        free = middle + 46


def _interface(drawing: Drawing, solution: Solution, zone: ZoneResult, frame: Frame) -> None:
    """Pressure by macro-element and surface stresses along the interface; both meshes below."""
    left, top, width, height = frame
    points = solution.mesh.points
    along = tangent(zone)
    start, end = extents(zone, points @ along)
    master = np.unique(np.concatenate([nodes[:, :2].ravel() for _, nodes in zone.master_faces]))
    low = min(start.min(), (points[master] @ along).min())
    high = max(end.max(), (points[master] @ along).max())
    means = expected(solution, zone)
    pressures = zone.multiplier if means is None else np.concatenate([zone.multiplier, means])
    largest = max(float(pressures.max()), 1e-300)
    x = Scale(low, high, left, left + width)
    y = Scale(min(0.0, float(zone.multiplier.min())), 1.25 * largest, top + height - 78, top + 36)
    label = with_unit(f"pressure along {zone.name}", solution.case.units.get("stress"))
    draw_axes(drawing, x, y, "", label)
    steps = np.stack([np.stack([x(start), y(zone.multiplier)], -1)] * 2, axis=1)
    steps[:, 1, 0] = x(end)
    ground = np.stack([steps[:, 1], steps[:, 0]], axis=1)
    ground[:, :, 1] = y(0.0)
    drawing.polygons(np.concatenate([steps, ground], axis=1), fill=mixed(BLUE, PAPER, 0.8))
    drawing.polygons(steps, closed=False, stroke=BLUE, stroke_width=2.2)
    _reference(drawing, zone, means, x, y, along)
    for nodes, stress, mark, color in (
        (zone.slave_nodes, zone.stress_slave, drawing.circles, BLUE),
        (zone.master_nodes, zone.stress_master, drawing.crosses, ORANGE),
    ):
        inside = (-stress >= y.low) & (-stress <= y.high)
        at = np.column_stack([x(points[nodes] @ along), y(-stress)])[inside]
        mark(at, 2.6, stroke=color, stroke_width=1.1)
    _nodes_of_both(drawing, zone, points @ along, master, x, top + height - 46)
    _legend(drawing, left, top + height - 6)


def _reference(
    drawing: Drawing,
    zone: ZoneResult,
    values: np.ndarray | None,
    x: Scale,
    y: Scale,
    along: np.ndarray,
) -> None:
    if values is None:
        return
    position = zone.centre @ along
    order = np.argsort(position)
    position, values = position[order], values[order]
    if np.ptp(values) == 0:  # a constant reference is drawn over the whole width
        position, values = np.array([x.low, x.high]), values[[0, -1]]
    line = np.column_stack([x(position), y(values)])
    drawing.polygons(line[None], closed=False, stroke=INK, stroke_width=1, stroke_dasharray=(5, 4))


def _nodes_of_both(
    drawing: Drawing,
    zone: ZoneResult,
    position: np.ndarray,
    master: np.ndarray,
    x: Scale,
    at: float,
) -> None:
    """Two rulers: ends of macro-elements (long), nodes of the cut (short), master nodes below."""
    start, end = extents(zone, position)
    inner = np.unique(np.concatenate([nodes[:, :2].ravel() for _, nodes, _ in zone.faces]))
    for positions, low, high, color in (
        (position[inner], 0, 6, BLUE),
        (np.concatenate([start, end]), 0, 12, BLUE),
        (position[master], -12, 0, ORANGE),
    ):
        pixels = x(np.unique(positions))
        ends = np.stack([np.full_like(pixels, at - low), np.full_like(pixels, at - high)], -1)
        lines = np.stack([np.stack([pixels] * 2, -1), ends], axis=-1)
        drawing.polygons(lines, closed=False, stroke=color, stroke_width=1.2)
    drawing.line(x.start, at, x.end, at, stroke=INK, stroke_width=0.8)


def _legend(drawing: Drawing, x: float, y: float) -> None:
    drawing.line(x, y - 4, x + 16, y - 4, stroke=BLUE, stroke_width=2.2)
    drawing.text(x + 21, y, "multiplier")
    drawing.circles(np.array([[x + 92, y - 4]]), 2.6, stroke=BLUE, stroke_width=1.1)
    drawing.text(x + 100, y, "−σₙ slave")
    drawing.crosses(np.array([[x + 168, y - 4]]), 2.6, stroke=ORANGE, stroke_width=1.1)
    drawing.text(x + 176, y, "−σₙ master")
    drawing.line(
        x + 250, y - 4, x + 268, y - 4, stroke=INK, stroke_width=1, stroke_dasharray=(5, 4)
    )
    drawing.text(x + 273, y, "reference")
    drawing.text(x + 335, y, "| nodes", color=MUTED)
