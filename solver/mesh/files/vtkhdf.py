"""VTKHDF UnstructuredGrid 2.0, with plain h5py: what ParaView and PyVista open, and our groups.

Beside the grid lies `mesh_groups`: `cells/<name>` and `nodes/<name>` hold the numbers of a group's
cells and nodes in the grid. A table is a group with one data set for each column. The same mesh
gives the same bytes.

Files are made in memory and written in one piece: on a full disk HDF5 itself fails at any later
place.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME, cell_type
from ...system.errors import InputError
from ...system.files import seal, seal_of

# Memory is asked for in pieces of this size (bytes).
_PIECE = 1 << 20


@contextmanager
def new_file(path: Path) -> Iterator[h5py.File]:
    """An HDF5 file in memory, written to `path` in one go when the block ends well.

    Raises OSError where the disk is full.
    """
    with h5py.File(path, "w", driver="core", backing_store=False, block_size=_PIECE) as file:
        yield file
        file.flush()
        image = file.id.get_file_image()
    path.write_bytes(image)


def write_table(group: h5py.Group, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write the rows' columns; nothing at all where there are no rows."""
    for key in rows[0] if rows else ():
        group[key] = column([row[key] for row in rows])


def column(values: list[Any]) -> np.ndarray:
    """An array of numbers, None as NaN, or of texts, None as an empty one."""
    if not values or any(isinstance(value, str) for value in values):
        return np.array([value or "" for value in values], dtype=h5py.string_dtype())
    return np.array([np.nan if value is None else value for value in values])


def read_table(group: h5py.Group) -> list[dict[str, Any]]:
    """Rows of a table that `write_table` wrote, as plain Python values."""
    columns = {
        name: (data.asstr()[()] if h5py.check_string_dtype(data.dtype) else data[()]).tolist()
        for name, data in group.items()
        if isinstance(data, h5py.Dataset)
    }
    rows = zip(*columns.values(), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


class Earlier(NamedTuple):
    """Positions before that of a grid: points (n, dim), and fields as the grid has them.

    `times` (s,) of all positions, the grid's own as the last.
    """

    times: Sequence[float]
    positions: Sequence[tuple[np.ndarray, Mapping[str, np.ndarray], Mapping[str, np.ndarray]]]


ALONE = Earlier((), ())
"""No position before that of a grid."""
_BY_VTK = {cell.vtk: cell for cell in BY_NAME.values()}
_GROUPS = "mesh_groups"


def write_grid(
    group: h5py.Group,
    mesh: meshio.Mesh,
    point_data: Mapping[str, np.ndarray],
    cell_data: Mapping[str, np.ndarray],
    earlier: Earlier = ALONE,
) -> None:
    """Write the grid into `group` (named VTKHDF for ParaView), its groups beside it.

    point_data (n_points, …) and cell_data (n_cells, …), cells counted block after block. Points of
    a 2D mesh get z = 0; the attribute `Dimension` has the dimension. Points and fields of `earlier`
    positions stand before those of the grid, on the same cells.
    """
    group.attrs["Version"] = np.array([2, 0], dtype=np.int64)
    grid = b"UnstructuredGrid"
    group.attrs.create("Type", grid, dtype=h5py.string_dtype("ascii", len(grid)))
    dim = mesh.points.shape[1]
    group.attrs["Dimension"] = dim
    cells = [(cell_type(block.type), block.data) for block in mesh.cells]
    sizes = np.repeat([cell.n_nodes for cell, _ in cells], [len(nodes) for _, nodes in cells])
    flat = [nodes.ravel() for _, nodes in cells]
    all_points = [*(one[0] for one in earlier.positions), mesh.points]
    points = np.pad(np.concatenate(all_points), ((0, 0), (0, 3 - dim)))
    arrays = {
        "NumberOfPoints": np.array([len(mesh.points)]),
        "NumberOfCells": np.array([len(sizes)]),
        "NumberOfConnectivityIds": np.array([sizes.sum()]),
        "Points": points,
        "Connectivity": np.concatenate(flat).astype(np.int64),
        "Offsets": np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        "Types": np.repeat([c.vtk for c, _ in cells], [len(n) for _, n in cells]).astype(np.uint8),
    }
    for name, array in arrays.items():
        group.create_dataset(name, data=array)
    for which, (kind, data) in enumerate((("PointData", point_data), ("CellData", cell_data)), 1):
        folder = group.create_group(kind)
        for name, array in data.items():
            whole = [*(one[which][name] for one in earlier.positions), array]
            folder.create_dataset(name, data=np.concatenate(whole) if len(whole) > 1 else array)
    if earlier.positions:
        _write_times(group.create_group("Steps"), earlier.times, len(mesh.points), len(sizes))
    _write_groups(group.parent.create_group(_GROUPS), mesh)


def _write_times(folder: h5py.Group, times: Sequence[float], points: int, cells: int) -> None:
    """Where each position begins; all have the same cells (VTKHDF 2.0, temporal data)."""
    count = np.arange(len(times))
    folder.attrs["NSteps"] = len(times)
    folder["Values"] = np.array(times, dtype=float)
    folder["PartOffsets"], folder["NumberOfParts"] = 0 * count, np.ones_like(count)
    folder["PointOffsets"] = count * points
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        folder[name] = np.zeros((len(times), 1), dtype=np.int64)
    grid = folder.parent
    for kind, size in (("PointData", points), ("CellData", cells)):
        for name in grid[kind]:
            folder[f"{kind}Offsets/{name}"] = count * size


def read_earlier(
    group: h5py.Group,
) -> list[tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]]:
    """Points and fields of the positions before that of a grid."""
    dim, found = int(group.attrs["Dimension"]), []
    points, cells = (int(group[f"NumberOf{name}"][0]) for name in ("Points", "Cells"))
    steps = int(group["Steps"].attrs["NSteps"]) if "Steps" in group else 1
    for step in range(steps - 1):
        rows = {
            "PointData": slice(step * points, (step + 1) * points),
            "CellData": slice(step * cells, (step + 1) * cells),
        }
        data = ({n: d[of] for n, d in group[kind].items()} for kind, of in rows.items())
        found.append((group["Points"][rows["PointData"], :dim], *data))
    return found


