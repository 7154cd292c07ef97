"""The package as it is installed: the command and the import `mortarcheck`, in a fresh folder."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "solver"
CASE = """\
name: pressed
mesh:
  recipe: blocks
  size: 50.0
  bottom: {cells: QUAD4, divisions: [3, 3]}
  top: {cells: TRIA3, divisions: [2, 2]}
plane: strain
materials: {all: {young: 2000.0, poisson: 0.3}}
supports: [{group: bottom, fix: [y]}, {group: left, fix: [x]}]
loads: [{group: top, pressure: 25.0}]
contact: [{name: interface, slave: upper_contact, master: lower_contact}]
reference: {kind: analytical, contact_pressure: 25.0}
"""
SCRIPT = """\
import sys
from mortarcheck import InputError, __version__, solve_case
solved = solve_case("pressed.yaml")
assert abs(solved.pressure - 25.0).max() < 1e-9, solved.pressure
try:
    solve_case({"name": "empty"})
except InputError as error:
    print(error)
import importlib, pkgutil, mortarcheck
for module in pkgutil.walk_packages(mortarcheck.__path__, "mortarcheck."):
    if module.name.rpartition(".")[2] not in ("__main__", "drawing", "shapes"):  # need PyVista
        importlib.import_module(module.name)
assert not [name for name in sys.modules if name.partition(".")[0] == "solver"]
print(__version__)
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder in which the project's wheel is installed, built without network."""
    if find_spec("setuptools") is None or find_spec("pip") is None:
        pytest.skip("setuptools and pip, which `make` installs, are not there")
    folder = tmp_path_factory.mktemp("installed")
    listed = ["git", "ls-files", "-z", "--cached", "--", "solver", "*.toml", "setup.py", "LICENSE"]
    files = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True, text=True).stdout
    for name in [*files.strip("\0").split("\0"), "README.md"]:
        target = folder / "sources" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes((ROOT / name).read_bytes())
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    alone = ["--no-deps", "--no-index"]
    build = [*pip, "wheel", *alone, "--no-build-isolation", "-w", folder, folder / "sources"]
    subprocess.run(build, check=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", *alone, "-t", folder / "packages", wheel], check=True)
    return folder


@pytest.fixture
def fresh(installed, tmp_path):
    """Run a command of the installed package, or its Python, in a folder with a case file."""
    (tmp_path / "pressed.yaml").write_text(CASE)
    environment = {**os.environ, "PYTHONPATH": str(installed / "packages")}

    def run(*command):
        return subprocess.run(
            [sys.executable, *map(str, command)],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )

    return run


def test_the_wheel_holds_every_file_of_the_package(installed):
    (wheel,) = installed.glob("*.whl")
    held = {name for name in ZipFile(wheel).namelist() if name.startswith("mortarcheck/")}
    files = (f for f in SOURCES.rglob("*") if f.is_file() and "__pycache__" not in f.parts)
    assert held == {f"mortarcheck/{f.relative_to(SOURCES).as_posix()}" for f in files}


def test_the_command_solves_checks_and_reports(installed, fresh, tmp_path):
    command = installed / "packages" / "bin" / "mortarcheck"
    assert fresh(command, "--version").stdout == "mortarcheck 0.1.0\n"
    solved = fresh(command, "solve", "pressed.yaml", "-o", "r.vtkhdf", "--verdict", "verdict.json")
    assert solved.returncode == 0, solved.stderr
    verdict = json.loads((tmp_path / "verdict.json").read_text())
    assert verdict["verdict"] == "passed"
    assert verdict["provenance"]["command"].startswith("mortarcheck solve pressed.yaml")
    assert verdict["provenance"]["mortarcheck"] == "0.1.0"
    assert fresh(command, "check", "r.vtkhdf").returncode == 0
    reported = fresh(command, "report", "verdict.json", "-o", "report")
    assert reported.returncode == 0, reported.stderr
    assert "pressed" in (tmp_path / "report" / "summary.html").read_text()
    assert "next: mortarcheck solve" in fresh(command, "new", "mine").stdout
    assert fresh("-m", "mortarcheck", "validate", "mine.yaml").stdout == "mine.yaml: valid\n"


def test_the_import_solves_and_every_module_is_found(fresh):
    done = fresh("-c", SCRIPT)
    assert done.returncode == 0, done.stderr
    refusal, version = done.stdout.splitlines()
    assert refusal.startswith("case: ")
    assert version == "0.1.0"


def test_the_project_folder_runs_in_place():
    command = [sys.executable, "-m", "solver", "--version"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "mortarcheck 0.1.0\n"
