"""What a picture draws of a mesh: cell outlines, boundary faces, outlines of macro-elements."""

from collections.abc import Iterable, Iterator

import meshio
import numpy as np

from ..mechanics.fem.faces import corner_sets
from ..mesh.catalogue import cell_type


def outlines(points: np.ndarray, kind: str, connectivity: np.ndarray) -> np.ndarray:
    """Polygons (n, corners, dim) around faces of one type; mid-nodes only where an edge bends."""
    face = cell_type(kind)
    ring = points[connectivity[:, face.boundary]]
    if face.order == 1 or face.dim == 1:
        return ring
    corners = ring[:, ::2]
    bend = ring[:, 1::2] - (corners + np.roll(corners, -1, axis=1)) / 2
    return ring if np.abs(bend).max(initial=0.0) > 1e-6 * np.ptp(points) else corners


def plane_cells(points: np.ndarray, mesh: meshio.Mesh) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Per cell type of a 2D mesh drawn at `points`: outlines (n, corners, 2), a node of each."""
    for block in mesh.cells:
        if block.dim == 2 and len(block.data):
            yield outlines(points, block.type, block.data), block.data[:, 0]


def boundary_faces(mesh: meshio.Mesh) -> Iterator[tuple[str, np.ndarray]]:
    """The faces that belong to one cell of a 3D mesh only, turned outward: (type, (n, nodes))."""
    by_type: dict[str, list[np.ndarray]] = {}
    for block in mesh.cells:
        if block.dim == 3:
            for face in cell_type(block.type).faces:
                by_type.setdefault(face.type, []).append(block.data[:, list(face.nodes)])
    faces = {kind: np.concatenate(parts) for kind, parts in by_type.items()}
    corners = [nodes[:, : cell_type(kind).n_vertices] for kind, nodes in faces.items()]
    keys = corner_sets(corners)
    _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    alone = counts[inverse.ravel()] == 1
    start = 0
    for kind, nodes in faces.items():
        yield kind, nodes[alone[start : start + len(nodes)]]
        start += len(nodes)


def macro_edges(faces: Iterable[tuple[str, np.ndarray, np.ndarray]]) -> np.ndarray:
    """The edges around macro-elements, given their sub-faces (type, nodes, number).

    Returns (n, 3): both ends, and the node between them, or an end again where there is none.
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
