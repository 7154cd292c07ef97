"""A layer of cells behind faces that have none: faces turned to one side, cells on the other.

Rigid lines and surfaces of a mesh become bodies in this way. The layer has no stiffness; it carries
the motion, and makes the faces part of a body like any other.
"""

from collections.abc import Mapping

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...lac.cells.catalogue import BY_NAME, CellType, cell_type
from ...lac.cells.faces import area_vectors, nodal_normals, right_side_out
from ...lac.cells.shape import shape_functions

# Thickness of a layer in parts of the face's size.
_THICKNESS = 0.1
Faces = Mapping[str, np.ndarray]


def turned(points: np.ndarray, faces: Faces, toward: np.ndarray) -> dict[str, np.ndarray] | None:
    """The faces by type, (n, n_nodes), all of them turned to one side of their surface.

    Of each connected part, the face nearest to points (k, 2 · dim) of another surface, with their
    outward normals, looks at it. None where a surface has one side only.

    >>> points = np.array([[0.0, 1.0], [1.0, 1.0], [2.0, 1.0]])
    >>> below = np.array([[0.9, 0.0, 0.0, 1.0]])
    >>> turned(points, {"SEG2": np.array([[1, 0], [1, 2]])}, below)["SEG2"].tolist()
    [[0, 1], [1, 2]]
    """
    dim, count = points.shape[1], sum(map(len, faces.values()))
    side = _sides(faces, len(points))
    if (side[:count] == side[count:]).any():
        return None
    centre = np.concatenate([points[nodes].mean(axis=1) for nodes in faces.values()])
    normal = np.concatenate([_normals(points, name, nodes) for name, nodes in faces.items()])
    distance, nearest = cKDTree(toward[:, :dim]).query(centre)
    away = np.einsum("fd,fd->f", normal, toward[nearest, dim:]) > 0
    flipped = np.zeros(count, dtype=bool)
    part = np.minimum(side[:count], side[count:])
    for label in np.unique(part):
        mine = np.flatnonzero(part == label)
        seed = mine[distance[mine].argmin()]
        flipped[mine] = (side[mine] != side[seed]) ^ away[seed]
    found, first = {}, 0
    for name, nodes in faces.items():
        mirrored = nodes[:, list(cell_type(name).mirror)]
        found[name] = np.where(flipped[first : first + len(nodes), None], mirrored, nodes)
        first += len(nodes)
    return found


def _sides(faces: Faces, size: int) -> np.ndarray:
    """A label (2 n,) for each of n faces as it is, then turned: the same on one side of a part.

    Two faces at a rim agree where they pass it in opposite ways.
    """
    rims = [_rims(cell_type(name), nodes, size) for name, nodes in faces.items()]
    number = np.split(
        np.arange(sum(map(len, faces.values()))), np.cumsum([len(r) for r, _ in rims])
    )
    owner = np.concatenate(
        [np.repeat(n, r.shape[1]) for n, (r, _) in zip(number, rims, strict=False)]
    )
    rim, way = (np.concatenate([a.ravel() for a in arrays]) for arrays in zip(*rims, strict=True))
    order = np.argsort(rim, kind="stable")
    same = np.flatnonzero(np.diff(rim[order]) == 0)
    one, other, count = order[same], order[same + 1], len(np.unique(owner))
    i, j, odd = owner[one], owner[other], way[one] == way[other]
    ends = (np.r_[i, i + count], np.r_[j + count * odd, j + count * ~odd])
    graph = sparse.coo_matrix((np.ones(len(ends[0])), ends), shape=(2 * count, 2 * count))
    return np.asarray(connected_components(graph, directed=False)[1])


def _rims(kind: CellType, nodes: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Keys (n, k) of the ends or edges of faces, and which way (n, k) each is passed."""
    if kind.dim == 1:
        return nodes[:, :2], np.tile([False, True], (len(nodes), 1))
    n = kind.n_vertices
    start, end = nodes[:, :n], np.roll(nodes[:, :n], -1, axis=1)
    return np.minimum(start, end) * size + np.maximum(start, end), start < end


def _normals(points: np.ndarray, name: str, nodes: np.ndarray) -> np.ndarray:
    kind = cell_type(name)
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    return area_vectors(points, nodes, shape_functions(name).gradients(middle[None]))[:, 0]


def layer(points: np.ndarray, faces: Faces) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Points (k, dim) to add, and the cells by type behind faces that are turned outward.

    >>> points = np.array([[0.0, 1.0], [2.0, 1.0]])
    >>> more, cells = layer(points, {"SEG2": np.array([[0, 1]])})
    >>> more.tolist(), cells["QUAD4"].tolist()
    ([[0.0, 1.2], [2.0, 1.2]], [[0, 1, 3, 2]])
    """
    normal = nodal_normals(points, list(faces.items()))
    used = np.unique(np.concatenate([nodes.ravel() for nodes in faces.values()]))
    corner = [points[nodes[:, :2]] for nodes in faces.values()]
    size = min(float(np.linalg.norm(c[:, 1] - c[:, 0], axis=1).min()) for c in corner)
    sheets = [points[used] - _THICKNESS * size * share * normal[used] for share in (0.5, 1.0)]
    cells = {}
    for name, nodes in faces.items():
        kind = cell_type(name).layer
        low = np.searchsorted(used, nodes)
        levels = np.stack([nodes, len(points) + low, len(points) + len(used) + low])
        height = np.rint(2 * kind.nodes[:, -1]).astype(int)
        apart = np.abs(kind.nodes[:, None, :-1] - cell_type(name).nodes).max(axis=2)
        cells[kind.name] = levels[height, :, apart.argmin(axis=1)].T
    every = np.concatenate([points, *sheets])
    kept = np.unique(np.concatenate([nodes.ravel() for nodes in cells.values()]))
    kept = kept[kept >= len(points)]
    new = np.arange(len(every))
    new[kept] = len(points) + np.arange(len(kept))
    found = {name: right_side_out(every, nodes, BY_NAME[name])[0] for name, nodes in cells.items()}
    return every[kept], {name: new[nodes] for name, nodes in found.items()}
