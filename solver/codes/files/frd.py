"""FRD files of CalculiX, as text: mesh, and the last of each block of nodal results.

The format is described in the manual of CalculiX GraphiX: records begin with a key in three
columns; numbers have fixed columns (10 for labels, 12 for values; 5 for labels in short files).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...system.errors import InputError
from .raw import Raw, RawField, plain_mesh

# Cells by number, and the places of VTK's nodes where the order is another one.
_CELLS = {
    1: "hexahedron", 2: "wedge", 3: "tetra", 4: "hexahedron20", 5: "wedge15", 6: "tetra10",
    7: "triangle", 8: "triangle6", 9: "quad", 10: "quad8",
}  # fmt: skip
_ORDER = {4: [*range(12), *range(16, 20), *range(12, 16)], 5: [*range(9), 12, 13, 14, 9, 10, 11]}
# Blocks that list only the nodes concerned: all others have zero.
_PARTIAL = {"CONTACT"}
_VALUE, _DIGITS = 12, 6


def read(path: Path) -> Raw:
    """The content of an FRD file; raises InputError for a binary one, and for one without nodes."""
    lines = path.read_text(encoding="ascii", errors="replace").splitlines()
    version, numbers, places = "", np.empty(0, dtype=int), np.empty((0, 3))
    cells: list[tuple[str, np.ndarray]] = []
    blocks: dict[str, tuple[tuple[str, ...], np.ndarray, np.ndarray]] = {}
    position = 0
    while position < len(lines):
        line = lines[position]
        position += 1
        key = line[:6].strip()
        if line.startswith("    1UVERSION"):
            version = line[13:].strip().removeprefix("Version").strip()
        elif key in ("2C", "3C", "100CL") and line.rstrip()[-1:] in "23" and line[73:75].strip():
            raise InputError(path, "format", None, "binary: only FRD files as text can be read")
        elif key == "2C":
            block, position = _block(lines, position)
            numbers, places = _records(block, line)
        elif key == "3C":
            block, position = _block(lines, position)
            cells = _cells(block, line)
        elif key.startswith("100C"):
            name, components, position = _head(lines, position)
            block, position = _block(lines, position)
            blocks[name] = components, *_records(block, line)
    if not len(numbers):
        raise InputError(
            path, "nodes", None, "the file has none: not an FRD file, or a damaged one"
        )
    return _assembled(numbers, places, cells, blocks, version)


def _assembled(
    numbers: np.ndarray,
    places: np.ndarray,
    cells: list[tuple[str, np.ndarray]],
    blocks: dict[str, tuple[tuple[str, ...], np.ndarray, np.ndarray]],
    version: str,
) -> Raw:
    """Labels of nodes replaced by their places in the list."""
    order = np.argsort(numbers)

    def place_of(labels: np.ndarray) -> np.ndarray:
        return order[np.searchsorted(numbers[order], labels)]

    mesh = plain_mesh(places, [(name, place_of(data)) for name, data in cells])
    fields = {}
    for name, (components, labels, values) in blocks.items():
        if not np.isin(labels, numbers).all():
            continue  # of nodes that the mesh has not, as of expanded ones in the plane
        nodes, given = place_of(labels), values[:, : len(components)]
        if name in _PARTIAL:
            given = np.zeros((len(places), given.shape[1]))
            given[nodes] = values[:, : len(components)]
            nodes = np.arange(len(places))
        fields[name] = RawField(given, components, mesh.points[nodes], nodes)
    return Raw(mesh, fields, "calculix", version, _DIGITS)


def _block(lines: list[str], start: int) -> tuple[list[str], int]:
    """The records up to the end of a block, and where the next one begins."""
    for stop in range(start, len(lines)):
        if lines[stop].startswith(" -3"):
            return lines[start:stop], stop + 1
    return lines[start:], len(lines)


def _width(head: str) -> int:
    """The columns of a label: 5 in short files, else 10."""
    return 5 if head.rstrip().endswith(" 0") else 10


def _records(block: list[str], head: str) -> tuple[np.ndarray, np.ndarray]:
    """Labels (k,) and values (k, c)."""
    start = 3 + _width(head)
    labels, values = [], []
    for line in block:
        numbers = [float(line[i : i + _VALUE]) for i in range(start, len(line.rstrip()), _VALUE)]
        if line.startswith(" -1"):
            labels.append(int(line[3:start]))
            values.append(numbers)
        elif line.startswith(" -2"):
            values[-1] += numbers
    return np.array(labels, dtype=int), np.array(values, dtype=float)


def _cells(block: list[str], head: str) -> list[tuple[str, np.ndarray]]:
    """Cells by type, with labels of nodes in VTK's order."""
    width = _width(head)
    kinds: dict[int, list[list[int]]] = {}
    for line in block:
        if line.startswith(" -1"):
            rows = kinds.setdefault(int(line[3 + width : 8 + width]), [])
            rows.append([])
        elif line.startswith(" -2"):
            rows[-1] += list(_labels(line, width))
    found = []
    for kind, rows in kinds.items():
        if kind in _CELLS:
            nodes = np.array(rows, dtype=int)
            found.append((_CELLS[kind], nodes[:, _ORDER.get(kind, slice(None))]))
    return found


def _labels(line: str, width: int) -> Iterator[int]:
    text = line.rstrip()
    return (int(text[i : i + width]) for i in range(3, len(text), width))


def _head(lines: list[str], start: int) -> tuple[str, tuple[str, ...], int]:
    """Name and components of a block of results, and where its values begin."""
    name, components, stop = "", [], start
    for stop in range(start, len(lines)):
        line = lines[stop]
        if line.startswith(" -4"):
            name = line[3:13].strip()
        elif line.startswith(" -5"):
            if line[3:13].strip() != "ALL":
                components.append(line[3:13].strip())
        else:
            break
    return name, tuple(components), stop
