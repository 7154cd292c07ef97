"""Mesh files, by their extension.

| extension | read by | groups |
|---|---|---|
| .med, .mmed | `med` | of cells and of nodes |
| .msh, versions 2 and 4 | gmsh | physical groups; points become groups of nodes |
| .inp | `abaqus` | *ELSET, *SURFACE, *NSET |
| .vtu | meshio | each integer array of 0 and 1 on cells or points is a group of its name |
| .vtkhdf | `vtkhdf` | as this program writes them |
"""

from importlib import import_module
from pathlib import Path

import meshio

from ...system.errors import InputError
from ...system.files import replacing
from ..tidy import tidy
from .apart import read_apart, read_here

WRITTEN = (".vtkhdf", ".med", ".msh", ".vtu", ".inp")
# Modules with a function `read(path)` that returns the mesh as stored in the file.
_READERS = {
    ".med": ".med",
    ".mmed": ".med",
    ".msh": ".msh",
    ".inp": ".abaqus",
    ".vtu": ".vtu",
    ".vtkhdf": ".vtkhdf",
}


def read(path: Path) -> meshio.Mesh:
    """The mesh of a file, tidied. Raises InputError for any file that cannot be read."""
    suffix = path.suffix.lower()
    if suffix not in _READERS:
        raise InputError(path, "extension", path.suffix, f"allowed: {', '.join(_READERS)}")
    if not path.is_file():
        raise InputError(path, "mesh", None, "no such file")
    reader = import_module(_READERS[suffix], __package__)
    # Our own files are hashed: what they hold is what was written.
    read_by = read_here if suffix == ".vtkhdf" else read_apart
    mesh = read_by(lambda file: tidy(reader.read(file), file), path)
    if not mesh.cell_sets:
        allowed = "the mesh must have named groups of cells or faces (docs/formats.md)"
        raise InputError(path, "groups", None, allowed)
    return mesh


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write the mesh with its groups, whole or not at all; the extension says how.

    Raises InputError for an extension that is not one of `WRITTEN`.
    """
    suffix = path.suffix.lower()
    if suffix not in WRITTEN:
        raise InputError(path, "extension", path.suffix, f"allowed: {', '.join(WRITTEN)}")
    with replacing(path) as temporary:
        # gmsh goes by the extension, in lower case.
        whole = temporary.with_name(f"{temporary.name}{suffix}")
        try:
            writer = ".abaqus_writer" if suffix == ".inp" else _READERS[suffix]
            import_module(writer, __package__).write(mesh, whole)
            whole.replace(temporary)
        finally:
            whole.unlink(missing_ok=True)
