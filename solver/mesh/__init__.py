"""Meshes: made by recipe, read, written, moved. The container is `meshio.Mesh` everywhere.

Points (n, dim) with dim 2 or 3; at most one block per cell type, volume cells first, in VTK's node
order and with positive Jacobian; groups of cells in `cell_sets`, of nodes in `point_sets`.
What needs gmsh or h5py is imported when it is called.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import meshio
from meshio._mesh import topological_dimension

from ..case.typed import FieldError, read_as
from ..lac.cells.catalogue import BY_NAME
from ..system.errors import InputError, hint, key_path
from .keys import RECIPES, BricksKeys, Recipe

# meshio knows the nodes of PENTA15 and PYRA13, but its table of dimensions has no line for them.
for _kind in BY_NAME.values():
    topological_dimension.setdefault(_kind.meshio, _kind.dim)


def read_recipe(content: Mapping[str, Any], where: str | Path) -> Recipe | BricksKeys:
    """The keys of a case file's `mesh:` mapping with the key `recipe`.

    `where` names the case file in the InputError that an unknown recipe, key or value raises.
    """
    name = content.get("recipe")
    if name not in RECIPES:
        allowed = f"no such recipe; {hint(str(name), RECIPES)}"
        raise InputError(where, "mesh.recipe", name, allowed)
    return read_as(RECIPES[name], dict(content), where, "mesh")


def generate(content: Mapping[str, Any], where: str | Path) -> meshio.Mesh:
    """The mesh of a recipe, the same every time; raises as `read_recipe`."""
    from .tidy import tidy

    recipe = read_recipe(content, where)
    name = content["recipe"]
    module = import_module(f".recipes.{'blocks' if name == 'blocks' else 'mapped'}", __package__)
    try:
        raw = getattr(module, name)(recipe)
    except FieldError as fault:
        key = key_path(("mesh", *fault.keys))
        raise InputError(where, key, fault.value, fault.problem) from None
    except Exception as error:
        # What gmsh raises has no class of its own.
        if type(error) is not Exception:
            raise
        raise InputError(where, "mesh", None, f"gmsh cannot make it: {error}") from error
    return tidy(raw, str(where))


def transform(mesh: meshio.Mesh, spec: Mapping[str, Any], where: str = "transform") -> meshio.Mesh:
    """The mesh changed as a case file's `transform:` mapping says; see `transforms`."""
    from . import transforms

    return transforms.transform(mesh, spec, where)


def read_mesh(path: str | os.PathLike[str]) -> meshio.Mesh:
    """The mesh in a file, by its extension; see `formats`. Raises InputError naming the file."""
    from .files import formats

    return formats.read(Path(path))


def write_mesh(mesh: meshio.Mesh, path: str | os.PathLike[str]) -> None:
    """Write the mesh, by the extension, whole or not at all; see `formats`.

    The same mesh gives the same bytes as VTKHDF.
    """
    from .files import formats

    formats.write(mesh, Path(path))
