"""The command line: `python -m solver COMMAND …`.

Exit status: 0 all checks hold; 1 a check fails or the result is unreliable; 2 the input is refused;
3 the solve failed; 70 an error of the program itself; 130 interrupted. What a command needs is
imported when it runs, so that help comes at once.
"""

import argparse
import io
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..lac.errors import SolveError
from ..system.errors import InputError, hint, of_machine
from ..system.package import PROGRAM, PROJECT, project_version
from . import codes, family_folder, jobs, look, report, results, studies
from .options import (
    BUG,
    FAILED,
    INTERRUPTED,
    NO_RESULT,
    PASSED,
    REFUSED,
    add_command,
    add_threads,
    limit_threads,
    print_checks,
)

if TYPE_CHECKING:
    from ..simulation.results.solution import Solution
    from ..verification.run import Job
    from ..verification.verdict import Verdict

_EXAMPLES = f"""examples:
  {PROGRAM} new my-block -o my-block.yaml
  {PROGRAM} solve my-block.yaml -o my-block.vtkhdf
  {PROGRAM} inspect part.med --gap lower_face upper_face
  {PROGRAM} check-result my-block.yaml other-code.vtu

Exit status: 0 all checks hold; 1 a check fails; 2 the input is refused; 3 there is no solution.
Batches and studies are targets of make: make help."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, by default that of this process; the exit status."""
    if arguments is None:
        # Lines leave as they are written, so that the last line of a log is what was said last.
        if isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.reconfigure(line_buffering=True)
        # An unsound result is refused in one line: earlier warnings of libraries add nothing.
        if not sys.warnoptions:
            warnings.simplefilter("ignore")
    options = parser().parse_args(arguments)
    if options.threads:
        limit_threads(options.threads)
    try:
        return options.run(options)
    except InputError as error:
        print(error, file=sys.stderr)
        return REFUSED
    except SolveError as error:
        case = getattr(options, "case", None)
        print(f"{case}: {error}" if case else error, file=sys.stderr)
        return NO_RESULT
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PASSED
    except Exception as error:  # noqa: BLE001 -- status 1, Python's own, means a failed check
        return _unexpected(error)


def _unexpected(error: Exception) -> int:
    """One line for what the machine lacks, a traceback for a bug."""
    if reason := of_machine(error):
        print(reason, file=sys.stderr)
        return REFUSED if isinstance(error, OSError) else NO_RESULT
    traceback.print_exception(error)
    return BUG


@cache
def parser() -> argparse.ArgumentParser:
    """The command line: all commands with their arguments."""
    parser = _Parser(
        prog=PROGRAM,
        description="Verified contact solves.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", nargs=0, action=_Version, help="print the version and end")
    parser.set_defaults(threads=None)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    # In the order of use: help lists them in this order.
    _add_cases(commands)
    look.add_commands(commands)
    results.add_commands(commands)
    codes.add_commands(commands)
    report.add_commands(commands)
    _add_batch(commands)
    family_folder.add_commands(commands)
    studies.add_commands(commands)
    return parser


def _add_cases(commands: Any) -> None:
    """Add the commands that work on one case."""
    command = add_command(commands, "new", _new, "write a commented case file to start from")
    command.add_argument("name", nargs="?", metavar="NAME", help="default: as FILE")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: NAME.yaml")

    command = add_command(commands, "validate", _validate, "check whether case files are valid")
    command.add_argument("cases", type=Path, nargs="+", metavar="CASE.yaml")
    command.add_argument("--mesh", action="store_true", help="also mesh them and check the groups")

    command = add_command(commands, "mesh", _mesh, "write the mesh of a case, after its transform")
    command.add_argument("case", type=Path, metavar="CASE", help="a case file, or a name")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="MESH")

    command = add_command(commands, "solve", _solve, "solve a case and check it")
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

    command = add_command(commands, "check", _check, "run the checks of stored results again")
    command.add_argument("results", type=Path, nargs="+", metavar="RESULT.vtkhdf")
    command.add_argument("--json", action="store_true", help="print a list of verdicts")


def _add_batch(commands: Any) -> None:
    """Add the commands that work on the results of many cases."""
    command = add_command(commands, "accept", _accept, "store results as the accepted values")
    command.add_argument(
        "results", type=Path, nargs="+", metavar="RESULT.vtkhdf", help="or a case file"
    )

    command = add_command(
        commands, "crashed", _crashed, "write the verdict of a solve that died", listed=False
    )
    _add_job(command)
    command.add_argument("--verdict", type=Path, required=True, metavar="VERDICT.json")
    command.add_argument("--log", type=Path, help="its last line is the reason")
    command.add_argument("--status", type=int, metavar="N", help="its exit status")
    command.add_argument("--refusal", help="it was not started, for this reason: refused")

    command = add_command(
        commands,
        "serve",
        _serve,
        "keep a warm process and fork it for each command of a batch",
        listed=False,
    )
    command.add_argument("socket", type=int, metavar="FD", help="an open, listening socket")


