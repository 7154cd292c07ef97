"""Unusual and broken case files: each is a row of the report, and stops no other.

A file with an odd name, or the name of another, is refused before anything runs.
"""

import os
import shutil

import pytest

from tests.workflow.projects import jobs, new_project, snakemake, summary, write_case


def write(folder, name, old="", new=""):
    """A case file with something exchanged."""
    write_case(folder, name)
    path = folder / f"{name}.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new) if old else text)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A batch of such files: the project, and what its run said."""
    folder = tmp_path_factory.mktemp("files")
    project, mine = new_project(folder / "project"), folder / "mine"
    shutil.rmtree(project / "cases" / "tiny")
    deep = folder / ("d" * 150) / ("e" * 150) / "deep"
    write_case(deep, "far-away")
    write(mine, "no-date", "directions", "title: 2024-02-30\ndirections")
    write(mine, "no-number", "directions", "title: 0x_\ndirections")
    write(mine, "on")
    write(mine, "x", "name: x", "name: 0x1F")
    write(mine, "yes")
    write(mine, "refined", "recipe: blocks,", "recipe: blocks, refine: -1,")
    (mine / "brackets.yaml").write_text("name: " + 100_000 * "[")
    (mine / "large.yaml").write_text("a: b\n" * 300_000)
    (mine / ".#on.yaml").symlink_to("user@host.1234:5678")  # as Emacs locks a file
    os.mkfifo(mine / "pipe.yaml")
    return project, snakemake(project, "--config", f"cases={mine},{deep}")


PASSED = ("far-away", "no-date", "no-number", "on", "0x1F", "yes")
REFUSED = {
    "refined": "mesh.refine = -1",
    "brackets": "nested deeper than",
    "large": "larger than 1000000 bytes",
    "pipe": "must be a regular file",
}


def test_each_file_is_one_row(run):
    project, done = run
    verdicts = {name: verdict["verdict"] for name, verdict in summary(project).items()}
    assert verdicts == dict.fromkeys(PASSED, "passed") | dict.fromkeys(REFUSED, "refused")
    for name, reason in REFUSED.items():
        assert reason in summary(project)[name]["reason"]
    assert done.returncode == 1
    assert "Traceback" not in done.stdout
    assert done.stdout.splitlines()[-1] == (
        "10 solves: 4 refused, 6 passed. Report: results/report/summary.html"
    )


def test_what_is_refused_for_good_is_not_tried_again(run):
    project, done = run
    config = next(arg for arg in done.args if arg.startswith("cases="))
    assert jobs(project, "--config", config) == {"all cases passed?"}


@pytest.mark.parametrize(
    "name", ["wörter.yaml", "two words.yaml", "{in}.yaml", "-first.yaml", f"{'a' * 65}.yaml"]
)
def test_an_odd_name_is_refused_before_anything_runs(run, tmp_path, name):
    project, _ = run
    write_case(tmp_path / "mine", "plain")
    (tmp_path / "mine" / "plain.yaml").rename(tmp_path / "mine" / name)
    refused = snakemake(project, "--config", f"cases={tmp_path / 'mine'}")
    assert refused.returncode == 2
    assert "must be letters, digits" in refused.stdout.splitlines()[-1]
    assert "Traceback" not in refused.stdout


def test_two_cases_of_one_name_are_refused_before_anything_runs(run, tmp_path):
    write(tmp_path / "mine", "once")
    write(tmp_path / "mine", "twice", "name: twice", "name: once")
    refused = snakemake(run[0], "--config", f"cases={tmp_path / 'mine'}")
    assert refused.returncode == 2
    assert "twice.yaml: name = 'once': already taken by" in refused.stdout.splitlines()[-1]


def test_a_folder_of_results_is_no_family(run, tmp_path):
    write_case(tmp_path / "report", "plain")
    refused = snakemake(run[0], "--config", f"cases={tmp_path / 'report'}")
    assert refused.returncode == 2
    assert refused.stdout.splitlines()[-1].endswith("is a folder of results: choose another name")
