"""The common parts of several commands."""

import argparse
import os
from collections.abc import Callable
from typing import Any


def add_command(
    commands: Any, name: str, run: Callable[[argparse.Namespace], int], purpose: str
) -> argparse.ArgumentParser:
    """Add a command by its name, what runs it, and its purpose in words."""
    text = f"{purpose[0].upper()}{purpose[1:]}."
    command: argparse.ArgumentParser = commands.add_parser(name, help=purpose, description=text)
    command.set_defaults(run=run)
    return command


def add_threads(command: argparse.ArgumentParser) -> None:
    """Let a command take `--threads`."""
    command.add_argument(
        "--threads", type=int, metavar="N", help="number of threads, unless the environment sets it"
    )


def limit_threads(number: int) -> None:
    """Tell the libraries, which read it when they are loaded; the environment comes first."""
    from ..system.process import THREADS

    for variable in THREADS:
        os.environ.setdefault(variable, str(number))
