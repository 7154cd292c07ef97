"""Faces of cells: who owns them, outward normals, quadrature points; cells right side out."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from ..threads import prefetch
from .catalogue import CellType, cell_type
from .shape import gauss_rule, shape_functions

FLAT = 1e-9
"""What bends or leans by less than this share is straight: meshes are rounded by about as much."""
# Below this share of the product of the edges that span it, a corner has no area.
_NO_CORNER = 1e-12
# Cells that are looked at together.
_AT_ONCE = 1 << 12


def vertex_jacobians(points: np.ndarray, cells: np.ndarray, cell: CellType) -> np.ndarray:
    """Jacobian at the vertices, as a share of the product of the edge tangents that span it.

    points (n, dim), cells (n_cells, n_nodes) of a type of the same dimension; returns
    (n_cells, n_corners), positive for a cell in the catalogue's orientation. The tangents are
    those of the cell's own interpolation, mid-edge nodes included. The apex of a pyramid, where
    the Jacobian has no value, is left out.
    """
    at = np.ascontiguousarray(points[cells].transpose(1, 2, 0))
    columns = []
    for vertex in range(cell.n_vertices):
        ends = [
            (sum(edge) - vertex, cell.n_vertices + i)
            for i, edge in enumerate(cell.edges)
            if vertex in edge
        ]
        if len(ends) != cell.dim:
            continue
        sign = np.sign(np.linalg.det([cell.nodes[end] - cell.nodes[vertex] for end, _ in ends]))
        tangents = [_tangent(at, cell, vertex, *end) for end in ends]
        size = np.prod([np.sqrt(np.einsum("dn,dn->n", t, t)) for t in tangents], axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            columns.append(sign * np.nan_to_num(_determinant(*tangents) / size))
    return np.stack(columns, axis=1)


def _tangent(at: np.ndarray, cell: CellType, vertex: int, end: int, middle: int) -> np.ndarray:
    """The tangent (dim, n) at a vertex of an edge, of cells with nodes `at` (n_nodes, dim, n)."""
    chord = at[end] - at[vertex]
    return chord if cell.order == 1 else 4 * (at[middle] - at[vertex]) - chord


def _determinant(a: np.ndarray, b: np.ndarray, c: np.ndarray | None = None) -> np.ndarray:
    """The determinants (n,) of two or three vectors (dim, n)."""
    if c is None:
        return a[0] * b[1] - a[1] * b[0]
    cross = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    return a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]


def right_side_out(
    points: np.ndarray, cells: np.ndarray, cell: CellType
) -> tuple[np.ndarray, np.ndarray]:
    """Cells, mirrored ones renumbered in a copy, and a mask (n_cells,) of invalid cells.

    The latter have a Jacobian that is zero at a vertex or changes its sign from one to another.
    """

    def judged(first: int) -> list[np.ndarray]:
        jacobian = vertex_jacobians(points, cells[first : first + _AT_ONCE], cell)
        mirrored = (jacobian < 0).all(axis=1)
        flat = (np.abs(jacobian) <= _NO_CORNER).any(axis=1)
        return [mirrored, flat | ((jacobian < 0).any(axis=1) & ~mirrored)]

    parts = list(prefetch(judged, range(0, max(1, len(cells)), _AT_ONCE)))
    mirrored, bad = (np.concatenate(masks) for masks in zip(*parts, strict=True))
    if not mirrored.any():
        return cells, bad
    turned = cells.copy()
    turned[mirrored] = cells[mirrored][:, list(cell.mirror)]
    return turned, bad


# Points each way on a face: enough for pressures that end with a vertical tangent.
FACE_POINTS = 8
# A block of faces of one type: its name, nodes (f, n_nodes), macro-elements (f,).
SlaveFaces = tuple[str, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class FaceBlock:
    """Faces of one type whose owners are of one type.

    `nodes` (n, n_nodes) turned outward; `number` (n,) their places in the group; `owner` (n,) the
    owner's index in the mesh's block of type `owner_type`; `local` (n,) which of its faces it is.
    """

    type: CellType
    nodes: np.ndarray
    number: np.ndarray
    owner_type: CellType
    owner: np.ndarray
    local: np.ndarray

    def of(self, chosen: np.ndarray) -> Self:
        """The chosen faces, by mask or numbers."""
        parts = {
            name: getattr(self, name)[chosen] for name in ("nodes", "number", "owner", "local")
        }
        return replace(self, **parts)

    def common(self, other: "FaceBlock") -> tuple[np.ndarray, np.ndarray]:
        """The numbers in both blocks (k,) of the faces that both have."""
        if self.owner_type is not other.owner_type or self.type is not other.type:
            return np.empty(0, dtype=int), np.empty(0, dtype=int)
        keys = (10 * block.owner + block.local for block in (self, other))
        _, mine, theirs = np.intersect1d(*keys, return_indices=True)
        return mine, theirs


def corner_sets(faces: list[np.ndarray]) -> np.ndarray:
    """Sorted corner nodes of faces as rows (n, 4), filled up with −1."""
    rows = [np.full((len(f), 4), -1) for f in faces]
    for row, face in zip(rows, faces, strict=True):
        row[:, : face.shape[1]] = np.sort(face, axis=1)
    return np.concatenate(rows) if rows else np.empty((0, 4), dtype=int)


def outer_faces(
    cells: Iterable[tuple[str, np.ndarray]],
) -> Iterator[tuple[str, np.ndarray]]:
    """The faces of one cell only, turned outward, of `cells` (type, nodes): (type, (n, nodes))."""
    by_type: dict[str, list[np.ndarray]] = {}
    for name, nodes in cells:
        for face in cell_type(name).faces:
            by_type.setdefault(face.type, []).append(nodes[:, list(face.nodes)])
    faces = {kind: np.concatenate(parts) for kind, parts in by_type.items()}
    keys = corner_sets([nodes[:, : cell_type(kind).n_vertices] for kind, nodes in faces.items()])
    _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    alone = counts[inverse.ravel()] == 1
    start = 0
    for kind, nodes in faces.items():
        yield kind, nodes[alone[start : start + len(nodes)]]
        start += len(nodes)


def area_vectors(points: np.ndarray, nodes: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """Outward normal × surface measure (n, q, dim) of faces, from shape gradients at q points.

    `tangents` (q, n_nodes, dim − 1) are the face type's reference gradients.
    """
    corner = points[nodes]
    slope = np.einsum("fad,qat->fqtd", corner - corner[:, :1], tangents, optimize=True)
    if points.shape[1] == 2:
        tangent = slope[:, :, 0]
        return np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1)
    return np.cross(slope[:, :, 0], slope[:, :, 1])


def circumference(places: np.ndarray) -> np.ndarray:
    """2πr (…,) at places (…, 2) of a meridian plane, whose first coordinate is the radius r.

    >>> circumference(np.array([[0.5, 7.0]])) == np.pi
    array([ True])
    """
    return 2 * np.pi * places[..., 0]


def surface_vectors(
    points: np.ndarray,
    nodes: np.ndarray,
    face_type: str,
    reference: np.ndarray,
    axisymmetric: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions (q, n_nodes) at reference points, and outward n dS (n, q, dim) there.

    `axisymmetric`: dS is the area of a whole ring, 2πr times the length in the meridian plane.
    """
    values, tangents = shape_functions(face_type).both(reference)
    vectors = area_vectors(points, nodes, tangents)
    if axisymmetric:
        vectors = vectors * circumference(values @ points[nodes])[..., None]
    return values, vectors


