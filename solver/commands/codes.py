"""The commands that run other codes, write their input, or check their results."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..system.errors import InputError
from .cli import FAILED, PASSED, positive, print_checks
from .jobs import case_file

if TYPE_CHECKING:
    import meshio

    from ..case.model import Case
    from ..codes.run import Code


def _add_case(command: argparse.ArgumentParser) -> None:
    """Add the arguments that identify a solve by one code."""
    command.add_argument("case", type=Path, metavar="CASE", help="a case file, or a name")
    command.add_argument("--code", required=True, metavar="NAME", help="which code")
    command.add_argument("--mesh", type=Path, help="a mesh written by `mesh`, used unchanged")
    command.add_argument("--swap", action="store_true", help="exchange slave and master")


def _chosen(options: argparse.Namespace) -> "tuple[Code, Case, meshio.Mesh]":
    """The code, the case as solved, and its mesh."""
    from ..case.reader import load_case
    from ..codes.run import find
    from ..mesh import read_mesh
    from ..verification.run import mesh_of

    code = find(options.code)
    case = load_case(case_file(options.case)).as_solved(options.swap)
    return code, case, read_mesh(options.mesh) if options.mesh else mesh_of(case)


def add_export(command: argparse.ArgumentParser) -> None:
    _add_case(command)
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")


def run_export(options: argparse.Namespace) -> int:
    from ..codes.deck import UnsupportedError, deck_of

    code, case, mesh = _chosen(options)
    options.output.mkdir(parents=True, exist_ok=True)
    try:
        code.write(deck_of(case, mesh, code.layer, code.follows), options.output)
    except UnsupportedError as error:
        raise InputError(options.case, "--code", code.name, str(error)) from None
    command = " ".join(code.command(options.output))
    print(f"{options.output}: written{command and f'; next, there: {command}'}")
    return 0


def add_run(command: argparse.ArgumentParser) -> None:
    _add_case(command)
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    command.add_argument("--seconds", type=positive, default=120.0, help="the time limit (120)")
    command.add_argument("--memory", type=positive, default=4000.0, help="the limit, MB (4000)")


def run_run(options: argparse.Namespace) -> int:
    from ..codes.run import Limits, run_case

    code, case, mesh = _chosen(options)
    limits = Limits(seconds=options.seconds, memory=1e6 * options.memory)
    verdict = run_case(code, case, mesh, options.output, limits)
    print_checks(verdict)
    return PASSED if verdict.sound else FAILED


def add_codes(command: argparse.ArgumentParser) -> None:
    command.add_argument("folders", type=Path, nargs="*", metavar="FOLDER", help="of your own")


def run_codes(options: argparse.Namespace) -> int:
    from ..codes.run import find, names

    for name in [*names(), *map(str, options.folders)]:
        code = find(name)
        version = code.version()
        print(f"{name}: {version or f'not installed: {code.install}'}")
    return 0


def add_check_result(command: argparse.ArgumentParser) -> None:
    command.add_argument("case", type=Path, metavar="CASE", help="a case file, or a name")
    command.add_argument(
        "results",
        type=Path,
        nargs="+",
        metavar="RESULT",
        help="VTU, VTKHDF, MED, FRD, Exodus, table",
    )
    command.add_argument("--map", type=Path, metavar="MAP.yaml", help="names, signs and units")
    command.add_argument("--code", default="", metavar="NAME", help="the name of the code")
    command.add_argument(
        "--only", metavar="FIELDS", help="compare these alone: displacement, stress, pressure, gap"
    )
    command.add_argument("--swap", action="store_true", help="exchange slave and master")
    command.add_argument("--mesh", type=Path, help="the case's mesh, written by `mesh`")
    command.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="a folder of results, for the verdict"
    )
    command.add_argument("--json", action="store_true", help="print the verdict")


def run_check_result(options: argparse.Namespace) -> int:
    from ..case.reader import load_case
    from ..codes.files.read import read_result_files
    from ..codes.verdicts import check_foreign, folder_of, store
    from ..mesh import read_mesh
    from ..verification.flat import to_json

    case = load_case(case_file(options.case)).as_solved(options.swap)
    only = _fields(options.only)
    foreign = read_result_files(options.results, options.map, options.code)
    mesh = read_mesh(options.mesh) if options.mesh else None
    if options.output:
        verdict = store(case, foreign, folder_of(options.output, case, foreign.code), mesh, only)
    else:
        verdict = check_foreign(case, foreign, mesh, only)
    if options.json:
        print(to_json(verdict.plain()))
    else:
        print_checks(verdict)
    return PASSED if verdict.sound else FAILED


def _fields(given: str | None) -> list[str] | None:
    """The fields of `--only`, between commas."""
    from ..codes.compared import CHECKED_BY

    if given is None:
        return None
    names = [name.strip() for name in given.split(",")]
    if unknown := [name for name in names if name not in CHECKED_BY]:
        raise InputError("command line", "--only", unknown[0], f"allowed: {', '.join(CHECKED_BY)}")
    return names
