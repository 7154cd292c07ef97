"""Verification of mortar contact: meshes, solves, checks and reports cases.

As a library: `from solver import solve_case`, or `from mortarcheck import solve_case` where it is
installed (see `solver.api`).
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .api import Solved, solve_case
    from .lac.errors import SolveError
    from .system.errors import InputError
    from .system.package import workflow_file

__all__ = ["InputError", "SolveError", "Solved", "solve_case", "workflow_file"]

_HOME = {
    "InputError": ".system.errors",
    "SolveError": ".lac.errors",
    "Solved": ".api",
    "solve_case": ".api",
    "workflow_file": ".system.package",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: `import solver` alone loads nothing."""
    if name == "__version__":
        from .system.package import project_version

        return project_version()
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    """The public names alone."""
    return [*__all__, "__version__"]
