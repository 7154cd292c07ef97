"""Uniform refinement of any mesh: each edge in two, groups kept, curved cells by their own map.

A new node is identified by the vertices of the cell, face or edge it is in, and its weights of
them. Neighbours have these in common, the two surfaces of an interface do not. Its place is that of
the parent's shape functions; the children of all types but pyramids reproduce the parent's map.

Sources: for tetrahedra Bey, Computing 55 (1995) 355–378.
"""

from functools import cache
from itertools import product

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME, CellType, cell_type
from ...lac.cells.shape import shape_functions

# Weights of vertices are whole multiples of this; the points of a pyramid have rounded ones.
_PART = 2.0**20
_APEX = 1 - 1e-12
_MIX = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xD6E8FEB86659FD93), np.uint64(32)
# Children of a tetrahedron, by its vertices 0 … 3 and the middles 4 … 9 of its edges.
_TETRA = (
    *((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)),
    *((4, 6, 7, 8), (4, 6, 5, 8), (6, 7, 8, 9), (6, 5, 8, 9)),
)


def refined(mesh: meshio.Mesh) -> meshio.Mesh:
    """The mesh with each edge halved; several blocks may have the same cell type.

    A new node is in a group of nodes where all vertices of its edge, face or cell are.

    >>> line = meshio.Mesh(np.array([[0.0, 0.0], [2.0, 0.0]]), [("line", [[0, 1]])])
    >>> found = refined(line)
    >>> found.points.tolist(), found.cells[0].data.tolist()
    ([[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]], [[0, 2], [2, 1]])
    """
    random = np.random.default_rng(0).integers(0, 2**64, len(mesh.points), dtype=np.uint64)
    kinds = [cell_type(block.type) for block in mesh.cells]
    known, numbers, fresh, places = [], [], [], []
    members: dict[str, list[np.ndarray]] = {name: [] for name in mesh.point_sets}
    inside = {name: np.isin(np.arange(len(random)), ids) for name, ids in mesh.point_sets.items()}
    for kind, block in zip(kinds, mesh.cells, strict=True):
        vertices = block.data[:, : kind.n_vertices]
        known.append(_keys(kind, kind.nodes, random[vertices]).ravel())
        numbers.append(block.data.ravel())
        local = _children(kind.name).points
        fresh.append(_keys(kind, local, random[vertices]))
        values = _values(kind.name, local)
        places.append((values @ mesh.points[block.data]).reshape(-1, mesh.points.shape[1]))
        touched = _weights(kind, local) > 0
        for name, mask in inside.items():
            members[name].append((mask[vertices][:, None] | ~touched).all(axis=2).ravel())
    old, first = np.unique(np.concatenate(known), return_index=True)
    all_new = np.concatenate([keys.ravel() for keys in fresh])
    added, where = np.unique(all_new[~np.isin(all_new, old)], return_index=True)
    place = np.concatenate(places)[~np.isin(all_new, old)][where]
    every = np.concatenate([old, added])
    order = np.argsort(every)
    number = np.concatenate([np.concatenate(numbers)[first], len(random) + np.arange(len(added))])
    number_of = [number[order][np.searchsorted(every[order], keys)] for keys in fresh]
    sets = {}
    for name, parts in members.items():
        mine = np.concatenate([n.ravel() for n in number_of])[np.concatenate(parts)]
        sets[name] = np.union1d(mesh.point_sets[name], mine)
    points = np.concatenate([mesh.points, place])
    return _with_children(mesh, points, kinds, number_of, sets)


def _with_children(
    mesh: meshio.Mesh,
    points: np.ndarray,
    kinds: list[CellType],
    number_of: list[np.ndarray],
    point_sets: dict[str, np.ndarray],
) -> meshio.Mesh:
    """Blocks of children, a block for each type of them, and the groups of their parents."""
    cells: list[tuple[str, np.ndarray]] = []
    sets: dict[str, list[np.ndarray]] = {name: [] for name in mesh.cell_sets}
    for i, (kind, numbers) in enumerate(zip(kinds, number_of, strict=True)):
        for child, local in _children(kind.name).cells.items():
            cells.append((BY_NAME[child].meshio, numbers[:, local].reshape(-1, local.shape[1])))
            for name, parts in mesh.cell_sets.items():
                parents = np.asarray([] if parts[i] is None else parts[i], dtype=int)
                of_each = parents[:, None] * len(local) + np.arange(len(local))
                sets[name].append(of_each.ravel())
    return meshio.Mesh(points, cells, cell_sets=sets, point_sets=point_sets)


