"""The picture of a solve: bodies, loads and supports on the left, what is pressed on the right.

In 2D the contact is enlarged where it is small; in 3D pressure and deviation are seen in plan.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from markupsafe import Markup

from ..mesh.catalogue import cell_type
from ..simulation.solution import Solution, ZoneResult
from ..verification.units import with_unit
from .charts import MUTED, PAPER
from .geometry import macro_edges, normals, outlines
from .layout import mean_normal, plan_axes, pressed_box
from .parts import DrawnPart, parts, three
from .profile import expected
from .svg import Drawing, mixed
from .symbols import Symbols, body_label, draw_axes
from .view import FLAT, View, axonometry, draw_labels, lit

# Width and height by the dimension of the bodies; bodies drawn apart by a share of the model.
SIZES = {2: (760, 360), 3: (1040, 400)}
_APART = {2: 0.03, 3: 0.3}
# Frames of the bodies, of bodies with the contact beside them, of the contact; in 3D of its plans.
_ALONE, _BESIDE, _CONTACT = (48, 48, 380, 248), (48, 48, 190, 248), (410, 10, 340, 340)
_SPACE, _PLANS = (28, 40, 210, 300), ((460, 40, 200, 280), (745, 40, 200, 280))
# Where the contact is more than this share of the model, it is not enlarged.
_LARGE = 0.5
# From no pressure to the largest, light to dark: distinguished by lightness alone.
PRESSURE = ("#f3f6fa", "#cfe1ee", "#9cc3dc", "#5f9dc6", "#2f75a8", "#174f7c")
# From too little to too much.
DEVIATION = ("#b35806", "#f1a340", "#fee0b6", "#f7f7f7", "#d8daeb", "#998ec3", "#542788")
MASTER = "#ffa45c"  # readable on every pressure
LEVELS = 32
MOST_FACES = 100_000
# Deviations of this size or less are round-off, and stay pale.
_ROUND_OFF = 1e-12
# Hatches of rigid lines, and their distance, in pixels; on one line there are this many at most.
_HATCH, _PITCH, _HATCHES = 6.0, 8.0, 200


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
    used = np.concatenate([p.points[p.used, :2] for p in drawn if p.out is None])
    box = pressed_box(solution.mesh.points, solution.zones, used)
    if np.ptp(box, axis=0).max() >= _LARGE * solution.length:
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
    frame: tuple[float, ...],
    end: float,
) -> View:
    """All bodies apart, with loads, supports, axes, and labels from the bodies to x = `end`."""
    dim, length = solution.mesh.points.shape[1], solution.case.units.get("length")
    share = _APART[dim] * solution.length
    screen = FLAT if dim == 2 else axonometry(mean_normal(solution))
    flat = [(p.points[p.used] + share * p.way) @ screen.T for p in drawn]
    axis = _axis(solution)
    view = View.of(drawing, screen, np.concatenate([*flat, axis[:, :2]]), frame)
    _draw_parts(view, drawn, share)
    if len(axis):
        view.lines(axis[None], MUTED, 0.8, stroke_dasharray=(9.0, 3.0, 2.0, 3.0))
    ways = {part.body: part.way for part in drawn}
    points = three(solution.mesh.points)
    points += share * np.stack([ways[number] for number in range(len(ways))])[solution.body]
    labels = Symbols(solution, view, points, _seen(drawn, points, view.eye)).draw()
    for part, places in zip(drawn, flat, strict=True):
        if part.zone is None:
            middle = view.at((places.min(axis=0) + places.max(axis=0)) / 2)
            centres = [part.points[nodes].mean(axis=1) for _, nodes, _ in part.faces]
            at = view(np.concatenate(centres) + share * part.way)
            nearest = np.linalg.norm(at - middle, axis=1).argmin()
            labels.append(body_label(solution, part.body, at[nearest]))
    left = float(view.at(np.concatenate(flat))[:, 0].max()) + 44
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


def _seen(drawn: Sequence[DrawnPart], points: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Which points (n,) as drawn are on faces that are turned to the eye."""
    seen = np.zeros(len(points), dtype=bool)
    for part in drawn:
        for kind, nodes, _ in part.faces if part.out is None and not part.zone else ():
            towards = np.abs if eye[2] == 1 else np.positive
            seen[nodes[towards(normals(outlines(points, kind, nodes)) @ eye) > 1e-6].ravel()] = True
    return seen


def _draw_parts(
    view: View, drawn: Sequence[DrawnPart], share: float, box: np.ndarray | None = None
) -> None:
    """Parts moved apart, far ones first, slave faces after their body; only what is in a box."""
    near = {p.body: (p.points[p.used] @ view.eye).mean() for p in drawn if not p.zone}
    for part in sorted(drawn, key=lambda part: (near[part.body], part.zone is not None)):
        points = part.points + share * part.way
        if part.zone:
            turned = three(part.zone.normal) @ view.eye > -1e-6
            faces = [(kind, nodes, owner) for kind, nodes, owner in part.faces]
            faces = [(kind, f[turned[owner]], owner[turned[owner]]) for kind, f, owner in faces]
            edges = macro_edges(faces) if view.solid else np.concatenate([f for _, f, _ in faces])
            view.lines(points[edges[:, :2]], part.color, 1.3 if view.solid else 1.6)
        elif part.out is not None and not view.solid:
            _draw_hatched(view, part, points, box)
        else:
            rings = [outlines(points, kind, nodes) for kind, nodes, _ in part.faces]
            rings = [ring[view.inside(ring, box)] for ring in rings]
            edge = mixed(part.color, PAPER, 0.25) if part.out is None else part.fill
            groups = [(ring, np.zeros(len(ring), dtype=int)) for ring in rings]
            both = part.out is not None or not view.solid
            view.faces(groups, partial(_lit, part.fill), edge, both)


