"""The commands that run other codes, or write their input."""

import argparse
from pathlib import Path
from typing import Any

from ..system.errors import InputError
from .options import add_command


def add_commands(commands: Any) -> None:
    """Add the commands of other codes to those of the program."""
    command = add_command(commands, "export", _export, "write the input of another code")
    _add_case(command)
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")


def _add_case(command: argparse.ArgumentParser) -> None:
    """What singles out one solve by one code."""
    command.add_argument("case", type=Path, metavar="CASE.yaml")
    command.add_argument("--code", required=True, metavar="NAME", help="which code")
    command.add_argument("--mesh", type=Path, help="a mesh written by `mesh`, used unchanged")
    command.add_argument("--swap", action="store_true", help="exchange slave and master")


def _export(options: argparse.Namespace) -> int:
    from ..case.reader import load_case
    from ..codes.deck import UnsupportedError, deck_of
    from ..codes.registry import find
    from ..mesh import read_mesh
    from ..verification.run import mesh_of

    code = find(options.code)
    case = load_case(options.case).as_solved(options.swap)
    mesh = read_mesh(options.mesh) if options.mesh else mesh_of(case)
    options.output.mkdir(parents=True, exist_ok=True)
    try:
        code.write(deck_of(case, mesh, code.layer), options.output)
    except UnsupportedError as error:
        raise InputError(options.case, "--code", code.name, str(error)) from None
    print(f"{options.output}: written; next, there: {' '.join(code.command(options.output))}")
    return 0