def _weights(kind: CellType, reference: np.ndarray) -> np.ndarray:
    """The weights (n, n_vertices) of a cell's vertices at reference points, as whole numbers."""
    return np.rint(_values(kind.skeleton, reference) * _PART).astype(np.int64)


def _values(name: str, reference: np.ndarray) -> np.ndarray:
    """Shape functions (n, n_nodes) at reference points, in pyramids just below the apex."""
    if name.startswith("PYRA"):
        reference = np.minimum(reference, [np.inf, np.inf, _APEX])
    return shape_functions(name).values(reference)


def _keys(kind: CellType, reference: np.ndarray, random: np.ndarray) -> np.ndarray:
    """A number (c, n) for each place in cells of which the vertices have random numbers (c, v).

    64 bits for all weights: sums of powers of two alone would leave the low bits zero.
    """
    first, second, shift = _MIX
    spread = _weights(kind, reference).astype(np.uint64) * first
    return random @ ((spread ^ (spread >> shift)) * second).T


class _Children:
    """The children of a reference cell: their distinct nodes, and by type their connectivity."""

    def __init__(self, kind: CellType):
        parts: dict[str, list[np.ndarray]] = {}
        for vertices in _vertices(kind):
            child = _type_of(kind, len(vertices))
            nodes = [vertices[list(owner)].mean(axis=0) for owner in child.owners]
            parts.setdefault(child.name, []).append(np.array(nodes))
        every = np.concatenate([np.concatenate(nodes) for nodes in parts.values()])
        self.points, label = np.unique(every.round(9), axis=0, return_inverse=True)
        self.cells: dict[str, np.ndarray] = {}
        start = 0
        for name, nodes in parts.items():
            shape = len(nodes), len(nodes[0])
            self.cells[name] = label.ravel()[start : start + shape[0] * shape[1]].reshape(shape)
            start += shape[0] * shape[1]


@cache
def _children(name: str) -> _Children:
    return _Children(BY_NAME[name])


def _type_of(kind: CellType, n_vertices: int) -> CellType:
    """The type of a child: the parent's, or the tetrahedron between the pyramids of a pyramid."""
    if n_vertices == kind.n_vertices:
        return kind
    return BY_NAME["TETRA4" if kind.order == 1 else "TETRA10"]


def _vertices(kind: CellType) -> list[np.ndarray]:
    """The vertices (v, dim) of each child in the parent's reference cell."""
    own = kind.nodes[: kind.n_vertices]
    shape = kind.shape
    middle = np.array([own[list(edge)].mean(axis=0) for edge in kind.edges])
    if shape == "TETRA":
        every = np.concatenate([own, middle])
        return [every[list(child)] for child in _TETRA]
    if shape == "PYRA":
        return _of_pyramid(own, middle)
    if shape in ("TRIA", "PENTA"):
        triangle = kind.nodes[:3, :2]
        flat = [(triangle + corner) / 2 for corner in triangle]
        flat.append((triangle + triangle[[1, 2, 0]]) / 2)
        if shape == "TRIA":
            return flat
        return [
            np.concatenate([np.c_[part, np.full(3, z)] for z in (low, low + 0.5)])
            for part in flat
            for low in (0.0, 0.5)
        ]
    return [(own + np.array(corner)) / 2 for corner in product((0, 1), repeat=kind.dim)]


def _of_pyramid(own: np.ndarray, middle: np.ndarray) -> list[np.ndarray]:
    """Six pyramids, two of them between the middles of the lateral edges, and four tetrahedra."""
    base, lateral, centre = middle[:4], middle[4:], own[:4].mean(axis=0)
    found = [np.array([own[i], base[i], centre, base[i - 1], lateral[i]]) for i in range(4)]
    found += [np.array([*lateral, own[4]]), np.array([*lateral[::-1], centre])]
    tetrahedra = [np.array([base[i], centre, lateral[i - 3], lateral[i]]) for i in range(4)]
    return found + tetrahedra
