"""The commands that report batches: a batch, and two side by side."""

import argparse
from pathlib import Path

from ..system.errors import InputError
from .cli import FAILED, PASSED


def add_report(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "results", type=Path, nargs="?", default=Path("results"), metavar="DIR", help="of a batch"
    )
    command.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    command.add_argument(
        "--run",
        type=Path,
        dest="asked",
        metavar="FILE",
        help="folders of solves; others there are older ones",
    )
    command.add_argument(
        "--families",
        type=Path,
        nargs="*",
        metavar="FAMILY.yaml",
        help="descriptions of families; default: those in cases/",
    )


def run_report(options: argparse.Namespace) -> int:
    from ..report import write_report

    found = {file.parent for file in options.results.rglob("verdict.json")}
    run = found
    if options.asked:
        lines = options.asked.read_text(encoding="utf-8", errors="replace").splitlines()
        run = {Path(line) for line in lines}
        if other := [folder for folder in run if not folder.is_relative_to(options.results)]:
            allowed = f"each line must be a folder in {options.results}"
            raise InputError(options.asked, "folder", str(min(other)), allowed)
        # What other codes made of a solve belongs to it.
        run |= {f for f in found if f.with_name(f.name.partition("@")[0]) in run}
    if not run:
        raise InputError(options.results, "verdict.json", None, "there is none in this folder")
    families = options.families
    if families is None:
        families = sorted(Path("cases").glob("*/family.yaml"))
    verdicts, older = (
        [folder / "verdict.json" for folder in sorted(folders)] for folders in (run, found - run)
    )
    print(write_report(verdicts, options.output, families, older))
    return FAILED if (options.output / "failures.txt").stat().st_size else PASSED


def add_saved(command: argparse.ArgumentParser) -> None:
    command.add_argument("results", type=Path, metavar="DIR", help="the family's results")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.json")


def run_saved(options: argparse.Namespace) -> int:
    from ..verification.savings import write_savings

    write_savings(options.results, options.output)
    return PASSED


def add_compare(command: argparse.ArgumentParser) -> None:
    command.add_argument("base", type=Path, metavar="BASE", help="results, or their summary.json")
    command.add_argument("this", type=Path, nargs="?", default=Path("results"), metavar="THIS")
    command.add_argument("--all", action="store_true", help="list all numbers that changed")


def run_compare(options: argparse.Namespace) -> int:
    from ..report.compare import Comparison, read_batch, to_markdown

    found = Comparison(read_batch(options.base), read_batch(options.this))
    print(to_markdown(found, options.all))
    return FAILED if found.groups["worse"] else PASSED
