"""The container and the environment of conda ask for what the bare system and the package have."""

import fnmatch
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
# Packages that conda-forge has under another name.
OF_CONDA = {"gmsh": "python-gmsh"}


def instructions() -> list[tuple[str, str]]:
    """The instructions of the container file, each in one line."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", "")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [(word, " ".join(rest.split())) for word, _, rest in (li.partition(" ") for li in lines)]


def test_the_container_is_the_bare_system_on_which_the_batch_is_tested():
    bare = (ROOT / ".ci" / "bare-machine").read_text(encoding="utf-8")
    packages = re.search(r"--include=(\S+)", bare)[1].split(",")
    installs = [text for word, text in instructions() if word == "RUN" and "apt-get" in text]
    [named] = re.findall(r"--no-install-recommends ([\w -]+)$", *installs)
    assert named.split() == packages
    image = next(text for word, text in instructions() if word == "FROM")
    assert re.fullmatch(r"debian:\d+-slim", image)


def test_the_commands_of_the_container_are_targets_and_the_readmes():
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    runs = [text for word, text in instructions() if word in ("RUN", "CMD")]
    made = re.findall(r"\bmake\W+([a-z-]+)", " ".join(run for run in runs if "apt-get" not in run))
    assert made == ["environment", "all-cases"]
    assert set(made) <= set(targets)
    assert "\nmake all-cases\n" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_what_is_copied_before_the_installation_is_all_that_it_reads(tmp_path):
    copied = [text.split() for word, text in instructions() if word == "COPY"]
    assert copied[-1] == [".", "."]
    for *patterns, _ in copied[:-1]:
        for source in (path for pattern in patterns for path in ROOT.glob(pattern)):
            target = tmp_path / source.relative_to(ROOT)
            copy = shutil.copytree if source.is_dir() else shutil.copy
            target.parent.mkdir(parents=True, exist_ok=True)
            copy(source, target)
    command = ["make", "--dry-run", "environment"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    for word in re.findall(r"requirements\S*\.txt|\S+\.py$", run.stdout, re.MULTILINE):
        assert (tmp_path / word).is_file(), word
    assert "workflow/libraries.py" in run.stdout


def test_the_container_is_not_given_what_git_ignores():
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    kept_out = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    for line in ignored:
        name = line.replace("!/", "!").strip("/")
        patterns = [pattern.removeprefix("**/") for pattern in kept_out]
        assert any(fnmatch.fnmatch(name, pattern) for pattern in patterns) or name == "*.pyc", line


def test_the_environment_of_conda_has_the_packages_of_the_project():
    content = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    python, *others = content["dependencies"]
    assert python == f"python {project['requires-python']}"
    names = {OF_CONDA.get(name, name) for name in project["dependencies"]}
    assert set(others) == names | {"pip", "setuptools"}
    assert (content["name"], content["channels"][0]) == (project["name"], "conda-forge")


def test_the_settings_are_those_of_the_schema():
    schema = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
    rows = re.findall(r"^\| (`.*?`) \|", (ROOT / "config/README.md").read_text(), re.MULTILINE)
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == {*schema["properties"]}
