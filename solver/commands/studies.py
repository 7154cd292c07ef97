"""The commands of the studies: each measures points, or writes the page of what was measured.

The workflow runs them, so the help of the program does not list them.
"""

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..studies import FULL, LARGE, QUICK, SIZES
from ..system.errors import InputError
from ..system.progress import report_outcomes
from .options import add_command, add_threads

RECORD, FOLDER = "RECORD.json", "DIR"


def add_commands(commands: Any) -> None:
    """Add the commands of all studies to the program."""
    _add_orders(commands)
    _add_expect(commands)
    _add_converge(commands)
    study = commands.add_parser("study", description="Error against run time.")
    _add_study(study.add_subparsers(title="commands", metavar="COMMAND", required=True))
    scaling = commands.add_parser("scaling", description="Cost against size.")
    _add_scaling(scaling.add_subparsers(title="commands", metavar="COMMAND", required=True))
    _add_benchmark(commands)
    _add_stability(commands)
    _add_infsup(commands)


def _output(command: argparse.ArgumentParser, metavar: str) -> None:
    command.add_argument("-o", "--output", type=Path, required=True, metavar=metavar)


def _sized(
    commands: Any,
    name: str,
    run: Any,
    purpose: str,
    file: str,
    output: str,
    sizes: Sequence[str] = SIZES,
) -> argparse.ArgumentParser:
    """A command on the file that describes a study, or on a part of it."""
    command = add_command(commands, name, run, purpose)
    command.add_argument("study", type=Path, metavar=file)
    command.add_argument("--size", choices=sizes, default=FULL)
    _output(command, output)
    return command


def _quick(command: argparse.ArgumentParser, what: str) -> None:
    """Add the arguments of commands that measure many points in one process."""
    _output(command, RECORD)
    command.add_argument("--quick", action="store_true", help=what)
    add_threads(command)


def _add_orders(commands: Any) -> None:
    command = add_command(
        commands, "orders", _orders, "write the page of orders of convergence", listed=False
    )
    command.add_argument("ladders", type=Path, nargs="+", metavar="ORDERS.yaml")
    command.add_argument("--results", type=Path, required=True, metavar=FOLDER, help="the levels")
    _output(command, FOLDER)


def _add_expect(commands: Any) -> None:
    purpose = "the errors that refined meshes predict for a case's own: its `expected`"
    command = add_command(commands, "expect", _expect, purpose)
    command.add_argument("case", type=Path, metavar="CASE.yaml")
    command.add_argument(
        "--levels",
        type=int,
        nargs="+",
        metavar="N",
        help="factors of divisions (1 2 4)",
    )


def _expect(options: argparse.Namespace) -> int:
    from ..studies.orders.expected import LEVELS, expected_errors

    print("expected:")
    for name, error in expected_errors(options.case, options.levels or LEVELS).items():
        print(f"  {name}: {error:.1e}")
    return 0


def _add_converge(commands: Any) -> None:
    purpose = "the order, the limit and its uncertainty of results, by refined meshes"
    command = add_command(commands, "converge", _converge, purpose)
    command.add_argument("cases", type=Path, nargs="+", metavar="CASE.yaml")
    command.add_argument("--swap", action="store_true", help="exchange slave and master")
    command.add_argument(
        "--levels",
        type=int,
        nargs="+",
        metavar="N",
        help="factors of divisions, three or more (1 2 4)",
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="and a page beside it, FILE.html"
    )
    add_threads(command)


def _converge(options: argparse.Namespace) -> int:
    from ..studies.converge.page import as_text, outcome, write_convergence
    from ..studies.converge.run import LEVELS, converge

    if options.output and options.output.suffix != ".json":
        raise InputError(options.output, "--output", None, "must end in .json")
    found = []
    for path in options.cases:
        found.append(converge(path, options.levels or LEVELS, options.swap))
        print(as_text(found[-1]) + "\n", flush=True)
    print(outcome(found))
    if options.output:
        print(f"Page: {write_convergence(found, options.output)}")
    return 0


def _orders(options: argparse.Namespace) -> int:
    from ..studies.orders.description import read_ladders
    from ..studies.orders.page import write_orders

    ladders = [read_ladders(path) for path in options.ladders]
    print(write_orders(ladders, options.results, options.output))
    return 0


def _add_study(commands: Any) -> None:
    file = "STUDY.yaml"
    purpose = "measure one point, in a process of its own"
    point = _sized(commands, "point", _study_point, purpose, file, RECORD)
    point.add_argument("point", metavar="POINT", help="PROBLEM/SLAVE-MASTER/TREATMENT/LEVEL")
    point.add_argument(
        "--reference", type=Path, metavar="RESULT.vtkhdf", help="used as the exact solution"
    )
    purpose = "solve a problem on its refined mesh"
    reference = _sized(commands, "reference", _reference, purpose, file, "RESULT.vtkhdf")
    reference.add_argument("problem", metavar="PROBLEM")
    page = _sized(commands, "page", _study_page, "write the page of all points", file, FOLDER)
    page.add_argument("--results", type=Path, required=True, metavar=FOLDER, help="the records")


