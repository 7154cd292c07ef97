"""The commands that solve a case, check its result again, and accept its values."""

import argparse
import logging
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..system.errors import InputError, of_machine
from ..system.progress import OUTCOME
from . import jobs
from .cli import FAILED, PASSED, add_threads, print_checks

if TYPE_CHECKING:
    from ..simulation.results.solution import Solution
    from ..verification.run import Job
    from ..verification.verdict import Verdict


_LOG = logging.getLogger(__name__)


def add_solve(command: argparse.ArgumentParser) -> None:
    _add_job(command)
    command.add_argument(
        "-o", "--output", type=Path, metavar="RESULT.vtkhdf", help="without it nothing is written"
    )
    command.add_argument(
        "--verdict", type=Path, metavar="VERDICT.json", help="written for every outcome"
    )
    command.add_argument(
        "--pictures", type=Path, metavar="DIR", help="draw the pictures of the report, kept there"
    )
    command.add_argument("--quiet", action="store_true", help="print nothing but errors")
    command.add_argument("--verbose", action="store_true", help="print each stage, with the time")
    add_threads(command)
    command.add_argument(
        "--everything", action="store_true", help="also do the work that the case does not need"
    )
    command.add_argument(
        "--no-memory-check", action="store_true", help="start even if memory cannot suffice"
    )


def _add_job(command: argparse.ArgumentParser) -> None:
    """The arguments that identify a solve: case, mesh, direction, variant."""
    command.add_argument(
        "case",
        type=Path,
        metavar="CASE",
        help="a case file, or the name of a case that `list` lists",
    )
    command.add_argument("--mesh", type=Path, help="a mesh written by `mesh`, used unchanged")
    command.add_argument("--swap", action="store_true", help="exchange slave and master")
    command.add_argument(
        "--hexahedra", choices=("pyramids", "hexahedra"), help="how to cut slave hexahedra"
    )
    command.add_argument(
        "--recovery",
        choices=("none", "linear", "quadratic", "smooth", "automatic"),
        help="how to recover a pressure of higher order, instead of the case's own setting",
    )
    command.add_argument(
        "--refine", type=int, default=1, metavar="N", help="a mesh so many times finer"
    )


def run_solve(options: argparse.Namespace) -> int:
    from ..system.progress import details, report_outcomes
    from ..verification.run import solve

    if options.pictures and not options.output:
        raise InputError("--pictures", "folder", str(options.pictures), "needs a result: add -o")
    log = _silent if options.quiet else partial(print, flush=True)
    checked, everything = not options.no_memory_check, options.everything
    job = replace(_job(options), memory_check=checked, everything=everything)
    with details(options.verbose and not options.quiet), report_outcomes(log):
        drawn = options.pictures and partial(_draw, options.pictures, options.output.parent)
        verdict = solve(job, options.output, options.verdict, drawn)
    return PASSED if verdict.sound else FAILED


def _job(options: argparse.Namespace) -> "Job":
    from ..case.model import SolvedAs
    from ..verification.run import Job

    file, swapped = jobs.named(options.case)
    solved_as = SolvedAs(options.swap != swapped, options.hexahedra, options.recovery)
    return Job(file, options.mesh, solved_as, options.refine)


def _draw(pictures: Path, folder: Path, solution: "Solution", verdict: "Verdict") -> None:
    """Draw what the report shows of a solve; the report draws whatever is missing."""
    from ..report.pictures import draw_all
    from ..report.rows import Row

    try:
        draw_all(Row(verdict, folder), pictures, solution)
    except Exception as error:  # noqa: BLE001 -- the solve is what counts
        reason = of_machine(error) or f"{type(error).__name__}: {error}"
        _LOG.log(OUTCOME, "no pictures: %s", reason)


def _silent(line: str) -> None:
    """Print nothing."""


def add_crashed(command: argparse.ArgumentParser) -> None:
    _add_job(command)
    command.add_argument("--verdict", type=Path, required=True, metavar="VERDICT.json")
    command.add_argument("--log", type=Path, help="its last line is the reason")
    command.add_argument("--status", type=int, metavar="N", help="its exit status")


def run_crashed(options: argparse.Namespace) -> int:
    from ..verification.run import record_crash

    print(record_crash(_job(options), options.verdict, options.log, options.status).summary)
    return PASSED


def add_check(command: argparse.ArgumentParser) -> None:
    command.add_argument("results", type=Path, nargs="+", metavar="RESULT.vtkhdf")
    command.add_argument("--json", action="store_true", help="print a list of verdicts")


def run_check(options: argparse.Namespace) -> int:
    from ..verification.flat import to_json
    from ..verification.run import check

    verdicts = [check(result) for result in options.results]
    if options.json:
        print(to_json([verdict.plain() for verdict in verdicts]))
    else:
        for verdict in verdicts:
            print_checks(verdict)
    return PASSED if all(verdict.sound for verdict in verdicts) else FAILED


def add_accept(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "results", type=Path, nargs="+", metavar="RESULT.vtkhdf", help="or a case file"
    )


def run_accept(options: argparse.Namespace) -> int:
    from ..verification.checks import accept, accepted_values, regression_file, run_checks
    from ..verification.results import read_result

    for path in (result for given in options.results for result in jobs.results_of(given)):
        solution = read_result(path).solution
        case, target = solution.case.path, regression_file(solution).resolve()
        if not (case.is_file() and target.is_relative_to(Path.cwd())):
            allowed = "must be a file below the current folder, where its accepted values lie"
            raise InputError(path, "case", str(case), allowed)
        checks = run_checks(solution, accepted_values(solution))
        changes = accept(solution, checks)
        print(f"{solution.job}: {len(changes)} new accepted values of {len(checks)}")
        for line in changes:
            print(f"  {line}")
    return PASSED
