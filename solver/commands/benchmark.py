"""The commands `python -m solver benchmark` and `savings`: what is measured side by side."""

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any

from solver.commands.options import add_command
from solver.studies.scaling import FULL, QUICK


def add_commands(commands: Any) -> None:
    """Add both commands to those of the program."""
    command = add_command(commands, "benchmark", _benchmark, "measure ratios side by side")
    command.add_argument("benchmark", type=Path, metavar="BENCHMARK.yaml")
    command.add_argument("--quick", action="store_true", help="on tiny meshes, for a first look")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="RECORD.json")

    command = add_command(commands, "savings", _savings, "measure what each line of a plan saves")
    command.add_argument("cases", type=Path, nargs="+", metavar="CASE.yaml")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="SAVINGS.json")


def _benchmark(options: argparse.Namespace) -> int:
    from solver.studies.benchmark import words
    from solver.studies.benchmark.description import read_benchmark
    from solver.studies.benchmark.run import run_benchmark
    from solver.system.files import write_text
    from solver.verification.verdict import to_json

    benchmark = read_benchmark(options.benchmark, QUICK if options.quick else FULL)
    record = run_benchmark(benchmark, partial(print, file=sys.stderr, flush=True))
    write_text(options.output, to_json(record) + "\n")
    print("\n".join(words.lines(record)))
    return 0


def _savings(options: argparse.Namespace) -> int:
    from solver.studies.benchmark.savings import write_savings

    write_savings(options.output, options.cases, partial(print, flush=True))
    return 0
