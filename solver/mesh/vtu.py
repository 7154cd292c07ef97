"""VTU files, read by meshio."""

from pathlib import Path

import meshio
import numpy as np


def read(path: Path) -> meshio.Mesh:
    """The mesh of a .vtu file; integer arrays of 0 and 1 on cells or points are its groups."""
    mesh = meshio.vtu.read(path)
    cells = {
        name: [np.flatnonzero(array) for array in arrays]
        for name, arrays in mesh.cell_data.items()
        if all(map(_is_mask, arrays))
    }
    nodes = {n: np.flatnonzero(array) for n, array in mesh.point_data.items() if _is_mask(array)}
    return meshio.Mesh(mesh.points, mesh.cells, cell_sets=cells, point_sets=nodes)


def _is_mask(array: np.ndarray) -> bool:
    return array.ndim == 1 and array.dtype.kind in "iub" and bool(np.isin(array, (0, 1)).all())
