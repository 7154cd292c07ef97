"""Mesh files by extension."""

from pathlib import Path

import meshio

from solver.errors import InputError


def read(path: Path) -> meshio.Mesh:
    """The mesh of a file."""
    if not path.is_file():
        raise InputError(path, "mesh", None, "no such file")
    if path.suffix == ".vtkhdf":
        from solver.mesh import vtkhdf

        return vtkhdf.read(path)
    raise InputError(path, "extension", path.suffix, "allowed: .vtkhdf")
