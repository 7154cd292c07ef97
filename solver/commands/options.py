"""The common parts of several commands."""

import argparse
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..verification.verdict import CheckResult, Verdict

# Exit statuses.
PASSED, FAILED, REFUSED, NO_RESULT, BUG, INTERRUPTED = 0, 1, 2, 3, 70, 130


def add_command(
    commands: Any,
    name: str,
    run: Callable[[argparse.Namespace], int],
    purpose: str,
    listed: bool = True,
) -> argparse.ArgumentParser:
    """Add a command by its name, what runs it, and its purpose in words.

    Commands of the workflow are not `listed` in the help.
    """
    text = f"{purpose[0].upper()}{purpose[1:]}."
    shown = {"help": purpose} if listed else {}
    command: argparse.ArgumentParser = commands.add_parser(name, description=text, **shown)
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


def print_checks(verdict: "Verdict") -> None:
    """Print a verdict, a line for each check."""
    print(verdict.summary)
    for row in verdict.checks:
        print("  " + _row(row))


def _row(check: "CheckResult") -> str:
    extremes = f"{check.minimum:.10g} … {check.maximum:.10g}"
    error = f"error {check.error:.1e} (allowed {check.tolerance:.0e})"
    word = "ok" if check.passed else "FAILED"
    return f"{word:<7}{check.name + ' ' + (check.zone or ''):<40}{extremes:<36}{error}"
