"""The commands that run other codes, or write their input."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..system.errors import InputError
from .jobs import case_file
from .options import FAILED, PASSED, add_command, print_checks

if TYPE_CHECKING:
    import meshio

    from ..case.model import Case
    from ..codes.run import Code


def add_commands(commands: Any) -> None:
    """Add the commands of other codes to the program."""
    command = add_command(commands, "export", _export, "write the input of another code")
    _add_case(command)
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")

    purpose = "run another code on a case and check what it finds"
    command = add_command(commands, "run", _run, purpose)
    _add_case(command)
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    command.add_argument("--seconds", type=float, default=120.0, help="the time limit (120)")
    command.add_argument("--memory", type=float, default=4000.0, help="the limit, MB (4000)")

    command = add_command(commands, "codes", _codes, "list the codes, and which are installed")
    command.add_argument("folders", type=Path, nargs="*", metavar="FOLDER", help="of your own")


def _add_case(command: argparse.ArgumentParser) -> None:
    """Add the arguments that identify a solve by one code."""
    command.add_argument("case", type=Path, metavar="CASE", help="a case file, or a name")
    command.add_argument("--code", required=True, metavar="NAME", help="which code")
    command.add_argument("--mesh", type=Path, help="a mesh written by `mesh`, used unchanged")
    command.add_argument("--swap", action="store_true", help="exchange slave and master")


def _chosen(options: argparse.Namespace) -> "tuple[Code, Case, meshio.Mesh]":
    """The code, the case as solved, and its mesh."""
    from ..case.reader import load_case
    from ..codes.run import find
    from ..mesh import read_mesh
    from ..verification.run import mesh_of

    code = find(options.code)
    case = load_case(case_file(options.case)).as_solved(options.swap)
    return code, case, read_mesh(options.mesh) if options.mesh else mesh_of(case)


def _export(options: argparse.Namespace) -> int:
    from ..codes.deck import UnsupportedError, deck_of

    code, case, mesh = _chosen(options)
    options.output.mkdir(parents=True, exist_ok=True)
    try:
        code.write(deck_of(case, mesh, code.layer), options.output)
    except UnsupportedError as error:
        raise InputError(options.case, "--code", code.name, str(error)) from None
    command = " ".join(code.command(options.output))
    print(f"{options.output}: written{command and f'; next, there: {command}'}")
    return 0


def _run(options: argparse.Namespace) -> int:
    from ..codes.run import Limits, run_case

    code, case, mesh = _chosen(options)
    limits = Limits(seconds=options.seconds, memory=1e6 * options.memory)
    verdict = run_case(code, case, mesh, options.output, limits)
    print_checks(verdict)
    return PASSED if verdict.sound else FAILED


def _codes(options: argparse.Namespace) -> int:
    from ..codes.run import find, names

    for name in [*names(), *map(str, options.folders)]:
        code = find(name)
        version = code.version()
        print(f"{name}: {version or f'not installed: {code.install}'}")
    return 0
