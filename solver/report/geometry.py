"""The lines of a picture: outlines of cells and macro-elements, normals."""

from collections.abc import Iterable

import numpy as np

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
