"""The local cut of slave-side cells, so that each macro-element owns an interior node.

A macro-element is an original slave face. Where it has no node strictly inside, its cell is cut by
a cone from the face centre to every other face of the cell; a QUAD4 in 2D, and hexahedra on
request, are cut into cells of their own shape instead. Every other face of the cell stays a whole
face of exactly one piece, so the cut never spreads, and a second slave face of the same cell is cut
by cutting the piece that carries it. Source: Abbas, Drouet, Hild, The Local Average Contact (LAC)
method, CMAME 339 (2018) 488–513, §3; which cells need the cut: code_aster R5.03.55.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import compress

import numpy as np

from .cells.catalogue import BY_NAME, CellType, cell_type
from .cells.faces import FaceBlock
from .cells.shape import has_straight_edges, shape_functions

# Shape functions below this at a new node are zero there up to round-off.
_NO_SHARE = 1e-14


@dataclass(frozen=True)
class SubFaces:
    """Slave sub-faces of one type: `nodes` (n, n_nodes) turned outward, `macro` (n,) element."""

    type: CellType
    nodes: np.ndarray
    macro: np.ndarray


@dataclass(frozen=True)
class CutMesh:
    """The mesh after the cut; the original nodes keep their numbers, new ones follow.

    `cells` by type name; `origin` by type name: the parent's type name and index for each run of
    cells, as (type, (n,)) in order; `sub_faces` of all macro-elements.
    """

    points: np.ndarray
    cells: dict[str, np.ndarray]
    origin: dict[str, list[tuple[str, np.ndarray]]]
    sub_faces: list[SubFaces]

    def members(self, name: str, mask: dict[str, np.ndarray]) -> np.ndarray:
        """For the cells of type `name`: a property (by type, per original cell), inherited."""
        return np.concatenate([mask[parent][cell] for parent, cell in self.origin[name]])


def needs_cut(face_type: str) -> bool:
    """Whether a slave face of that type has no node in its middle (2D: SEG3 has one).

    >>> needs_cut("SEG2"), needs_cut("SEG3")
    (True, False)
    """
    kind = BY_NAME[face_type]
    return all(len(owners) < kind.n_vertices for owners in kind.owners)


def cut(
    points: np.ndarray,
    cells: dict[str, np.ndarray],
    faces: list[FaceBlock],
    macro: list[np.ndarray] | None = None,
    into_hexahedra: list[bool] | None = None,
    uncut: list[bool] | None = None,
) -> CutMesh:
    """Cut the cells behind slave faces.

    By block: `faces` are the slave faces of all zones, `macro` their macro-element numbers, by
    default those within their group; hexahedra behind blocks marked `into_hexahedra` are cut into
    hexahedra, and cells behind blocks marked `uncut` are left as they are.

    A triangle on its slave edge from (0, 0) to (2, 0) is cut in two, at a new node 3:

    >>> corner = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    >>> zero = np.array([0])
    >>> face = FaceBlock(BY_NAME["SEG2"], np.array([[0, 1]]), zero, BY_NAME["TRIA3"], zero, zero)
    >>> mesh = cut(corner, {"TRIA3": np.array([[0, 1, 2]])}, [face])
    >>> mesh.points[3:].tolist(), len(mesh.cells["TRIA3"]), mesh.sub_faces[0].nodes.tolist()
    ([[1.0, 0.0]], 2, [[0, 3], [3, 1]])
    """
    macro = [block.number for block in faces] if macro is None else macro
    no = [False] * len(faces)
    chosen = [
        needs_cut(block.type.name) and not leave
        for block, leave in zip(faces, uncut or no, strict=True)
    ]
    slaves = _slave_faces_by_cell(
        list(compress(faces, chosen)),
        list(compress(macro, chosen)),
        list(compress(into_hexahedra or no, chosen)),
    )
    whole = [
        SubFaces(block.type, block.nodes, number)
        for block, number, pick in zip(faces, macro, chosen, strict=True)
        if not pick
    ]
    pieces = _Pieces(points, cells)
    for (name, pattern), (owner, numbers) in slaves.items():
        pieces.add(_template(name, pattern), name, owner, numbers)
    return pieces.mesh(whole)


Pattern = tuple[tuple[int, bool], ...]


def _slave_faces_by_cell(
    faces: list[FaceBlock], macro: list[np.ndarray], into_hexahedra: list[bool]
) -> dict[tuple[str, Pattern], tuple[np.ndarray, np.ndarray]]:
    """Cells to cut, grouped by type and by which of their faces are slaves and how they are cut.

    Values: owner cells (n,) and the macro-element numbers of their faces (n, n_faces).
    """
    groups: dict[tuple[str, Pattern], tuple[np.ndarray, np.ndarray]] = {}
    by_type: dict[str, list[np.ndarray]] = {}
    for block, number, whole in zip(faces, macro, into_hexahedra, strict=True):
        flag = np.full(len(number), whole)
        rows = np.stack([block.owner, block.local, flag, number], axis=1)
        by_type.setdefault(block.owner_type.name, []).append(rows)
    for name, parts in by_type.items():
        rows = np.concatenate(parts)
        rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
        owner, start, count = np.unique(rows[:, 0], return_index=True, return_counts=True)
        for n in np.unique(count):
            chosen = start[count == n][:, None] + np.arange(n)
            patterns, label = np.unique(
                rows[chosen][:, :, 1:3].reshape(len(chosen), -1), axis=0, return_inverse=True
            )
            for k, pattern in enumerate(patterns):
                hit = label.ravel() == k
                key = tuple((int(a), bool(b)) for a, b in pattern.reshape(-1, 2))
                groups[name, key] = (owner[count == n][hit], rows[chosen[hit], 3])
    return groups


class _Pieces:
    """Collects pieces of cut cells and puts the new mesh together."""

    def __init__(self, points: np.ndarray, cells: dict[str, np.ndarray]):
        self.points, self.cells = [points], cells
        self.n_points = len(points)
        self.kept = {name: np.ones(len(data), dtype=bool) for name, data in cells.items()}
        self.new: dict[str, list[tuple[np.ndarray, str, np.ndarray]]] = {}
        self.sub_faces: list[SubFaces] = []

    def add(self, template: "_Template", name: str, owner: np.ndarray, macro: np.ndarray) -> None:
        parents = self.cells[name][owner]
        new = template.places(self.points[0][parents], BY_NAME[name])
        count = new.shape[1]
        numbers = self.n_points + np.arange(len(owner) * count).reshape(len(owner), count)
        self.points.append(new.reshape(-1, new.shape[2]))
        self.n_points += numbers.size
        nodes = np.concatenate([parents, numbers], axis=1, dtype=parents.dtype)
        self.kept[name][owner] = False
        for piece, local in template.pieces:
            self.new.setdefault(piece, []).append((nodes[:, local], name, owner))
        for k, sub_faces in enumerate(template.sub_faces):
            for face, local in sub_faces:
                self.sub_faces.append(SubFaces(BY_NAME[face], nodes[:, local], macro[:, k]))

    def mesh(self, whole: list[SubFaces]) -> CutMesh:
        cells: dict[str, np.ndarray] = {}
        origin: dict[str, list[tuple[str, np.ndarray]]] = {}
        for name in [*self.cells, *(n for n in self.new if n not in self.cells)]:
            data, parents = [], []
            if name in self.cells:
                kept = self.kept[name]
                data.append(self.cells[name] if kept.all() else self.cells[name][kept])
                parents.append((name, np.flatnonzero(self.kept[name])))
            for piece, parent, owner in self.new.get(name, []):
                data.append(piece)
                parents.append((parent, owner))
            joined = data[0] if len(data) == 1 else np.concatenate(data)
            if len(joined):
                cells[name], origin[name] = joined, parents
        return CutMesh(np.concatenate(self.points), cells, origin, _joined(whole + self.sub_faces))


def _joined(parts: list[SubFaces]) -> list[SubFaces]:
    """Sub-faces in one block per type, sorted by macro-element."""
    blocks = []
    for name in dict.fromkeys(p.type.name for p in parts):
        same = [p for p in parts if p.type.name == name]
        nodes = np.concatenate([p.nodes for p in same])
        macro = np.concatenate([p.macro for p in same])
        order = np.argsort(macro, kind="stable")
        blocks.append(SubFaces(BY_NAME[name], nodes[order], macro[order]))
    return blocks


@dataclass(frozen=True)
class _Template:
    """How one cell type is cut for one pattern of slave faces.

    Local node numbers: the parent's nodes, then the new ones, which lie at `new_nodes` (k, dim) of
    the parent's reference cell; those numbered `middles` (e,) are the middles of the edges
    `new_edges` (e, 2), given by local numbers. `sub_faces` by slave face.
    """

    new_nodes: np.ndarray
    middles: np.ndarray
    new_edges: np.ndarray
    pieces: list[tuple[str, list[int]]]
    sub_faces: list[list[tuple[str, list[int]]]]

    def places(self, corner: np.ndarray, kind: CellType) -> np.ndarray:
        """New nodes (c, k, dim) of parents with node coordinates (c, n_nodes, dim).

        They follow the parent's own map, so that the pieces keep a bent shape; but a parent with
        straight edges gets pieces with straight edges, whose faces are affine triangles. Its own
        map would bend the diagonals of a face that is no parallelogram.
        """
        values = shape_functions(kind.name).values(self.new_nodes)
        values[np.abs(values) < _NO_SHARE] = 0.0
        # Counted from the nearest node, so that the middle of a plane face lies in it to the bit.
        base = corner[:, np.abs(values).argmax(axis=1)]
        new = base + np.einsum("ka,ckad->ckd", values, corner[:, None] - base[:, :, None])
        if len(self.new_edges):
            ends = np.concatenate([corner, new], axis=1)[:, self.new_edges]
            straight = has_straight_edges(kind, corner)
            among = self.middles - corner.shape[1]
            new[np.ix_(straight, among)] = ends[straight].mean(axis=2)
        return new


Cell = tuple[str, tuple[int, ...]]


@cache
def _template(name: str, pattern: Pattern) -> _Template:
    """Cut the vertex skeleton face by face, then add the mid-edge nodes of a quadratic parent."""
    kind = BY_NAME[name]
    places = [tuple(x) for x in kind.nodes[: kind.n_vertices]]
    pieces: list[Cell] = [(kind.skeleton, tuple(range(kind.n_vertices)))]
    sub_faces: list[list[Cell]] = []
    for local, into_hexahedra in pattern:
        face = kind.faces[local]
        corners = face.nodes[: cell_type(face.type).n_vertices]
        carrier = next(p for p in pieces if any(set(f) == set(corners) for f in _faces(p)))
        pieces.remove(carrier)
        cutter = _cutter(carrier, into_hexahedra or kind.centred)
        new_pieces, new_faces = cutter(carrier, corners, places)
        pieces += new_pieces
        sub_faces.append(new_faces)
    return _promote(kind, places, pieces, sub_faces)


def _cutter(cell: Cell, into_hexahedra: bool):  # type: ignore[no-untyped-def]
    if cell[0] == "QUAD4":
        return _cut_quadrangle
    return _cut_into_hexahedra if cell[0] == "HEXA8" and into_hexahedra else _cut_into_cones


def _faces(cell: Cell) -> list[tuple[int, ...]]:
    return [tuple(cell[1][i] for i in face.nodes) for face in BY_NAME[cell[0]].faces]


def _mean(places: list[tuple[float, ...]], weights: dict[int, float]) -> tuple[float, ...]:
    return tuple(np.sum([w * np.array(places[i]) for i, w in weights.items()], axis=0))


def _add(places: list[tuple[float, ...]], place: tuple[float, ...]) -> int:
    places.append(place)
    return len(places) - 1


def _ring(nodes: Sequence[int]) -> list[tuple[int, int]]:
    return list(zip(nodes, (*nodes[1:], nodes[0]), strict=True))


def _cut_into_cones(
    cell: Cell, corners: tuple[int, ...], places: list[tuple[float, ...]]
) -> tuple[list[Cell], list[Cell]]:
    centre = _add(places, _mean(places, dict.fromkeys(corners, 1 / len(corners))))
    if len(corners) == 2:
        a, b = corners
        bases = [f for f in _faces(cell) if set(f) != set(corners)]
        faces: list[Cell] = [("SEG2", (a, centre)), ("SEG2", (centre, b))]
        return [("TRIA3", (*f, centre)) for f in bases], faces
    pieces: list[Cell] = []
    for face in _faces(cell):
        if set(face) != set(corners):
            # Outward faces, read backwards, have the apex on their positive side.
            base = (face[0], *face[:0:-1])
            pieces.append(("TETRA4" if len(base) == 3 else "PYRA5", (*base, centre)))
    return pieces, [("TRIA3", (a, b, centre)) for a, b in _ring(corners)]


def _cut_quadrangle(
    cell: Cell, corners: tuple[int, ...], places: list[tuple[float, ...]]
) -> tuple[list[Cell], list[Cell]]:
    a, b = corners
    turn = cell[1].index(a)
    c, d = cell[1][(turn + 2) % 4], cell[1][(turn + 3) % 4]
    e = _add(places, _mean(places, {a: 2 / 3, b: 1 / 3}))
    f = _add(places, _mean(places, {a: 1 / 3, b: 2 / 3}))
    g = _add(places, _mean(places, {a: 1 / 3, b: 1 / 6, c: 1 / 6, d: 1 / 3}))
    h = _add(places, _mean(places, {a: 1 / 6, b: 1 / 3, c: 1 / 3, d: 1 / 6}))
    quads = [(a, e, g, d), (e, f, h, g), (f, b, c, h), (g, h, c, d)]
    return [("QUAD4", q) for q in quads], [("SEG2", s) for s in ((a, e), (e, f), (f, b))]


def _cut_into_hexahedra(
    cell: Cell, corners: tuple[int, ...], places: list[tuple[float, ...]]
) -> tuple[list[Cell], list[Cell]]:
    edges = [{cell[1][i], cell[1][j]} for i, j in BY_NAME["HEXA8"].edges]
    far = [
        next((e - {a}).pop() for e in edges if a in e and not e <= set(corners)) for a in corners
    ]
    inner, deep = [], []
    for i in range(4):
        near = {corners[j]: 1 / 4 * 2 / 3 + (1 / 3 if j == i else 0) for j in range(4)}
        below = {far[j]: near[corners[j]] for j in range(4)}
        inner.append(_add(places, _mean(places, near)))
        half = {node: w / 2 for node, w in (near | below).items()}
        deep.append(_add(places, _mean(places, half)))
    tops, bottoms = [tuple(inner)], [tuple(deep)]
    for i, j in _ring(range(4)):
        tops.append((corners[i], corners[j], inner[j], inner[i]))
        bottoms.append((far[i], far[j], deep[j], deep[i]))
    hexahedra = [
        ("HEXA8", (*top[::-1], *bottom[::-1]))
        for top, bottom in zip([*tops, tuple(deep)], [*bottoms, tuple(far)], strict=True)
    ]
    return hexahedra, [("QUAD4", top) for top in tops]


def _promote(
    kind: CellType,
    places: list[tuple[float, ...]],
    pieces: list[Cell],
    sub_faces: list[list[Cell]],
) -> _Template:
    """Number the nodes as parent's nodes then new ones; give quadratic pieces their own nodes.

    A node is known by the vertices whose mean it is. One that falls on a node of the parent, as the
    middle of a quadratic edge that is cut, is that node.
    """
    known = {frozenset(owner): i for i, owner in enumerate(kind.owners)}
    new_nodes: list[np.ndarray] = []
    middles: list[int] = []
    new_edges: list[tuple[int, int]] = []

    def number(vertices: frozenset[int]) -> int:
        if vertices not in known:
            place = np.mean([places[v] for v in sorted(vertices)], axis=0)
            distance = np.abs(kind.nodes - place).max(axis=1)
            known[vertices] = int(distance.argmin())
            if distance.min() > _NO_SHARE:
                known[vertices] = kind.n_nodes + len(new_nodes)
                new_nodes.append(place)
                if len(vertices) == 2:
                    middles.append(known[vertices])
                    new_edges.append(tuple(known[frozenset([v])] for v in sorted(vertices)))  # type: ignore[arg-type]
        return known[vertices]

    def full(cell: Cell) -> tuple[str, list[int]]:
        skeleton, vertices = cell
        own = cell_type(skeleton).of(kind.order, kind.centred)
        return own.name, [number(frozenset(vertices[i] for i in owner)) for owner in own.owners]

    for vertex in range(len(places)):
        number(frozenset([vertex]))
    return _Template(
        pieces=[full(p) for p in pieces],
        sub_faces=[[full(f) for f in group] for group in sub_faces],
        new_nodes=np.array(new_nodes).reshape(-1, kind.dim),
        middles=np.array(middles, dtype=int),
        new_edges=np.array(new_edges, dtype=int).reshape(-1, 2),
    )
