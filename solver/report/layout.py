"""What all pictures share: colours, where bodies go apart, outlines, normals, and SVG text.

SVG: integer tenths of a pixel, many polygons in one path, all text escaped. For pictures of meshes
alone: a thousand faces cost some milliseconds and kilobytes.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from markupsafe import Markup, escape

from ..lac.cells.catalogue import cell_type
from ..simulation.results.solution import BodyInfo, Solution, ZoneResult
from .charts import BLUE, INK, MUTED, ORANGE, PAPER

Style = str | float | tuple[float, ...]


class Drawing:
    """An SVG under construction. Lengths and positions are pixels, y downward."""

    def __init__(self, width: float, height: float, title: str):
        self.width, self.height, self.title = width, height, title
        self._parts: list[str] = []

    def polygons(self, points: np.ndarray, closed: bool = True, **style: Style) -> None:
        """Add polygons or lines of equally many points, (n, points, 2), as one path."""
        if not len(points):
            return
        pattern = "M%d %dl" + " ".join(["%d %d"] * (points.shape[1] - 1)) + ("Z" if closed else "")
        whole = np.rint(points * 10).astype(int)
        whole[:, 1:] -= whole[:, :-1].copy()  # steps have fewer digits than places
        data = pattern * len(points) % tuple(whole.ravel().tolist())
        self._parts.append(f'<path d="{data}"{_attributes(style)}/>')

    def rectangle(self, x: float, y: float, width: float, height: float, **style: Style) -> None:
        """Add an upright rectangle, (x, y) its upper left corner."""
        corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
        self.polygons(np.array([corners]), True, **style)

    @contextmanager
    def clipped(self, x: float, y: float, width: float, height: float) -> Iterator[None]:
        """Clip all that is added meanwhile to this rectangle."""
        box = f'x="{x * 10:g}" y="{y * 10:g}" width="{width * 10:g}" height="{height * 10:g}"'
        seen = " ".join(f"{10 * length:g}" for length in (x, y, width, height))
        self._parts.append(f'<svg {box} viewBox="{seen}">')
        yield
        self._parts.append("</svg>")

    def text(
        self,
        x: float,
        y: float,
        content: object,
        anchor: str = "start",
        size: float = 11,
        color: str = INK,
        weight: str = "",
    ) -> None:
        """Add one line of text with its baseline at y; `anchor` start, middle or end."""
        bold = f' font-weight="{weight}"' if weight else ""
        self._parts.append(
            f'<text x="{x * 10:.0f}" y="{y * 10:.0f}" font-size="{size * 10:g}" fill="{color}"'
            f' text-anchor="{anchor}"{bold}>{escape(content)}</text>'
        )

    def svg(self) -> Markup:
        """The drawing as one SVG element that stands alone and fits into a page."""
        w, h = self.width, self.height
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w * 10:g} {h * 10:g}" '
            f'width="{w:g}" height="{h:g}" role="img" font-family="system-ui, sans-serif" '
            f'stroke-linejoin="round" style="background:{PAPER}">'
            f"<title>{escape(self.title)}</title>"
        )
        return Markup(head + "".join(self._parts) + "</svg>")


def _attributes(style: dict[str, Style]) -> str:
    """Attributes from keyword arguments; strokes in pixels, no fill unless asked for."""
    style = {"fill": "none"} | style
    for key in ("stroke_width", "stroke_dasharray"):
        if key in style:
            style[key] = " ".join(f"{10 * length:g}" for length in np.atleast_1d(style[key]))
    return "".join(f' {key.replace("_", "-")}="{escape(value)}"' for key, value in style.items())


def mixed(color: str, other: str, share: float) -> str:
    """The colour between two, `share` of the way to the other."""
    a, b = (np.array([int(c[i : i + 2], 16) for i in (1, 3, 5)]) for c in (color, other))
    return "#" + "".join(f"{round(v):02x}" for v in (1 - share) * a + share * b)


# From no pressure to the largest, light to dark: distinguished by lightness alone.
PRESSURE = ("#f3f6fa", "#cfe1ee", "#9cc3dc", "#5f9dc6", "#2f75a8", "#174f7c")
# From too little to too much.
DEVIATION = ("#b35806", "#f1a340", "#fee0b6", "#f7f7f7", "#d8daeb", "#998ec3", "#542788")
# Errors without a sign, from none to the largest.
ERROR = ("#fff7ec", "#fdd49e", "#fc8d59", "#d7301f", "#7f0000")
RELATIVE = "Δp / max p"
STATUS = "status: 0 open, 1 stick, 2 slip"
OF_STATUS = {"open": PRESSURE[0], "stick": PRESSURE[4], "slip": DEVIATION[1]}
# Errors of this size or less are round-off, and stay pale; values of the other sign below this
# share of the largest are.
_ROUND_OFF, _NO_SIGN = 1e-12, 1e-9
# A picture of the contact shows this share of its extent around it.
_AROUND = 0.15


def edge_color(body: BodyInfo) -> str:
    """Blue for the slave, orange for the master."""
    return {"slave": BLUE, "master": ORANGE}.get(body.role, MUTED)


def tint(body: BodyInfo) -> str:
    """The light colour a body is filled with."""
    return mixed(edge_color(body), PAPER, 0.8)


def color_map(title: str, values: np.ndarray) -> tuple[tuple[float, float], Sequence[str]]:
    """Limits and colours of a map: the same on both sides of zero where values have two signs."""
    if title == STATUS:
        return (0.0, 2.0), tuple(OF_STATUS.values())
    low, high = float(values.min()), float(values.max())
    most = max(abs(low), abs(high), _ROUND_OFF if "Δ" in title else 0.0) or 1.0
    if min(-low, high) > _NO_SIGN * most or title == RELATIVE:
        return (-most, most), DEVIATION
    colors = ERROR if "Δ" in title else PRESSURE
    # Of compression alone, dark is the largest.
    return ((-most, 0.0), colors[::-1]) if high <= 0 and low < 0 else ((0.0, most), colors)


def shade(share: float, colors: Sequence[str] = PRESSURE) -> str:
    """The colour between the first and the last, `share` of the way."""
    position = share * (len(colors) - 1)
    k = min(int(position), len(colors) - 2)
    return mixed(colors[k], colors[k + 1], position - k)


def mean_normal(solution: Solution) -> np.ndarray:
    """The outward normal of the first zone's slave where it is pressed, (dim,); else upward."""
    upward = np.eye(solution.mesh.points.shape[1])[-1]
    return _mean(solution.zones[0], upward) if solution.zones else upward


