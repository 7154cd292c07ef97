"""The picture of a 2D case: both blocks after the cut, and the contact enlarged beside them."""

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from ..mechanics.fem.faces import outer_faces
from ..simulation.solution import Solution
from .charts import BLUE, MUTED, PAPER
from .geometry import plane_cells
from .layout import Placement, apart, edge_color, fit, pressed_box, tint, ways_apart
from .obstacles import Obstacle, obstacles
from .svg import Drawing, mixed
from .symbols import View, draw_axes, draw_name, draw_symbols

WIDTH, HEIGHT = 760, 360
# Where the contact is more than this share of the model, it is not enlarged.
_LARGE = 0.5
# Bodies are drawn apart by this share of the model; hatches of rigid lines are so long (pixels).
_APART, _HATCH = 0.03, 6.0
_Box = tuple[np.ndarray, np.ndarray]
_ALL: _Box = (np.array(-np.inf), np.array(np.inf))


def draw_plane(solution: Solution, title: str) -> Markup:
    """Blocks on the left with names, loads and supports; on the right what is pressed, enlarged."""
    drawing = Drawing(WIDTH, HEIGHT, title)
    points, rigid = apart(solution, _APART), obstacles(solution)
    meshed = ~np.isin(solution.body, list(rigid))
    whole = solution.mesh.points
    low, high = pressed_box(whole, solution.zones, whole[meshed])
    enlarged = np.ptp([low, high], axis=0).max() < _LARGE * solution.length
    ways = _APART * solution.length * ways_apart(solution)
    shown = np.concatenate([points[meshed], *(r.points + ways[k] for k, r in rigid.items())])
    place = fit(shown, (48.0, 48.0, 190.0 if enlarged else 380.0, HEIGHT - 112.0))
    _blocks(drawing, solution, place, points, rigid)
    for number, surface in rigid.items():
        _rigid(drawing, place, surface, edge_color(solution.bodies[number]), ways[number])
    view = View(points, place, np.ones(len(points), dtype=bool))
    draw_symbols(drawing, solution, view, list(outer_faces(solution.mesh)))
    _names(drawing, solution, place, points, rigid, float(place(shown)[:, 0].max()))
    draw_axes(
        drawing,
        np.eye(2),
        np.ptp(whole[solution.deformable], axis=0),
        solution.case.units.get("length"),
    )
    if enlarged:
        (x0, y1), (x1, y0) = place(np.stack([low, high]))
        drawing.rectangle(x0, y0, x1 - x0, y1 - y0, stroke=MUTED, stroke_width=1)
        _enlarged(drawing, solution, (low, high), rigid)
    return drawing.svg()


def _enlarged(
    drawing: Drawing, solution: Solution, box: _Box, rigid: Mapping[int, Obstacle]
) -> None:
    place = fit(np.stack(box), (WIDTH - 390.0, 10.0, 380.0, HEIGHT - 20.0))
    (x0, y1), (x1, y0) = place(np.stack(box))
    with drawing.clipped(x0, y0, x1 - x0, y1 - y0):
        _blocks(drawing, solution, place, solution.mesh.points, rigid, box)
        for number, surface in rigid.items():
            _rigid(drawing, place, surface, edge_color(solution.bodies[number]))
    drawing.rectangle(x0, y0, x1 - x0, y1 - y0, stroke=MUTED, stroke_width=1)


def _blocks(
    drawing: Drawing,
    solution: Solution,
    place: Placement,
    points: np.ndarray,
    rigid: Mapping[int, Obstacle],
    box: _Box = _ALL,
) -> None:
    """The cells of every body that reach into a box, the slave's surface in blue."""
    low, high = box
    for polygons, node in plane_cells(points, solution.mesh):
        seen = ((polygons.max(axis=1) > low) & (polygons.min(axis=1) < high)).all(axis=1)
        for number, body in enumerate(solution.bodies):
            if number in rigid:
                continue
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


def _rigid(
    drawing: Drawing,
    place: Placement,
    surface: Obstacle,
    color: str,
    way: np.ndarray | float = 0.0,
) -> None:
    """A rigid line, hatched on the side of the body."""
    ends = place(surface.points[surface.faces] + way)
    drawing.polygons(ends, closed=False, stroke=color, stroke_width=2)
    pieces = np.linspace(0.0, 1.0, max(2, 24 // len(ends)))[None, :, None]
    along = (ends[:, None, 0] + pieces * (ends[:, None, 1] - ends[:, None, 0])).reshape(-1, 2)
    out = np.repeat(surface.out[surface.faces].mean(axis=1), pieces.shape[1], axis=0)
    into = _HATCH * np.stack([-out[:, 0] - out[:, 1], out[:, 1] - out[:, 0]], axis=1)
    hatches = np.stack([along, along + into], axis=1)
    drawing.polygons(hatches, closed=False, stroke=color, stroke_width=0.8)


def _names(
    drawing: Drawing,
    solution: Solution,
    place: Placement,
    points: np.ndarray,
    rigid: Mapping[int, Obstacle],
    right: float,
) -> None:
    """Name, cells and role of every body beside it, one below the other where they would meet."""
    own = [
        place(rigid[k].points if k in rigid else points[solution.body == k])[:, 1]
        for k in range(len(solution.bodies))
    ]
    middles, free = [float((y.min() + y.max()) / 2) for y in own], 0.0
    for number in np.argsort(middles):
        y = max(middles[number], free) - 4
        free = draw_name(drawing, solution, int(number), right + 42, y) + 22
