"""The recipe `blocks`: two rectangular blocks, one on the other, each meshed in its own way.

    recipe: blocks
    size: [50, 50]         # of each block along x, y (and z in 3D); one number for a cube
    bottom: {cells: QUAD4, divisions: [12, 12]}
    top: {cells: TRIA3, divisions: [10, 8], far: 6, inner: 1.2, algorithm: frontal}

`cells` is the cell type, in both blocks of the same dimension. `divisions` says how many pieces
the edges have along each axis; blocks of QUAD and HEXA cells are regular grids. Blocks of TRIA and
TETRA cells are unstructured inside; there `far` (divisions of the lateral edges on the side away
from the interface, by default as on it), `inner` (edge length that gmsh aims at inside, in the
units of `size`; by default the edges of the block decide) and `algorithm` (for the surfaces) shape
the mesh. Blocks of more than a million nodes are filled by HXT, which is ten times faster.
Blocks of PENTA and PYRA cells are boxes cut in pieces: see below.

The interface lies in y = 0 (2D) or z = 0 (3D), the corner of both blocks at x = 0 (and y = 0).
Groups: cells `bottom`, `top`; faces `bottom_contact`, `top_contact`, `base` (the lower side of the
bottom block), `press` (the upper side of the top block), `symx` (x = 0) and `symy` (y = 0, 3D) of
both blocks, `farx` and `fary` opposite to them. `refine` multiplies all divisions and divides
`inner` (1).

A box cut into prisms or pyramids, for the recipe `blocks`.

    top: {cells: PENTA6, contact: TRIA3}    # the triangular ends of prisms lie on the interface
    top: {cells: PENTA6, contact: QUAD4}    # lying: a lateral side of every other prism does
    top: {cells: PYRA5, contact: TRIA3}     # apexes lie on the interface
    top: {cells: PYRA5, contact: QUAD4}     # bases do
    top: {cells: PYRA5, contact: QUAD4, divisions: [4, 4, 2]}

`contact` is the type of the faces on the interface: TRIA6 and QUAD8 for PENTA15 and PYRA13. The box
is divided into smaller ones (by default it is one), each cut into two prisms, or into six pyramids
whose apex is its centre. In one layer the apex is in the middle of a side instead, and there are
five of them: next to the interface where its faces are triangles, else furthest from it.
"""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import gmsh
import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME, CellType
from ..keys import BlockKeys, BlocksKeys, Recipe, each
from ..size import fills_by_hxt
from .gmsh_session import current_model, session


def side_name(block: str, corners: np.ndarray) -> str:
    """Group of the side of the unit square or cube on which the corners (n, dim) lie.

    `block` is `bottom` (interface at height 1) or `top` (interface at height 0). Empty where the
    corners lie on no side.
    """
    dim = corners.shape[1]
    for axis in range(dim):
        height = corners[0, axis]
        if height not in (0, 1) or np.ptp(corners[:, axis]) > 0:
            continue
        if axis < dim - 1:
            return f"{'sym' if height == 0 else 'far'}{'xy'[axis]}"
        if (height == 0) == (block == "top"):
            return f"{block}_contact"
        return "base" if block == "bottom" else "press"
    return ""


# gmsh's algorithms for surfaces, in the words of the recipe.
_ALGORITHMS = {"frontal": 6, "delaunay": 5, "meshadapt": 1}
_HXT = 10


def blocks(recipe: BlocksKeys) -> meshio.Mesh:
    """Both blocks, which share no nodes."""
    return stacked(recipe, each(recipe.size, recipe.dim, "size"))


def stacked(recipe: Recipe, size: list[float] | None = None) -> meshio.Mesh:
    """Both blocks, each of a `size` along each axis, by default of edge 1."""
    edges = np.array(size or [1.0] * recipe.dim)
    both = {"bottom": recipe.bottom, "top": recipe.top}
    low = {"bottom": -np.eye(len(edges))[-1] * edges, "top": np.zeros(len(edges))}
    return joined(
        [block(name, keys, low[name], edges, recipe.refine) for name, keys in both.items()]
    )


def block(
    name: str, keys: BlockKeys, origin: np.ndarray, size: np.ndarray, refine: int
) -> meshio.Mesh:
    """One block with its groups, `bottom` or `top`, from its corner `origin` (dim,) on."""
    if keys.cells.startswith(("PENTA", "PYRA")):
        return cube(name, keys, origin, size, refine)
    return _Block(name, keys, origin, size, refine).mesh()


