"""From the mesh of a file to the mesh of the solver."""

import meshio
import numpy as np

from ..lac.cells.catalogue import BY_MESHIO, BY_NAME, CellType
from ..lac.cells.faces import right_side_out
from ..system.errors import InputError
from .keys import LARGEST

_RANK = {cell.name: i for i, cell in enumerate(BY_NAME.values())}
_SHOWN = 5
# A mesh no thicker than this share of its extent is plane; leaving its round-off in z away changes
# no length by more than the square of it.
_PLANE = 1e-9


# Mid-nodes are at most so many halves of their edge away from its middle: as far as its ends.
_FARTHEST = 1.0


def tidy(raw: meshio.Mesh, where: object) -> meshio.Mesh:
    """One block per cell type, volumes first, right side out; 2D points in two columns.

    `raw` has any blocks, groups in its cell and point sets, and, if its file numbers the cells,
    these numbers as cell data `number`. Cells written twice become one. Cells of lower dimension
    stay when their nodes belong to volume cells and they are faces or in a group; faces in a group
    also when none of their nodes does (a rigid surface). Nodes of no cell go. A group none of whose
    members stay is kept, empty. Point cells become node groups. Raises InputError naming the file
    `where`.
    """
    table = _Table(raw, where)
    dim = max((cell.dim for cell in table.cells), default=0)
    if dim < 2:
        raise InputError(where, "cells", None, "the mesh has no cells of dimension 2 or 3")
    points = _flattened(raw.points, dim, where)
    blocks = [table.merged(cell) for cell in sorted(table.cells, key=lambda c: _order(c, dim))]
    names = sorted({name for block in blocks for name in block.groups})
    blocks = _attached(blocks, dim, len(points), where)
    for block in blocks:
        if block.cell.dim == dim:
            block.turn(points, where)
            block.check_middles(points, where)
    return _compact(points, blocks, names, table.node_groups)


class _CellBlock:
    """All cells of one type: connectivity, numbers in the file, and a mask per group."""

    def __init__(
        self, cell: CellType, nodes: np.ndarray, number: np.ndarray, groups: dict[str, np.ndarray]
    ):
        self.cell, self.nodes, self.number, self.groups = cell, nodes, number, groups

    def taken(self, keep: np.ndarray) -> "_CellBlock":
        groups = {name: mask[keep] for name, mask in self.groups.items()}
        return _CellBlock(self.cell, self.nodes[keep], self.number[keep], groups)

    def named(self) -> np.ndarray:
        return np.any([np.zeros(len(self.nodes), dtype=bool), *self.groups.values()], axis=0)

    def check_middles(self, points: np.ndarray, where: object) -> None:
        """InputError where mid-nodes lie farther from the middle of their edge than its ends."""
        if self.cell.order < 2:
            return
        ends = points[self.nodes[:, np.array(self.cell.edges)]]
        n = self.cell.n_vertices
        middles = points[self.nodes[:, n : n + len(self.cell.edges)]]
        away = np.linalg.norm(middles - ends.mean(axis=2), axis=2)
        half = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2) / 2
        bad = (away > _FARTHEST * half).any(axis=1)
        if bad.any():
            raise InputError(
                where,
                _numbered(self.cell, self.number[bad]),
                None,
                "mid-nodes in the wrong order: some are not between the ends of their edge "
                "(docs/formats.md has the node orders)",
            )

    def turn(self, points: np.ndarray, where: object) -> None:
        self.nodes, bad = right_side_out(points, self.nodes, self.cell)
        if bad.any():
            centre = points[self.nodes[bad][0]].mean(axis=0)
            raise InputError(
                where,
                _numbered(self.cell, self.number[bad]),
                None,
                "flat or folded: the Jacobian must not vanish or change its sign at the cell's "
                f"vertices (the first lies around {', '.join(f'{x:.6g}' for x in centre)})",
            )


class _Table:
    """The file's blocks sorted by cell type, its groups as masks over each block."""

    def __init__(self, raw: meshio.Mesh, where: object):
        self.blocks: list[_CellBlock] = []
        for name in (*raw.cell_sets, *raw.point_sets):
            if not name or not name.isprintable():
                raise InputError(where, "group", name, "must have a name of printable characters")
        self.node_groups = {n: np.asarray(ids, dtype=np.int64) for n, ids in raw.point_sets.items()}
        numbers = raw.cell_data.get("number")
        for i, block in enumerate(raw.cells):
            groups = {name: sets[i] for name, sets in raw.cell_sets.items() if _len(sets[i])}
            if block.type == "vertex":
                for name, ids in groups.items():
                    nodes = np.r_[self.node_groups.get(name, []), block.data[ids, 0]]
                    self.node_groups[name] = np.unique(nodes.astype(np.int64))
                continue
            if block.type not in BY_MESHIO:
                raise InputError(where, "cell type", block.type, f"allowed: {', '.join(BY_NAME)}")
            if block.data.dtype.kind not in "iu" and block.data.size:
                allowed = f"node numbers must be whole numbers, not {block.data.dtype}"
                raise InputError(where, f"cells {block.type}", None, allowed)
            nodes = np.asarray(block.data, dtype=np.int64)
            number = np.arange(1, len(nodes) + 1) if numbers is None else numbers[i]
            masks = {name: np.isin(np.arange(len(nodes)), ids) for name, ids in groups.items()}
            cell = BY_MESHIO[block.type]
            loose = ((nodes < 0) | (nodes >= len(raw.points))).any(axis=1)
            if loose.any():
                raise InputError(
                    where,
                    _numbered(cell, number[loose]),
                    None,
                    "made of nodes that the file does not hold",
                )
            self.blocks.append(_CellBlock(cell, nodes, number, masks))
        self.cells = {block.cell for block in self.blocks if len(block.nodes)}

    def merged(self, cell: CellType) -> _CellBlock:
        parts = [block for block in self.blocks if block.cell is cell]
        nodes = parts[0].nodes if len(parts) == 1 else np.concatenate([p.nodes for p in parts])
        first = rank = np.arange(len(nodes))
        if not _all_differ(nodes):
            key = np.sort(nodes, axis=1)
            _, first, same = np.unique(key, axis=0, return_index=True, return_inverse=True)
            # Position in the merged block of each cell of the file, by its first appearance.
            rank = np.argsort(np.argsort(first))[same.ravel()]
        groups = {}
        for name in sorted({name for part in parts for name in part.groups}):
            mask = [part.groups.get(name, np.zeros(len(part.nodes), bool)) for part in parts]
            groups[name] = np.isin(np.arange(len(first)), rank[np.concatenate(mask)])
        number = np.concatenate([part.number for part in parts])
        if len(first) < len(nodes):
            first = np.sort(first)
            nodes, number = nodes[first], number[first]
        return _CellBlock(cell, nodes, number, groups)


