"""The commands `python -m solver study …`."""

import argparse
from pathlib import Path
from typing import Any

from solver.commands.options import add_command
from solver.studies.work_precision import FULL, SIZES
from solver.system.errors import InputError

STUDY = "STUDY.yaml"


def add_commands(command: argparse.ArgumentParser) -> None:
    """Add the commands of the study to its parser."""
    commands = command.add_subparsers(title="commands", metavar="COMMAND", required=True)

    point = _add(commands, "point", _point, "measure one point, in a process of its own")
    point.add_argument("point", metavar="POINT", help="PROBLEM/SLAVE-MASTER/TREATMENT/LEVEL")
    point.add_argument("-o", "--output", type=Path, required=True, metavar="RECORD.json")
    point.add_argument("--reference", type=Path, metavar="RESULT.vtkhdf", help="taken for exact")

    reference = _add(commands, "reference", _reference, "solve a problem on its refined mesh")
    reference.add_argument("problem", metavar="PROBLEM")
    reference.add_argument("-o", "--output", type=Path, required=True, metavar="RESULT.vtkhdf")

    page = _add(commands, "page", _page, "write the page of all points")
    page.add_argument("--results", type=Path, required=True, metavar="DIR", help="the records")
    page.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")


def _add(commands: Any, name: str, run: Any, purpose: str) -> argparse.ArgumentParser:
    command = add_command(commands, name, run, purpose)
    command.add_argument("study", type=Path, metavar=STUDY)
    command.add_argument("--size", choices=SIZES, default=FULL)
    return command


def _point(options: argparse.Namespace) -> int:
    from solver.studies.work_precision.description import read_study
    from solver.studies.work_precision.point import measure_apart

    study = read_study(options.study, options.size)
    point = study.point(options.point)
    if point.problem.reference and not options.reference:
        allowed = f"{point.problem.name} has no exact solution: name a result by --reference"
        raise InputError(options.study, "reference", None, allowed)
    print(measure_apart(study, point, options.output, options.reference))
    return 0


def _reference(options: argparse.Namespace) -> int:
    from solver.studies.work_precision.description import read_study
    from solver.studies.work_precision.reference import write_reference

    study = read_study(options.study, options.size)
    write_reference(study, options.problem, options.output)
    return 0


def _page(options: argparse.Namespace) -> int:
    from solver.studies.work_precision.description import read_study
    from solver.studies.work_precision.page import write_study

    write_study(read_study(options.study, options.size), options.results, options.output)
    return 0
