"""Mesh files of gmsh, versions 2 and 4, read by gmsh."""

from pathlib import Path

import gmsh
import meshio

from ...lac.cells.catalogue import BY_NAME
from ...system.errors import InputError
from ..recipes.gmsh_session import current_model, foreign_types, session


def read(path: Path) -> meshio.Mesh:
    """The mesh of a .msh file; physical groups are its groups."""
    # Handed anything else, gmsh runs it as a script.
    with path.open("rb") as file:
        if not file.read(4096).lstrip().startswith(b"$"):
            raise InputError(path, "mesh", None, "no gmsh mesh: it must start with $MeshFormat")
    with session():
        gmsh.merge(str(path))
        if foreign := foreign_types():
            allowed = f"allowed: {', '.join(BY_NAME)}"
            raise InputError(path, "cell type", ", ".join(foreign), allowed)
        return current_model()
