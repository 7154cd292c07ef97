"""The commands that report batches: a batch, and two side by side."""

import argparse
import os
from pathlib import Path
from typing import Any

from ..system.errors import InputError
from .options import FAILED, PASSED, add_command


def add_commands(commands: Any) -> None:
    """Add `report` and `compare`."""
    command = add_command(commands, "report", _report, "write the report of many verdicts")
    command.add_argument("verdicts", type=Path, nargs="*", metavar="VERDICT.json")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    command.add_argument("--results", type=Path, metavar="DIR", help="use all verdicts in DIR")
    command.add_argument("--list", type=Path, metavar="FILE", help="use those in FILE, one a line")
    command.add_argument(
        "--older",
        type=Path,
        metavar="FILE",
        help="also show those in FILE; they are no failures of this batch",
    )
    command.add_argument(
        "--families",
        type=Path,
        nargs="*",
        metavar="FAMILY.yaml",
        help="descriptions of families; default: those in cases/",
    )
    command.add_argument(
        "--processes", type=int, metavar="N", help="to draw pictures; default: one for each core"
    )

    command = add_command(
        commands, "saved", _saved, "measure the time that a family saves", listed=False
    )
    command.add_argument("results", type=Path, metavar="DIR", help="the family's results")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.json")

    command = add_command(commands, "compare", _compare, "compare with another batch")
    command.add_argument("base", type=Path, metavar="BASE", help="results, or their summary.json")
    command.add_argument("this", type=Path, nargs="?", default=Path("results"), metavar="THIS")
    command.add_argument("-o", "--output", type=Path, metavar="PAGE.html")


def _verdicts(options: argparse.Namespace) -> list[Path]:
    """The verdicts named, listed, or in the folder of results, but those of ladders' levels."""
    verdicts = list(options.verdicts)
    if options.list:
        verdicts += _listed(options.list)
    if options.results:
        found = sorted(options.results.glob("**/verdict.json"))
        # The levels of ladders have a page of their own.
        verdicts += [p for p in found if "orders" not in p.relative_to(options.results).parts]
    if not verdicts:
        where = options.results or options.run.__name__.strip("_")
        raise InputError(where, "VERDICT.json", None, "no verdict is named or found")
    return verdicts


def _listed(file: Path) -> list[Path]:
    """The paths in a file, one a line."""
    return [Path(os.fsdecode(line)) for line in file.read_bytes().splitlines()]


def _report(options: argparse.Namespace) -> int:
    from ..report import write_report

    verdicts = _verdicts(options)
    families = options.families
    if families is None:
        families = sorted(Path("cases").glob("*/family.yaml"))
    older = _listed(options.older) if options.older else []
    print(write_report(verdicts, options.output, families, options.processes, older))
    return FAILED if (options.output / "failures.txt").stat().st_size else PASSED


def _saved(options: argparse.Namespace) -> int:
    from ..verification.savings import write_savings

    write_savings(options.results, options.output)
    return PASSED


def _compare(options: argparse.Namespace) -> int:
    from ..report.compare import compare

    found, text = compare(options.base, options.this, options.output)
    print(text)
    return FAILED if found.groups["worse"] else PASSED
