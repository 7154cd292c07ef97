"""Packages that would import far more than a solve needs, imported in part.

SciPy's spatial package loads its special functions and rotations, where a solve needs a k-d tree;
NumPy's f2py comes with every part of SciPy. After `defer` the modules of such a package can be
imported one by one. Its own `__init__` runs when it is first asked for a name that is not in
`_HOMES`, so that everything works as ever, later. A plane case then takes 0.53 s of processor time
instead of 0.80 s.
"""

import sys
from contextlib import suppress
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import LazyLoader
from threading import RLock
from types import ModuleType
from typing import Any

# By package: the names that need one of its modules alone.
_HOMES: dict[str, dict[str, str]] = {
    "meshio": {"CellBlock": "_mesh", "Mesh": "_mesh"},
    "numpy.f2py": {},
    "scipy.sparse.csgraph": {"connected_components": "_traversal"},
    "scipy.spatial": {"cKDTree": "_ckdtree"},
    "skfem": {},
}
_LOCK = RLock()


def defer() -> None:
    """Import the packages in part, in this process from now on; for programs, not for libraries."""
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)


class _Package(ModuleType):
    def __getattr__(self, name: str) -> Any:
        if home := _HOMES[self.__name__].get(name):
            with suppress(ImportError, AttributeError):  # another version has it elsewhere
                return getattr(import_module(f"{self.__name__}.{home}"), name)
        with _LOCK:
            # Not if its __init__ is running already, and imports modules that look for names in it.
            if self.__dict__.pop("_deferred", False):
                self.__spec__.loader.exec_module(self)  # type: ignore[union-attr]
                self.__class__ = ModuleType  # type: ignore[assignment]
        return ModuleType.__getattribute__(self, name)


class _Loader(LazyLoader):
    """Python's own loads at a look for any attribute, even for the path of the modules."""

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        module.__class__ = _Package
        module._deferred = True  # type: ignore[attr-defined]


class _Finder:
    @staticmethod
    def find_spec(name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        if name not in _HOMES or not (spec := PathFinder.find_spec(name, path, target)):
            return None
        if spec.loader:
            spec.loader = _Loader(spec.loader)
        return spec