def surface_nodes(blocks: Sequence[Any]) -> np.ndarray:
    """The nodes (k,) of blocks of faces, each once, ascending."""
    return np.unique(np.concatenate([block.nodes.ravel() for block in blocks]))


def surface_normals(points: np.ndarray, blocks: Sequence[Any]) -> np.ndarray:
    """The `nodal_normals` of blocks of faces."""
    return nodal_normals(points, [(block.type.name, block.nodes) for block in blocks])


def nodal_normals(points: np.ndarray, faces: list[tuple[str, np.ndarray]]) -> np.ndarray:
    """Unit normals (n_points, dim) of a surface of faces (type, nodes) at its nodes.

    The mean of the normals there of the faces around a node, weighted by area; zero away from the
    surface. Components below `FLAT` are zero, so that a plane along the axes has normals along the
    axes.
    """
    total = np.zeros_like(points)
    for name, nodes in faces:
        kind = cell_type(name)
        np.add.at(
            total, nodes, area_vectors(points, nodes, shape_functions(name).gradients(kind.nodes))
        )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    total /= np.where(length > 0, length, 1.0)
    total[np.abs(total) < FLAT] = 0.0
    return total


@dataclass(frozen=True)
class SurfacePoints:
    """Quadrature points on faces: `place` (k, dim), `weight` (k,), `macro` (k,) of the face."""

    place: np.ndarray
    weight: np.ndarray
    macro: np.ndarray

    def means(self, values: np.ndarray) -> np.ndarray:
        """The mean of values (k,) over each macro-element."""
        return np.bincount(self.macro, self.weight * values) / np.bincount(self.macro, self.weight)


def surface_points(
    points: np.ndarray, faces: Sequence[SlaveFaces], axisymmetric: bool = False
) -> SurfacePoints:
    """Points all over a slave surface."""
    place, weight, macro = [], [], []
    for name, nodes, owner in faces:
        kind = cell_type(name)
        reference, weights = gauss_rule(kind.name, FACE_POINTS)
        values, slopes = shape_functions(kind.name).both(reference)
        # Straight lines and flat triangles: one point serves for all.
        slopes = slopes[:1] if (slopes == slopes[:1]).all() else slopes
        measure = np.linalg.norm(area_vectors(points, nodes, slopes), axis=2) * weights
        where = np.einsum("qa,fad->fqd", values, points[nodes], optimize=True)
        if axisymmetric:
            measure *= circumference(where)
        place.append(where.reshape(-1, points.shape[1]))
        weight.append(measure.ravel())
        macro.append(np.repeat(owner, len(weights)))
    return SurfacePoints(np.concatenate(place), np.concatenate(weight), np.concatenate(macro))
