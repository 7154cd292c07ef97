"""The common parts of several commands."""

import argparse
import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..verification.verdict import CheckResult, Verdict

# Exit statuses.
PASSED, FAILED, REFUSED, NO_RESULT, BUG, INTERRUPTED = 0, 1, 2, 3, 70, 130


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
