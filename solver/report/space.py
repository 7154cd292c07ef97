"""The picture of a 3D case: the blocks from the slave's side, pressure and deviation in plan."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from ..mechanics.fem.faces import outer_faces
from ..mesh.catalogue import cell_type
from ..simulation.solution import Solution, ZoneResult
from ..verification.units import with_unit
from .charts import BLUE, INK, MUTED, PAPER
from .geometry import macro_edges, normals, outlines
from .layout import (
    Frame,
    Placement,
    apart,
    edge_color,
    fit,
    mean_normal,
    plan_axes,
    pressed_box,
    tint,
    ways_apart,
)
from .obstacles import obstacles
from .profile import expected
from .svg import Drawing, mixed
from .symbols import View, draw_axes, draw_name, draw_symbols

WIDTH, HEIGHT = 960, 400
AZIMUTH, ELEVATION = np.radians(-58), np.radians(24)
# From no pressure to the largest, light to dark: distinguished by lightness alone.
PRESSURE = ("#f3f6fa", "#cfe1ee", "#9cc3dc", "#5f9dc6", "#2f75a8", "#174f7c")
LEVELS = 32
# Bodies are drawn apart by this share of the model.
_APART = 0.3
MASTER = "#ffa45c"  # readable on every pressure
# From too little to too much.
DEVIATION = ("#b35806", "#f1a340", "#fee0b6", "#f7f7f7", "#d8daeb", "#998ec3", "#542788")


def draw_space(solution: Solution, title: str) -> Markup:
    """Axonometric view on the left, plan of the first zone on the right."""
    drawing = Drawing(WIDTH, HEIGHT, title)
    _blocks(drawing, solution, (30, 40, 240, HEIGHT - 100))
    if solution.zones:
        zone = solution.zones[0]
        largest, unit = max(float(zone.multiplier.max()), 1e-300), solution.case.units.get("stress")
        label = with_unit(f"p on {zone.name}", unit)
        _plan(drawing, solution, zone, 392, label, zone.multiplier, (0.0, largest), PRESSURE)
        means = expected(solution, zone)
        if means is not None:
            off = (zone.multiplier - means) / (np.abs(means).max() or 1.0)
            most = max(float(np.abs(off).max()), 1e-17)
            _plan(drawing, solution, zone, 664, "Δp / max p", off, (-most, most), DEVIATION)
        _legend(drawing, zone, (392, HEIGHT - 32))
    return drawing.svg()


def _camera(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Screen axes (right, up) (2, 3) and the direction towards the eye (3,).

    The eye is above a slave that looks up and below one that looks down, so that the slave's
    surface, where cells are cut, is seen.
    """
    return axonometry(mean_normal(solution))


