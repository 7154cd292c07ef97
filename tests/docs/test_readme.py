"""The commands of the README and of the tutorial, run from top to bottom as a newcomer would.

They run as they stand, in a copy of the project where long ones are short: `cases/` holds only the
case that the README names and studies of a few points, and `tests/` a single test. The
installation is left out: the copy borrows this environment.
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
# CI runs these for themselves, whole quick studies; here they only plan their jobs.
STUDIES = re.compile(r"^make (?:study|stability|scaling) LEVEL=quick", re.MULTILINE)
LEFT_OUT = {".git", ".venv", ".snakemake", "cases", "results", "tests"}


def write_studies(cases: Path) -> None:
    """The project's studies, each with a small series of the first group of its quick part."""
    shutil.copytree(ROOT / "cases" / "studies", cases / "studies")
    for file in (cases / "studies").glob("*.yaml"):
        study = yaml.safe_load(file.read_text())
        group = next(g for g in study["groups"] if "quick" in g and len(g["series"]) >= 1)
        names = {axis: list(values)[:1] for axis, values in study.get("axes", {}).items()}
        quick = group["quick"] | {axis: v for axis, v in names.items() if axis in group["vary"]}
        quick["series"] = [group["series"][0]["name"]]
        group["quick"] = quick
        study["axes"] = {
            axis: {k: {**choice, "groups": []} for k, choice in choices.items()}
            for axis, choices in study.get("axes", {}).items()
        }
        once = {"groups": [group], "goals": [], "repetitions": 1}
        file.write_text(yaml.safe_dump(study | once))


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
    write_studies(tmp_path / "cases")
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
    environment |= {"MAKEFLAGS": "INSTALLED=yes"} | variables
    for language, text in blocks(page):
        if language == "yaml":
            with (project / "my-cases" / "part.yaml").open("a") as case:
                case.write(text)
            continue
        text = STUDIES.sub(r"\g<0> ARGS=--dry-run", text)
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
