"""The package under the name it was imported by.

That is `solver` in the project folder and `mortarcheck` where it is installed. Nothing else in the
package depends on the name.
"""

import sys
from functools import cache
from pathlib import Path

PROJECT = "mortarcheck"
PACKAGE = __name__.partition(".")[0]
PROGRAM = PROJECT if PACKAGE == PROJECT else f"python -m {PACKAGE}"
"""The command that starts the program."""
COMMAND = [sys.executable, "-P", str(Path(__file__).parents[1] / "__main__.py")]
"""The program as a process of its own."""
_SOURCES = Path(__file__).parents[2]


def in_project() -> bool:
    """Whether the package is in the project folder, not installed."""
    return (_SOURCES / "pyproject.toml").is_file()


def cases_folder() -> Path:
    """The cases that come with the program: those of the project, or of the installed package."""
    return _SOURCES / "cases" if in_project() else Path(__file__).parents[1] / "cases"


def workflow_folder() -> Path:
    """The Snakemake workflow of the project, or of the installed package."""
    return _SOURCES / "workflow" if in_project() else Path(__file__).parents[1] / "workflow"


def workflow_file() -> str:
    """The Snakefile that a workflow of one's own uses as a `module`."""
    return str(workflow_folder() / "Snakefile")


@cache
def project_version() -> str:
    """The version in pyproject.toml: of the file itself, or as installed; else `unknown`."""
    if in_project():
        import tomllib

        content = tomllib.loads((_SOURCES / "pyproject.toml").read_text(encoding="utf-8"))
        return str(content["project"]["version"])
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(PROJECT)
    except PackageNotFoundError:  # a copy of the folder alone
        return "unknown"
