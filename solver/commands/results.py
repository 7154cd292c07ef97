"""The command that checks results of other codes."""

import argparse
from pathlib import Path
from typing import Any

from ..system.errors import InputError
from .jobs import case_file
from .options import FAILED, PASSED, add_command, print_checks


def add_commands(commands: Any) -> None:
    """Add `check-result`."""
    command = add_command(
        commands, "check-result", _check_result, "check a result that another code computed"
    )
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


def _check_result(options: argparse.Namespace) -> int:
    from ..case.reader import load_case
    from ..case.typed import read_as
    from ..case.yaml import read_mapping
    from ..codes.files.map import ResultMap
    from ..codes.files.read import read_result_files
    from ..codes.verdicts import check_foreign, folder_of, store
    from ..mesh import read_mesh
    from ..verification.verdict import to_json

    case = load_case(case_file(options.case)).as_solved(options.swap)
    mapping = ResultMap()
    if options.map:
        mapping = read_as(ResultMap, read_mapping(options.map), options.map)
    only = _fields(options.only)
    foreign = read_result_files(options.results, mapping, options.map, options.code)
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
