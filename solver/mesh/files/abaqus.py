"""Abaqus input files (.inp), read and written: nodes, cells, sets.

Read here and not by meshio, which knows no *SURFACE, no plane strain quadrangles, and gives sets
named in *ELEMENT to the wrong cells. Groups are written as *ELSET, *SURFACE and *NSET. Lines,
keywords and options are those of `deck_lines`; what is not understood is refused with its line.
"""

import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_MESHIO, BY_NAME, CellType
from ...system.errors import InputError
from .deck_lines import Keyword, integer, keyword_blocks, place_of

_SOLIDS = {k.n_nodes: name for name, k in BY_NAME.items() if k.dim == 3 and k.abaqus}
_SURFACES = {kind.n_nodes: name for name, kind in BY_NAME.items() if kind.dim == 2}
_LINES = {
    "T2D2": "SEG2", "T3D2": "SEG2", "B21": "SEG2", "B31": "SEG2", "R2D2": "SEG2",
    "T2D3": "SEG3", "T3D3": "SEG3", "B22": "SEG3", "B32": "SEG3", "B33": "SEG3",
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
# Faces of the cells of a surface that are the cells themselves.
_ITSELF = ("", "SPOS", "SNEG")


def read(path: Path) -> meshio.Mesh:
    """The mesh of an input file; *ELSET, *SURFACE and *NSET are its groups.

    At most one part and one instance, placed at the origin. Raises InputError, with the line, for
    element types, keywords and options that are not followed.
    """
    deck = _Deck(path)
    for block in keyword_blocks(path):
        deck.take(block)
    return deck.mesh()


# A cell or face: its number (0 for a face of a surface), its nodes, the names of its groups.
_Row = tuple[int, list[int], set[str]]


@dataclass
class _Set:
    """Numbers given one by one, with the line that gives them, and ranges, of which some exist."""

    numbers: dict[int, str] = field(default_factory=dict)
    ranges: dict[range, None] = field(default_factory=dict)

    def add(self, other: "_Set") -> None:
        self.numbers |= other.numbers
        self.ranges |= other.ranges

    def among(self, known: Collection[int]) -> set[int]:
        """The members that are among the known numbers."""
        found = {n for n in self.numbers if n in known}
        for run in self.ranges:
            few, many = (run, known) if len(run) < len(known) else (known, run)
            found.update(n for n in few if n in many)
        return found


class _Deck:
    """The content of all keywords; Abaqus ignores the case of names."""

    def __init__(self, path: Path):
        self.path = path
        self.nodes: dict[int, list[float]] = {}
        self.cells: dict[int, tuple[CellType, list[int]]] = {}
        self.cell_sets: dict[str, _Set] = defaultdict(_Set)
        self.node_sets: dict[str, _Set] = defaultdict(_Set)
        self.surfaces: dict[str, Keyword] = {}
        self.sections: list[Keyword] = []
        self.beams: Keyword | None = None
        self.spelling: dict[str, str] = {}
        self.seen: set[str] = set()

    @property
    def dim(self) -> int:
        """The dimension of the cells that make the bodies."""
        return max((cell.dim for cell, _ in self.cells.values()), default=0)

    def take(self, block: Keyword) -> None:
        if block.keyword in ("PART", "INSTANCE"):
            if block.keyword in self.seen or block.lines:
                raise block.refusal("allowed: one part and one instance, not moved")
            self.seen.add(block.keyword)
        elif block.keyword == "NODE":
            self._take_nodes(block)
        elif block.keyword == "ELEMENT":
            self._take_cells(block)
        elif block.keyword == "ELSET":
            self._take_set(self.cell_sets, block, block.options["ELSET"])
        elif block.keyword == "NSET":
            self._take_set(self.node_sets, block, block.options["NSET"])
        elif block.keyword == "SURFACE":
            self._take_surface(block)
        elif block.keyword.endswith("SECTION") and "ELSET" in block.options:
            self.sections.append(block)

    def _key(self, name: str) -> str:
        self.spelling.setdefault(name.upper(), name)
        return name.upper()

    def _take_nodes(self, block: Keyword) -> None:
        members = _Set()
        for line in block.lines:
            n = integer(line, 0)
            if n in self.nodes:
                raise line.refusal("*NODE", n, "two nodes have this number")
            self.nodes[n] = place_of(line, block.options.get("SYSTEM", "R").upper(), block)
            members.numbers[n] = line.where
        if "NSET" in block.options:
            self.node_sets[self._key(block.options["NSET"])].add(members)

    def _take_cells(self, block: Keyword) -> None:
        kind = block.options["TYPE"]
        cell = self._cell_type(block, kind.upper())
        if kind.upper().startswith("B"):
            self.beams = block
        flat = [(line, i) for line in block.lines for i in range(len(line.fields))]
        size = cell.n_nodes + 1
        if len(flat) % size:
            raise block.refusal(f"each {kind} must have {cell.n_nodes} nodes")
        numbers = [integer(line, i) for line, i in flat]
        members = _Set()
        for start in range(0, len(flat), size):
            line, n, nodes = flat[start][0], numbers[start], numbers[start + 1 : start + size]
            if cell.name == "SEG3":
                nodes = [nodes[i] for i in _MIDDLE_SECOND]
            missing = next((i for i in nodes if i not in self.nodes), None)
            if missing is not None:
                raise line.refusal("node", missing, f"cell {n} has it, *NODE has not")
            if n in self.cells:
                raise line.refusal("*ELEMENT", n, "two cells have this number")
            self.cells[n] = (cell, nodes)
            members.numbers[n] = line.where
        if "ELSET" in block.options:
            self.cell_sets[self._key(block.options["ELSET"])].add(members)

    def _cell_type(self, block: Keyword, name: str) -> CellType:
        plane = _PLANE.match(name)
        found = _LINES.get(name.removesuffix("H"))
        if solid := re.match(r"C3D(\d+)", name):
            found = _SOLIDS.get(int(solid[1]))
        elif plane and not found:
            found = _SURFACES.get(int(plane[1]))
        if found is None:
            allowed = "C3D4, C3D5, C3D6, C3D8, C3D10, C3D15, C3D20, CPE3, CPE4, CPE6, CPE8 and kin"
            raise InputError(block.where, "*ELEMENT, TYPE", name, f"allowed: {allowed}")
        return BY_NAME[found]

    def _take_set(self, sets: dict[str, _Set], block: Keyword, name: str) -> None:
        members = sets[self._key(name)]
        for line in block.lines:
            if "GENERATE" in block.options:
                first, last = (integer(line, i) for i in (0, 1))
                step = integer(line, 2) if len(line.fields) > 2 else 1
                if not step or (last - first) % step or (last - first) // step < 0:
                    allowed = "the increment must lead from the first number to the last"
                    raise line.refusal(f"set {name}", step, allowed)
                members.ranges[range(first, last + (1 if step > 0 else -1), step)] = None
                continue
            for i, entry in enumerate(line.fields):
                if entry.upper() in sets:
                    members.add(sets[entry.upper()])
                elif entry.lstrip("+-").isdigit() or not entry:
                    members.numbers[integer(line, i)] = line.where
                else:
                    raise line.refusal(f"set {name}", entry, "no such set above it")

    def _take_surface(self, block: Keyword) -> None:
        name, kind = block.options["NAME"], block.options.get("TYPE", "ELEMENT").upper()
        if name.upper() in self.surfaces:
            raise block.refusal(f"two surfaces have the name {name}")
        if kind == "NODE":
            lines = [replace(line, fields=line.fields[:1]) for line in block.lines]
            self._take_set(self.node_sets, replace(block, lines=lines), name)
        elif kind == "ELEMENT":
            self.surfaces[self._key(name)] = block
        else:
            raise block.refusal(f"TYPE {kind}: allowed: ELEMENT, NODE")

    def mesh(self) -> meshio.Mesh:
        """The mesh: cells of a type in one block, the faces of surfaces after them."""
        names: dict[int, set[str]] = defaultdict(set)
        for name, members in self.cell_sets.items():
            self._refuse_strangers(name, members, self.cells, "cell")
            for n in members.among(self.cells):
                names[n].add(name)
        nodes_of = self._node_sets()
        self._refuse_structures()
        rows: dict[CellType, list[_Row]] = defaultdict(list)
        for n, (cell, nodes) in self.cells.items():
            rows[cell].append((n, nodes, names[n]))
        for name, block in self.surfaces.items():
            for cell, nodes in self._faces(name, block):
                rows[cell].append((0, nodes, {name}))
        rank = {n: i for i, n in enumerate(self.nodes)}
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
                self.spelling[name]: np.array(sorted(rank[n] for n in members), np.int64)
                for name, members in nodes_of.items()
            },
        )

    def _node_sets(self) -> dict[str, set[int]]:
        """The nodes of each set."""
        found = {}
        for name, members in self.node_sets.items():
            self._refuse_strangers(name, members, self.nodes, "node")
            found[name] = members.among(self.nodes)
        return found

    def _refuse_strangers(
        self, name: str, members: _Set, known: Collection[int], what: str
    ) -> None:
        for n, where in members.numbers.items():
            if n not in known:
                raise InputError(where, f"set {self.spelling[name]}", n, f"no such {what}")

    def _refuse_structures(self) -> None:
        """Refuse beams, trusses, shells and membranes that the deck makes part of the model."""
        dim = self.dim
        for block in self.sections:
            members = self.cell_sets.get(block.options["ELSET"].upper(), _Set())
            thin = [n for n in members.among(self.cells) if self.cells[n][0].dim < dim]
            if thin:
                raise block.refusal(f"cell {min(thin)} is a structure beside solids: remove it")
        if self.beams and dim == 3:
            raise self.beams.refusal(f"{self.beams.options['TYPE']}: beams beside solids")

    def _faces(self, name: str, block: Keyword) -> Iterator[tuple[CellType, list[int]]]:
        """The faces of a surface, whose lines hold a cell, or a set of them, and a face."""
        key, dim = f"surface {self.spelling[name]}", self.dim
        for line in block.lines:
            owner, label = (*line.fields, "")[:2]
            if owner.upper() in self.cell_sets:
                numbers = sorted(self.cell_sets[owner.upper()].among(self.cells))
            elif owner.isdigit():
                numbers = [integer(line, 0)]
            else:
                raise line.refusal(key, owner, "no such set of cells")
            for n in numbers:
                if n not in self.cells:
                    raise line.refusal(key, n, "no such cell")
                cell, nodes = self.cells[n]
                corners = FACES.get(cell.shape, [])
                if cell.dim < dim and label.upper() in _ITSELF:
                    yield cell, nodes
                    continue
                if not re.fullmatch(rf"[Ss][1-{len(corners)}]", label):
                    allowed = f"a face of {cell.name} is S1 to S{len(corners)}"
                    raise line.refusal(key, label, allowed)
                wanted = {int(c) - 1 for c in corners[int(label[1]) - 1]}
                face = next(f for f in cell.faces if wanted <= set(f.nodes))
                yield BY_NAME[face.type], [nodes[i] for i in face.nodes]


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