def read_cells(group: h5py.Group) -> tuple[list[tuple[str, np.ndarray]], list[tuple[int, int]]]:
    """The blocks of cells (meshio's type, nodes) of a grid, and the first and last of each.

    Raises InputError for a type that the catalogue has not.
    """
    offsets, types = group["Offsets"][()], group["Types"][()]
    connectivity = group["Connectivity"][()]
    breaks = np.flatnonzero(np.diff(types)) + 1
    bounds = list(pairwise([0, *breaks.tolist(), len(types)]))
    if unknown := {int(types[start]) for start, _ in bounds} - set(_BY_VTK):
        allowed = f"allowed: {', '.join(BY_NAME)}"
        raise InputError(group.file.filename, "cell type", min(unknown), allowed)
    cells = []
    for start, stop in bounds:
        cell = _BY_VTK[int(types[start])]
        nodes = connectivity[offsets[start] : offsets[stop]].reshape(-1, cell.n_nodes)
        cells.append((cell.meshio, nodes))
    return cells, bounds


def last_of(group: h5py.Group, name: str) -> np.ndarray:
    """The rows of a data set of a grid that belong to its last step, or all without steps.

    `name`: Points, or that of a field, as PointData/displacement. Earlier steps stand first.
    """
    kind, _, field = name.partition("/")
    starts = group.get(f"Steps/{kind}Offsets/{field}" if field else "Steps/PointOffsets")
    count = "NumberOfCells" if kind == "CellData" else "NumberOfPoints"
    start, rows = 0 if starts is None else int(np.ravel(starts[()])[-1]), int(group[count][0])
    return np.asarray(group[name][start : start + rows])


def read_grid(group: h5py.Group) -> tuple[meshio.Mesh, dict, dict]:
    """The mesh of a grid that `write_grid` wrote at its last position, and its fields."""
    dim = int(group.attrs["Dimension"])
    cells, bounds = read_cells(group)
    cell_sets, point_sets = {}, {}
    groups = group.parent[_GROUPS]
    for name, numbers in groups["cells"].items():
        ids = numbers[()]
        cell_sets[_plain(name)] = [
            ids[(ids >= start) & (ids < stop)] - start for start, stop in bounds
        ]
    for name, ids in groups["nodes"].items():
        point_sets[_plain(name)] = ids[()]
    points = last_of(group, "Points")[:, :dim]
    mesh = meshio.Mesh(points, cells, cell_sets=cell_sets, point_sets=point_sets)
    kinds = "PointData", "CellData"
    return mesh, *({n: last_of(group, f"{kind}/{n}") for n in group[kind]} for kind in kinds)


def check_name(path: Path) -> None:
    """Raise InputError for a name that readers would not take for VTKHDF."""
    if path.suffix != ".vtkhdf":
        raise InputError(path, "extension", path.suffix, "must be .vtkhdf")


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write the mesh alone into a new file."""
    with new_file(path) as file:
        write_grid(file.create_group("VTKHDF"), mesh, {}, {})
    seal(path)


def read(path: Path) -> meshio.Mesh:
    """The mesh of a file that `write` or the solver wrote.

    Raises InputError; where the file is a line of text instead, with that line.
    """
    if not h5py.is_hdf5(path):
        lines = path.read_text(errors="replace")[:2000].splitlines()
        raise InputError(path, "mesh", None, lines[0] if lines else "the file is empty")
    if not seal_of(path):
        raise InputError(path, "mesh", None, "damaged, or no mesh that this program wrote")
    with h5py.File(path) as file:
        if "VTKHDF" not in file or _GROUPS not in file:
            raise InputError(path, "mesh", None, "no mesh that this program wrote")
        return read_grid(file["VTKHDF"])[0]


def _write_groups(folder: h5py.Group, mesh: meshio.Mesh) -> None:
    cells, nodes = folder.create_group("cells"), folder.create_group("nodes")
    starts = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    for name, ids in mesh.cell_sets.items():
        numbers = [start + np.asarray(i, np.int64) for start, i in zip(starts, ids, strict=False)]
        cells.create_dataset(_escaped(name), data=np.concatenate(numbers))
    for name, ids in mesh.point_sets.items():
        nodes.create_dataset(_escaped(name), data=np.asarray(ids, np.int64))


# HDF5 takes a slash, and a name of nothing but a dot, for a path.
def _escaped(name: str) -> str:
    return name.replace("%", "%25").replace("/", "%2F").replace(".", "%2E")


def _plain(name: str) -> str:
    return name.replace("%2E", ".").replace("%2F", "/").replace("%25", "%")
