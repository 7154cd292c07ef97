"""Meshes in which one surface has cells of two types, or none behind it."""

import meshio
import numpy as np

from solver.lac.cells.catalogue import BY_NAME, CellType, cell_type
from solver.mesh.tidy import tidy

from .options import HALVES

# The vertices of the two halves of a quadrangle, and of a hexahedron cut along its third axis.
_CUT = {
    "QUAD": ((0, 1, 2), (0, 2, 3)),
    "HEXA": ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
}
_TOUCHES = 1e-9


def halved(mesh: meshio.Mesh, body: str, beyond: float) -> meshio.Mesh:
    """With cells of a body whose middle has a larger x in two halves each, upright in space."""
    points, cells = mesh.points.copy(), list[tuple[str, np.ndarray]]()
    members = {name: list[np.ndarray]() for name in mesh.cell_sets}
    for number, block in enumerate(mesh.cells):
        kind, numbers = cell_type(block.type), np.arange(len(block.data))
        far = points[block.data].mean(axis=1)[:, 0] > beyond
        cut = far & np.isin(numbers, mesh.cell_sets[body][number]) & (kind.name in HALVES)
        for name, sets in mesh.cell_sets.items():
            members[name].append(np.flatnonzero(np.isin(numbers[~cut], sets[number])))
        cells.append((block.type, block.data[~cut]))
        if cut.any():
            points, halves = _halves(points, kind, block.data[cut])
            cells.append((BY_NAME[HALVES[kind.name]].meshio, halves))
            for name, of in members.items():
                of.append(np.arange(len(halves) * (name == body)))
    return tidy(meshio.Mesh(points, cells, cell_sets=members), "pairs")


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
    up, cells, faces = mesh.points[:, -1], list[tuple[str, np.ndarray]](), dict[str, list]()
    members = {group: list[np.ndarray]() for group in mesh.cell_sets if group != body}
    for number, block in enumerate(mesh.cells):
        mine = np.zeros(len(block.data), dtype=bool)
        mine[mesh.cell_sets[body][number]] = True
        for face in cell_type(block.type).faces if mine.any() else ():
            nodes = block.data[mine][:, list(face.nodes)]
            there = (np.abs(up[nodes]) < _TOUCHES).all(axis=1)
            faces.setdefault(BY_NAME[face.type].meshio, []).append(nodes[there])
        kept = np.flatnonzero(~mine)
        cells.append((block.type, block.data[kept]))
        for group, of in members.items():
            of.append(np.flatnonzero(np.isin(kept, mesh.cell_sets[group][number])))
    members[name] = [np.empty(0, dtype=int)] * len(cells)
    for kind, blocks in faces.items():
        nodes = np.concatenate(blocks)
        cells.append((kind, nodes))
        for group, of in members.items():
            of.append(np.arange(len(nodes) * (group == name)))
    return tidy(meshio.Mesh(mesh.points, cells, cell_sets=members), "pairs")
