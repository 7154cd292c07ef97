"""The commands of numerical stability: sweeps, the inf-sup test, and their pages."""

import argparse
from functools import partial
from pathlib import Path
from typing import Any

from solver.commands.options import add_command, add_threads


def add_commands(commands: Any) -> None:
    """Add the commands to those of the program."""
    command = add_command(
        commands, "sweep", _sweep, "push one quantity of a case through its values"
    )
    command.add_argument("sweep", type=Path, metavar="SWEEP.yaml")
    _add_record(command, quick="some of the values only")

    command = add_command(
        commands, "stability", _stability, "write the page of numerical stability"
    )
    command.add_argument("records", type=Path, nargs="+", metavar="RECORD.json")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    command.add_argument("--quick", action="store_true", help="say that values are left out")
    command.add_argument("--infsup", type=Path, metavar="RECORD.json", help="show its record too")

    command = add_command(
        commands, "infsup", _infsup, "run the inf-sup test and the half-loaded block"
    )
    command.add_argument("ladders", type=Path, metavar="INFSUP.yaml")
    _add_record(command, quick="fewer levels")

    command = add_command(
        commands, "infsup-page", _infsup_page, "write the page of the inf-sup test"
    )
    command.add_argument("record", type=Path, metavar="RECORD.json")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")


def _add_record(command: argparse.ArgumentParser, quick: str) -> None:
    """What a command takes that measures many points in one process."""
    command.add_argument("-o", "--output", type=Path, required=True, metavar="RECORD.json")
    command.add_argument("--quick", action="store_true", help=quick)
    add_threads(command)


def _sweep(options: argparse.Namespace) -> int:
    from solver.studies.stability.points import run_sweep
    from solver.studies.stability.sweeps import read_sweep

    record = run_sweep(read_sweep(options.sweep, options.quick), options.output, print)
    return 0 if all(point["holds"] for point in record["points"]) else 1


def _stability(options: argparse.Namespace) -> int:
    from solver.studies.infsup.page import read_record
    from solver.studies.stability.page import read_records, write_stability

    theory = read_record(options.infsup) if options.infsup else None
    records = read_records(options.records)
    write_stability(records, options.output, options.quick, theory=theory)
    return 0


def _infsup(options: argparse.Namespace) -> int:
    from solver.studies.infsup.description import read_ladders, run
    from solver.studies.infsup.half_loaded import FACES, profiles
    from solver.studies.infsup.page import write_record

    log = partial(print, flush=True)
    ladders = [run(ladder, log) for ladder in read_ladders(options.ladders, options.quick)]
    faces = FACES // 2 if options.quick else FACES
    write_record(options.output, ladders, profiles(faces, log))
    return 0


def _infsup_page(options: argparse.Namespace) -> int:
    from solver.studies.infsup.page import read_record, write_page

    write_page(read_record(options.record), options.output)
    return 0
