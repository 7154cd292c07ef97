"""Meshes in which one surface has cells of two types, or none behind it."""

import meshio
import numpy as np

from solver.lac.cells.catalogue import BY_NAME, CellType, cell_type
from solver.lac.cells.faces import outer_faces
from solver.mesh.tidy import tidy
from solver.simulation.scene.groups import with_cells
from solver.simulation.scene.holdings.rigid_surfaces import _with_cells

from .options import HALVES

# The vertices of the two halves of a quadrangle, and of a hexahedron cut along its third axis.
_CUT = {
    "QUAD": ((0, 1, 2), (0, 2, 3)),
    "HEXA": ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
}
_TOUCHES = 1e-9


def halved(mesh: meshio.Mesh, body: str, beyond: float) -> meshio.Mesh:
    """With cells of a body whose middle has a larger x in two halves each, upright in space."""
    points, sets, halves, wanted = mesh.points, mesh.cell_sets[body], {}, []
    for number, block in enumerate(mesh.cells):
        kind, mine = cell_type(block.type), sets[number]
        far = mesh.points[block.data].mean(axis=1)[:, 0] > beyond
        cut = mine[far[mine]] if kind.name in HALVES else mine[:0]
        if len(cut):
            half = BY_NAME[HALVES[kind.name]].meshio
            points, halves[half] = _halves(points, kind, block.data[cut])
        sets[number] = np.setdiff1d(mine, cut)
        wanted.append(~np.isin(np.arange(len(block.data)), cut))
    return tidy(_with_cells(with_cells(mesh, wanted), points, body, halves), "pairs")


def _halves(points: np.ndarray, kind: CellType, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points, with those in the middle of cuts, and both halves of cells (n, nodes)."""
    half, owners = BY_NAME[HALVES[kind.name]], {frozenset(o): i for i, o in enumerate(kind.owners)}
    if kind.dim == 3:
        cells = cells[:, _upright(points, kind, cells[0])]
    found, middles = [], dict[tuple[int, ...], int]()
    for vertices in _CUT[kind.shape]:
        columns = [cells[:, v] for v in vertices]
        for ends in half.edges if half.order == 2 else ():
            own = frozenset(vertices[e] for e in ends)
            diagonal = owners.get(own, owners.get(frozenset(range(4))) if kind.dim == 2 else None)
            if diagonal is not None:
                columns.append(cells[:, diagonal])
                continue
            pairs = [tuple(sorted(pair)) for pair in cells[:, sorted(own)].tolist()]
            for pair in pairs:
                middles.setdefault(pair, len(points) + len(middles))
            columns.append(np.array([middles[pair] for pair in pairs]))
        found.append(np.stack(columns, axis=1))
    new = [points[list(pair)].mean(axis=0) for pair in middles]
    return np.vstack([points, *new]), np.concatenate(found)


def _upright(points: np.ndarray, kind: CellType, cell: np.ndarray) -> list[int]:
    """The order of a hexahedron's nodes in which its third axis is z."""
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        order = [
            int(np.abs(kind.nodes - node[list(axes)]).sum(axis=1).argmin()) for node in kind.nodes
        ]
        low, high = points[cell[order]][:4], points[cell[order]][4:8]
        if np.abs(high - low)[:, 2].min() > np.abs(high - low)[:, :2].max():
            return order
    raise AssertionError("no axis of the cells is upright")


def bare(mesh: meshio.Mesh, body: str, name: str) -> meshio.Mesh:
    """Without the cells of a body; its faces at height zero are kept, in a group of that name."""
    blocks = list(zip(mesh.cells, mesh.cell_sets.pop(body), strict=True))
    cells = [(cell_type(b.type).name, b.data[mine]) for b, mine in blocks if len(mine)]
    faces = {}
    for kind, nodes in outer_faces(cells):
        there = (np.abs(mesh.points[nodes, -1]) < _TOUCHES).all(axis=1)
        faces[BY_NAME[kind].meshio] = nodes[there]
    others = [~np.isin(np.arange(len(b.data)), mine) for b, mine in blocks]
    return tidy(_with_cells(with_cells(mesh, others), mesh.points, name, faces), "pairs")
