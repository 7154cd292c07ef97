"""The picture of a solve: bodies, loads and supports on the left, what is pressed on the right.

In 2D the contact is enlarged where it is small; in 3D pressure and deviation are seen in plan.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from markupsafe import Markup

from ..lac.cells.catalogue import cell_type
from ..lac.cells.faces import outer_faces
from ..mechanics.fem.faces import volume_cells
from ..simulation.results.solution import Solution, ZoneResult
from ..verification.units import with_unit
from .charts import MUTED, PAPER
from .layout import (
    OF_STATUS,
    PRESSURE,
    RELATIVE,
    STATUS,
    Drawing,
    color_map,
    macro_edges,
    mean_normal,
    mixed,
    normals,
    outlines,
    pressed_box,
    shade,
)
from .parts import DrawnPart, parts, three, zone_fields
from .symbols import Symbols, body_label, draw_axes
from .unrolled import laid_flat
from .view import FLAT, Frame, View, axonometry, draw_labels, lit

# Width and height by the dimension of the bodies; bodies drawn apart by a share of the model.
SIZES = {2: (760, 360), 3: (1040, 400)}
_APART = {2: 0.03, 3: 0.3}
# Frames of the bodies, of bodies with the contact beside them, of the contact; in 3D of its plans.
_ALONE, _BESIDE, _CONTACT = (48, 48, 380, 248), (48, 48, 190, 248), (410, 10, 340, 340)
_SPACE, _PLANS = (28, 40, 210, 300), ((460, 40, 200, 280), (745, 40, 200, 280))
# Where the contact is more than this share of the model, it is not enlarged.
_LARGE = 0.5
MASTER = "#ffa45c"  # readable on every pressure
LEVELS = 32
MOST_FACES = 100_000
# The length of hatches behind rigid lines, in pixels.
_HATCH = 6.0


def draw_case(solution: Solution, title: str) -> Markup:
    """The picture of a solution; raises ValueError where there are too many faces to draw."""
    dim, drawn = solution.mesh.points.shape[1], list(parts(solution))
    number = sum(len(nodes) for part in drawn for _, nodes, _ in part.faces)
    if number > MOST_FACES:
        raise ValueError(f"{number} faces are too many to draw; {MOST_FACES} at most are allowed")
    drawing = Drawing(*SIZES[dim], title)
    if dim == 3:
        _whole(drawing, solution, drawn, _SPACE, 415)
        if solution.zones:
            _draw_plans(drawing, solution, solution.zones[0])
        return drawing.svg()
    used = np.concatenate([p.points[p.used, :2] for p in drawn if p.meshed])
    box = pressed_box(solution.mesh.points, solution.zones, used)
    if np.ptp(box, axis=0).max() >= _LARGE * solution.scalars.length:
        _whole(drawing, solution, drawn, _ALONE, drawing.width)
        return drawing.svg()
    whole = _whole(drawing, solution, drawn, _BESIDE, _CONTACT[0])
    view = View.of(drawing, FLAT, box, _CONTACT)
    with drawing.clipped(*view.rectangle(box)):
        _draw_parts(view, drawn, 0.0, box)
    for seen in (whole, view):
        drawing.rectangle(*seen.rectangle(box), stroke=MUTED, stroke_width=1)
    return drawing.svg()


def _whole(
    drawing: Drawing,
    solution: Solution,
    drawn: Sequence[DrawnPart],
    frame: Frame,
    end: float,
) -> View:
    """All bodies apart, with loads, supports, axes, and labels from the bodies to x = `end`."""
    dim, length = solution.mesh.points.shape[1], solution.case.about.units.get("length")
    share = _APART[dim] * solution.scalars.length
    screen = FLAT if dim == 2 else axonometry(mean_normal(solution))
    flat = [(p.points[p.used] + share * p.way) @ screen.T for p in drawn]
    axis = _axis(solution)
    view = View.of(drawing, screen, np.concatenate([*flat, axis[:, :2]]), frame)
    _draw_parts(view, drawn, share)
    if len(axis):
        view.lines(axis[None], MUTED, 0.8, stroke_dasharray=(9.0, 3.0, 2.0, 3.0))
    ways = {part.body: part.way for part in drawn}
    points = three(solution.mesh.points)
    points += share * np.stack([ways[number] for number in range(len(ways))])[solution.fields.body]
    faces = [face[:2] for part in drawn if part.meshed for face in part.faces]
    seen = _seen(faces, points, view) if dim == 3 else np.ones(len(points), dtype=bool)
    faces = faces if dim == 3 else list(outer_faces(volume_cells(solution.mesh).items()))
    labels = Symbols(solution, view, points, seen, faces).draw()
    for part, places in zip(drawn, flat, strict=True):
        if part.zone is None:
            middle = view.at((places.min(axis=0) + places.max(axis=0)) / 2)
            centres = [part.points[nodes].mean(axis=1) for _, nodes, _ in part.faces]
            at = view(np.concatenate(centres) + share * part.way)
            nearest = np.linalg.norm(at - middle, axis=1).argmin()
            labels.append(body_label(solution, part.body, at[nearest]))
    left = float(view.at(np.concatenate(flat))[:, 0].max()) + 40
    draw_labels(drawing, labels, (left, 12, end - left - 8, drawing.height - 24))
    draw_axes(view, np.ptp(solution.mesh.points[solution.deformable], axis=0), length)
    return view


def _axis(solution: Solution) -> np.ndarray:
    """The ends (2, 3) of the axis of symmetry beside the bodies; none (0, 3) where it is far."""
    points = solution.mesh.points[solution.deformable]
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    if not solution.case.axisymmetric or low[0] > 2 * size[0]:
        return np.empty((0, 3))
    return np.array([[0, low[1] - 0.05 * size[1], 0], [0, low[1] + 1.05 * size[1], 0]])


def _seen(faces: Sequence[tuple[str, np.ndarray]], points: np.ndarray, view: View) -> np.ndarray:
    """Which points (n,) as drawn are on faces that are turned to the eye."""
    seen = np.zeros(len(points), dtype=bool)
    for kind, nodes in faces:
        seen[nodes[normals(outlines(points, kind, nodes)) @ view.eye > 1e-6].ravel()] = True
    return seen


def _draw_parts(
    view: View, drawn: Sequence[DrawnPart], share: float, box: np.ndarray | None = None
) -> None:
    """Parts moved apart, far ones first, slave faces after their body; only what is in a box."""
    near = {p.body: (p.points[p.used] @ view.eye).mean() for p in drawn if not p.zone}
    for part in sorted(drawn, key=lambda part: (near[part.body], part.zone is not None)):
        points = part.points + share * part.way
        if part.zone:
            to = three(part.zone.normal) @ view.eye > -1e-6
            faces = [(kind, nodes[to[own]], own[to[own]]) for kind, nodes, own in part.faces]
            edges = macro_edges(faces) if view.solid else np.concatenate([f for _, f, _ in faces])
            view.lines(points[edges[:, :2]], part.color, 1.3 if view.solid else 1.6)
        elif part.out is not None and not view.solid:
            _draw_hatched(view, part, part.out, points, box)
        else:
            rings = [outlines(points, kind, nodes) for kind, nodes, _ in part.faces]
            rings = [ring[view.inside(ring, box)] for ring in rings]
            edge = mixed(part.color, PAPER, 0.25) if part.out is None else part.fill
            groups = [(ring, np.zeros(len(ring), dtype=int)) for ring in rings]
            both = part.out is not None or not view.solid
            view.faces(groups, partial(lit, part.fill), edge, both)


def _draw_hatched(
    view: View, part: DrawnPart, out: np.ndarray, points: np.ndarray, box: np.ndarray | None
) -> None:
    """A rigid line, and a wide dashed one behind it: hatches across."""
    nodes = np.concatenate([nodes[:, :2] for _, nodes, _ in part.faces])
    nodes = nodes[view.inside(points[nodes], box)]
    behind = points - _HATCH / 2 / view.scale * out
    view.lines(points[nodes], part.color, 2)
    view.lines(behind[nodes], part.color, _HATCH, stroke_dasharray=(0.8, 5.0))


def _draw_plans(drawing: Drawing, solution: Solution, zone: ZoneResult) -> None:
    """A zone laid flat: its pressure, and what sticks, or the deviation."""
    laid, screen = laid_flat(zone), np.eye(3)[:2]
    flat, fields = laid.plan(solution.mesh.points), zone_fields(solution, zone)
    used = np.unique(np.concatenate([f.ravel() for _, f, _ in zone.faces]))
    faces = [(k, f[w], o[w]) for k, f, o in zone.faces for w in [laid.whole(flat[f])]]
    masters = [(kind, f[laid.whole(flat[f])]) for kind, f in zone.surfaces.master_faces]
    sides = replace(zone.surfaces, master_faces=masters)
    zone = replace(zone, faces=faces, surfaces=sides)
    points, box = three(flat), pressed_box(flat, [zone], flat[used])
    names = (with_unit(laid.names[0], solution.case.about.units.get("length")), laid.names[1])
    pressure = next(iter(fields))
    second = next((name for name in (STATUS, RELATIVE) if name in fields), pressure)
    for frame, title in zip(_PLANS, dict.fromkeys((pressure, second)), strict=False):
        values = fields[title]
        view, (limits, colors) = View.of(drawing, screen, box, frame), color_map(title, values)
        x, y, width, height = view.rectangle(box)
        with drawing.clipped(x, y, width, height):
            share = np.clip((values - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0)
            _draw_sub_faces(view, points, zone, np.rint(share * LEVELS).astype(int), colors, box)
        drawing.text(x, y - 10, title)
        _draw_ends(drawing, (x, y, width, height), box, names if frame is _PLANS[0] else names[:1])
        _draw_legend(drawing, (x + width + 10, y, 10, height), title, limits, colors)
    sub_faces = sum(len(nodes) for _, nodes, _ in zone.faces)
    kinds = ", ".join(sorted({cell_type(kind).name for kind, _, _ in zone.faces}))
    words = f"{zone.name}: macro-elements {len(zone.centre)}, sub-faces {sub_faces} ({kinds}), "
    words += f"master faces {sum(len(f) for _, f in zone.surfaces.master_faces)} (orange)"
    drawing.text(_PLANS[0][0], drawing.height - 24, words)


def _draw_legend(
    drawing: Drawing,
    frame: Frame,
    title: str,
    limits: tuple[float, float],
    colors: Sequence[str],
) -> None:
    """The colours of a plan beside it: a scale with its ends, or the words of each status."""
    x, y, width, height = frame
    if title == STATUS:
        for k, (word, color) in enumerate(OF_STATUS.items()):
            drawing.rectangle(x, y + 20 * k, width, width, fill=color, stroke=MUTED)
            drawing.text(x + 14, y + 20 * k + 9, word)
        return
    for k in range(LEVELS):
        fill, step = shade((LEVELS - k - 0.5) / LEVELS, colors), height / LEVELS
        drawing.rectangle(x, y + k * step, width, step + 0.3, fill=fill)
    drawing.text(x + 14, y + 9, f"{limits[1]:.3g}")
    drawing.text(x + 14, y + height, f"{limits[0]:.3g}")


def _draw_sub_faces(
    view: View,
    points: np.ndarray,
    zone: ZoneResult,
    level: np.ndarray,
    colors: Sequence[str],
    box: np.ndarray,
) -> None:
    """Sub-faces coloured by the level (m,) of their macro-element; this and master in outline."""
    groups = [(outlines(points, kind, nodes), level[owner]) for kind, nodes, owner in zone.faces]
    groups = [(r[seen], n[seen]) for r, n in groups for seen in [view.inside(r, box)]]
    view.faces(groups, lambda n, _: shade(n / LEVELS, colors), PAPER, both=True)
    outline = PAPER if colors is PRESSURE else MUTED
    view.lines(points[macro_edges(zone.faces)[:, :2]], outline, 1.6)
    for kind, nodes in zone.surfaces.master_faces:
        ring = outlines(points, kind, nodes)
        ring = view(ring[view.inside(ring, box)])
        view.drawing.polygons(ring, stroke=MASTER, stroke_width=0.8)


def _draw_ends(drawing: Drawing, frame: Frame, box: np.ndarray, names: Sequence[str]) -> None:
    """The coordinates at the ends of a plan, to the right and, with a second name, upward."""
    x, y, width, height = frame
    box = np.where(np.abs(box) < 1e-9 * np.ptp(box, axis=0), 0.0, box)
    words = [f"{box[0, 0]:.4g}", names[0], f"{box[1, 0]:.4g}"]
    for k, anchor in enumerate(("start", "middle", "end")):
        drawing.text(x + k * width / 2, y + height + 15, words[k], anchor, color=MUTED)
        if len(names) > 1:
            upward = [f"{box[0, 1]:.4g}", names[1], f"{box[1, 1]:.4g}"][k]
            drawing.text(x - 7, y + height - k * (height - 9) / 2, upward, "end", color=MUTED)
