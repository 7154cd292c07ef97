"""The catalogue of cell types: names, reference nodes, edges, faces, orders.

Nodes are in VTK's order (and meshio's) throughout. Faces are listed with their nodes turned
outward for a cell of positive Jacobian. Reference cells: the unit simplex, the unit square and
cube, triangle × [0, 1]; pyramids stand on [-1, 1]² with their apex at (0, 0, 1).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Face:
    """One face of a cell: its type and the cell's local nodes, in the face type's node order."""

    type: str
    nodes: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class CellType:
    """One cell type.

    `meshio`, `vtk`, `gmsh`, `med`, `abaqus`: its name or number there, empty where it has none;
    `element` the class of its shape functions; `nodes` (n_nodes, dim) are the reference
    coordinates; `owners` the vertices in whose middle each node lies; `edges` the vertex pairs, in
    the order of the mid-edge nodes; `mirror` the node permutation that reverses the orientation;
    `skeleton` the name of the linear type with the same vertices; `centred`: whether a node lies in
    the middle of each quadrangle.
    """

    name: str
    meshio: str
    vtk: int
    gmsh: int
    med: str
    abaqus: str
    element: str
    order: int
    skeleton: str
    nodes: np.ndarray
    owners: tuple[tuple[int, ...], ...]
    edges: tuple[tuple[int, int], ...]
    faces: tuple[Face, ...]
    mirror: tuple[int, ...]
    centred: bool

    @cached_property
    def dim(self) -> int:
        """Dimension of the reference cell."""
        return self.nodes.shape[1]

    @cached_property
    def shape(self) -> str:
        """The name without the number of nodes."""
        return _shape_of(self.name)

    @cached_property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.nodes)

    @cached_property
    def n_vertices(self) -> int:
        """Number of vertices; they come first in the node order."""
        return len(_SHAPES[self.shape].vertices)

    @property
    def degree(self) -> int:
        """The degree of the shape functions of an edge or a face, in both directions together."""
        if self.n_vertices < 4:
            return self.order
        return 2 * self.order - (self.order == 2 and not self.centred)

    @property
    def layer(self) -> "CellType":
        """The type of the cells of one layer over cells of this type."""
        over = {"SEG": "QUAD", "TRIA": "PENTA", "QUAD": "HEXA"}[self.shape]
        return BY_NAME[_type_of(over, self.order, self.centred)]

    def of(self, order: int, centred: bool) -> "CellType":
        """The type of an order on these vertices, with a node in its middle if there is one."""
        return BY_NAME[_type_of(self.shape, order, centred)]

    def put_between(self, values: np.ndarray, nodes: np.ndarray) -> None:
        """Give the nodes of cells (n, n_nodes) that are no vertices the mean of their vertices'.

        `values` (n_points, …) by node, changed in place.
        """
        for i in range(self.n_vertices, self.n_nodes):
            values[nodes[:, i]] = values[nodes[:, self.owners[i]]].mean(axis=1)

    @cached_property
    def boundary(self) -> tuple[int, ...]:
        """The nodes of a 2D cell, or the two ends of a line, as a closed polygon (mid-nodes in)."""
        if self.dim == 1:
            return (0, 1) if self.order == 1 else (0, 2, 1)
        n = self.n_vertices
        if self.order == 1:
            return tuple(range(n))
        return tuple(k for i in range(n) for k in (i, n + i))


@dataclass(frozen=True)
class _Shape:
    """The common part of the types of one shape: vertices, edges, faces, mirrored vertices."""

    vertices: tuple[tuple[float, ...], ...]
    edges: tuple[tuple[int, int], ...]
    faces: tuple[tuple[int, ...], ...]
    mirror: tuple[int, ...]


_SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))
_RING = ((0, 1), (1, 2), (2, 3), (3, 0))
_SHAPES = {
    "SEG": _Shape(((0,), (1,)), ((0, 1),), (), (1, 0)),
    "TRIA": _Shape(
        ((0, 0), (1, 0), (0, 1)),
        ((0, 1), (1, 2), (2, 0)),
        ((0, 1), (1, 2), (2, 0)),
        (0, 2, 1),
    ),
    "QUAD": _Shape(_SQUARE, _RING, _RING, (0, 3, 2, 1)),
    "TETRA": _Shape(
        ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
        ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
        (0, 2, 1, 3),
    ),
    # The faces of a hexahedron are in the order of HEXA27's face-centre nodes.
    "HEXA": _Shape(
        tuple((*v, z) for z in (0, 1) for v in _SQUARE),
        (*_RING, *((a + 4, b + 4) for a, b in _RING), (0, 4), (1, 5), (2, 6), (3, 7)),
        ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
        (0, 3, 2, 1, 4, 7, 6, 5),
    ),
    "PENTA": _Shape(
        tuple((*v, z) for z in (0, 1) for v in ((0, 0), (1, 0), (0, 1))),
        ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
        ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
        (0, 2, 1, 3, 5, 4),
    ),
    "PYRA": _Shape(
        ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1)),
        (*_RING, (0, 4), (1, 4), (2, 4), (3, 4)),
        ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
        (0, 3, 2, 1, 4),
    ),
}

# name: (names in meshio, VTK, gmsh, MED and Abaqus, class of its shape functions, order, has nodes
# in the middle of quadrangular faces, of the cell). The class is scikit-fem's or one of
# `extra_elements`; edges and faces need none.
_TYPES = {
    "SEG2": ("line", 3, 1, "SE2", "", "", 1, False, False),
    "SEG3": ("line3", 21, 8, "SE3", "", "", 2, False, False),
    "TRIA3": ("triangle", 5, 2, "TR3", "CPE3", "", 1, False, False),
    "TRIA6": ("triangle6", 22, 9, "TR6", "CPE6", "", 2, False, False),
    "QUAD4": ("quad", 9, 3, "QU4", "CPE4", "", 1, False, False),
    "QUAD8": ("quad8", 23, 16, "QU8", "CPE8", "", 2, False, False),
    "QUAD9": ("quad9", 28, 10, "QU9", "", "", 2, False, True),
    "TETRA4": ("tetra", 10, 4, "TE4", "C3D4", "ElementTetP1", 1, False, False),
    "TETRA10": ("tetra10", 24, 11, "T10", "C3D10", "ElementTetP2", 2, False, False),
    "HEXA8": ("hexahedron", 12, 5, "HE8", "C3D8", "ElementHex1", 1, False, False),
    "HEXA20": ("hexahedron20", 25, 17, "H20", "C3D20", "ElementHexS2", 2, False, False),
    "HEXA27": ("hexahedron27", 29, 12, "H27", "", "ElementHex2", 2, True, True),
    "PENTA6": ("wedge", 13, 6, "PE6", "C3D6", "ElementWedge1", 1, False, False),
    "PENTA15": ("wedge15", 26, 18, "P15", "C3D15", "ElementWedgeS2", 2, False, False),
    "PYRA5": ("pyramid", 14, 7, "PY5", "C3D5", "ElementPyramid", 1, False, False),
    "PYRA13": ("pyramid13", 27, 19, "P13", "", "ElementPyramid", 2, False, False),
}


def _shape_of(name: str) -> str:
    return name.rstrip("0123456789")


def _type_of(shape: str, order: int, centred: bool) -> str:
    """The type of a shape and order; of two, the one whose quadrangles are `centred` or not."""
    found = [n for n in _TYPES if _shape_of(n) == shape and _TYPES[n][6] == order]
    return next((n for n in found if any(_TYPES[n][7:]) == centred), found[0])


def _build(name: str) -> CellType:
    meshio_name, vtk, gmsh, med, abaqus, element, order, face_centres, cell_centre = _TYPES[name]
    shape = _SHAPES[_shape_of(name)]
    vertices = np.array(shape.vertices, dtype=float)
    # Each node is known by the set of vertices whose mean it is.
    owners = [frozenset([i]) for i in range(len(vertices))]
    if order == 2:
        owners += [frozenset(edge) for edge in shape.edges]
    if face_centres:
        owners += [frozenset(face) for face in shape.faces if len(face) == 4]
    if cell_centre:
        owners.append(frozenset(range(len(vertices))))
    number = {owner: i for i, owner in enumerate(owners)}
    mirrored = [frozenset(shape.mirror[i] for i in owner) for owner in owners]
    faces = []
    for face in shape.faces:
        parts = [frozenset([i]) for i in face]
        if order == 2:
            rim = zip(face, (*face[1:], face[0]), strict=True)
            parts += [frozenset(e) for e in (rim if len(face) > 2 else [face])]
        if face_centres and len(face) == 4:
            parts.append(frozenset(face))
        nodes = tuple(number[p] for p in parts)
        faces.append(
            Face(_type_of(("SEG", "TRIA", "QUAD")[len(face) - 2], order, face_centres), nodes)
        )
    return CellType(
        name=name,
        meshio=meshio_name,
        vtk=vtk,
        gmsh=gmsh,
        med=med,
        abaqus=abaqus,
        element=element,
        order=order,
        skeleton=next(t for t in _TYPES if _shape_of(t) == _shape_of(name)),
        nodes=np.array([vertices[sorted(owner)].mean(axis=0) for owner in owners]),
        owners=tuple(tuple(sorted(owner)) for owner in owners),
        edges=shape.edges,
        faces=tuple(faces),
        mirror=tuple(number[m] for m in mirrored),
        centred=face_centres or cell_centre,
    )


BY_NAME: dict[str, CellType] = {name: _build(name) for name in _TYPES}
BY_MESHIO: dict[str, CellType] = {t.meshio: t for t in BY_NAME.values()}


def cell_type(name: str) -> CellType:
    """The cell type of that name, the field's (`HEXA20`) or meshio's (`hexahedron20`)."""
    return BY_NAME[name] if name in BY_NAME else BY_MESHIO[name]
