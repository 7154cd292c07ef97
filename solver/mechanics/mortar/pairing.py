"""Which slave sub-faces and master faces may meet: a spatial search by enclosing balls."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from solver.mechanics.mortar.facets import Facets
from solver.mesh.catalogue import CellType

# A master face may meet a slave face only where their normals oppose at least this much.
_FACING = 0.2


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """The m faces of several blocks as closed polygons of v corners, whatever their types.

    `corner` (m, v, dim); `bulge` (m, v, dim): the offset of each edge's middle node from the middle
    of its chord (among quadrangles, a triangle has a first edge of no length); `vertices` (m, v)
    their nodes; `block`, `face` (m,): where they are from; `centre`, `normal` (m, dim), `radius`,
    `affine` (m,) as in Facets.
    """

    corner: np.ndarray
    bulge: np.ndarray
    vertices: np.ndarray
    block: np.ndarray
    face: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    radius: np.ndarray
    affine: np.ndarray


def outlines(blocks: Sequence[Facets], reverse: bool = False) -> Outlines:
    """The outlines of all faces; in `reverse`, they go round as seen from the other side.

    >>> outlines([slave, master]).vertices.tolist()
    [[1, 0], [2, 3], [3, 4]]
    """
    width = max(block.type.n_vertices for block in blocks)
    corner, bulge, vertices = [], [], []
    for block in blocks:
        order, middle = _around(block.type, reverse)
        first, last = block.corner[:, order], block.corner[:, np.roll(order, -1)]
        if middle is None:
            offset = np.zeros_like(first)
        else:
            offset = block.corner[:, middle] - (first + last) / 2
        more = width - len(order)
        corner.append(np.concatenate([first[:, :1]] * more + [first], axis=1))
        bulge.append(np.pad(offset, ((0, 0), (more, 0), (0, 0))))
        vertices.append(block.nodes[:, [order[0]] * more + list(order)])
    count = [len(block.number) for block in blocks]
    return Outlines(
        corner=np.concatenate(corner),
        bulge=np.concatenate(bulge),
        vertices=np.concatenate(vertices),
        block=np.repeat(np.arange(len(blocks)), count),
        face=np.concatenate([np.arange(n) for n in count]),
        centre=np.concatenate([block.centre for block in blocks]),
        normal=np.concatenate([block.normal for block in blocks]),
        radius=np.concatenate([block.radius for block in blocks]),
        affine=np.concatenate([block.affine for block in blocks]),
    )


def _around(kind: CellType, reverse: bool) -> tuple[np.ndarray, np.ndarray | None]:
    """The vertices of a face in order, and the mid-node of the edge from each to the next."""
    n = kind.n_vertices
    order = np.arange(n)[::-1] if reverse else np.arange(n)
    if kind.dim == 1 or kind.order == 1:
        return order, None
    return order, n + (np.roll(order, -1) if reverse else order)


def facing_pairs(
    slave: Facets, master: Outlines | Facets, reach: float, among: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (slave number, master number) of faces within `reach` that look at each other.

    `among`: the slave faces that are looked at, all of them by default.

    >>> [pair.tolist() for pair in facing_pairs(slave, master, 0.1)]
    [[0, 0], [0, 1]]
    >>> [pair.tolist() for pair in facing_pairs(slave, slave, 0.1)]
    [[], []]
    """
    some = np.arange(len(slave.number)) if among is None else among
    i, j = candidate_pairs(
        slave.centre[some], slave.radius[some], master.centre, master.radius, reach
    )
    i = some[i]
    facing = np.einsum("pd,pd->p", slave.normal[i], master.normal[j]) < -_FACING
    return i[facing], j[facing]


def candidate_pairs(
    slave_centre: np.ndarray,
    slave_radius: np.ndarray,
    master_centre: np.ndarray,
    master_radius: np.ndarray,
    reach: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (slave number, master number) whose balls come within `reach` of each other.

    Centres (n, dim), radii (n,), in units of length. Each side is sorted into classes of similar
    radius, so that a few large faces do not make every small one search far: the work stays
    near-linear in the number of faces also where one side is much finer.

    >>> one, radius = np.array([[0.0]]), np.array([1.0])
    >>> others, radii = np.array([[2.4], [2.6]]), np.array([1.0, 1.0])
    >>> [pair.tolist() for pair in candidate_pairs(one, radius, others, radii, 0.5)]
    [[0], [0]]
    """
    found = [(np.empty(0, dtype=int), np.empty(0, dtype=int))]
    masters = [(members, cKDTree(master_centre[members])) for members in _classes(master_radius)]
    for slaves in _classes(slave_radius):
        tree = cKDTree(slave_centre[slaves])
        for members, master_tree in masters:
            distance = slave_radius[slaves].max() + master_radius[members].max() + reach
            near = tree.sparse_distance_matrix(master_tree, distance, output_type="ndarray")
            s, m = slaves[near["i"]], members[near["j"]]
            close = near["v"] <= slave_radius[s] + master_radius[m] + reach
            found.append((s[close], m[close]))
    slave, master = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((master, slave))
    return slave[order], master[order]


def _classes(radius: np.ndarray) -> list[np.ndarray]:
    """Members of each class of radii within a factor of two."""
    if not len(radius):
        return []
    size = np.floor(np.log2(np.maximum(radius, np.finfo(float).tiny))).astype(int)
    return [np.flatnonzero(size == k) for k in np.unique(size)]
