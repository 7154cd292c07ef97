"""Mesh files of gmsh: versions 2 and 4 are read, 4 is written, by gmsh itself.

Groups that share members are written as the sets that a member alone can belong to.
"""

import errno
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import gmsh
import meshio
import numpy as np

from ...lac.cells.catalogue import BY_MESHIO, BY_NAME
from ...system.errors import InputError
from ..recipes.gmsh_session import POINT, current_model, foreign_types, node_order, session

_END = b"$EndElements\n"


def combinations(
    count: int, groups: Mapping[str, Sequence[int] | np.ndarray]
) -> tuple[np.ndarray, list[list[str]]]:
    """Which combination (n,) of groups each of `count` members is in, and the names of each.

    >>> of, names = combinations(3, {"a": [0, 1], "b": [1]})
    >>> of.tolist(), names
    ([1, 2, 0], [[], ['a'], ['a', 'b']])
    """
    known = sorted(groups)
    inside = np.zeros((count, len(known)), dtype=bool)
    for column, name in enumerate(known):
        inside[np.asarray(groups[name], dtype=int), column] = True
    found, of = np.unique(inside, axis=0, return_inverse=True)
    return of.ravel(), [[n for n, there in zip(known, row, strict=True) if there] for row in found]


def read(path: Path) -> meshio.Mesh:
    """The mesh of a .msh file; physical groups are its groups."""
    # Handed anything else, gmsh runs it as a script.
    with path.open("rb") as file:
        if not file.read(4096).lstrip().startswith(b"$"):
            raise InputError(path, "mesh", None, "no gmsh mesh: it must start with $MeshFormat")
    with session():
        gmsh.merge(str(path))
        if foreign := foreign_types():
            allowed = f"allowed: {', '.join(BY_NAME)}"
            raise InputError(path, "cell type", ", ".join(foreign), allowed)
        return current_model()


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write the mesh; its groups are physical ones, those of nodes as points.

    Raises OSError where the file cannot be written; gmsh does not report a full disk.
    """
    path.touch()
    numbers = np.arange(1, 1 + len(mesh.points))
    places = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    members: dict[tuple[int, str], list[int]] = {}
    with session(Mesh__SaveAll=1):
        first = gmsh.model.addDiscreteEntity(mesh.points.shape[1])
        gmsh.model.mesh.addNodes(mesh.points.shape[1], first, numbers, places.ravel())

        def add(dim: int, kind: int, nodes: np.ndarray, names: list[str]) -> None:
            entity = gmsh.model.addDiscreteEntity(dim)
            gmsh.model.mesh.addElementsByType(entity, kind, [], numbers[nodes].ravel())
            for name in names:
                members.setdefault((dim, name), []).append(entity)

        for i, block in enumerate(mesh.cells):
            cell = BY_MESHIO[block.type]
            theirs = block.data[:, np.argsort(node_order(cell.name))]
            of, names = combinations(len(theirs), {n: ids[i] for n, ids in mesh.cell_sets.items()})
            for k, each in enumerate(names):
                add(cell.dim, cell.gmsh, theirs[of == k], each)
        of, names = combinations(len(numbers), mesh.point_sets)
        for k, each in enumerate(names):
            if each:
                add(0, POINT, np.flatnonzero(of == k), each)
        for (dim, name), entities in members.items():
            gmsh.model.addPhysicalGroup(dim, entities, name=name)
        gmsh.write(str(path))
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - len(_END), 0))
        if file.read() != _END:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