class _Parser(argparse.ArgumentParser):
    """Answers an unknown command with those that help lists, the nearest one first."""

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if isinstance(action, argparse._SubParsersAction) and value not in action.choices:
            listed = [choice.dest for choice in action._choices_actions]
            self.error(f"no such command: {value}; {hint(value, listed)}")
        super()._check_value(action, value)


class _Version(argparse.Action):
    """Prints the version, which is looked up only then."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(PROJECT, project_version())
        parser.exit()


def _add_job(command: argparse.ArgumentParser) -> None:
    """Add the arguments that identify a solve: case, mesh, direction, variant."""
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


def _mesh(options: argparse.Namespace) -> int:
    from ..case.reader import load_case
    from ..mesh import write_mesh
    from ..verification.run import mesh_of

    file, _ = jobs.named(options.case)
    write_mesh(mesh_of(load_case(file), limited=True), options.output)
    return PASSED


def _job(options: argparse.Namespace) -> "Job":
    from ..verification.run import Job

    given = vars(options)
    chosen = {name: given[name] for name in ("case", "mesh", "hexahedra", "recovery", "refine")}
    file, swapped = jobs.named(options.case)
    return Job(swapped=options.swap != swapped, **chosen | {"case": file})


def _solve(options: argparse.Namespace) -> int:
    from ..system.progress import details, report_outcomes
    from ..verification.run import solve

    log = _silent if options.quiet else partial(print, flush=True)
    checked, everything = not options.no_memory_check, options.everything
    job = replace(_job(options), memory_check=checked, everything=everything)
    with details(options.verbose and not options.quiet), report_outcomes(log):
        drawn = options.pictures and options.output
        draw = partial(_draw, options.pictures, options.output.parent) if drawn else None
        verdict = solve(job, options.output, options.verdict, draw)
    return PASSED if verdict.sound else FAILED


def _draw(pictures: Path, folder: Path, solution: "Solution", verdict: "Verdict") -> None:
    """Draw what the report shows of a solve; it draws what is missing, and says why it cannot."""
    from ..report.pictures import draw_all
    from ..report.rows import Row

    with suppress(Exception):
        draw_all(Row(verdict, folder), pictures, solution)


def _silent(line: str) -> None:
    """Print nothing."""


def _crashed(options: argparse.Namespace) -> int:
    from ..verification.run import record_crash, record_refusal

    if options.refusal:
        print(record_refusal(options.case, options.verdict, options.refusal).summary)
        return PASSED
    print(record_crash(_job(options), options.verdict, options.log, options.status).summary)
    return PASSED


def _check(options: argparse.Namespace) -> int:
    from ..verification.run import check
    from ..verification.verdict import to_json

    verdicts = [check(result) for result in options.results]
    if options.json:
        print(to_json([verdict.plain() for verdict in verdicts]))
    else:
        for verdict in verdicts:
            print_checks(verdict)
    return PASSED if all(verdict.sound for verdict in verdicts) else FAILED


def _validate(options: argparse.Namespace) -> int:
    status = PASSED
    for path in options.cases:
        try:
            _validate_one(path, options.mesh)
        except InputError as error:
            print(error, file=sys.stderr)
            status = REFUSED
        else:
            print(f"{path}: valid")
    return status


def _validate_one(path: Path, with_mesh: bool) -> None:
    from ..case.reader import check_mesh_file, load_case

    case = load_case(path)
    check_mesh_file(case)
    if "recipe" in case.mesh:
        from ..mesh.recipes import read_recipe

        read_recipe(case.mesh, path)
    if with_mesh:
        from ..simulation.scene.groups import check_groups
        from ..simulation.scene.selections import with_groups
        from ..verification.run import mesh_of

        check_groups(case, with_groups(case, mesh_of(case)))


def _new(options: argparse.Namespace) -> int:
    from ..case.template import write_template

    name = options.name or (options.output.stem if options.output else "new-case")
    path = options.output or Path(f"{name}.yaml")
    write_template(name, path)
    print(f"{path}: written; next: {PROGRAM} solve {path} -o {path.with_suffix('.vtkhdf')}")
    return PASSED


def _accept(options: argparse.Namespace) -> int:
    from ..verification.checks import run_checks
    from ..verification.regression import accept, accepted_values, regression_file
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


def _serve(options: argparse.Namespace) -> int:
    import socket

    from .server import serve

    with socket.socket(fileno=options.socket) as listener:
        serve(listener)
    return PASSED
