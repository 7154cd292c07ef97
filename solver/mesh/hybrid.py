"""A cube cut into two prisms or five pyramids, for the recipe `blocks`.

    top: {cells: PENTA6, contact: TRIA3}    # both triangular ends lie on the interface
    top: {cells: PENTA6, contact: QUAD4}    # lying: one prism has a lateral side on it
    top: {cells: PYRA5, contact: TRIA3}     # the apex is in the middle of the interface
    top: {cells: PYRA5, contact: QUAD4}     # the apex is in the middle of the opposite side

`contact` is the type of the faces on the interface: TRIA6 and QUAD8 for PENTA15 and PYRA13.
"""

from collections import defaultdict

import gmsh
import meshio
import numpy as np

from solver.mesh.catalogue import BY_NAME, CellType
from solver.mesh.gmsh_session import current_model, number_of, session
from solver.mesh.keys import Keys
from solver.mesh.sides import side_name

_CUBE = BY_NAME["HEXA8"]
_STANDING = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]
_LYING = [(0, 1, 5, 3, 2, 6), (0, 5, 4, 3, 6, 7)]


def cube(
    name: str, cell: CellType, origin: np.ndarray, size: np.ndarray, keys: Keys
) -> meshio.Mesh:
    """The block `name` of PENTA or PYRA cells, with its groups."""
    contact = keys.choice("contact", sorted({face.type for face in cell.faces}))
    keys.finish()
    on_triangles = contact.startswith("TRIA")
    nodes, pieces = _CUBE.nodes, np.array(_STANDING if on_triangles else _LYING)
    if cell.name.startswith("PYRA"):
        nodes, pieces = _pyramids(apex_height=float(on_triangles == (name == "bottom")))
    linear = BY_NAME[cell.skeleton]
    with session(Mesh__SecondOrderIncomplete=1):
        volume = gmsh.model.addDiscreteEntity(3)
        numbers = np.arange(1, len(nodes) + 1)
        gmsh.model.mesh.addNodes(3, volume, numbers, (origin + nodes * size).ravel())
        _fill(volume, 3, name, [(linear.name, pieces)])
        for group, faces in _sides(name, linear, nodes, pieces).items():
            _fill(gmsh.model.addDiscreteEntity(2), 2, group, faces)
        gmsh.model.mesh.setOrder(cell.order)
        return current_model(unnamed=False)


def _pyramids(apex_height: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the cube with the middle of its lower (0) or upper (1) side, and five pyramids."""
    apex = np.array([0.5, 0.5, apex_height])
    bases = [
        face.nodes
        for face in _CUBE.faces
        if (_CUBE.nodes[list(face.nodes), 2] != apex_height).any()
    ]
    return np.vstack([_CUBE.nodes, apex]), np.array([(*base, 8) for base in bases])


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
        gmsh.model.mesh.addElementsByType(entity, number_of(kind), [], nodes.ravel() + 1)
    gmsh.model.addPhysicalGroup(dim, [entity], name=group)
