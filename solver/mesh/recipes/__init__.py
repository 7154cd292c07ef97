"""The recipes by which gmsh makes meshes: a name, a function, and the keys it takes.

A new kind of mesh is a module with one function `(Keys) -> meshio.Mesh` and a line in `_RECIPES`.
"""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import meshio

from ...system.errors import InputError
from ..keys import Keys
from ..tidy import tidy

_RECIPES = {
    "blocks": ".blocks:blocks",
    "rings": ".mapped:rings",
    "shells": ".mapped:shells",
    "wavy": ".mapped:wavy",
    "parabola": ".mapped:parabola",
    "hertz": ".mapped:hertz",
    "punch": ".mapped:punch",
}


def generate(recipe: Mapping[str, Any], where: str) -> meshio.Mesh:
    """The mesh of a case file's `mesh:` mapping with the key `recipe`.

    The same mesh every time. `where` names the case file in the InputError that an unknown
    recipe, key or value raises.
    """
    keys = Keys(recipe, where, "mesh")
    module, function = _RECIPES[keys.choice("recipe", _RECIPES)].split(":")
    make = getattr(import_module(module, __package__), function)
    try:
        raw = make(keys)
    except Exception as error:
        # What gmsh raises has no class of its own.
        if type(error) is not Exception:
            raise
        raise InputError(where, "mesh", None, f"gmsh cannot make it: {error}") from error
    return tidy(raw, where)
