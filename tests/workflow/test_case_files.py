"""Unusual and broken case files: each is a row of the report, and stops no other."""

import os
import shutil

import pytest

from tests.workflow.projects import jobs, new_project, snakemake, summary, write_case

OTHER_NAME = "wörter {in} klammern, 'x' $y.yaml"


def write(folder, name, old="", new="", file=None):
    """A case file with something exchanged, and another file name."""
    write_case(folder, name)
    path = folder / f"{name}.yaml"
    text = path.read_text()
    assert old in text
    path.unlink()
    (folder / (file or path.name)).write_text(text.replace(old, new) if old else text)


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
    write(mine, "a" + 20 * "0")
    write(mine, "on", file=OTHER_NAME)
    write(mine, "x", "name: x", "name: 0x1F")
    write(mine, "yes")
    write(mine, "twice")
    write(mine, "once-more", "name: once-more", "name: twice")
    write(mine, "refined", "recipe: blocks,", "recipe: blocks, refine: -1,")
    (mine / "brackets.yaml").write_text("name: " + 100_000 * "[")
    (mine / "large.yaml").write_text("a: b\n" * 300_000)
    (mine / ".#on.yaml").symlink_to("user@host.1234:5678")  # as Emacs locks a file
    os.mkfifo(mine / "pipe.yaml")
    shutil.copy(mine / "yes.yaml", os.fsencode(mine) + b"/\xff.yaml")
    return project, snakemake(project, "--config", f"cases={mine},{deep}")


PASSED = ("far-away", "no-date", "no-number", "a" + 20 * "0", "on", "0x1F", "yes", "twice")
REFUSED = {
    "once-more": "name = 'twice': already taken by",
    "refined": "mesh.refine = -1",
    "brackets": "nested deeper than",
    "large": "larger than 1000000 bytes",
    "pipe": "must be a regular file",
    "_": "its path must be UTF-8",
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
        "14 solves: 6 refused, 8 passed. Report: results/report/summary.html"
    )


def test_what_is_refused_for_good_is_not_tried_again(run):
    project, done = run
    config = next(arg for arg in done.args if arg.startswith("cases="))
    assert jobs(project, "--config", config) == {"all cases passed?"}


def test_a_file_whose_name_is_a_pattern_is_solved_again_when_it_changes(run):
    project, done = run
    config = next(arg for arg in done.args if arg.startswith("cases="))
    mine = project.parent / "mine"
    with (mine / OTHER_NAME).open("a") as file:
        file.write("# changed\n")
    planned = jobs(project, "--config", config)
    assert {job for job in planned if job.startswith("solve")} == {"solve on"}
