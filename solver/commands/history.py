"""The command that records batches."""

import argparse
from pathlib import Path
from typing import Any

from .options import FAILED, PASSED, add_command


def add_commands(commands: Any) -> None:
    """Add `record`."""
    command = add_command(commands, "record", _record, "record a batch, show all past ones")
    command.add_argument(
        "batch",
        type=Path,
        nargs="?",
        default=Path("results"),
        metavar="BATCH",
        help="results, or their summary.json",
    )
    command.add_argument(
        "--history",
        type=Path,
        default=Path("results/history"),
        metavar="DIR",
        help="folder of the records; default: results/history",
    )
    command.add_argument("-o", "--output", type=Path, metavar="PAGE.html")


def _record(options: argparse.Namespace) -> int:
    from ..report.history import record

    courses, text = record(options.batch, options.history, options.output)
    print(text)
    return FAILED if any(course.bad for course in courses) else PASSED
