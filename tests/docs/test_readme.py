"""The commands of the README and of the tutorial, run from top to bottom as a newcomer would.

They run as they stand, in a copy of the project where long ones are short: `cases/` holds only the
case that the README names, a study and a scaling family of one point each, and `tests/` a single
test. The installation is left out: the copy borrows this environment.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
README, TUTORIAL = ROOT / "README.md", ROOT / "docs" / "tutorial.md"
LEFT_OUT = {".git", ".venv", ".snakemake", "cases", "results", "tests"}


def write_study(folder: Path) -> None:
    """The project's study with a single point in its quick part."""
    shutil.copytree(ROOT / "cases" / "study", folder)
    study = yaml.safe_load((folder / "study.yaml").read_text())
    pair = study["problems"][0]["pairs"][0]
    study["treatments"] = study["treatments"][:1]
    study["quick"] = {
        "repetitions": 1,
        "levels": 1,
        "pairs": {study["problems"][0]["name"]: [list(pair)]},
    }
    (folder / "study.yaml").write_text(yaml.safe_dump(study))


def write_scaling(folder: Path) -> None:
    """The project's scaling family with a single small point, its benchmark with one comparison."""
    shutil.copytree(ROOT / "cases" / "scaling", folder)
    scaling = yaml.safe_load((folder / "scaling.yaml").read_text())
    [plane] = [series for series in scaling["series"] if series["name"] == "quad4"]
    scaling["series"], scaling["goals"] = [plane | {"sizes": [1000]}], []
    for part in ("quick", "large"):
        scaling[part]["series"] = ["quad4"]
    (folder / "scaling.yaml").write_text(yaml.safe_dump(scaling))
    benchmark = yaml.safe_load((folder / "benchmark.yaml").read_text())
    comparison = benchmark["comparisons"][0] | {"series": "quad4"}
    benchmark["comparisons"] = [comparison | {"ways": comparison["ways"][:1]}]
    (folder / "benchmark.yaml").write_text(yaml.safe_dump(benchmark))


def write_sweep(folder: Path) -> None:
    """One of the project's sweeps, with its base cases, and one ladder of the inf-sup test."""
    shutil.copytree(ROOT / "cases" / "stability" / "base", folder / "base")
    (folder / "sweeps").mkdir()
    shutil.copy(ROOT / "cases" / "stability" / "sweeps" / "stiffness.yaml", folder / "sweeps")
    ladders = yaml.safe_load((ROOT / "cases/stability/infsup/infsup.yaml").read_text())
    ladders["cells"] = ladders["cells"][:1]
    (folder / "infsup").mkdir()
    (folder / "infsup" / "infsup.yaml").write_text(yaml.safe_dump(ladders))


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """The copy with little to do."""
    for path in ROOT.iterdir():
        if path.name not in LEFT_OUT and not path.name.startswith("."):
            copy = shutil.copytree if path.is_dir() else shutil.copy
            copy(path, tmp_path / path.name)
    (tmp_path / ".venv").symlink_to(sys.prefix)
    (tmp_path / "cases" / "ssnp170").mkdir(parents=True)
    for name in ("e.yaml", "family.yaml"):
        shutil.copy(ROOT / "cases" / "ssnp170" / name, tmp_path / "cases" / "ssnp170")
    write_study(tmp_path / "cases" / "study")
    write_scaling(tmp_path / "cases" / "scaling")
    write_sweep(tmp_path / "cases" / "stability")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_start.py").write_text(
        "def test_start():\n    import solver.commands.cli\n"
    )
    (tmp_path / "my-cases").mkdir()
    return tmp_path


def blocks(page: Path) -> list[tuple[str, str]]:
    """The blocks of code of a page, by language."""
    return FENCE.findall(page.read_text(encoding="utf-8"))


def run_all(page: Path, project: Path, **variables: str) -> None:
    """Run the blocks of a page; those in YAML are added to the case `part`."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
    environment |= {"MAKEFLAGS": "INSTALL=:"} | variables
    for language, text in blocks(page):
        if language == "yaml":
            with (project / "my-cases" / "part.yaml").open("a") as case:
                case.write(text)
            continue
        command = ["bash", "-ec"] if language == "sh" else [sys.executable, "-c"]
        run = subprocess.run(
            [*command, text],
            cwd=project,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert run.returncode == 0, f"{text}\n{run.stdout}"


def test_every_command_works_in_its_order(project: Path):
    run_all(README, project)
    assert (project / "results" / "report" / "workflow.html").is_file()
    assert (project / "results" / "my-cases" / "my-block" / "result.vtkhdf").is_file()


def test_the_tutorial_ends_with_a_verdict_in_the_batch(project: Path):
    # The program gmsh keeps preferences in the home folder.
    run_all(TUTORIAL, project, HOME=str(project))
    verdict = json.loads((project / "results" / "my-cases" / "part" / "verdict.json").read_text())
    assert verdict["verdict"] == "passed"
    assert "force" in {check["name"] for check in verdict["checks"]}


def test_the_readme_is_short():
    assert len(README.read_text(encoding="utf-8").split()) <= 900


def test_links_lead_to_files():
    for target in re.findall(r"\]\(([^)#]+)\)", README.read_text(encoding="utf-8")):
        assert (ROOT / target).exists(), target
