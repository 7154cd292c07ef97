"""The files for GitHub Actions and GitLab CI: valid, and their lines do what they say.

The servers are not here; their schemas are, and the shell lines run as they stand in a small copy
of the project.
"""

import os
import re
import shutil
import subprocess
import sys
from itertools import product

import pytest
import xmlschema
import yaml

from tests.workflow.projects import ROOT, new_project, summary, write_case

GITHUB = ROOT / ".github" / "workflows" / "verification.yml"
ENVIRONMENT = ROOT / ".github" / "actions" / "environment" / "action.yml"
GITLAB = ROOT / ".gitlab-ci.yml"
JUNIT = ROOT / "tests" / "report" / "schemas" / "jenkins-junit.xsd"


@pytest.mark.parametrize(
    ("schema", "file", "key"),
    [
        ("github-workflows", GITHUB, "runs-on"),
        ("github-actions", ENVIRONMENT, "using"),
        ("gitlab-ci", GITLAB, "expose_as"),
    ],
)
def test_schemas_of_the_servers_hold(schema, file, key, tmp_path):
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{schema}"]
    run = subprocess.run([*command, file], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    spoilt = tmp_path / file.name
    spoilt.write_text(file.read_text().replace(f"{key}:", "nonsense:"))
    run = subprocess.run([*command, spoilt], capture_output=True, text=True)
    assert run.returncode == 1, "the schema has to notice a wrong key"


def read(file):
    return yaml.safe_load(file.read_text(encoding="utf-8"))


def github_jobs():
    """The steps of each job, the project's own action replaced by its steps."""
    own = {"./.github/actions/environment": read(ENVIRONMENT)["runs"]["steps"]}
    return {
        name: (job, [each for step in job["steps"] for each in own.get(step.get("uses"), [step])])
        for name, job in read(GITHUB)["jobs"].items()
    }


def filled(line, variable, matrix):
    """A line for each entry of a matrix, its variables replaced; `variable` is their pattern."""
    entries = [dict(zip(matrix, values, strict=True)) for values in product(*matrix.values())]
    return [re.sub(variable, lambda found, entry=entry: entry[found[1]], line) for entry in entries]


def github_lines(name):
    """The shell lines of a job, for each entry of its matrix."""
    job, steps = github_jobs()[name]
    matrix = job.get("strategy", {}).get("matrix", {})
    lines = [step["run"] for step in steps if "run" in step]
    return [each for line in lines for each in filled(line, r"\$\{\{ matrix\.(\w+) \}\}", matrix)]


def gitlab_lines(name):
    """The same of GitLab's."""
    job = read(GITLAB)[name]
    [matrix] = job.get("parallel", {}).get("matrix", [{}])
    return [each for line in job["script"] for each in filled(line, r"\$(\w+)", matrix)]


LINES = {
    (server, job): lines(job)
    for server, lines in (("github", github_lines), ("gitlab", gitlab_lines))
    for job in ("batch", "studies")
}


def test_they_call_targets_of_make_and_nothing_else():
    for line in (line for lines in LINES.values() for line in lines):
        match = re.fullmatch(r'make ([a-z-]+)( >> "\$GITHUB_STEP_SUMMARY")?', line)
        assert match, line
        plan = subprocess.run(
            ["make", "--dry-run", match[1]], cwd=ROOT, capture_output=True, text=True
        )
        assert plan.returncode == 0, plan.stderr


def test_the_studies_are_those_of_the_project():
    studies = {line.removeprefix("make ") for line in LINES["gitlab", "studies"]}
    assert studies == {"orders", "study", "stability", "scaling"}
    assert studies <= {line.removeprefix("make ") for line in LINES["github", "studies"]}
    assert LINES["gitlab", "batch"] == ["make all-cases"]


def run_lines(project, lines, page):
    """The statuses of shell lines; the installation finds everything there."""
    # Tests run by make: its level would make it tell the folders that it enters.
    left_out = ("PYTEST", "MAKELEVEL")
    environment = {k: v for k, v in os.environ.items() if not k.startswith(left_out)}
    environment |= {"MAKEFLAGS": "INSTALLED=yes", "GITHUB_STEP_SUMMARY": str(page)}
    return [
        subprocess.run(["bash", "-ec", line], cwd=project, env=environment).returncode
        for line in lines
    ]


@pytest.mark.parametrize("pressure", [25.0, 26.0], ids=["passed", "failed"])
def test_the_batch_of_github_tells_its_page_and_keeps_its_results(tmp_path, pressure):
    project = new_project(tmp_path / "project")
    shutil.rmtree(project / "cases")
    write_case(project / "cases" / "tiny", "tiny", pressure=pressure)
    shutil.copy(ROOT / "Makefile", project)
    (project / ".venv").symlink_to(sys.prefix)
    page = tmp_path / "page.md"
    page.write_text("what stood there\n")

    statuses = run_lines(project, LINES["github", "batch"], page)

    _, steps = github_jobs()["batch"]
    always = [s.get("if") == "${{ !cancelled() }}" for s in steps if "run" in s]
    failed = [bool(status) for status in statuses]
    assert failed == [False, pressure != 25.0, False]
    assert always == [False, False, True]  # the page is written whatever the batch came to
    word = "passed" if pressure == 25.0 else "failed"
    assert summary(project)["tiny"]["verdict"] == word
    assert page.read_text().startswith("what stood there\n# Verification of contact solves")
    assert f"| tiny | {word} |" in page.read_text()
    [upload] = [step for step in steps if "upload-artifact" in step.get("uses", "")]
    assert upload["if"] == "${{ !cancelled() }}"
    kept = project / upload["with"]["path"]
    assert {"report/summary.html", "report/junit.xml", "tiny/tiny/result.vtkhdf"} <= {
        str(path.relative_to(kept)) for path in kept.rglob("*") if path.is_file()
    }
    xmlschema.validate(kept / "report" / "junit.xml", JUNIT)


def test_gitlab_keeps_the_same():
    batch = read(GITLAB)["batch"]
    kept = batch["artifacts"]
    _, steps = github_jobs()["batch"]
    [upload] = [step for step in steps if "upload-artifact" in step.get("uses", "")]
    assert kept["paths"] == [upload["with"]["path"]]
    assert not any("*" in path for path in kept["paths"])  # or GitLab would not expose them
    assert kept["when"] == "always"
    assert kept["expose_as"]
    assert kept["reports"]["junit"] == "results/report/junit.xml"


def test_the_environment_is_cached_by_what_is_locked():
    locks = {path.name for path in ROOT.glob("requirements*.txt")}
    _, steps = github_jobs()["batch"]
    [restore] = [step for step in steps if "cache/restore" in step.get("uses", "")]
    [pattern] = re.findall(r"hashFiles\('(.*?)'\)", restore["with"]["key"])
    assert {path.name for path in ROOT.glob(pattern)} == locks
    cache = read(GITLAB)["default"]["cache"]
    assert {path.name for each in cache["key"]["files"] for path in ROOT.glob(each)} == locks
    assert restore["with"]["path"] == ".venv"
    assert cache["paths"] == [".venv/"]
