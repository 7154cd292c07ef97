"""What is around the project: it does not change a run, and a run does not change it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.workflow.projects import ROOT, new_project

TAKEN_OVER = "raise SystemExit('taken over')\n"


def make(project, home, **environment):
    """The finished process of `make all-cases`, with the environment there is."""
    return subprocess.run(
        ["make", "all-cases", "INSTALLED=yes"],
        cwd=project,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
        env={"PATH": os.environ["PATH"], "HOME": str(home), **environment},
    )


@pytest.fixture
def project(tmp_path):
    project = new_project(tmp_path / "project")
    (project / "cases" / "tiny" / "tiny-a.yaml").unlink()
    shutil.copy(ROOT / "Makefile", project)
    (project / ".venv").symlink_to(sys.prefix)
    return project


def test_foreign_modules_do_not_join_a_run_and_nothing_is_written_into_the_home_folder(
    project, tmp_path
):
    hostile, home = tmp_path / "hostile", tmp_path / "home"
    hostile.mkdir()
    home.mkdir()
    for name in ("re", "types", "enum", "solver"):
        (project / f"{name}.py").write_text(TAKEN_OVER)
    for name in ("yaml", "numpy", "h5py", "jsonschema", "signal"):
        (project / f"{name}.py").write_text(TAKEN_OVER)
        (hostile / f"{name}.py").write_text(TAKEN_OVER)
    (hostile / "sitecustomize.py").write_text(TAKEN_OVER)
    run = make(project, home, PYTHONPATH=str(hostile), PYTHONHOME=str(hostile))
    assert run.returncode == 0, run.stdout
    assert "The one solve passed." in run.stdout
    assert list(home.iterdir()) == []
    solve = [sys.executable, "-m", "solver", "validate", "cases/tiny/tiny-b.yaml"]
    for name in ("re", "types", "enum"):  # `-m` imports them before anything of ours
        (project / f"{name}.py").unlink()
    direct = subprocess.run(solve, cwd=project, capture_output=True, text=True)
    assert direct.stdout == "cases/tiny/tiny-b.yaml: valid\n"


def test_no_home_folder_is_needed(project):
    run = make(project, Path(os.devnull) / "none")
    assert run.returncode == 0, run.stdout
