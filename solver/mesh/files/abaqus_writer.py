"""Abaqus input files (.inp), written: nodes, cells, groups as *ELSET, *SURFACE and *NSET."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_MESHIO, BY_NAME, CellType
from ...system.errors import InputError
from .abaqus import FACES

_NAMES = {name: kind.abaqus for name, kind in BY_NAME.items() if kind.abaqus}
# Entries of a data line.
_IN_LINE = 15


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write the mesh with its groups; plane cells are those of plane strain.

    Raises InputError for what the format lacks: TRIA3 … HEXA20 alone, groups of faces behind which
    there are cells, names without commas and quotes that differ by more than capitals.
    """
    _check_names(mesh, path)
    lines = [*_cells(mesh, path), *_cell_groups(mesh), *_face_groups(mesh, path)]
    for name, nodes in mesh.point_sets.items():
        lines += [f"*NSET, NSET={name}", *data_lines((np.asarray(nodes) + 1).tolist())]
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def _check_names(mesh: meshio.Mesh, path: Path) -> None:
    folded = [name.upper() for name in {*mesh.cell_sets, *mesh.point_sets}]
    for name in (*mesh.cell_sets, *mesh.point_sets):
        if folded.count(name.upper()) > 1 or set(name) & set(',"\n'):
            raise InputError(path, "group", name, "Abaqus cannot tell its name from others")


def _blocks(mesh: meshio.Mesh) -> Iterator[tuple[int, int, CellType, np.ndarray]]:
    """The blocks of cells: index, the number of the first cell, type, nodes; no faces."""
    first = 1
    for i, block in enumerate(mesh.cells):
        cell = BY_MESHIO[block.type]
        if cell.dim == mesh.points.shape[1]:
            yield i, first, cell, block.data
            first += len(block.data)


def _cells(mesh: meshio.Mesh, path: Path) -> Iterator[str]:
    yield "*NODE"
    for number, place in enumerate(mesh.points.tolist(), start=1):
        yield f"{number}, " + ", ".join(repr(x) for x in place)
    for _, first, cell, data in _blocks(mesh):
        if cell.name not in _NAMES:
            raise InputError(path, "cell type", cell.name, f"allowed: {', '.join(_NAMES)}")
        yield f"*ELEMENT, TYPE={_NAMES[cell.name]}"
        for number, nodes in enumerate((data + 1).tolist(), start=first):
            yield from data_lines([number, *nodes])


def _cell_groups(mesh: meshio.Mesh) -> Iterator[str]:
    for name, ids in mesh.cell_sets.items():
        numbers = [n for i, first, *_ in _blocks(mesh) for n in (ids[i] + first).tolist()]
        if numbers:
            yield from (f"*ELSET, ELSET={name}", *data_lines(numbers))


def _face_groups(mesh: meshio.Mesh, path: Path) -> Iterator[str]:
    owners = _owners(mesh)
    for name, ids in mesh.cell_sets.items():
        faces = [
            tuple(sorted(face[: BY_MESHIO[block.type].n_vertices]))
            for block, chosen in zip(mesh.cells, ids, strict=True)
            for face in block.data[chosen].tolist()
            if BY_MESHIO[block.type].dim < mesh.points.shape[1]
        ]
        if not all(face in owners for face in faces):
            raise InputError(path, "group", name, "has faces without cells behind them")
        if faces:
            yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
            yield from (owners[face] for face in faces)


def _owners(mesh: meshio.Mesh) -> dict[tuple[int, ...], str]:
    """The line of a *SURFACE, `cell, face`, by the sorted corners of the face."""
    found: dict[tuple[int, ...], str] = {}
    for _, first, cell, data in _blocks(mesh):
        for i, face in enumerate(cell.faces):
            local = list(face.nodes[: BY_NAME[face.type].n_vertices])
            corners = np.sort(data[:, local], axis=1).tolist()
            label = f"S{face_number(cell, i)}"
            found |= {tuple(c): f"{n}, {label}" for n, c in enumerate(corners, start=first)}
    return found


def face_number(cell: CellType, local: int) -> int:
    """The number of a cell's face in Abaqus and CalculiX, from 1.

    >>> from solver.lac.cells.catalogue import BY_NAME
    >>> [face_number(BY_NAME["TETRA4"], i) for i in range(4)]
    [1, 2, 3, 4]
    """
    face = cell.faces[local]
    corners = set(face.nodes[: BY_NAME[face.type].n_vertices])
    labels = [{int(c) - 1 for c in text} for text in FACES[cell.shape]]
    return next(i for i, label in enumerate(labels, start=1) if label <= corners)


def data_lines(numbers: Sequence[int]) -> Iterator[str]:
    """Numbers in lines of 16 at most; a line that goes on ends with a comma."""
    for start in range(0, len(numbers), _IN_LINE):
        more = "," if start + _IN_LINE < len(numbers) else ""
        yield ", ".join(map(str, numbers[start : start + _IN_LINE])) + more