def _all_differ(cells: np.ndarray) -> bool:
    """Whether no two cells (n, n_nodes) have the same nodes; by chance False, never True, if so.

    A cell's sign is a sum of random numbers of its nodes: no rows of nodes need be sorted.
    """
    count = int(cells.max(initial=-1)) + 1
    of_node = np.random.default_rng(0).integers(1 << 63, size=count, dtype=np.uint64)
    signs = np.zeros(len(cells), dtype=np.uint64)
    for nodes in cells.T:
        signs += of_node[nodes]
    signs.sort()
    return not (signs[1:] == signs[:-1]).any()


def _numbered(cell: CellType, numbers: np.ndarray) -> str:
    """Type and numbers of faulty cells."""
    shown = ", ".join(str(n) for n in numbers[:_SHOWN])
    more = f" and {len(numbers) - _SHOWN} more" if len(numbers) > _SHOWN else ""
    return f"{cell.name} {shown}{more}"


def _len(ids: object) -> int:
    return 0 if ids is None else len(ids)  # type: ignore[arg-type]


def _order(cell: CellType, dim: int) -> tuple[int, int]:
    return dim - cell.dim, _RANK[cell.name]


def _flattened(points: np.ndarray, dim: int, where: object) -> np.ndarray:
    points = np.asarray(points)
    if points.dtype.kind not in "fiu" or points.ndim != 2 or not dim <= points.shape[1] <= 3:
        found = f"{points.dtype} {points.shape}"
        raise InputError(where, "node coordinates", found, "must be two or three numbers a node")
    points = points.astype(float)
    if not (np.abs(points) <= LARGEST).all():
        allowed = f"must be finite numbers, at most {LARGEST:g}"
        raise InputError(where, "node coordinates", None, allowed)
    if dim == 2 and points.shape[1] == 3:
        if np.ptp(points[:, 2]) > _PLANE * np.ptp(points, axis=0).max():
            allowed = (
                "a mesh of 2D cells must have z = 0; for bodies in 3D cells of volume are missing"
            )
            raise InputError(where, "node coordinates", None, f"{allowed} (docs/formats.md)")
        points = points[:, :2]
    return np.ascontiguousarray(points)


def _attached(blocks: list[_CellBlock], dim: int, n_points: int, where: object) -> list[_CellBlock]:
    inside = np.zeros(n_points, dtype=bool)
    for block in blocks:
        if block.cell.dim == dim:
            inside[block.nodes] = True
    kept = []
    for block in blocks:
        on_volume = inside[block.nodes].all(axis=1)
        for name, mask in block.groups.items():
            if mask.any() and on_volume[mask].any() and not on_volume[mask].all():
                loose = (mask & ~on_volume).sum()
                raise InputError(
                    where, f"group {name}", None, f"{loose} of its {block.cell.name} touch no cell"
                )
        wanted = on_volume if block.cell.dim >= dim - 1 else on_volume & block.named()
        if block.cell.dim == dim - 1:
            wanted |= ~inside[block.nodes].any(axis=1) & block.named()
        if wanted.any():
            kept.append(block if wanted.all() else block.taken(wanted))
    return kept


def _compact(
    points: np.ndarray,
    blocks: list[_CellBlock],
    names: list[str],
    node_groups: dict[str, np.ndarray],
) -> meshio.Mesh:
    present = np.zeros(len(points), dtype=bool)
    for block in blocks:
        present[block.nodes] = True
    used = np.flatnonzero(present)
    # Node numbers take most of the memory of a mesh: from here on they have 32 bits.
    new = np.full(len(points), -1, dtype=np.int32)
    new[used] = np.arange(len(used))
    sets = {
        name: [np.flatnonzero(block.groups.get(name, ())) for block in blocks] for name in names
    }
    node_sets = {name: np.unique(new[ids]) for name, ids in sorted(node_groups.items())}
    return meshio.Mesh(
        points[used],
        [(block.cell.meshio, new[block.nodes]) for block in blocks],
        cell_sets=sets,
        point_sets={n: ids[ids >= 0] for n, ids in node_sets.items()},
    )
