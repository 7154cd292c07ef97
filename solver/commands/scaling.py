"""The commands `python -m solver scaling …`."""

import argparse
from pathlib import Path
from typing import Any

from solver.commands.options import add_command
from solver.studies.scaling import FULL, SIZES


def add_commands(command: argparse.ArgumentParser) -> None:
    """Add the commands of the scaling family to its parser."""
    commands = command.add_subparsers(title="commands", metavar="COMMAND", required=True)

    point = _add(commands, "point", _point, "solve one point, in a process of its own")
    point.add_argument("point", metavar="POINT", help="SERIES/SIZE")
    point.add_argument("-o", "--output", type=Path, required=True, metavar="RECORD.json")

    page = _add(commands, "page", _page, "write the page of all points")
    page.add_argument("--results", type=Path, required=True, metavar="DIR", help="the records")
    page.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")


def _add(commands: Any, name: str, run: Any, purpose: str) -> argparse.ArgumentParser:
    command = add_command(commands, name, run, purpose)
    command.add_argument("scaling", type=Path, metavar="SCALING.yaml")
    command.add_argument("--size", choices=SIZES, default=FULL)
    return command


def _point(options: argparse.Namespace) -> int:
    from solver.studies.scaling.description import read_scaling
    from solver.studies.scaling.point import measure_point

    scaling = read_scaling(options.scaling, options.size)
    print(measure_point(scaling, scaling.point(options.point), options.output))
    return 0


def _page(options: argparse.Namespace) -> int:
    from solver.studies.scaling.description import read_scaling
    from solver.studies.scaling.page import write_scaling

    write_scaling(read_scaling(options.scaling, options.size), options.results, options.output)
    return 0