def _lit(color: str, _: int, light: float) -> str:
    return lit(color, light)


def _draw_hatched(view: View, part: DrawnPart, points: np.ndarray, box: np.ndarray | None) -> None:
    """A rigid line, hatched on the side of the body."""
    assert part.out is not None
    nodes = np.concatenate([nodes[:, :2] for _, nodes, _ in part.faces])
    nodes = nodes[view.inside(points[nodes], box)]
    view.lines(points[nodes], part.color, 2)
    first, last = (view(points[end])[:, None] for end in nodes.T)
    length = np.linalg.norm(last - first, axis=2).max(initial=0.0)
    shares = np.linspace(0, 1, int(np.clip(length / _PITCH, 1, _HATCHES)), endpoint=False)
    along = first + shares[:, None] * (last - first)
    out = part.out[nodes].mean(axis=1)
    into = _HATCH * np.stack([-out[:, 0] - out[:, 1], out[:, 1] - out[:, 0]], axis=1)
    hatches = np.stack([along, along + into[:, None]], axis=2).reshape(-1, 2, 2)
    view.drawing.polygons(hatches, closed=False, stroke=part.color, stroke_width=0.8)


def _draw_plans(drawing: Drawing, solution: Solution, zone: ZoneResult) -> None:
    """A zone seen along its normal: its pressure, and its deviation from the reference."""
    largest, unit = max(float(zone.multiplier.max()), 1e-300), solution.case.units.get("stress")
    label = with_unit(f"p on {zone.name}", unit)
    _draw_plan(solution, zone, drawing, 0, label, zone.multiplier, (0.0, largest), PRESSURE)
    means = expected(solution, zone)
    if means is not None:
        off = (zone.multiplier - means) / (np.abs(means).max() or 1.0)
        most = max(float(np.abs(off).max()), _ROUND_OFF)
        _draw_plan(solution, zone, drawing, 1, "Δp / max p", off, (-most, most), DEVIATION)
    sub_faces = sum(len(nodes) for _, nodes, _ in zone.faces)
    kinds = ", ".join(sorted({cell_type(kind).name for kind, _, _ in zone.faces}))
    words = f"{len(zone.centre)} macro-elements (white) in {sub_faces} sub-faces ({kinds}), "
    words += f"{sum(len(f) for _, f in zone.master_faces)} master faces (orange)"
    drawing.text(_PLANS[0][0], drawing.height - 24, words)


def _draw_plan(
    solution: Solution,
    zone: ZoneResult,
    drawing: Drawing,
    number: int,
    label: str,
    values: np.ndarray,
    limits: tuple[float, float],
    colors: Sequence[str],
) -> None:
    """Sub-faces coloured by a value (m,), macro-elements and master in outline."""
    points, (screen, names) = solution.mesh.points, plan_axes(zone)
    used = np.concatenate([nodes.ravel() for _, nodes, _ in zone.faces])
    flat = points @ screen.T
    box = pressed_box(flat, [zone], flat[used])
    view = View.of(drawing, screen, box, _PLANS[number])
    share = np.clip((values - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0)
    level = np.rint(share * LEVELS).astype(int)
    groups = [(outlines(points, kind, nodes), level[owner]) for kind, nodes, owner in zone.faces]
    groups = [(r[seen], n[seen]) for r, n in groups for seen in [view.inside(r, box)]]
    x, y, width, height = view.rectangle(box)
    with drawing.clipped(x, y, width, height):
        view.faces(groups, lambda n, _: shade(n / LEVELS, colors), PAPER, both=True)
        view.lines(points[macro_edges(zone.faces)[:, :2]], PAPER, 1.6)
        for kind, nodes in zone.master_faces:
            ring = outlines(points, kind, nodes)
            drawing.polygons(view(ring[view.inside(ring, box)]), stroke=MASTER, stroke_width=0.8)
    drawing.text(x, y - 10, label)
    length, below, text = solution.case.units.get("length"), y + height + 15, drawing.text
    box = np.where(np.abs(box) < 1e-9 * np.ptp(box, axis=0), 0.0, box)
    text(x, below, f"{box[0, 0]:.4g}", color=MUTED)
    text(x + width / 2, below, with_unit(names[0], length), "middle", color=MUTED)
    text(x + width, below, f"{box[1, 0]:.4g}", "end", color=MUTED)
    if number == 0:  # the other has the same axes
        text(x - 7, y + height, f"{box[0, 1]:.4g}", "end", color=MUTED)
        text(x - 7, y + height / 2, names[1], "end", color=MUTED)
        text(x - 7, y + 9, f"{box[1, 1]:.4g}", "end", color=MUTED)
    step = height / LEVELS
    for k in range(LEVELS):
        fill = shade((LEVELS - k - 0.5) / LEVELS, colors)
        drawing.rectangle(x + width + 10, y + k * step, 10, step + 0.3, fill=fill)
    text(x + width + 24, y + 9, f"{limits[1]:.3g}")
    text(x + width + 24, y + height, f"{limits[0]:.3g}")


def shade(share: float, colors: Sequence[str] = PRESSURE) -> str:
    """The colour between the first and the last, `share` of the way."""
    position = share * (len(colors) - 1)
    k = min(int(position), len(colors) - 2)
    return mixed(colors[k], colors[k + 1], position - k)
