"""Files of one curved cell, written by tools that know nothing of the project's node orders.

Groups: `body` the cell, `side` its last face, `pin` its first vertex.
"""

from pathlib import Path

import gmsh
import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from solver.lac.cells.catalogue import BY_MESHIO, BY_NAME
from solver.mesh.recipes.gmsh_session import session
from tests.mesh.curved import Curved, ours

_POINT = 15  # gmsh's number of the type


def write_by_gmsh(name: str, path: Path, **options: float) -> None:
    """The cell with its nodes where gmsh's own cell of that type has them, and all its faces."""
    curved = Curved.of(name)
    cell = curved.cell
    with session(**options):
        places = curved.places(_gmsh_nodes(name))
        tags = np.arange(1, cell.n_nodes + 1)
        body = gmsh.model.addDiscreteEntity(cell.dim)
        gmsh.model.mesh.addNodes(cell.dim, body, tags, places.ravel())
        gmsh.model.mesh.addElementsByType(body, BY_NAME[name].gmsh, [], tags)
        gmsh.model.addPhysicalGroup(cell.dim, [body], name="body")
        for face in cell.faces:
            side = gmsh.model.addDiscreteEntity(cell.dim - 1)
            nodes = _nearest(places, curved.face_places(face, _gmsh_nodes(face.type)))
            gmsh.model.mesh.addElementsByType(side, BY_NAME[face.type].gmsh, [], tags[nodes])
        gmsh.model.addPhysicalGroup(cell.dim - 1, [side], name="side")
        point = gmsh.model.addDiscreteEntity(0)
        gmsh.model.mesh.addElementsByType(point, _POINT, [], tags[:1])
        gmsh.model.addPhysicalGroup(0, [point], name="pin")
        gmsh.write(str(path))


def _gmsh_nodes(name: str) -> np.ndarray:
    """Where gmsh's own cell of that type has its nodes, in our reference cell, (n, dim)."""
    _, dim, _, count, flat, _ = gmsh.model.mesh.getElementProperties(BY_NAME[name].gmsh)
    return ours(name, np.reshape(flat, (count, dim)))


def vtk_nodes(name: str) -> np.ndarray:
    """Where VTK's own cell of that type has its nodes, in our reference cell, (n, dim)."""
    cell, theirs = BY_NAME[name], vtk.vtkGenericCell()
    theirs.SetCellType(cell.vtk)
    flat = theirs.GetParametricCoords()
    places = np.array([flat[i] for i in range(3 * cell.n_nodes)]).reshape(-1, 3)[:, : cell.dim]
    if name.startswith("PYRA"):
        places = from_cube(places)
    return ours(name, places)


def from_cube(places: np.ndarray) -> np.ndarray:
    """Places (n, 3) in our pyramid of those in VTK's: a cube whose upper face is the apex."""
    return np.c_[(2 * places[:, :2] - 1) * (1 - places[:, 2:]), places[:, 2]]


def to_cube(places: np.ndarray) -> np.ndarray:
    """The other way; not for the apex."""
    return np.c_[(places[:, :2] / (1 - places[:, 2:]) + 1) / 2, places[:, 2]]


def _nearest(places: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The rows (n,) of `places` at which `wanted` (n, 3) lies."""
    distance = np.linalg.norm(places[None] - wanted[:, None], axis=2)
    assert (distance.min(axis=1) < 1e-9).all()
    return distance.argmin(axis=1)


def in_vtk_order(name: str) -> meshio.Mesh:
    """The cell and the face `side`, in VTK's node order as meshio has it."""
    curved = Curved.of(name)
    face = curved.cell.faces[-1]
    places = curved.places(vtk_nodes(name))
    side = _nearest(places, curved.face_places(face, vtk_nodes(face.type)))
    cells = [
        (curved.cell.meshio, np.arange(len(places))[None]),
        (BY_NAME[face.type].meshio, side[None]),
    ]
    return meshio.Mesh(places, cells)


def with_masks(mesh: meshio.Mesh) -> meshio.Mesh:
    """Its groups as arrays of 0 and 1, and an array that is no group."""
    one, none = np.array([1]), np.array([0])
    return meshio.Mesh(
        mesh.points,
        mesh.cells,
        cell_data={"body": [one, none], "side": [none, one], "material": [7 * one, 7 * one]},
        point_data={"pin": np.eye(len(mesh.points), dtype=int)[0]},
    )


def vtk_grid(name: str) -> vtk.vtkUnstructuredGrid:
    """The cell and the face `side` as VTK's own grid, groups as arrays of 0 and 1."""
    mesh = with_masks(in_vtk_order(name))
    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    points.SetData(numpy_to_vtk(mesh.points, deep=True))
    grid.SetPoints(points)
    for block in mesh.cells:
        for nodes in block.data:
            grid.InsertNextCell(BY_MESHIO[block.type].vtk, len(nodes), nodes.tolist())
    on_cells = {key: np.concatenate(values) for key, values in mesh.cell_data.items()}
    for target, data in ((grid.GetPointData(), mesh.point_data), (grid.GetCellData(), on_cells)):
        for key, values in data.items():
            array = numpy_to_vtk(values.astype(np.int32), deep=True)
            array.SetName(key)
            target.AddArray(array)
    return grid
