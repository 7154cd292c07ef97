"""The recipes by which gmsh makes meshes: a name, a function, and the keys it takes.

A new kind of mesh is a module with one function `(Keys) -> meshio.Mesh` and a line in `_RECIPES`.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping
from importlib import import_module
from typing import Any

import meshio

from solver.errors import InputError
from solver.mesh.tidy import tidy

_RECIPES = {"blocks": "solver.mesh.blocks:blocks"}


class Keys:
    """The keys of a recipe, read one by one; what is missing, wrong or left over is refused."""

    def __init__(self, values: Mapping[str, Any], where: str, path: str):
        self._values, self._where, self._path = dict(values), where, path
        self._asked: set[str] = set()

    def refuse(self, key: str, value: object, allowed: str) -> InputError:
        """The refusal of a value, naming file, key and what is allowed."""
        return InputError(self._where, f"{self._path}.{key}", value, allowed)

    def _get(self, key: str) -> Any:
        self._asked.add(key)
        return self._values.get(key)

    def given(self, key: str) -> bool:
        """Whether the key is there."""
        self._asked.add(key)
        return key in self._values

    def choice(self, key: str, allowed: Collection[str], default: str | None = None) -> str:
        """A word out of a list."""
        value = self._get(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or value not in allowed:
            raise self.refuse(key, value, f"allowed: {', '.join(allowed)}")
        return value

    def numbers(self, key: str, count: int, default: float | None = None) -> list[float]:
        """Positive numbers; a single one stands for all `count` of them."""
        value = self._get(key)
        value = default if value is None else value
        values: list[Any] = value if isinstance(value, list) else [value] * count
        good = all(isinstance(v, int | float) and v is not True and 0 < v < 1e300 for v in values)
        if not good or len(values) != count:
            raise self.refuse(key, value, f"must be a positive number, or {count} of them")
        return [float(v) for v in values]

    def integers(self, key: str, count: int, default: list[int] | None = None) -> list[int]:
        """Positive whole numbers; a single one stands for all `count` of them."""
        value = self._get(key)
        value = default if value is None else value
        values: list[Any] = value if isinstance(value, list) else [value] * count
        if len(values) != count or any(type(v) is not int or v < 1 for v in values):
            raise self.refuse(key, value, f"must be a whole number from 1 on, or {count} of them")
        return values

    def section(self, key: str) -> Keys:
        """A mapping of keys below this one."""
        value = self._get(key)
        if not isinstance(value, dict):
            raise self.refuse(key, value, "must be a mapping of keys")
        return Keys(value, self._where, f"{self._path}.{key}")

    def finish(self) -> None:
        """Refuse keys that nobody asked for."""
        for key in self._values:
            if key not in self._asked:
                near = difflib.get_close_matches(str(key), self._asked, 1)
                hint = f" (did you mean {near[0]}?)" if near else ""
                allowed = f"unknown key{hint}; allowed: {', '.join(sorted(self._asked))}"
                raise InputError(self._where, f"{self._path}.{key}", None, allowed)


def generate(recipe: Mapping[str, Any], where: str) -> meshio.Mesh:
    """The mesh of a case file's `mesh:` mapping with the key `recipe`.

    The same mesh every time. `where` names the case file in the InputError that an unknown
    recipe, key or value raises.
    """
    keys = Keys(recipe, where, "mesh")
    module, function = _RECIPES[keys.choice("recipe", _RECIPES)].split(":")
    return tidy(getattr(import_module(module), function)(keys), where)
