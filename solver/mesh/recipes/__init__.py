"""The recipes by which gmsh makes meshes: a name, a function, and the type of its keys.

A new kind of mesh is a type in `solver.mesh.keys`, and a function of that type in a module here.
"""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import meshio

from ...case.typed import FieldError, read_as
from ...system.errors import InputError, hint, key_path
from ..keys import RECIPES, BricksKeys, Recipe
from ..tidy import tidy


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
    recipe = read_recipe(content, where)
    name = content["recipe"]
    module = import_module(f".{'blocks' if name == 'blocks' else 'mapped'}", __package__)
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
