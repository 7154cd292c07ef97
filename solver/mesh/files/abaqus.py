"""Abaqus input files (.inp), read and written: nodes, cells, sets.

Read here and not by meshio, which knows no *SURFACE, no plane strain quadrangles, and gives sets
named in *ELEMENT to the wrong cells. Groups are written as *ELSET, *SURFACE and *NSET.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_MESHIO, BY_NAME, CellType
from ...system.errors import InputError

_SOLIDS = {k.n_nodes: name for name, k in BY_NAME.items() if k.dim == 3 and k.abaqus}
_SURFACES = {kind.n_nodes: name for name, kind in BY_NAME.items() if kind.dim == 2}
_LINES = {
    "T2D2": "SEG2", "T3D2": "SEG2", "B21": "SEG2", "B31": "SEG2", "R2D2": "SEG2",
    "T2D3": "SEG3", "T3D3": "SEG3", "B22": "SEG3", "B32": "SEG3",
}  # fmt: skip
# Node orders are the catalogue's, except that lines have their middle node second.
_MIDDLE_SECOND = [0, 2, 1]
_PLANE = re.compile(r"(?:CPE|CPS|CAX|M3D|SFM3D|R3D|DS|STRI|S)(\d)")
# Corners of the faces S1, S2, … of each shape, counted from 1.
FACES = {
    "TRIA": ["12", "23", "31"],
    "QUAD": ["12", "23", "34", "41"],
    "TETRA": ["123", "142", "243", "341"],
    "PYRA": ["1234", "152", "253", "354", "451"],
    "PENTA": ["123", "465", "1452", "2563", "3641"],
    "HEXA": ["1234", "5876", "1562", "2673", "3784", "4851"],
}
# Keywords that make or place nodes and cells in ways not supported here.
_REFUSED = ("NGEN", "NCOPY", "NFILL", "ELGEN", "ELCOPY", "NMAP", "SYSTEM")


def read(path: Path) -> meshio.Mesh:
    """The mesh of an input file; *ELSET, *SURFACE and *NSET are its groups.

    At most one part and one instance, placed at the origin. Raises InputError for element types and
    keywords that are not followed.
    """
    deck = _Deck(path)
    for keyword, options, lines in _keywords(path):
        deck.take(keyword, options, lines)
    return deck.mesh()


def files_of(path: Path) -> list[Path]:
    """The file and all that it includes, in their order; those that are missing as well."""
    found, waiting = [], [path]
    while waiting:
        found.append(waiting.pop(0))
        try:
            text = found[-1].read_text(errors="replace")
        except OSError:
            continue
        named = [found[-1].parent / name for name in _INCLUDED.findall(text)]
        waiting += [file for file in named if file not in found and file not in waiting]
    return found


_INCLUDED = re.compile(
    r'^[ \t]*\*include[ \t]*,[ \t]*input[ \t]*=[ \t]*"?(.*?)"?[ \t]*$', re.IGNORECASE | re.MULTILINE
)
_Options = dict[str, str]
_Lines = list[list[str]]
# A cell or face: its number (0 for a face of a surface), its nodes, the names of its groups.
_Row = tuple[int, list[int], set[str]]


def _keywords(path: Path) -> Iterator[tuple[str, _Options, _Lines]]:
    """Each keyword line with its options and the data lines below it, includes followed."""
    block: tuple[str, _Options, _Lines] | None = None
    for line in path.read_text(errors="replace").splitlines():
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not text.startswith("*"):
            if block:
                block[2].append([field.strip() for field in text.split(",")])
            continue
        if block:
            yield block
        head, *rest = text[1:].split(",")
        pairs = [part.partition("=") for part in rest]
        options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
        block = (head.strip().upper(), options, [])
        if block[0] == "INCLUDE":
            yield from _keywords(path.parent / options.get("INPUT", ""))
            block = None
    if block:
        yield block


class _Deck:
    """The content of all keywords; Abaqus ignores the case of names."""

    def __init__(self, path: Path):
        self.path = path
        self.nodes: dict[int, list[float]] = {}
        self.cells: dict[int, tuple[CellType, list[int]]] = {}
        self.cell_sets: dict[str, list[int]] = defaultdict(list)
        self.node_sets: dict[str, list[int]] = defaultdict(list)
        self.surfaces: dict[str, _Lines] = {}
        self.spelling: dict[str, str] = {}
        self.seen: set[str] = set()

    def _refuse(self, key: str, value: object, allowed: str) -> InputError:
        return InputError(self.path, key, value, allowed)

    def take(self, keyword: str, options: _Options, lines: _Lines) -> None:
        if keyword in _REFUSED:
            raise self._refuse(f"*{keyword}", None, "not followed: write out the mesh")
        if keyword in ("PART", "INSTANCE"):
            if keyword in self.seen or lines:
                allowed = "allowed: one part and one instance, not moved"
                raise self._refuse(f"*{keyword}", None, allowed)
            self.seen.add(keyword)
        elif keyword == "NODE":
            self._take_nodes(options, lines)
        elif keyword == "ELEMENT":
            self._take_cells(options, lines)
        elif keyword in ("NSET", "ELSET"):
            sets = self.node_sets if keyword == "NSET" else self.cell_sets
            self._take_set(sets, options[keyword], "GENERATE" in options, lines)
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            self.surfaces[self._key(options["NAME"])] = lines

    def _key(self, name: str) -> str:
        self.spelling.setdefault(name.upper(), name)
        return name.upper()

    def _take_nodes(self, options: _Options, lines: _Lines) -> None:
        for number, *place in lines:
            if int(number) in self.nodes:
                raise self._refuse("*NODE", int(number), "two nodes have this number")
            self.nodes[int(number)] = ([float(x) for x in place[:3] if x] + [0.0] * 3)[:3]
        if "NSET" in options:
            self.node_sets[self._key(options["NSET"])] += [int(line[0]) for line in lines]

    def _take_cells(self, options: _Options, lines: _Lines) -> None:
        kind = options.get("TYPE", "")
        cell = self._cell_type(kind.upper())
        flat = [int(field) for line in lines for field in line if field]
        if len(flat) % (cell.n_nodes + 1):
            raise self._refuse("*ELEMENT", None, f"each {kind} must have {cell.n_nodes} nodes")
        table = np.array(flat).reshape(-1, cell.n_nodes + 1)
        if cell.name == "SEG3":
            table[:, 1:] = table[:, 1:][:, _MIDDLE_SECOND]
        for number, *nodes in table.tolist():
            missing = next((n for n in nodes if n not in self.nodes), None)
            if missing is not None:
                raise self._refuse("node", missing, f"cell {number} has it, *NODE has not")
            if number in self.cells:
                raise self._refuse("*ELEMENT", number, "two cells have this number")
            self.cells[number] = (cell, nodes)
        if "ELSET" in options:
            self.cell_sets[self._key(options["ELSET"])] += table[:, 0].tolist()

    def _cell_type(self, name: str) -> CellType:
        plane = _PLANE.match(name)
        found = _LINES.get(name.removesuffix("H"))
        if solid := re.match(r"C3D(\d+)", name):
            found = _SOLIDS.get(int(solid[1]))
        elif plane and not found:
            found = _SURFACES.get(int(plane[1]))
        if found is None:
            allowed = "C3D4, C3D5, C3D6, C3D8, C3D10, C3D15, C3D20, CPE3, CPE4, CPE6, CPE8 and kin"
            raise self._refuse("*ELEMENT, TYPE", name, f"allowed: {allowed}")
        return BY_NAME[found]

    def _take_set(
        self, sets: dict[str, list[int]], name: str, generate: bool, lines: _Lines
    ) -> None:
        members = sets[self._key(name)]
        for line in lines:
            fields = [field for field in line if field]
            if generate:
                first, last, *step = map(int, fields)
                members += range(first, last + 1, *step)
                continue
            for field in fields:
                if not field.isdigit() and field.upper() not in sets:
                    raise self._refuse(f"set {name}", field, "no such set above it")
                members += [int(field)] if field.isdigit() else sets[field.upper()]

    def mesh(self) -> meshio.Mesh:
        """The mesh: cells of a type in one block, the faces of surfaces after them."""
        names: dict[int, set[str]] = defaultdict(set)
        for name, members in self.cell_sets.items():
            for number in members:
                names[number].add(name)
        rows: dict[CellType, list[_Row]] = defaultdict(list)
        for number, (cell, nodes) in self.cells.items():
            rows[cell].append((number, nodes, names[number]))
        for name, lines in self.surfaces.items():
            for cell, nodes in self._faces(name, lines):
                rows[cell].append((0, nodes, {name}))
        rank = {number: i for i, number in enumerate(self.nodes)}
        return meshio.Mesh(
            np.array(list(self.nodes.values())).reshape(-1, 3),
            [
                (cell.meshio, np.array([[rank[n] for n in nodes] for _, nodes, _ in row]))
                for cell, row in rows.items()
            ],
            cell_data={"number": [np.array([n for n, _, _ in row]) for row in rows.values()]},
            cell_sets={
                self.spelling[name]: [
                    np.flatnonzero([name in of for _, _, of in row]) for row in rows.values()
                ]
                for name in {**self.cell_sets, **self.surfaces}
            },
            point_sets={
                self.spelling[name]: np.array([rank[n] for n in members if n in rank], np.int64)
                for name, members in self.node_sets.items()
            },
        )

    def _faces(self, name: str, lines: _Lines) -> Iterator[tuple[CellType, list[int]]]:
        """The faces of a surface, whose lines hold a cell, or a set of them, and a face."""
        for owner, *label in lines:
            if not owner.isdigit() and owner.upper() not in self.cell_sets:
                raise self._refuse(f"surface {self.spelling[name]}", owner, "no such set of cells")
            numbers = [int(owner)] if owner.isdigit() else self.cell_sets[owner.upper()]
            for number in numbers:
                if number not in self.cells:
                    raise self._refuse(f"surface {self.spelling[name]}", number, "no such cell")
                yield self._face(*self.cells[number], label[0].upper() if label else "")

    def _face(self, cell: CellType, nodes: list[int], label: str) -> tuple[CellType, list[int]]:
        corners = FACES[cell.shape]
        number = int(label[1:]) if re.fullmatch(r"S\d", label) else 0
        if not 0 < number <= len(corners):
            # Without a number, or as SPOS and SNEG: the shell itself is the face.
            return cell, nodes
        wanted = {int(c) - 1 for c in corners[number - 1]}
        face = next(f for f in cell.faces if wanted <= set(f.nodes))
        return BY_NAME[face.type], [nodes[i] for i in face.nodes]


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