def axonometry(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Screen axes (right, up) (2, 3) and the direction towards an eye (3,) that sees a surface."""
    tilt = ELEVATION if normal[2] >= 0 else -ELEVATION
    flat = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0])
    eye = np.cos(tilt) * flat + np.sin(tilt) * np.array([0.0, 0.0, 1.0])
    right = np.array([-flat[1], flat[0], 0.0])
    return np.stack([right, np.cross(eye, right)]), eye


def _blocks(drawing: Drawing, solution: Solution, frame: Frame) -> None:
    """The faces turned to the eye, from far to near, the bodies drawn apart."""
    points, rigid = apart(solution, _APART), obstacles(solution)
    ways = _APART * solution.length * ways_apart(solution)
    screen, eye = _camera(solution)
    outer = list(outer_faces(solution.mesh))
    faces = [(outlines(points, k, nodes), solution.body[nodes[:, 0]]) for k, nodes in outer]
    owned = {n: [p[owner == n] for p, owner in faces] for n in range(len(solution.bodies))}
    for number, surface in rigid.items():  # seen from both sides
        sides = (surface.points + ways[number])[surface.faces]
        owned[number] = [np.concatenate([sides, sides[:, ::-1]])]
    corners = {n: np.concatenate([p.reshape(-1, 3) for p in own]) for n, own in owned.items()}
    place = fit(np.concatenate(list(corners.values())) @ screen.T, frame)
    for number in sorted(owned, key=lambda n: float((corners[n] @ eye).mean())):
        body = solution.bodies[number]
        for _, polygons in far_to_near(owned[number], eye):
            light = float(normals(polygons[:1])[0] @ np.array([0.25, -0.45, 0.85]))
            drawing.polygons(
                place(polygons @ screen.T),
                fill=mixed(tint(body), INK, 0.16 * (1 - max(light, 0.0))),
                stroke=mixed(edge_color(body), PAPER, 0.15),
                stroke_width=0.5,
            )
        if body.role != "master":
            _macro_outlines(drawing, solution, points, lambda x: place(x @ screen.T))
        own = place(corners[number] @ screen.T)
        at, y = float(own[:, 0].max()) + 24, float(own[:, 1].mean()) - 8
        draw_name(drawing, solution, number, at, y)
    seen = np.zeros(len(points), dtype=bool)
    for kind, nodes in outer:
        seen[nodes[normals(outlines(points, kind, nodes)) @ eye > 1e-6].ravel()] = True
    draw_symbols(drawing, solution, View(points, lambda x: place(x @ screen.T), seen), outer)
    size = np.ptp(solution.mesh.points[solution.deformable], axis=0)
    draw_axes(drawing, screen, size, solution.case.units.get("length"))


def far_to_near(groups: list[np.ndarray], eye: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Faces (n, corners, 3) turned to the eye, in runs of one direction with their group's number.

    Far ones come first.
    """
    runs = []
    for number, polygons in enumerate(groups):
        seen = polygons[normals(polygons) @ eye > 1e-6] if len(polygons) else polygons
        directions = np.round(normals(seen), 1) if len(seen) else np.empty((0, 3))
        for direction in np.unique(directions, axis=0):
            run = seen[(directions == direction).all(axis=1)]
            runs.append((float((run.mean(axis=1) @ eye).mean()), number, run))
    return [(number, run) for _, number, run in sorted(runs, key=lambda entry: entry[0])]


def _macro_outlines(
    drawing: Drawing, solution: Solution, points: np.ndarray, place: Placement
) -> None:
    for zone in solution.zones:
        edges = macro_edges(zone.faces)[:, :2]
        drawing.polygons(place(points[edges]), closed=False, stroke=BLUE, stroke_width=1.3)


def _plan(
    drawing: Drawing,
    solution: Solution,
    zone: ZoneResult,
    left: float,
    label: str,
    values: np.ndarray,
    limits: tuple[float, float],
    colors: Sequence[str],
) -> None:
    """Sub-faces coloured by a value (m,), macro-elements and master in outline."""
    axes, names = plan_axes(zone)
    flat = solution.mesh.points @ axes.T
    used = np.concatenate([nodes.ravel() for _, nodes, _ in zone.faces])
    box = pressed_box(flat, [zone], flat[used])
    place = fit(box, (left, 40, 200, HEIGHT - 120))
    (x0, y1), (x1, y0) = place(box)
    share = np.clip((values - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0)
    level = np.rint(share * LEVELS).astype(int)
    with drawing.clipped(x0, y0, x1 - x0, y1 - y0):
        for kind, nodes, owner in zone.faces:
            ring = outlines(flat, kind, nodes)
            seen = ((ring.max(axis=1) > box[0]) & (ring.min(axis=1) < box[1])).all(axis=1)
            for value in np.unique(level[owner[seen]]):
                drawing.polygons(
                    place(ring[seen & (level[owner] == value)]),
                    fill=shade(value / LEVELS, colors),
                    stroke=PAPER,
                    stroke_width=0.4,
                )
        edges = place(flat[macro_edges(zone.faces)[:, :2]])
        drawing.polygons(edges, closed=False, stroke=PAPER, stroke_width=1.6)
        for kind, nodes in zone.master_faces:
            ring = outlines(flat, kind, nodes)
            seen = ((ring.max(axis=1) > box[0]) & (ring.min(axis=1) < box[1])).all(axis=1)
            drawing.polygons(place(ring[seen]), stroke=MASTER, stroke_width=0.8)
    drawing.text(x0, y0 - 10, label)
    unit = solution.case.units.get("length")
    _ends(
        drawing, np.array([x0, y0]), np.array([x1, y1]), box, (with_unit(names[0], unit), names[1])
    )
    _color_bar(drawing, limits, colors, (x1 + 10, y0, 10, y1 - y0))


def _ends(
    drawing: Drawing, low: np.ndarray, high: np.ndarray, flat: np.ndarray, names: tuple[str, str]
) -> None:
    """The axes of the plan: two directions, with the coordinates at their ends."""
    first, last = flat.min(axis=0), flat.max(axis=0)
    first = np.where(np.abs(first) < 1e-9 * (last - first), 0.0, first)
    drawing.text(low[0], high[1] + 15, f"{first[0]:.4g}", color=MUTED)
    drawing.text((low[0] + high[0]) / 2, high[1] + 15, names[0], "middle", color=MUTED)
    drawing.text(high[0], high[1] + 15, f"{last[0]:.4g}", "end", color=MUTED)
    drawing.text(low[0] - 7, high[1], f"{first[1]:.4g}", "end", color=MUTED)
    drawing.text(low[0] - 7, (low[1] + high[1]) / 2, names[1], "end", color=MUTED)
    drawing.text(low[0] - 7, low[1] + 9, f"{last[1]:.4g}", "end", color=MUTED)


def shade(share: float, colors: Sequence[str] = PRESSURE) -> str:
    """The colour between the first and the last, `share` of the way."""
    position = share * (len(colors) - 1)
    k = min(int(position), len(colors) - 2)
    return mixed(colors[k], colors[k + 1], position - k)


def _color_bar(
    drawing: Drawing, limits: tuple[float, float], colors: Sequence[str], frame: Frame
) -> None:
    x, y, width, height = frame
    step = height / LEVELS
    for k in range(LEVELS):
        fill = shade((LEVELS - k - 0.5) / LEVELS, colors)
        drawing.rectangle(x, y + k * step, width, step + 0.3, fill=fill)
    drawing.text(x + width + 4, y + 9, f"{limits[1]:.3g}")
    drawing.text(x + width + 4, y + height, f"{limits[0]:.3g}")


def _legend(drawing: Drawing, zone: ZoneResult, corner: tuple[float, float]) -> None:
    x, y = corner
    sub_faces = sum(len(nodes) for _, nodes, _ in zone.faces)
    master = sum(len(nodes) for _, nodes in zone.master_faces)
    kinds = ", ".join(sorted({cell_type(kind).name for kind, _, _ in zone.faces}))
    drawing.rectangle(x, y - 8, 14, 9, fill=PRESSURE[4], stroke=PAPER, stroke_width=1.8)
    slave = f"{len(zone.centre)} macro-elements in {sub_faces} sub-faces ({kinds})"
    drawing.text(x + 20, y, slave)
    drawing.rectangle(x, y + 7, 14, 9, stroke=MASTER, stroke_width=1)
    drawing.text(x + 20, y + 16, f"{master} master faces")