def _mean(zone: ZoneResult, upward: np.ndarray) -> np.ndarray:
    """The mean normal (dim,) of a slave, weighed by the pressure where there is one."""
    force = zone.area * np.maximum(zone.multiplier, 0.0)
    mean = (force if force.any() else zone.area) @ zone.normal
    length = float(np.linalg.norm(mean))
    whole = float(force.sum() if force.any() else zone.area.sum())
    return mean / length if length > 1e-6 * whole else upward


def ways_apart(solution: Solution) -> np.ndarray:
    """Displacement of each body in the exploded view, (bodies, dim): a master away from its slave.

    A body that is master and slave takes its own masters along.
    """
    dim, names = solution.mesh.points.shape[1], [body.name for body in solution.bodies]
    found, moved = np.zeros((len(names), dim)), set[int]()
    for zone, given in zip(solution.zones, solution.case.zones, strict=True):
        slaves = np.unique(solution.fields.body[zone.surfaces.slave_nodes]).tolist()
        masters = np.unique(solution.fields.body[zone.surfaces.master_nodes]).tolist()
        if given.master in solution.case.rigid and given.master in names:
            masters = [names.index(given.master)]
        for body in {*masters} - {*slaves} - moved:
            found[body] = found[slaves[0]] + _mean(zone, np.eye(dim)[-1])
            moved.add(body)
    return found


def pressed_box(points: np.ndarray, zones: Sequence[ZoneResult], within: np.ndarray) -> np.ndarray:
    """Corners (2, 2) of a square around what is pressed in zones of points (n, 2).

    Cut to the extent of the points `within` (k, 2), which is all where nothing is pressed.
    """
    pressed = [
        points[nodes[zone.multiplier[owner] > 0]].reshape(-1, 2)
        for zone in zones
        for _, nodes, owner in zone.faces
    ]
    found = np.concatenate([np.empty((0, 2)), *pressed])
    found = found if len(found) else within
    middle = (found.min(axis=0) + found.max(axis=0)) / 2
    half = (0.5 + _AROUND) * np.ptp(found, axis=0).max()
    return np.clip([middle - half, middle + half], within.min(axis=0), within.max(axis=0))


def tangent(zone: ZoneResult) -> np.ndarray:
    """The direction along the interface, (2,): to the right, or upward."""
    normal = zone.normal.mean(axis=0)
    along = np.array([normal[1], -normal[0]])
    if not along.any():  # a closed surface: its mean normal is zero
        return np.array([1.0, 0.0])
    along /= np.linalg.norm(along)
    return along if tuple(np.round(along, 9)) > (0.0, 0.0) else -along


def extents(zone: ZoneResult, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last position of every macro-element, (m,) each."""
    start, end = np.full(len(zone.centre), np.inf), np.full(len(zone.centre), -np.inf)
    for _, nodes, owner in zone.faces:
        np.minimum.at(start, owner, position[nodes].min(axis=1))
        np.maximum.at(end, owner, position[nodes].max(axis=1))
    return start, end


def outlines(points: np.ndarray, kind: str, connectivity: np.ndarray) -> np.ndarray:
    """Polygons (n, corners, dim) around faces of one type; mid-nodes only where an edge bends."""
    face = cell_type(kind)
    ring = points[connectivity[:, face.boundary]]
    if face.order == 1 or face.dim == 1:
        return ring
    corners = ring[:, ::2]
    bend = ring[:, 1::2] - (corners + np.roll(corners, -1, axis=1)) / 2
    return ring if np.abs(bend).max(initial=0.0) > 1e-6 * np.ptp(points) else corners


def macro_edges(faces: Iterable[tuple[str, np.ndarray, np.ndarray]]) -> np.ndarray:
    """The edges around macro-elements, given their sub-faces (type, nodes, number).

    Returns (n, 3): both ends and the midside node. Without a midside node, one end is repeated.
    """
    edges = []
    for kind, nodes, owner in faces:
        n, order = cell_type(kind).n_vertices, cell_type(kind).order
        corners = nodes[:, :n]
        pairs = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
        pairs.sort()
        middle = nodes[:, n : 2 * n].ravel() if order == 2 else pairs[:, 0]
        edges.append(np.column_stack([pairs, middle, np.repeat(owner, n)]))
    unique, counts = np.unique(np.concatenate(edges), axis=0, return_counts=True)
    return np.unique(unique[counts == 1, :3], axis=0)


def normals(polygons: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3) of nearly plane polygons (n, corners, 3)."""
    turned = np.cross(polygons, np.roll(polygons, -1, axis=1)).sum(axis=1)
    return turned / np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-300)