def _study_point(options: argparse.Namespace) -> int:
    from ..studies.work_precision.description import read_study
    from ..studies.work_precision.point import measure_point

    study = read_study(options.study, options.size)
    point = study.point(options.point)
    if point.problem.reference and not options.reference:
        problem = f"{point.problem.name} has no exact solution: name a result by --reference"
        raise InputError(options.study, "reference", None, problem)
    print(measure_point(study, point, options.output, options.reference))
    return 0


def _reference(options: argparse.Namespace) -> int:
    from ..studies.work_precision.description import read_study
    from ..studies.work_precision.reference import write_reference

    write_reference(read_study(options.study, options.size), options.problem, options.output)
    return 0


def _study_page(options: argparse.Namespace) -> int:
    from ..studies.work_precision.description import read_study
    from ..studies.work_precision.page import write_study

    study = read_study(options.study, options.size)
    print(write_study(study, options.results, options.output))
    return 0


def _add_scaling(commands: Any) -> None:
    file, sizes = "SCALING.yaml", (*SIZES, LARGE)
    purpose = "solve one point, in a process of its own"
    point = _sized(commands, "point", _scaling_point, purpose, file, RECORD, sizes)
    point.add_argument("point", metavar="POINT", help="SERIES/SIZE")
    purpose = "write the page of all points"
    page = _sized(commands, "page", _scaling_page, purpose, file, FOLDER, sizes)
    page.add_argument("--results", type=Path, required=True, metavar=FOLDER, help="the records")


def _scaling_point(options: argparse.Namespace) -> int:
    from ..studies.scaling.description import read_scaling
    from ..studies.scaling.point import measure_point

    scaling = read_scaling(options.study, options.size)
    print(measure_point(scaling, scaling.point(options.point), options.output))
    return 0


def _scaling_page(options: argparse.Namespace) -> int:
    from ..studies.scaling.description import read_scaling
    from ..studies.scaling.page import write_scaling

    scaling = read_scaling(options.study, options.size)
    print(write_scaling(scaling, options.results, options.output))
    return 0


def _add_benchmark(commands: Any) -> None:
    command = add_command(
        commands, "benchmark", _benchmark, "measure time ratios side by side", listed=False
    )
    command.add_argument("benchmark", type=Path, metavar="BENCHMARK.yaml")
    command.add_argument("--quick", action="store_true", help="tiny meshes, for a first look")
    _output(command, RECORD)


def _benchmark(options: argparse.Namespace) -> int:
    from ..studies.benchmark.description import read_benchmark
    from ..studies.benchmark.page import as_text, write_benchmark
    from ..studies.benchmark.run import run_benchmark

    benchmark = read_benchmark(options.benchmark, QUICK if options.quick else FULL)
    with report_outcomes(partial(print, file=sys.stderr, flush=True)):
        record = run_benchmark(options.benchmark, benchmark)
    page = write_benchmark(record, options.output)
    print(f"{as_text(record)}\n\nPage: {page}")
    return 0


def _add_stability(commands: Any) -> None:
    purpose = "run a case over the values of one quantity"
    command = add_command(commands, "sweep", _sweep, purpose, listed=False)
    command.add_argument("sweep", type=Path, metavar="SWEEP.yaml")
    _quick(command, "only some of the values")

    purpose = "write the page of numerical stability"
    command = add_command(commands, "stability", _stability, purpose, listed=False)
    command.add_argument("records", type=Path, nargs="+", metavar=RECORD)
    _output(command, FOLDER)
    command.add_argument(
        "--quick", action="store_true", help="state on the page that values are left out"
    )
    command.add_argument("--infsup", type=Path, metavar=RECORD, help="also show this record")


def _sweep(options: argparse.Namespace) -> int:
    from ..studies.stability.description import read_sweep
    from ..studies.stability.point import run_sweep

    record = run_sweep(read_sweep(options.sweep, options.quick), options.output)
    held = [point["holds"] for point in record["points"]]
    seconds = f"{record['cpu_seconds']:.1f} s"
    print(f"{record['sweep']}: {sum(held)} of {len(held)} points hold, {seconds}")
    return 0 if all(held) else 1


def _stability(options: argparse.Namespace) -> int:
    from ..studies.infsup.records import read_record
    from ..studies.stability.page import read_records, write_stability

    theory = read_record(options.infsup) if options.infsup else None
    records = read_records(options.records)
    print(write_stability(records, options.output, options.quick, theory))
    return 0


def _add_infsup(commands: Any) -> None:
    purpose = "run the inf-sup test and the half-loaded block"
    command = add_command(commands, "infsup", _infsup, purpose, listed=False)
    command.add_argument("ladders", type=Path, metavar="INFSUP.yaml")
    _quick(command, "fewer levels")

    purpose = "write the page of the inf-sup test"
    command = add_command(commands, "infsup-page", _infsup_page, purpose, listed=False)
    command.add_argument("record", type=Path, metavar=RECORD)
    _output(command, FOLDER)


def _infsup(options: argparse.Namespace) -> int:
    from ..studies.infsup.point import measure

    with report_outcomes(partial(print, flush=True)):
        measure(options.ladders, options.output, options.quick)
    return 0


def _infsup_page(options: argparse.Namespace) -> int:
    from ..studies.infsup.page import write_page
    from ..studies.infsup.records import read_record

    print(write_page(read_record(options.record), options.output))
    return 0
