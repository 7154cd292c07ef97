"""What a gallery picture shows of a result, made from the grid as PyVista reads it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import meshio
import numpy as np

from ...mesh.catalogue import BY_NAME, cell_type
from ..geometry import boundary_faces, macro_edges, normals, outlines
from ..layout import magnification
from ..space import AZIMUTH, ELEVATION

_BY_VTK = {cell.vtk: cell for cell in BY_NAME.values()}
# The highest bar, as a share of the size of what is pressed.
_BAR = 0.25
# Where less than this share of the slave's extent is pressed, only that is drawn.
_PRESSED = 0.5

Faces = list[tuple[str, np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Shape:
    """The cut mesh of a result and its slave faces.

    `points` and `displacement` (n, 3), `body` (n,); `mesh` holds the volume cells, `faces` the
    slave sub-faces as (type, nodes, macro-element), both in the order of the grid's cells, among
    which `is_volume` tells them apart. `pressure` (s,) is that of the faces. `units` maps fields to
    the names of their units.
    """

    dim: int
    points: np.ndarray
    displacement: np.ndarray
    body: np.ndarray
    is_volume: np.ndarray
    mesh: meshio.Mesh
    faces: Faces
    pressure: np.ndarray
    units: dict[str, str]

    @classmethod
    def of(cls, grid: Any) -> "Shape":
        """The shape in a PyVista grid with the fields of a result."""
        zone, macro = (np.asarray(grid.cell_data[name]) for name in ("zone", "macro_element"))
        # Macro-elements are counted zone by zone.
        owner = macro + zone * (int(macro.max(initial=0)) + 1)
        points, kinds = np.asarray(grid.points, dtype=float), np.asarray(grid.celltypes)
        nodes, ends = np.asarray(grid.cell_connectivity), np.asarray(grid.cell_offsets)
        volumes, faces = [], []
        # The cells of a type lie together: volumes first, then the slave faces.
        cuts = np.flatnonzero(np.diff(kinds) | np.diff(zone < 0)) + 1
        for start, stop in zip([0, *cuts], [*cuts, len(kinds)], strict=True):
            kind = _BY_VTK[int(kinds[start])]
            table = nodes[ends[start] : ends[stop]].reshape(-1, kind.n_nodes)
            if zone[start] < 0:
                volumes.append((kind.meshio, table))
            else:
                faces.append((kind.name, table, owner[start:stop]))
        return cls(
            dim=max(cell_type(kind).dim for kind, _ in volumes),
            points=points,
            displacement=np.asarray(grid.point_data["displacement"]),
            body=np.asarray(grid.point_data["body"]),
            is_volume=zone < 0,
            mesh=meshio.Mesh(points, volumes),
            faces=faces,
            pressure=np.asarray(grid.cell_data["pressure"])[zone >= 0],
            units=dict(str(text).split(": ", 1) for text in grid.field_data.get("units", ())),
        )

    @cached_property
    def size(self) -> float:
        """The largest extent."""
        return float(np.ptp(self.points, axis=0).max())

    @cached_property
    def magnification(self) -> float:
        """How much the displacement is drawn larger."""
        return magnification(self.displacement, self.size)

    @cached_property
    def deformed(self) -> np.ndarray:
        """Points (n, 3) with the magnified displacement."""
        return self.points + self.magnification * self.displacement

    @cached_property
    def slaves(self) -> np.ndarray:
        """The numbers of the bodies with slave faces."""
        return np.unique(self.body[self.nodes_of_faces()])

    @cached_property
    def of_slaves(self) -> np.ndarray:
        """Which volume cells (c,) belong to bodies with slave faces."""
        return np.isin(
            np.concatenate([self.body[block.data[:, 0]] for block in self.mesh.cells]), self.slaves
        )

    @cached_property
    def face_normals(self) -> np.ndarray:
        """Unit normals (s, 3) of the slave faces, in the plane to the right of their edges."""
        found = [np.empty((0, 3))]
        for kind, nodes, _ in self.faces:
            corners = self.points[nodes[:, : BY_NAME[kind].n_vertices]]
            if self.dim == 3:
                found.append(normals(corners))
                continue
            along = corners[:, 1] - corners[:, 0]
            right = np.stack([along[:, 1], -along[:, 0], np.zeros(len(along))], axis=1)
            found.append(right / np.linalg.norm(right, axis=1, keepdims=True))
        return np.concatenate(found)

    @cached_property
    def normal(self) -> np.ndarray:
        """The mean outward normal (3,) of the slave faces; upward where there is none."""
        mean = self.face_normals.sum(axis=0)
        length = float(np.linalg.norm(mean))
        enough = length > 1e-6 * max(1, len(self.pressure))
        return mean / length if enough else np.eye(3)[self.dim - 1]

    @cached_property
    def eye(self) -> np.ndarray:
        """The direction (3,) towards the eye: in space from where the slave faces are seen."""
        if self.dim == 2:
            return np.array([0.0, 0.0, 1.0])
        tilt = ELEVATION if self.normal[2] >= 0 else -ELEVATION
        flat = np.cos(tilt) * np.array([np.cos(AZIMUTH), np.sin(AZIMUTH)])
        return np.array([*flat, np.sin(tilt)])

    @cached_property
    def up(self) -> np.ndarray:
        """The direction (3,) that is upward in the picture, at a right angle to the eye's."""
        upward = np.eye(3)[self.dim - 1]
        upward -= (upward @ self.eye) * self.eye
        return upward / np.linalg.norm(upward)

    @cached_property
    def moved(self) -> np.ndarray:
        """By how much (3,) the slave bodies are moved away from the others, to be seen apart."""
        alone = np.isin(self.body, self.slaves).all()
        share = 0.0 if alone else 0.3 if self.dim == 3 else 0.06
        return -share * self.size * self.normal

    @cached_property
    def apart(self) -> np.ndarray:
        """Points (n, 3) with the slave bodies moved."""
        return self.points + np.isin(self.body, self.slaves)[:, None] * self.moved

    def outlines(self, points: np.ndarray, slave: bool | None = None) -> Iterator[np.ndarray]:
        """Cells, or in space the faces of the surface, drawn at `points`: (c, corners, 3).

        Of all bodies, or of those that are slaves, or are not.
        """
        blocks = (
            boundary_faces(self.mesh)
            if self.dim == 3
            else ((block.type, block.data) for block in self.mesh.cells)
        )
        for kind, nodes in blocks:
            mine = np.isin(self.body[nodes[:, 0]], self.slaves) == slave
            yield _rounded(outlines(points, kind, nodes if slave is None else nodes[mine]), kind)

    def _chosen(self, shown: np.ndarray | None) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """The slave faces, or those that are `shown` (s,)."""
        start = 0
        for kind, nodes, owner in self.faces:
            mine = slice(None) if shown is None else shown[start : start + len(nodes)]
            start += len(nodes)
            yield kind, nodes[mine], owner[mine]

    def nodes_of_faces(self, shown: np.ndarray | None = None) -> np.ndarray:
        """All nodes (k,) of slave faces."""
        parts = [nodes.ravel() for _, nodes, _ in self._chosen(shown)]
        return np.concatenate([np.empty(0, dtype=int), *parts])

    def face_outlines(self, shown: np.ndarray) -> list[np.ndarray]:
        """Slave faces as polygons (s, corners, 3), a type at a time."""
        chosen = self._chosen(shown)
        return [_rounded(outlines(self.points, kind, nodes), kind) for kind, nodes, _ in chosen]

    def pressed(self) -> tuple[np.ndarray, bool]:
        """Which slave faces (s,) to show, and whether these are all.

        Those that are pressed and what lies around them, where most of the surface is not.
        """
        middle = np.concatenate([self.points[n].mean(axis=1) for _, n, _ in self.faces])
        everything = np.ones(len(middle), dtype=bool)
        inside = self.pressure > 0
        if not inside.any():
            return everything, True
        low, high = middle[inside].min(axis=0), middle[inside].max(axis=0)
        wide = max(float((high - low).max()), 1e-9 * self.size)
        if wide > _PRESSED * np.ptp(middle, axis=0).max():
            return everything, True
        around = 0.3 * wide
        return ((middle >= low - around) & (middle <= high + around)).all(axis=1), False

    def bars(self) -> np.ndarray:
        """In the plane, the pressure as bars (s, 4, 3) that stand on the slave faces."""
        ends = np.concatenate([self.points[nodes[:, :2]] for _, nodes, _ in self.faces])
        shown, _ = self.pressed()
        height = _BAR * np.ptp(ends[shown].reshape(-1, 3), axis=0).max()
        rise = (height / max(float(self.pressure.max()), 1e-300) * self.pressure)[:, None]
        tips = ends + (rise * self.face_normals)[:, None]
        return np.stack([ends[:, 0], ends[:, 1], tips[:, 1], tips[:, 0]], axis=1)

    def macro_outlines(self, shown: np.ndarray) -> np.ndarray:
        """Edges (e, 5, 3) around macro-elements; in the plane their ends, as points (e, 3)."""
        chosen = list(self._chosen(shown))
        if self.dim == 3:
            start, end, middle = np.moveaxis(self.points[macro_edges(chosen)], 1, 0)
            straight = (middle == start).all(axis=1, keepdims=True)
            return _parabola(start, np.where(straight, (start + end) / 2, middle), end)
        ends = [np.c_[nodes[:, :2].ravel(), np.repeat(owner, 2)] for _, nodes, owner in chosen]
        pairs, counts = np.unique(np.concatenate(ends), axis=0, return_counts=True)
        return self.points[np.unique(pairs[counts == 1, 0])]


def _rounded(rings: np.ndarray, kind: str) -> np.ndarray:
    """Rings (n, corners, 3) with bent edges in four pieces: parabolas through the mid-nodes."""
    if rings.shape[1] == cell_type(kind).n_vertices:
        return rings
    start, middle = rings[:, ::2], rings[:, 1::2]
    end = np.roll(start, -1, axis=1)
    return np.reshape(_parabola(start, middle, end)[:, :, :4], (len(rings), -1, 3))


def _parabola(start: np.ndarray, middle: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Five points (…, 5, 3) along the parabolas through three (…, 3)."""
    at = np.linspace(0.0, 1.0, 5)[:, None]
    weights = ((1 - at) * (1 - 2 * at), 4 * at * (1 - at), at * (2 * at - 1))
    places = (start, middle, end)
    return sum(w * p[..., None, :] for w, p in zip(weights, places, strict=True))
