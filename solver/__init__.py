"""Verification of mortar contact: meshes, solves, checks and reports cases.

As a library: `from solver import solve_case` (see `solver.library`).
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solver.errors import InputError, SolveError
    from solver.library import Solved, solve_case

__all__ = ["InputError", "SolveError", "Solved", "solve_case"]

_HOME = {
    "InputError": "solver.errors",
    "SolveError": "solver.errors",
    "Solved": "solver.library",
    "solve_case": "solver.library",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: `import solver` alone loads nothing."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)
