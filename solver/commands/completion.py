"""Shell completion: a script that knows all commands and options, made by shtab from the parser."""

import argparse
from copy import copy
from pathlib import Path
from typing import Any

from ..system.package import PROJECT
from .options import PASSED, add_command

SHELLS = ("bash", "zsh", "tcsh")


def add_commands(commands: Any, parser: argparse.ArgumentParser) -> None:
    """Add `completion`."""
    purpose = "print a script that completes commands in a shell"
    command = add_command(commands, "completion", _completion, purpose)
    command.add_argument("shell", choices=SHELLS)
    command.set_defaults(parser=parser)


def _completion(options: argparse.Namespace) -> int:
    print(script(options.parser, options.shell))
    return PASSED


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The script for a shell that completes the installed command; paths complete to files."""
    import shtab

    parser = copy(parser)
    parser.prog = PROJECT
    [commands] = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    for command in commands.choices.values():
        for action in command._actions:
            if action.type is Path:
                folder = action.metavar == "DIR"
                action.complete = shtab.DIRECTORY if folder else shtab.FILE
    return str(shtab.complete(parser, shell))
