"""The README's pictures are made by a command, of solves that the batch has."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "docs" / "site" / "front.py"


def test_every_solve_shown_is_in_the_batch():
    script = runpy.run_path(str(SCRIPT))
    for job in (*script["SHOWN"], f"friction/{script['CATTANEO']}"):
        family, name = job.split("/")
        case = ROOT / "cases" / family / f"{name.removeprefix(f'{family}-')}.yaml"
        assert f"name: {name}\n" in case.read_text(encoding="utf-8")


def test_without_a_batch_it_says_what_draws_them(tmp_path):
    copy = tmp_path / "docs" / "site" / "front.py"
    copy.parent.mkdir(parents=True)
    copy.write_text(SCRIPT.read_text(encoding="utf-8"))
    with pytest.raises(SystemExit, match="no such picture; make all-cases draws it"):
        runpy.run_path(str(copy), run_name="__main__")
