"""VTU files, by meshio."""

import re
from pathlib import Path

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME
from ...system.errors import InputError

_COMPRESSORS = ("vtkZLibDataCompressor", "vtkLZMADataCompressor")


def read(path: Path) -> meshio.Mesh:
    """The mesh of a .vtu file; integer arrays of 0 and 1 on cells or points are its groups.

    Raises InputError for a compression that meshio does not know, and where it would leave cells
    out whose type it does not know.
    """
    header = path.read_bytes()
    compressor = re.search(rb'<VTKFile[^>]*\scompressor="(\w*)"', header)
    if compressor and compressor[1].decode() not in ("", *_COMPRESSORS):
        allowed = f"allowed: none, {', '.join(_COMPRESSORS)}"
        raise InputError(path, "compressor", compressor[1].decode(), allowed)
    mesh = meshio.vtu.read(path)
    stated = sum(map(int, re.findall(rb'<Piece[^>]*\sNumberOfCells="\s*(\d+)', header)))
    known = sum(len(block.data) for block in mesh.cells)
    if known != stated:
        left_out = f"{stated - known} of {stated} cells are of other types"
        raise InputError(path, "cell type", None, f"{left_out}; allowed: {', '.join(BY_NAME)}")
    cells = {
        name: [np.flatnonzero(array) for array in arrays]
        for name, arrays in mesh.cell_data.items()
        if all(map(_is_mask, arrays))
    }
    nodes = {n: np.flatnonzero(array) for n, array in mesh.point_data.items() if _is_mask(array)}
    return meshio.Mesh(mesh.points, mesh.cells, cell_sets=cells, point_sets=nodes)


def _is_mask(array: np.ndarray) -> bool:
    return array.ndim == 1 and array.dtype.kind in "iub" and bool(np.isin(array, (0, 1)).all())


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write the mesh; each group is an array of 0 and 1 on cells or points, of its name."""
    cells = {
        name: [_mask(len(block.data), i) for block, i in zip(mesh.cells, ids, strict=True)]
        for name, ids in mesh.cell_sets.items()
    }
    nodes = {name: _mask(len(mesh.points), ids) for name, ids in mesh.point_sets.items()}
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    meshio.vtu.write(path, meshio.Mesh(points, mesh.cells, cell_data=cells, point_data=nodes))


def _mask(count: int, members: np.ndarray) -> np.ndarray:
    mask = np.zeros(count, dtype=np.int8)
    mask[np.asarray(members, dtype=int)] = 1
    return mask
