"""Files of one distorted cell, written by tools that know nothing of the project's node orders."""

from pathlib import Path

import gmsh
import numpy as np

from solver.mesh.catalogue import BY_NAME, CellType
from solver.mesh.gmsh_session import number_of, session

KINDS = [name for name, cell in BY_NAME.items() if cell.dim > 1]


def distorted(cell: CellType, seed: int = 1) -> np.ndarray:
    """Vertices (n_vertices, 3) of the reference cell, each moved a little."""
    vertices = np.zeros((cell.n_vertices, 3))
    moves = np.random.default_rng(seed).uniform(-0.15, 0.15, (cell.n_vertices, cell.dim))
    vertices[:, : cell.dim] = cell.nodes[: cell.n_vertices] + moves
    return vertices


def write_by_gmsh(name: str, path: Path, **options: float) -> None:
    """One distorted cell; gmsh itself makes the mid-nodes and numbers them. Group: `body`."""
    cell = BY_NAME[name]
    numbers = np.arange(1, cell.n_vertices + 1)
    complete = name in ("QUAD9", "HEXA27")
    with session(Mesh__SecondOrderIncomplete=not complete, **options):
        entity = gmsh.model.addDiscreteEntity(cell.dim)
        gmsh.model.mesh.addNodes(cell.dim, entity, numbers, distorted(cell).ravel())
        gmsh.model.mesh.addElementsByType(entity, number_of(cell.skeleton), [], numbers)
        gmsh.model.addPhysicalGroup(cell.dim, [entity], name="body")
        gmsh.model.mesh.setOrder(cell.order)
        gmsh.write(str(path))


def middles(cell: CellType, vertices: np.ndarray) -> np.ndarray:
    """Where the nodes after the vertices belong: the middles of edges, faces and cell."""
    parts = [list(edge) for edge in cell.edges] if cell.order == 2 else []
    if cell.name == "HEXA27":
        parts += [list(face.nodes[:4]) for face in cell.faces]
    if cell.name in ("QUAD9", "HEXA27"):
        parts.append(list(range(cell.n_vertices)))
    return np.array([vertices[part].mean(axis=0) for part in parts]).reshape(-1, cell.dim)
