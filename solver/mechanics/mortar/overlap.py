"""Bodies that lie in one another."""

import numpy as np

from ...lac.cells.catalogue import CellType, cell_type
from ...lac.pairing import candidate_pairs
from ...lac.threads import prefetch

# Cells that are looked at together.
_AT_ONCE = 1 << 14
# A place is inside a cell from this share of the depth of the cell's own middle on.
_DEEP = 1e-3


def inside_others(points: np.ndarray, cells: dict[str, np.ndarray], body: np.ndarray) -> int:
    """How many cells have their middle inside a cell of another body.

    `cells` by type (n, n_nodes) on `points` (n_points, dim), `body` (n_points,) a number from zero
    on. Faces of cells are taken as plane. Bodies that touch, and faces of curved surfaces that
    overlap a little, count as apart: it takes about half a cell.

    Two squares of edge 1 overlap by less than half a cell, then by more:

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> quads = {"QUAD4": np.arange(8).reshape(2, 4)}
    >>> for x in (0.6, 0.4):
    ...     inside_others(np.concatenate([square, square + [x, 0.1]]), quads, np.repeat([0, 1], 4))
    0
    2
    """
    count, dim = int(body.max()) + 1, points.shape[1]
    low, high = np.full((count, dim), np.inf), np.full((count, dim), -np.inf)
    np.minimum.at(low, body, points)
    np.maximum.at(high, body, points)
    meet = np.all((low[:, None] < high) & (low < high[:, None]), axis=2)
    meet &= ~np.eye(count, dtype=bool)
    if not meet.any():
        return 0
    blocks = [(cell_type(name), nodes) for name, nodes in cells.items()]
    parts = [
        nodes[first : first + _AT_ONCE, : kind.n_vertices]
        for kind, nodes in blocks
        for first in range(0, len(nodes), _AT_ONCE)
    ]
    balls = prefetch(lambda nodes: _ball(points[nodes]), parts)
    middle, radius = (np.concatenate(each) for each in zip(*balls, strict=True))
    owner = np.concatenate([body[nodes[:, 0]] for _, nodes in blocks])
    inside = np.zeros(len(owner), dtype=bool)
    for a in np.unique(np.nonzero(meet)[0]):
        boxes = np.flatnonzero(meet[a])
        mine = np.flatnonzero(owner == a)
        at = middle[mine][:, None]
        within = np.all((at > low[boxes]) & (at < high[boxes]), axis=2)
        mine = mine[np.any(within, axis=1)]
        if not len(mine):
            continue
        near = (middle + radius[:, None] > middle[mine].min(axis=0)) & (owner != a)[:, None]
        near &= middle - radius[:, None] < middle[mine].max(axis=0)
        theirs = np.flatnonzero(near.all(axis=1))
        around = middle[theirs], radius[theirs]
        i, j = candidate_pairs(middle[mine], np.zeros(len(mine)), *around, 0.0)
        i, j, first = mine[i], theirs[j], 0
        for kind, nodes in blocks:
            pick = (j >= first) & (j < first + len(nodes))
            hit = _contained(points, kind, nodes[j[pick] - first], middle[i[pick]])
            inside[i[pick][hit]] = True
            first += len(nodes)
    return int(inside.sum())


def _ball(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle (n, dim) of cells with vertices (n, n_vertices, dim), and radius (n,) around it."""
    middle = vertices.mean(axis=1)
    return middle, np.linalg.norm(vertices - middle[:, None], axis=2).max(axis=1)


def _contained(
    points: np.ndarray, kind: CellType, nodes: np.ndarray, place: np.ndarray
) -> np.ndarray:
    """Which places (n, dim) are inside their cell (n, n_nodes): behind all of its faces.

    By more than rounding, as a share of the depth of its own middle.
    """
    inside = np.ones(len(nodes), dtype=bool)
    middle = points[nodes[:, : kind.n_vertices]].mean(axis=1)
    for face in kind.faces:
        corner = points[nodes[:, face.nodes[: cell_type(face.type).n_vertices]]]
        a, b, *rest = np.moveaxis(corner, 1, 0)
        if kind.dim == 2:
            normal = (b - a)[:, ::-1] * [1.0, -1.0]
        else:
            # of a quadrangle, the angle of its diagonals
            one, other = (b - a, rest[0] - a) if len(rest) == 1 else (rest[0] - a, rest[1] - b)
            normal = np.cross(one, other)
        depth, own = (
            np.einsum("nd,nd->n", at - corner.mean(axis=1), normal) for at in (place, middle)
        )
        inside &= depth < _DEEP * own
    return inside
