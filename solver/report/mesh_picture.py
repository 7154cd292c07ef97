"""The picture of a mesh file: its outer faces or plane cells, and its groups of faces by colour."""

from itertools import cycle

import meshio
import numpy as np
from markupsafe import Markup

from ..lac.cells.catalogue import BY_MESHIO
from .charts import MUTED, PAPER
from .layout import outlines
from .parts import outside, three
from .svg import Drawing, mixed
from .view import FLAT, View, axonometry, lit

WIDTH, HEIGHT = 760, 420
_LEGEND = 220
_FRAME = (10.0, 10.0, WIDTH - _LEGEND - 30.0, HEIGHT - 20.0)
_COLORS = ("#2a78d6", "#eb6834", "#1a936f", "#8a4fbf", "#c2a000", "#c23b6b", "#4a9fb5", "#7a6a53")


def draw_mesh(mesh: meshio.Mesh, title: str) -> Markup:
    """The mesh, its groups of faces in colour, with a legend; in 3D what the eye sees."""
    drawing, points, groups = Drawing(WIDTH, HEIGHT, title), three(mesh.points), _face_groups(mesh)
    screen = FLAT if mesh.points.shape[1] == 2 else axonometry(np.eye(3)[2])
    view = View.of(drawing, screen, points @ screen.T, _FRAME)
    colors = dict(zip(groups, cycle(_COLORS), strict=False))
    shades = [mixed(MUTED, PAPER, 0.85), *(mixed(color, PAPER, 0.4) for color in colors.values())]
    rings = [(outlines(points, kind, nodes), 0) for kind, nodes in outside(mesh)]
    faces = [
        (outlines(points, k, f), n) for n, own in enumerate(groups.values(), 1) for k, f in own
    ]
    solid = [(ring, np.full(len(ring), n)) for ring, n in [*rings, *faces] if ring.shape[1] > 2]
    view.faces(solid, lambda level, light: lit(shades[level], level, light), MUTED, not view.solid)
    for ring, n in faces:
        if ring.shape[1] == 2:
            view.lines(ring, list(colors.values())[n - 1], 2.5)
    pitch = min(18.0, (HEIGHT - 30) / max(1, len(colors)))
    for row, (name, color) in enumerate(colors.items()):
        y = 24.0 + pitch * row
        drawing.rectangle(WIDTH - _LEGEND, y - 9, 10, min(10.0, pitch), fill=color)
        drawing.text(WIDTH - _LEGEND + 16, y, name, size=min(11.0, pitch))
    return drawing.svg()


def _face_groups(mesh: meshio.Mesh) -> dict[str, list[tuple[str, np.ndarray]]]:
    """Faces of each group that has some, by type."""
    dim = mesh.points.shape[1] - 1
    found: dict[str, list[tuple[str, np.ndarray]]] = {}
    for name, parts in mesh.cell_sets.items():
        for block, part in zip(mesh.cells, parts, strict=True):
            if BY_MESHIO[block.type].dim == dim and len(part):
                nodes = block.data[np.asarray(part, dtype=int)]
                found.setdefault(name, []).append((block.type, nodes))
    return found
