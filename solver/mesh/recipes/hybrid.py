"""A box cut into prisms or pyramids, for the recipe `blocks`.

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

import gmsh
import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME, CellType
from ..keys import BlockKeys, each
from .blocks import side_name
from .gmsh_session import current_model, session

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
