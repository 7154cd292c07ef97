"""The commands of the studies.

The workflow runs `study`, so the help of the program does not list it.
"""

import argparse
import sys
from functools import partial
from pathlib import Path

from ..system.errors import InputError
from ..system.progress import report_outcomes
from .cli import NO_RESULT, PASSED, add_threads
from .jobs import case_file

LEVELS = (1, 2, 4)


def _add_levels(command: argparse.ArgumentParser) -> None:
    text = "factors of divisions, three or more (1 2 4)"
    command.add_argument("--levels", type=int, nargs="+", metavar="N", default=LEVELS, help=text)


def _add_common(command: argparse.ArgumentParser, output: str) -> None:
    command.add_argument("--level", default="full", choices=("full", "quick", "large"))
    command.add_argument("-o", "--output", type=Path, required=True, metavar=output)


def add_expect(command: argparse.ArgumentParser) -> None:
    command.add_argument("case", type=Path, metavar="CASE", help="a case file, or a name")
    _add_levels(command)


def run_expect(options: argparse.Namespace) -> int:
    from ..studies.converge import expected_errors

    found = expected_errors(case_file(options.case), options.levels)
    print("expected:" if found else "# no check against a reference errs by more than round-off")
    for name, error in found.items():
        print(f"  {name}: {error:.1e}")
    return PASSED


def add_converge(command: argparse.ArgumentParser) -> None:
    command.add_argument("cases", type=Path, nargs="+", metavar="CASE", help="files, or names")
    command.add_argument("--swap", action="store_true", help="exchange slave and master")
    _add_levels(command)
    command.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="and a page in this folder"
    )
    add_threads(command)


def run_converge(options: argparse.Namespace) -> int:
    from ..studies.converge import convergence

    cases = [case_file(case) for case in options.cases]
    study, groups = convergence(cases, options.levels, options.swap)
    from ..studies.page import lost_points, show, write_page

    shown = show(study, groups)
    for section in shown.sections:
        print("\n".join(table.text() for table in section.tables) + "\n")
    said = "\n".join([*shown.problems, shown.outcome])
    print(write_page(study, groups, options.output) if options.output else said)
    return NO_RESULT if lost_points(groups) else PASSED


def add_measure(command: argparse.ArgumentParser) -> None:
    command.add_argument("study", type=Path, metavar="STUDY.yaml")
    command.add_argument("group", metavar="GROUP")
    _add_common(command, "RECORD.json")
    add_threads(command)


def run_measure(options: argparse.Namespace) -> int:
    from ..studies.description import read_study
    from ..studies.run import write_group

    study = read_study(options.study, options.level)
    with report_outcomes(partial(print, file=sys.stderr, flush=True)):
        print(write_group(study, options.group, options.output, options.study, options.level))
    return 0


def add_study_page(command: argparse.ArgumentParser) -> None:
    command.add_argument("study", type=Path, metavar="STUDY.yaml")
    command.add_argument("--results", type=Path, required=True, metavar="DIR", help="the records")
    _add_common(command, "DIR")


def run_study_page(options: argparse.Namespace) -> int:
    from ..studies.description import read_study
    from ..studies.page import write_study

    study = read_study(options.study, options.level)
    if not options.results.is_dir():
        raise InputError(options.results, "--results", None, "no such folder")
    print(write_study(study, options.results, options.output, options.level))
    return 0
