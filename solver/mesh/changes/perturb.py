"""Random moves of the nodes of a mesh that keep its plane sides plane and its edges straight.

Nodes on a plane side move in it, nodes on an edge of the body along it, its corners and the nodes
of curved sides stay, and mid-nodes go with the vertices they lie between.
"""

import meshio
import numpy as np

from ...lac.cells.catalogue import CellType, cell_type
from ...lac.cells.orient import right_side_out

_Volumes = list[tuple[CellType, np.ndarray]]
# Squared sine of the angle below which two faces are of one plane.
_ONE_PLANE = 1e-12


def perturbed(
    mesh: meshio.Mesh, amplitude: float, seed: int, chosen: np.ndarray | None = None
) -> np.ndarray | None:
    """The points (n, dim) moved by at most `amplitude` of the shortest edge at each.

    Only those `chosen` (n,), where given. None where a cell is folded over by it.
    """
    points, dim = np.asarray(mesh.points, dtype=float), mesh.points.shape[1]
    volumes = _volumes(mesh)
    step = np.random.default_rng(seed).uniform(-1, 1, points.shape) / np.sqrt(dim)
    step *= amplitude * _shortest_edges(points, volumes)[:, None]
    step = np.einsum("nij,nj->ni", _freedom(points, volumes), step)
    if chosen is not None:
        step[~chosen] = 0.0
    return stepped(mesh, step)


def stepped(mesh: meshio.Mesh, step: np.ndarray) -> np.ndarray | None:
    """The points (n, dim) with the vertices moved by `step`, mid-nodes going with them.

    None where a cell is folded over by it.
    """
    volumes, step = _volumes(mesh), step.copy()
    for cell, nodes in volumes:
        cell.put_between(step, nodes)
    moved = mesh.points + step
    return None if any(_folded(moved, nodes, cell) for cell, nodes in volumes) else moved


def _volumes(mesh: meshio.Mesh) -> _Volumes:
    dim = mesh.points.shape[1]
    return [(c, b.data) for b in mesh.cells if (c := cell_type(b.type)).dim == dim]


def _folded(points: np.ndarray, nodes: np.ndarray, cell: CellType) -> bool:
    turned, bad = right_side_out(np.asarray(points, dtype=float), nodes, cell)
    return bool(bad.any() or (turned != nodes).any())


def _shortest_edges(points: np.ndarray, volumes: _Volumes) -> np.ndarray:
    shortest = np.full(len(points), np.inf)
    for cell, nodes in volumes:
        for edge in cell.edges:
            ends = nodes[:, edge]
            length = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
            np.minimum.at(shortest, ends, length[:, None])
    return np.where(np.isfinite(shortest), shortest, 0)


def _freedom(points: np.ndarray, volumes: _Volumes) -> np.ndarray:
    """For each node the projector (n, dim, dim) on the directions in which the sides let it go."""
    dim = points.shape[1]
    spread = np.zeros((len(points), dim, dim))
    for corners in _outer_faces(volumes):
        normals = _normals(points[corners])
        np.add.at(spread, corners, (normals[:, :, None] * normals[:, None, :])[:, None])
    strength, directions = np.linalg.eigh(spread)
    free = strength <= _ONE_PLANE * np.maximum(strength.max(axis=1, keepdims=True), 1)
    return np.einsum("nik,nk,njk->nij", directions, free, directions)


def _outer_faces(volumes: _Volumes) -> list[np.ndarray]:
    """Corner nodes (n_faces, n_corners) of the faces of one cell only, by number of corners."""
    faces: dict[int, list[np.ndarray]] = {}
    for cell, nodes in volumes:
        for face in cell.faces:
            corners = [i for i in face.nodes if i < cell.n_vertices]
            faces.setdefault(len(corners), []).append(nodes[:, corners])
    outer = []
    for parts in faces.values():
        every = np.concatenate(parts)
        _, first, count = np.unique(
            np.sort(every, axis=1), axis=0, return_index=True, return_counts=True
        )
        outer.append(every[first[count == 1]])
    return outer


def _normals(corners: np.ndarray) -> np.ndarray:
    """Unit normals (n, dim) of faces by their corners (n, n_corners, dim)."""
    if corners.shape[2] == 2:
        tangent = corners[:, 1] - corners[:, 0]
        normals = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    else:
        normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
