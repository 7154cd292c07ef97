"""The package as it is installed: the command and the import `mortarcheck`, in a fresh folder."""

import json
import os
import platform
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "solver"
SCRIPT = """\
import sys
from mortarcheck import InputError, __version__, solve_case
solved = solve_case("block.yaml")
assert abs(solved.pressure - 25.0).max() < 1e-9, solved.pressure
try:
    solve_case({"name": "empty"})
except InputError as error:
    print(error)
import importlib, pkgutil, mortarcheck
for module in pkgutil.walk_packages(mortarcheck.__path__, "mortarcheck."):
    if not module.name.endswith("_main") and not module.name.endswith("_main__"):
        importlib.import_module(module.name)  # the others are started, by the Python of other codes
assert not [name for name in sys.modules if name.partition(".")[0] == "solver"]
print(__version__)
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder in which the project's wheel is installed, built without network."""
    if find_spec("setuptools") is None or find_spec("pip") is None:
        pytest.skip("setuptools and pip, which `make` installs, are not there")
    folder = tmp_path_factory.mktemp("installed")
    copied = folder / "sources"
    shutil.copytree(SOURCES, copied / "solver", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("cases", "workflow"):
        shutil.copytree(ROOT / name, copied / name, ignore=shutil.ignore_patterns("__pycache__"))
    (copied / "build" / "lib" / "mortarcheck").mkdir(parents=True)
    (copied / "build" / "lib" / "mortarcheck" / "removed.py").touch()  # of an earlier build
    for name in ("LICENSE", "README.md", "pyproject.toml", "setup.py"):
        shutil.copy(ROOT / name, copied)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    alone = ["--no-deps", "--no-index"]
    build = [*pip, "wheel", *alone, "--no-build-isolation", "-w", folder, copied]
    subprocess.run(build, check=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", *alone, "-t", folder / "packages", wheel], check=True)
    return folder


@pytest.fixture
def fresh(installed, tmp_path):
    """Run Python with the installed package in a fresh folder."""
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
    expected = {
        f"mortarcheck/{prefix}{f.relative_to(folder).as_posix()}"
        for prefix, folder in (
            ("", SOURCES),
            ("cases/", ROOT / "cases"),
            ("workflow/", ROOT / "workflow"),
        )
        for f in folder.rglob("*")
        if f.is_file() and "__pycache__" not in f.parts
    }
    assert held == expected


def test_the_command_solves_checks_and_reports(installed, fresh, tmp_path):
    command = installed / "packages" / "bin" / "mortarcheck"
    assert fresh(command, "--version").stdout == "mortarcheck 0.1.0\n"
    told = fresh(command, "--version", "--verbose").stdout.splitlines()
    assert told[0] == "mortarcheck 0.1.0"
    assert [line.split()[0] for line in told[1:4]] == ["python", "numpy", "scipy"]
    assert told[-1].startswith(platform.system())
    made = fresh(command, "new", "block").stdout
    assert made.endswith("next: mortarcheck solve block.yaml -o block.vtkhdf\n")
    solved = fresh(command, "solve", "block.yaml", "-o", "r.vtkhdf", "--verdict", "verdict.json")
    assert solved.returncode == 0, solved.stderr
    verdict = json.loads((tmp_path / "verdict.json").read_text())
    assert verdict["verdict"] == "passed"
    assert verdict["provenance"]["command"].startswith("mortarcheck solve block.yaml")
    assert verdict["provenance"]["mortarcheck"] == "0.1.0"
    assert fresh(command, "check", "r.vtkhdf").returncode == 0
    reported = fresh(command, "report", ".", "-o", "report")
    assert reported.returncode == 0, reported.stderr
    assert "block" in (tmp_path / "report" / "summary.html").read_text()
    validated = fresh("-m", "mortarcheck", "validate", "block.yaml")
    assert validated.stdout == "block.yaml: valid\n"


def test_the_cases_come_with_it_and_are_solved_by_name(installed, fresh):
    command = installed / "packages" / "bin" / "mortarcheck"
    listed = fresh(command, "list").stdout
    assert "ssnp170           33 cases  Patch test of two pressed blocks" in listed
    assert "ssnp170-e-swapped" in fresh(command, "list", "ssnp170").stdout
    solved = fresh(command, "solve", "ssnp170-e-swapped")
    assert solved.returncode == 0, solved.stderr
    assert "ssnp170-e-swapped: passed, largest checked error" in solved.stdout
    refused = fresh(command, "solve", "ssnp170-ee")
    assert refused.returncode == 2
    assert "case = 'ssnp170-ee': no such case; did you mean ssnp170-e? (" in refused.stderr


@pytest.fixture
def own(installed, tmp_path):
    """Run the Python of an environment that has the wheel and Snakemake alone."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "own"], check=True)
    (site,) = tmp_path.glob("own/lib/python*/site-packages")
    packages = Path(pytest.__file__).parents[1]
    (site / "here.pth").write_text(f"{packages}\n{installed / 'packages'}\n")

    def run(folder, *command):
        return subprocess.run(
            [tmp_path / "own/bin/python", "-Es", "-m", *command],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    return run


def test_a_family_in_a_folder_of_its_own_becomes_green_and_red(own, tmp_path):
    made = own(tmp_path, "mortarcheck", "init", "my-family")
    assert made.stdout == "my-family: written; next: cd my-family && snakemake --cores all\n"
    family = tmp_path / "my-family"
    green = own(family, "snakemake", "--cores", "1")
    assert green.returncode == 0, green.stdout
    assert "The one solve passed. Report: results/report/summary.html" in green.stdout
    assert "<h1>my-family</h1>" in (family / "results/report/my-family.html").read_text()
    assert "Nothing to be done" in own(family, "snakemake", "--cores", "1").stdout
    case = family / "cases/my-family/block.yaml"
    text = case.read_text()
    assert "contact_pressure: 25.0" in text
    case.write_text(text.replace("contact_pressure: 25.0", "contact_pressure: 26.0"))
    red = own(family, "snakemake", "--cores", "1")
    assert red.returncode == 1, red.stdout
    assert "block: failed: " in red.stdout
    assert "1 failed. Report: results/report/summary.html" in red.stdout
    refused = own(tmp_path, "mortarcheck", "init", "my-family")
    assert refused.returncode == 2
    assert refused.stdout == "my-family: folder: is not empty; name a new one\n"
    assert own(tmp_path, "mortarcheck", "init", "odd name").returncode == 2


def test_the_import_solves_and_every_module_is_found(fresh):
    fresh("-m", "mortarcheck", "new", "block")
    done = fresh("-c", SCRIPT)
    assert done.returncode == 0, done.stderr
    refusal, version = done.stdout.splitlines()
    assert refusal.startswith("case: ")
    assert version == "0.1.0"


def test_contact_serves_scripts_over_scikit_fem(fresh):
    script = (ROOT / "docs/examples/lac/ex01_patch.py").read_text(encoding="utf-8")
    done = fresh("-c", script.replace("from solver.lac", "from mortarcheck.lac"))
    assert done.stdout == "pressure: 25 … 25\n", done.stderr


def test_the_citation_has_the_same_version():
    assert "\nversion: 0.1.0\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_project_folder_runs_in_place():
    command = [sys.executable, "-m", "solver", "--version"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "mortarcheck 0.1.0\n"
