"""The picture of a mesh file: its outer faces or plane cells, and its groups of faces by colour."""

from itertools import cycle
from typing import TypeAlias

import meshio
import numpy as np
from markupsafe import Markup

from ..mechanics.fem.faces import outer_faces
from ..mesh.catalogue import BY_MESHIO
from .charts import MUTED, PAPER
from .geometry import outlines, plane_cells
from .layout import fit
from .space import axonometry, far_to_near
from .svg import Drawing, mixed

WIDTH, HEIGHT = 760, 420
_LEGEND = 220
_FRAME = (10.0, 10.0, WIDTH - _LEGEND - 30.0, HEIGHT - 20.0)
_PALE = mixed(MUTED, PAPER, 0.85)
_COLORS = ("#2a78d6", "#eb6834", "#1a936f", "#8a4fbf", "#c2a000", "#c23b6b", "#4a9fb5", "#7a6a53")
# A colour, and outlines of faces by type.
_Groups: TypeAlias = list[tuple[str, list[np.ndarray]]]


def draw_mesh(mesh: meshio.Mesh, title: str) -> Markup:
    """The mesh, its groups of faces in colour, with a legend; in 3D what the eye sees."""
    drawing = Drawing(WIDTH, HEIGHT, title)
    groups = _face_groups(mesh)
    colors = dict(zip(groups, cycle(_COLORS), strict=False))
    draw = _draw_plane if mesh.points.shape[1] == 2 else _draw_space
    draw(drawing, mesh, [(colors[name], faces) for name, faces in groups.items()])
    for row, (name, color) in enumerate(colors.items()):
        y = 24.0 + 18 * row
        drawing.rectangle(WIDTH - _LEGEND, y - 9, 10, 10, fill=color)
        drawing.text(WIDTH - _LEGEND + 16, y, name)
    return drawing.svg()


def _draw_plane(drawing: Drawing, mesh: meshio.Mesh, groups: _Groups) -> None:
    place = fit(mesh.points, _FRAME)
    for polygons, _ in plane_cells(mesh.points, mesh):
        drawing.polygons(place(polygons), fill=_PALE, stroke=MUTED, stroke_width=0.5)
    for color, faces in groups:
        for lines in faces:
            drawing.polygons(place(lines), closed=False, stroke=color, stroke_width=2.5)


def _draw_space(drawing: Drawing, mesh: meshio.Mesh, groups: _Groups) -> None:
    screen, eye = axonometry(np.array([0.0, 0.0, 1.0]))
    place = fit(mesh.points @ screen.T, _FRAME)
    outer = [outlines(mesh.points, kind, nodes) for kind, nodes in outer_faces(mesh)]
    parts = [(MUTED, _PALE, faces) for faces in outer]
    parts += [(color, mixed(color, PAPER, 0.4), f) for color, faces in groups for f in faces]
    for number, run in far_to_near([faces for *_, faces in parts], eye):
        stroke, fill, _ = parts[number]
        drawing.polygons(place(run @ screen.T), fill=fill, stroke=stroke, stroke_width=0.8)


def _face_groups(mesh: meshio.Mesh) -> dict[str, list[np.ndarray]]:
    """Outlines of the faces of each group that has some, by type."""
    dim = mesh.points.shape[1] - 1
    found: dict[str, list[np.ndarray]] = {}
    for name, parts in mesh.cell_sets.items():
        for block, part in zip(mesh.cells, parts, strict=True):
            if BY_MESHIO[block.type].dim == dim and len(part):
                nodes = block.data[np.asarray(part, dtype=int)]
                found.setdefault(name, []).append(outlines(mesh.points, block.type, nodes))
    return found
