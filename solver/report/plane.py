"""The picture of a 2D case: both blocks after the cut, and the contact enlarged beside them."""

import numpy as np
from markupsafe import Markup

from ..simulation.solution import Solution
from .charts import BLUE, MUTED, PAPER
from .geometry import plane_cells
from .layout import Placement, apart, edge_color, fit, pressed_box, tint
from .svg import Drawing, mixed

WIDTH, HEIGHT = 760, 330
# Where the contact is more than this share of the model, it is not enlarged.
_LARGE = 0.5


def draw_plane(solution: Solution, title: str) -> Markup:
    """Blocks on the left with their names; on the right what is pressed, with its surroundings."""
    drawing = Drawing(WIDTH, HEIGHT, title)
    points = apart(solution, 0.03)
    whole = solution.mesh.points
    low, high = pressed_box(whole, solution.zones, whole)
    enlarged = np.ptp([low, high], axis=0).max() < _LARGE * solution.length
    frame = (4.0, 10.0, 190.0 if enlarged else 420.0, HEIGHT - 20.0)
    place = fit(points, frame)
    _blocks(drawing, solution, place, points)
    _names(drawing, solution, place(points))
    if enlarged:
        (x0, y1), (x1, y0) = place(np.stack([low, high]))
        drawing.rectangle(x0, y0, x1 - x0, y1 - y0, stroke=MUTED, stroke_width=1)
        place = fit(np.stack([low, high]), (WIDTH - 410.0, 10.0, 400.0, HEIGHT - 20.0))
        (x0, y1), (x1, y0) = place(np.stack([low, high]))
        with drawing.clipped(x0, y0, x1 - x0, y1 - y0):
            _blocks(drawing, solution, place, solution.mesh.points, (low, high))
        drawing.rectangle(x0, y0, x1 - x0, y1 - y0, stroke=MUTED, stroke_width=1)
    return drawing.svg()


def _blocks(
    drawing: Drawing,
    solution: Solution,
    place: Placement,
    points: np.ndarray,
    box: tuple[np.ndarray, np.ndarray] = (np.array(-np.inf), np.array(np.inf)),
) -> None:
    """The cells of every body that reach into a box, the slave's surface in blue."""
    low, high = box
    for polygons, node in plane_cells(points, solution.mesh):
        seen = ((polygons.max(axis=1) > low) & (polygons.min(axis=1) < high)).all(axis=1)
        for number, body in enumerate(solution.bodies):
            drawing.polygons(
                place(polygons[seen & (solution.body[node] == number)]),
                fill=tint(body),
                stroke=mixed(edge_color(body), PAPER, 0.25),
                stroke_width=0.6,
            )
    for zone in solution.zones:
        for _, nodes, _ in zone.faces:
            drawing.polygons(
                place(points[nodes[:, :2]]), closed=False, stroke=BLUE, stroke_width=1.6
            )


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
