"""Meshes: made by recipe, read, written, moved. The container is `meshio.Mesh` everywhere.

Points (n, dim) with dim 2 or 3; at most one block per cell type, volume cells first, in VTK's node
order and with positive Jacobian; groups of cells in `cell_sets`, of nodes in `point_sets`.
What needs gmsh or h5py is imported when it is called.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import meshio
from meshio._mesh import topological_dimension

from ..lac.cells.catalogue import BY_NAME

# meshio knows the nodes of PENTA15 and PYRA13, but its table of dimensions has no line for them.
for _kind in BY_NAME.values():
    topological_dimension.setdefault(_kind.meshio, _kind.dim)

__all__ = ["generate", "read_mesh", "transform", "write_mesh"]


def generate(recipe: Mapping[str, Any], where: str) -> meshio.Mesh:
    """The mesh of a case file's `mesh:` mapping with the key `recipe`; see `recipes`."""
    from . import recipes

    return recipes.generate(recipe, where)


def transform(mesh: meshio.Mesh, spec: Mapping[str, Any], where: str = "transform") -> meshio.Mesh:
    """The mesh changed as a case file's `transform:` mapping says; see `transforms`."""
    from . import transforms

    return transforms.transform(mesh, spec, where)


def read_mesh(path: str | os.PathLike[str]) -> meshio.Mesh:
    """The mesh in a file, by its extension; see `formats`. Raises InputError naming the file."""
    from .files import formats

    return formats.read(Path(path))


def write_mesh(mesh: meshio.Mesh, path: str | os.PathLike[str]) -> None:
    """Write the mesh, by the extension, whole or not at all; see `formats`.

    The same mesh gives the same bytes as VTKHDF.
    """
    from .files import formats

    formats.write(mesh, Path(path))
