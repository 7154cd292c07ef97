"""What a mesh file contains, for someone who writes a case: groups, sizes, gaps, a picture."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle

import meshio
import numpy as np
from markupsafe import Markup

from ..lac.cells.catalogue import BY_MESHIO
from ..lac.facets import facets
from ..lac.operator import meet_in_segments
from ..lac.partners import face_samples
from ..mechanics.fem.faces import FaceError, boundary_faces
from ..system.errors import InputError, hint
from .charts import MUTED, PAPER
from .layout import Drawing, mixed, outlines
from .parts import outside, three
from .view import FLAT, View, axonometry, lit


@dataclass(frozen=True, kw_only=True)
class Group:
    """A group of a mesh, or all its cells.

    `cells`: their number by type; `nodes`: how many there are; `low`, `high` (dim,): corners of the
    box around them; `size`: smallest, mean and largest length of the cells' edges between
    vertices, 0 for a group of nodes.
    """

    name: str
    cells: dict[str, int]
    nodes: int
    low: np.ndarray
    high: np.ndarray
    size: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The gap of a surface to another one, along its normals, negative where they overlap.

    `covered`: the share of its area that the other one faces.
    """

    smallest: float
    mean: float
    largest: float
    covered: float


def groups_of(mesh: meshio.Mesh) -> Iterator[Group]:
    """All cells of the mesh's dimension, as a group without a name, then the mesh's groups."""
    dim = mesh.points.shape[1]
    whole = [np.arange(len(b.data)) if b.dim == dim else np.empty(0, int) for b in mesh.cells]
    for name, parts in {"": whole, **mesh.cell_sets}.items():
        blocks = [
            (BY_MESHIO[block.type], block.data[np.asarray(part, dtype=int)])
            for block, part in zip(mesh.cells, parts, strict=True)
            if len(part)
        ]
        nodes = [np.empty(0, dtype=int), *(data.ravel() for _, data in blocks)]
        edges = [mesh.points[data[:, np.array(kind.edges)]] for kind, data in blocks]
        counts = {kind.name: len(data) for kind, data in blocks}
        yield _group(mesh, name, counts, np.concatenate(nodes), edges)
    for name, chosen in mesh.point_sets.items():
        yield _group(mesh, name, {}, np.asarray(chosen, dtype=int), [])


def _group(
    mesh: meshio.Mesh, name: str, cells: dict[str, int], nodes: np.ndarray, edges: list[np.ndarray]
) -> Group:
    """A group from its nodes and its cells' edges (n, edges, 2, dim) by type."""
    nodes = np.unique(nodes)
    points = mesh.points[nodes] if len(nodes) else np.full((1, mesh.points.shape[1]), np.nan)
    # Coordinates of round-off are shown as zeros.
    points = np.where(np.abs(points) > 1e-12 * np.abs(mesh.points).max(), points, 0.0)
    sizes = [np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).ravel() for ends in edges]
    size = np.concatenate(sizes) if sizes else np.zeros(1)
    return Group(
        name=name,
        cells=cells,
        nodes=len(nodes),
        low=points.min(axis=0),
        high=points.max(axis=0),
        size=(float(size.min()), float(size.mean()), float(size.max())),
    )


def gap_between(mesh: meshio.Mesh, names: Sequence[str], path: object) -> Gap:
    """The gap that contact begins with between the two named groups of faces, the slave first.

    Raises InputError, naming the file `path`, for a group that is unknown or no outer surface, and
    where the surfaces do not face each other.
    """
    sides = []
    for name in names:
        if name not in mesh.cell_sets:
            raise InputError(path, "gap", name, f"no such group; {hint(name, mesh.cell_sets)}")
        try:
            blocks = boundary_faces(mesh, name)
        except FaceError as error:
            raise InputError(path, "gap", name, str(error)) from None
        sides.append([facets(mesh.points, b.type, b.nodes, b.number) for b in blocks])
    reach = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    found = meet_in_segments(sides[0], [], sides[1], reach)
    weight = np.concatenate([np.empty(0), *(segments.weight.ravel() for segments in found)])
    gap = np.concatenate([np.empty(0), *(segments.gap.ravel() for segments in found)])
    if not weight.sum() > 0:
        raise InputError(path, "gap", ", ".join(names), "the surfaces do not face each other")
    area = sum(sample.weight.sum() for sample in face_samples(sides[0]))
    return Gap(
        smallest=float(gap.min()),
        mean=float(weight @ gap / weight.sum()),
        largest=float(gap.max()),
        covered=float(weight.sum() / area),
    )


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