class _Block:
    """One block: a rectangle or a box, with the corners and sides of QUAD4 or HEXA8."""

    def __init__(
        self, name: str, keys: BlockKeys, origin: np.ndarray, size: np.ndarray, refine: int
    ):
        self.cell = cell = BY_NAME[keys.cells]
        self.name, self.origin, self.size = name, origin, size
        self.solid = BY_NAME["QUAD4" if cell.dim == 2 else "HEXA8"]
        self.regular = cell.name.startswith(("QUAD", "HEXA"))
        self.divisions = [refine * n for n in each(keys.divisions, cell.dim, "divisions")]
        self.far = self.divisions[:-1]
        if keys.far is not None:
            self.far = [refine * n for n in each(keys.far, cell.dim - 1, "far")]
        self.options: dict[str, float] = {}
        if not self.regular:
            self.options["Mesh__Algorithm"] = _ALGORITHMS[keys.algorithm or "frontal"]
        if fills_by_hxt(cell.name, self.divisions):
            self.options["Mesh__Algorithm3D"] = _HXT
        if keys.inner is not None:
            self.options["Mesh__MeshSizeExtendFromBoundary"] = 0
            self.options["Mesh__MeshSizeMax"] = keys.inner / refine

    def mesh(self) -> meshio.Mesh:
        """The block's mesh, with its groups."""
        with session(Mesh__SecondOrderIncomplete=not self.cell.centred, **self.options):
            edges = self._edges(self._corners())
            self._volume(self._surfaces(edges))
            gmsh.model.mesh.generate(self.cell.dim)
            # Gmsh measures curves numerically, which leaves their nodes 1e-12 of the size away.
            if not self.regular:
                self._divide_edges_evenly()
            gmsh.model.mesh.setOrder(self.cell.order)
            mesh = current_model(unnamed=False)
        if self.regular:
            steps = np.array(self.divisions) * self.cell.order
            mesh.points[:, : self.cell.dim] = self._snapped(mesh.points, steps)
        return mesh

    def _corners(self) -> list[int]:
        places = np.zeros((self.solid.n_nodes, 3))
        places[:, : self.cell.dim] = self.origin + self.solid.nodes * self.size
        return [gmsh.model.geo.addPoint(*place) for place in places]

    def _edges(self, corners: list[int]) -> list[int]:
        edges = []
        for start, end in self.solid.edges:
            edge = gmsh.model.geo.addLine(corners[start], corners[end])
            axis = int(np.abs(self.solid.nodes[end] - self.solid.nodes[start]).argmax())
            height = self.solid.nodes[[start, end], -1].mean()
            is_far = height == (0 if self.name == "bottom" else 1)
            count = self.far[axis] if is_far else self.divisions[axis]
            gmsh.model.geo.mesh.setTransfiniteCurve(edge, count + 1)
            edges.append(edge)
        return edges

    def _surfaces(self, edges: list[int]) -> list[int]:
        """The sides in 3D, with their groups; the edges themselves in 2D."""
        numbers = {}
        for edge, (a, b) in zip(edges, self.solid.edges, strict=True):
            numbers[a, b], numbers[b, a] = edge, -edge
        sides = []
        for face in self.solid.faces:
            rim = [numbers[pair] for pair in pairwise((*face.nodes, face.nodes[0]))]
            sides.append(rim[0] if self.cell.dim == 2 else self._surface(rim))
        return sides

    def _surface(self, rim: list[int]) -> int:
        surface = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(rim)])
        if self.regular:
            gmsh.model.geo.mesh.setTransfiniteSurface(surface)
            gmsh.model.geo.mesh.setRecombine(2, surface)
        return surface

    def _volume(self, sides: list[int]) -> None:
        dim = self.cell.dim
        if dim == 2:
            volume = self._surface(sides)
        else:
            volume = gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(sides)])
            if self.regular:
                gmsh.model.geo.mesh.setTransfiniteVolume(volume)
        gmsh.model.geo.synchronize()
        gmsh.model.addPhysicalGroup(dim, [volume], name=self.name)
        for side, face in zip(sides, self.solid.faces, strict=True):
            name = side_name(self.name, self.solid.nodes[list(face.nodes)])
            if name:
                gmsh.model.addPhysicalGroup(dim - 1, [abs(side)], name=name)

    def _divide_edges_evenly(self) -> None:
        far_end = 0 if self.name == "bottom" else 1
        for dim, edge in gmsh.model.getEntities(1):
            tags, flat, _ = gmsh.model.mesh.getNodes(dim, edge)
            for tag, place in zip(tags, flat.reshape(-1, 3), strict=True):
                height = (place[self.cell.dim - 1] - self.origin[-1]) / self.size[-1]
                lateral = self.far if abs(height - far_end) < 1e-9 else self.divisions[:-1]
                steps = np.array([*lateral, self.divisions[-1]])
                place[: self.cell.dim] = self._snapped(place, steps)
                gmsh.model.mesh.setNode(tag, place, [])

    def _snapped(self, places: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Places (…, dim) moved to the nearest node of a lattice of so many steps each way."""
        share = (places[..., : self.cell.dim] - self.origin) / self.size
        return self.origin + np.round(share * steps) * self.size / steps


def joined(meshes: Sequence[meshio.Mesh]) -> meshio.Mesh:
    """The meshes side by side in one; groups of the same name become one."""
    offsets = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells = [
        (block.type, block.data + offset)
        for mesh, offset in zip(meshes, offsets, strict=False)
        for block in mesh.cells
    ]
    sets = {}
    for name in sorted({name for mesh in meshes for name in mesh.cell_sets}):
        sets[name] = [
            ids
            for mesh in meshes
            for ids in mesh.cell_sets.get(name, [np.arange(0)] * len(mesh.cells))
        ]
    return meshio.Mesh(np.concatenate([mesh.points for mesh in meshes]), cells, cell_sets=sets)


_CUBE = BY_NAME["HEXA8"]
_STANDING = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]
_LYING = [(0, 1, 5, 3, 2, 6), (0, 5, 4, 3, 6, 7)]


def cube(
    name: str, keys: BlockKeys, origin: np.ndarray, size: np.ndarray, refine: int
) -> meshio.Mesh:
    """The block `name` of PENTA or PYRA cells, with its groups; `refine` multiplies divisions."""
    cell, contact = BY_NAME[keys.cells], keys.contact or ""
    divisions = refine * np.array(each(keys.divisions or 1, 3, "divisions"))
    on_triangles = contact.startswith("TRIA")
    if cell.name.startswith("PYRA"):
        at_top = on_triangles == (name == "bottom")
        corners = _pyramids(divisions, divisions[2] - 1 if at_top else 0, float(at_top))
    else:
        corners = _copies(_CUBE.nodes[_STANDING if on_triangles else _LYING], divisions)
    halves, pieces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    nodes, pieces = halves / (2 * divisions), pieces.reshape(corners.shape[:2])
    linear = BY_NAME[cell.skeleton]
    with session(Mesh__SecondOrderIncomplete=not cell.centred):
        volume = gmsh.model.addDiscreteEntity(3)
        numbers = np.arange(1, len(nodes) + 1)
        gmsh.model.mesh.addNodes(3, volume, numbers, (origin + nodes * size).ravel())
        _fill(volume, 3, name, [(linear.name, pieces)])
        for group, faces in _sides(name, linear, nodes, pieces).items():
            _fill(gmsh.model.addDiscreteEntity(2), 2, group, faces)
        gmsh.model.mesh.setOrder(cell.order)
        return current_model(unnamed=False)


def _copies(cells: np.ndarray, divisions: np.ndarray) -> np.ndarray:
    """Cells (n, corners, 3) of the unit cube in every box, in half steps of the boxes."""
    offsets = np.indices(tuple(divisions)).reshape(3, -1).T
    moved = np.rint(2 * (cells[None] + offsets[:, None, None])).astype(int)
    return moved.reshape(-1, *cells.shape[1:])


def _pyramids(divisions: np.ndarray, layer: int, apex_height: float) -> np.ndarray:
    """Corners (n, 5, 3) in half steps: apexes at a height in the boxes of one layer, else amid."""
    parts = []
    for k, height in enumerate(np.where(np.arange(divisions[2]) == layer, apex_height, 0.5)):
        apex = np.array([0.5, 0.5, height])
        bases = [_CUBE.nodes[list(face.nodes)] for face in _CUBE.faces]
        cells = np.array([[*b, apex] for b in bases if (b[:, 2] != height).any()])
        parts.append(_copies(cells, np.array([*divisions[:2], 1])) + np.array([0, 0, 2 * k]))
    return np.concatenate(parts)


_Cells = list[tuple[str, np.ndarray]]


def _sides(name: str, cell: CellType, nodes: np.ndarray, pieces: np.ndarray) -> dict[str, _Cells]:
    """The faces that lie on a side with a group: by group, the type and the nodes of each."""
    sides: dict[str, _Cells] = defaultdict(list)
    for face in cell.faces:
        for corners in pieces[:, face.nodes]:
            group = side_name(name, nodes[corners])
            if group:
                sides[group].append((face.type, corners))
    return sides


def _fill(entity: int, dim: int, group: str, cells: _Cells) -> None:
    for kind, nodes in cells:
        gmsh.model.mesh.addElementsByType(entity, BY_NAME[kind].gmsh, [], nodes.ravel() + 1)
    gmsh.model.addPhysicalGroup(dim, [entity], name=group)
