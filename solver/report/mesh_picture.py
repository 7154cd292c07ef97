"""The picture of a mesh file: its groups of cells and of faces by colour."""

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
    """The mesh, its groups in colour, with a legend; in 3D what the eye sees.

    Groups of cells are pale, the last one on top where they share cells.
    """
    drawing, points, dim = Drawing(WIDTH, HEIGHT, title), three(mesh.points), mesh.points.shape[1]
    bodies = _groups(mesh, dim)
    groups = bodies | _groups(mesh, dim - 1)
    screen = FLAT if mesh.points.shape[1] == 2 else axonometry(np.eye(3)[2])
    view = View.of(drawing, screen, points @ screen.T, _FRAME)
    colors = dict(zip(groups, cycle(_COLORS), strict=False))
    pale = [0.8 if name in bodies else 0.4 for name in groups]
    shades = [
        mixed(c, PAPER, p) for c, p in zip((MUTED, *colors.values()), (0.85, *pale), strict=True)
    ]
    parts = {0: mesh.cells if not bodies else []}
    parts |= dict(enumerate(bodies.values(), 1))
    taken = [face for name, own in groups.items() if name not in bodies for face in own]
    rings = [
        (outlines(points, kind, _without(kind, nodes, taken)), n)
        for n, own in parts.items()
        for kind, nodes in outside(meshio.Mesh(mesh.points, list(own)))
    ]
    faces = [
        (outlines(points, k, f), n)
        for n, own in enumerate(groups.values(), 1)
        for k, f in own
        if n > len(bodies)
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


def _without(kind: str, nodes: np.ndarray, taken: list[tuple[str, np.ndarray]]) -> np.ndarray:
    """Faces of a type (n, n_nodes) without those that are in a group: they have its colour."""

    def keys(faces: np.ndarray) -> np.ndarray:
        whole = np.ascontiguousarray(np.sort(faces, axis=1))
        return whole.view([("", whole.dtype)] * whole.shape[1]).ravel()

    others = [faces for other, faces in taken if BY_MESHIO[other].name == kind]
    return nodes[~np.isin(keys(nodes), keys(np.concatenate(others)))] if others else nodes


def _groups(mesh: meshio.Mesh, dim: int) -> dict[str, list[tuple[str, np.ndarray]]]:
    """Cells of a dimension in each group that has some, by type."""
    found: dict[str, list[tuple[str, np.ndarray]]] = {}
    for name, parts in mesh.cell_sets.items():
        for block, part in zip(mesh.cells, parts, strict=True):
            if BY_MESHIO[block.type].dim == dim and len(part):
                nodes = block.data[np.asarray(part, dtype=int)]
                found.setdefault(name, []).append((block.type, nodes))
    return found
