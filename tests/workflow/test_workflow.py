"""The workflow as a user meets it: real Snakemake on a copy of the project with tiny cases."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest

from tests.workflow.projects import (
    ROOT,
    jobs,
    new_project,
    snakemake,
    started,
    summary,
    write_case,
)


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """A project whose batch has run."""
    project = new_project(tmp_path_factory.mktemp("solved"))
    done = snakemake(project)
    assert done.returncode == 0, done.stdout
    told = re.findall(r"^(\S+): passed, .* \[(\d)/3\]$", done.stdout, re.MULTILINE)
    assert [number for _, number in told] == ["1", "2", "3"]
    assert {name for name, _ in told} == {"tiny-a", "tiny-a-swapped", "tiny-b"}
    assert not re.search(r"Job \d|\r", done.stdout)  # Snakemake's own lines; a terminal's
    assert "All 3 solves passed. Report: results/report/summary.html" in done.stdout
    return project


@pytest.fixture
def project(solved, tmp_path):
    """A copy of the solved project, to be changed."""
    return shutil.copytree(solved, tmp_path / "project")


def append(file, text):
    file.write_text(file.read_text() + text)


def test_results_lie_where_they_should(solved):
    for job in ("tiny-a", "tiny-a-swapped", "tiny-b"):
        folder = solved / "results" / "tiny" / job
        assert json.loads((folder / "verdict.json").read_text())["job"] == job
        for name in ("result.vtkhdf", "log", "benchmark"):
            assert (folder / name).stat().st_size > 0
    meshes = solved / "results" / "meshes" / "tiny"
    assert {path.parent.name for path in meshes.glob("*/mesh.vtkhdf")} == {"tiny-a", "tiny-b"}
    assert summary(solved).keys() == {"tiny-a", "tiny-a-swapped", "tiny-b"}
    assert "Tiny cases" in (solved / "results" / "report" / "summary.html").read_text()
    assert "<h1>Tiny cases</h1>" in (solved / "results" / "report" / "tiny.html").read_text()


def test_nothing_to_do_is_said(solved):
    again = snakemake(solved)
    assert again.returncode == 0
    assert "Nothing to be done" in again.stdout


REPORT = {"report of all cases", "all cases passed?"}
SAVED = {"time saved: tiny"}


def test_a_changed_case_runs_alone(project):
    append(project / "cases" / "tiny" / "tiny-a.yaml", "# changed\n")
    expected = {"mesh tiny-a", "solve tiny-a", "solve tiny-a-swapped"} | SAVED | REPORT
    assert jobs(project) == expected


def test_changed_accepted_values_check_their_solve_again(project):
    accepted = project / "cases" / "tiny" / "regression" / "tiny-a-swapped.json"
    accepted.parent.mkdir()
    accepted.write_text("{}")
    assert jobs(project) == {"solve tiny-a-swapped"} | SAVED | REPORT


def test_a_changed_solver_runs_all_and_a_changed_report_only_itself(project):
    append(project / "solver" / "report" / "page.py", "# changed\n")
    assert jobs(project) == REPORT
    append(project / "solver" / "mechanics" / "mortar" / "__init__.py", "# changed\n")
    solves = {"solve tiny-a", "solve tiny-a-swapped", "solve tiny-b"}
    assert jobs(project) == solves | SAVED | REPORT


def test_one_case_again_is_one_case(project):
    verdict = "results/tiny/tiny-a-swapped"
    assert jobs(project, "--forcerun", verdict) == {"solve tiny-a-swapped"} | SAVED | REPORT
    assert jobs(project, verdict, "--forcerun", verdict) == {"solve tiny-a-swapped"}
    forced = ("--config", "case=tiny-b", "--forcerun", "solve")
    assert jobs(project, *forced) == {"solve tiny-b"} | REPORT


def test_cases_are_chosen_by_pattern(project):
    forced = ("--forcerun", "solve", "--config", "case=tiny-a*")
    assert jobs(project, *forced) == {"solve tiny-a", "solve tiny-a-swapped"} | REPORT
    (file,) = (project / "cases").rglob("tiny-a.yaml")
    forced = ("--forcerun", "solve", "--config", f"case={file.relative_to(project)}")
    assert jobs(project, *forced) == {"solve tiny-a", "solve tiny-a-swapped"} | REPORT


def test_what_has_not_passed_runs_once_more(project):
    failed = ("--forcerun", "solve", "--config", "failed=true")
    done = snakemake(project, *failed)
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == "Nothing to be done: all chosen cases have passed."
    verdict = project / "results/tiny/tiny-b/verdict.json"
    verdict.unlink()
    assert jobs(project, *failed) == {"solve tiny-b"} | REPORT


def test_another_family_joins_what_was_solved(project):
    write_case(project / "cases" / "other", "other-a")
    expected = {"mesh other-a", "solve other-a", "time saved: other"} | REPORT
    assert jobs(project, "--config", "family=other") == expected
    assert jobs(project) == expected


def test_both_cuts_of_hexahedra(project):
    case = (project / "cases" / "tiny" / "tiny-b.yaml").read_text().replace("QUAD4", "HEXA8")
    (project / "cases" / "tiny" / "tiny-b.yaml").write_text(case)
    planned = jobs(project, "--config", "variants=true")
    assert {"solve tiny-b", "solve tiny-b-hexahedra"} <= planned
    assert not any("solve tiny-a" in job for job in planned)


def test_a_batch_with_every_kind_of_ending(project, tmp_path):
    mine = tmp_path / "my-cases"
    write_case(mine, "good")
    write_case(mine, "wrong", pressure=26.0)
    write_case(mine, "doomed")
    (mine / "broken.yaml").write_text("name: [broken\n")
    (mine / "family.yaml").write_text("title: Cases of mine\n")
    write_case(mine, "meshless")
    text = (mine / "meshless.yaml").read_text().replace("recipe: blocks", "recipe: nothing")
    (mine / "meshless.yaml").write_text(text)
    main = project / "solver" / "__main__.py"
    dies = "if 'solve' in sys.argv and 'doomed' in str(sys.argv): os.kill(os.getpid(), 9)\n"
    warm = "print('warm' if 'skfem' in sys.modules else 'cold')\n"
    main.write_text(f"import os, sys\n{dies}{warm}{main.read_text()}")

    run = snakemake(project, "--config", f"cases={mine}", "family=my-cases")

    assert run.returncode != 0
    shown = summary(project)
    # The family that was not asked for stays in the report.
    assert [shown.pop(name)["verdict"] for name in ("tiny-a", "tiny-b")] == ["passed", "passed"]
    verdicts = {name: v["verdict"] for name, v in shown.items() if v["family"] == "my-cases"}
    assert verdicts == {
        "good": "passed",
        "wrong": "failed",
        "doomed": "crashed",
        "broken": "refused",
        "meshless": "refused",
    }
    reasons = {name: v["reason"] for name, v in summary(project).items()}
    assert "multiplier" in reasons["wrong"]
    assert "137" in reasons["doomed"]
    assert "nothing" in reasons["meshless"]
    for name in verdicts.keys() - {"good"}:
        assert re.search(rf"^{name}: {verdicts[name]}: \S", run.stdout, re.MULTILINE), name
    assert (project / "results/my-cases/good/log").read_text().startswith("warm\n")
    for page in ("summary.html", "my-cases.html"):
        text = (project / "results" / "report" / page).read_text()
        assert all(name in text for name in verdicts)
        assert "Cases of mine" in text
    assert not (project / "results" / "report" / "passed").exists()


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("family=tinny", "family = tinny: unknown; did you mean tiny? (allowed: tiny)"),
        ("famly=tiny", "'famly' was unexpected"),
        ("case=tiny-c", "case = tiny-c: unknown; did you mean tiny-b?"),
        ("case=tiny-c*", "case = tiny-c*: unknown"),
        ("cases=/nowhere", "/nowhere: cases: no such folder"),
        ("cases=workflow", "workflow: cases: no case file"),
        ("variants=maybe", "variants: 'maybe' is not one of"),
    ],
)
def test_a_wrong_setting_is_refused(solved, setting, message):
    refused = snakemake(solved, "--dry-run", "--config", setting)
    assert refused.returncode == 2
    *_, line = refused.stdout.splitlines()
    assert message in line
    assert "Error" not in refused.stdout


def test_a_second_run_is_refused_while_one_lives_and_after_its_kill_it_works(tmp_path):
    project = new_project(tmp_path / "killed")
    with (tmp_path / "output").open("w") as output:
        run = started(project, output)
        while not list(project.glob("results/tiny/*/log")):
            assert run.poll() is None
            time.sleep(0.02)
        # Stopped, so that it does not end while the second one starts.
        os.killpg(run.pid, signal.SIGSTOP)
        second = snakemake(project)
        assert second.returncode != 0
        assert "another run is at work in this folder" in second.stdout
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
    done = snakemake(project)
    assert done.returncode == 0, done.stdout
    assert "All 3 solves passed." in done.stdout


def state_of(folder):
    """All files but Snakemake's own, with content and dates."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {
        path: (path.read_bytes(), path.stat().st_mtime_ns)
        for path in files
        if path.relative_to(folder).parts[0] != ".snakemake"
    }


def test_a_dry_run_changes_nothing(project):
    (project / "results/tiny/tiny-b/verdict.json").write_text("{")
    text = (project / "results/tiny/tiny-a/verdict.json").read_text()
    transient = text.replace('"transient": false', '"transient": true')
    assert transient != text
    (project / "results/tiny/tiny-a/verdict.json").write_text(transient)
    append(project / "solver" / "report" / "page.py", "# changed\n")
    before = state_of(project)
    assert {"solve tiny-a", "solve tiny-b"} <= jobs(project)
    assert state_of(project) == before
    # A run takes both in hand.
    assert snakemake(project).returncode == 0
    assert jobs(project) == set()


def test_contents_decide_not_dates(project):
    """A case copied over another one with an older date: no run calls its solve up to date."""
    case = project / "cases" / "tiny" / "tiny-b.yaml"
    case.write_text(case.read_text().replace("pressure: 25.0", "pressure: 24.0"))
    os.utime(case, (1e9, 1e9))
    assert jobs(project) >= {"solve tiny-b"} | REPORT
    for target in (["--config", "failed=true"], ["report"]):
        shutil.copytree(project, other := project.with_name(f"other-{target[-1]}"))
        run = snakemake(other, *target)
        told = summary(other)["tiny-b"]
        assert (told["verdict"], told["pressure"][0]) == ("passed", pytest.approx(24.0)), run.stdout


def test_a_report_that_ends_early_is_no_success(project):
    page = project / "results" / "report" / "tiny.html"
    page.unlink()
    (page / "in the way").mkdir(parents=True)
    append(project / "solver" / "report" / "page.py", "# changed\n")
    assert snakemake(project).returncode != 0
    shutil.rmtree(page)
    assert snakemake(project).returncode == 0
    assert page.is_file()
    assert jobs(project) == set()


def test_a_case_file_that_is_a_link_to_itself_is_one_refused_case(project):
    loop = project / "cases" / "tiny" / "loop.yaml"
    loop.symlink_to(loop.name)
    assert snakemake(project).returncode != 0
    assert {name: v["verdict"] for name, v in summary(project).items()} == {
        "loop": "refused", "tiny-a": "passed", "tiny-a-swapped": "passed", "tiny-b": "passed",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["a{b}", "a$(touch pwned)", "a`b`", "a;b"])
def test_a_folder_whose_name_would_be_run_is_refused(name, tmp_path):
    (tmp_path / name).mkdir()
    shutil.copy(ROOT / "Makefile", tmp_path / name)
    done = subprocess.run(
        ["make", "all-cases"], cwd=tmp_path / name, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "in its path: move it to one without" in done.stderr
    assert not list(tmp_path.rglob("pwned"))


@pytest.mark.parametrize(
    "damage",
    [
        lambda solve: (solve / "verdict.json").write_bytes(b"\xff{}"),
        lambda solve: (solve / "verdict.json").write_text('"passed"'),
        lambda solve: (solve / "verdict.json").unlink(),
        lambda solve: (solve / "result.vtkhdf").unlink(),
        lambda solve: os.truncate(solve / "result.vtkhdf", 20000),
        lambda solve: shutil.copy(solve.with_name("tiny-a") / "result.vtkhdf", solve),
        shutil.rmtree,
    ],
)
def test_a_damaged_verdict_or_a_lost_result_is_solved_again(project, damage):
    damage(project / "results" / "tiny" / "tiny-b")
    planned = jobs(project)
    assert planned >= {"solve tiny-b"} | REPORT
    assert not planned & {"solve tiny-a", "solve tiny-a-swapped"}


def test_a_mesh_that_includes_a_changed_file_is_solved_again(project):
    own = project / "cases" / "tiny" / "tiny-b.yaml"
    text = re.sub(r"mesh: \{.*?\}\}\n", "mesh: {file: own.inp}\n", own.read_text(), flags=re.DOTALL)
    own.write_text(text)
    own.with_name("own.inp").write_text("*Heading\n*INCLUDE, INPUT=nodes/all.txt\n")
    part = own.parent / "nodes" / "all.txt"
    part.parent.mkdir()
    part.write_text("*INCLUDE, input=more.txt\n")
    part.with_name("more.txt").write_text("*NODE\n")
    commands = snakemake(project, "--dry-run", "--printshellcmds", "results/tiny/tiny-b").stdout
    assert "result.vtkhdf" in commands
    assert "mesh.vtkhdf" not in commands
    snakemake(project)
    assert "solve tiny-b" not in jobs(project)
    part.with_name("more.txt").write_text("*NODE\n1, 0, 0\n")
    assert "solve tiny-b" in jobs(project)


def test_a_family_alone_leaves_the_others_in_the_report(project):
    write_case(project / "cases" / "other", "wrong", pressure=26.0)
    last = "4 solves: 1 failed, 3 passed. Report: results/report/summary.html"
    wrong = snakemake(project)
    assert wrong.returncode == 1
    assert wrong.stdout.splitlines()[-1] == last
    assert wrong.stdout.count(last) == 1
    done = snakemake(project, "--config", "family=tiny", "--forcerun", "report")
    assert done.returncode == 0, done.stdout  # what failed was not asked for
    older = "Older results in the report, not of this run: 1 solve: 1 failed."
    outcome = "This run: All 3 solves passed. Report: results/report/summary.html"
    assert done.stdout.splitlines()[-2:] == [older, outcome]
    assert "wrong: failed" not in done.stdout
    assert summary(project).keys() == {"tiny-a", "tiny-a-swapped", "tiny-b", "wrong"}
    again = snakemake(project)
    assert again.returncode == 1
    assert again.stdout.splitlines()[-1] == last
    assert "Error" not in again.stdout


def make(project, *arguments, folder=None):
    """The finished process of a target of make, the environment taken as it is."""
    shutil.copy(ROOT / "Makefile", project)
    link = project / ".venv"
    if not link.is_symlink():
        link.symlink_to(sys.prefix)
    folder = folder or project
    return subprocess.run(
        ["make", "-C", project, "INSTALLED=yes", *arguments],
        cwd=folder,
        env=os.environ | {"PWD": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
    )


def test_settings_of_make(project):
    write_case(project / "cases" / "other", "other-a")
    mine = project.parent / "my-cases"
    write_case(mine, "good")
    dry = "ARGS=--dry-run"
    chosen = make(project, "all-cases", dry, "FAMILY=other").stdout
    assert "solve other-a" in chosen
    assert "solve tiny-a" not in chosen
    joined = make(project, "all-cases", dry, "CASES=my-cases", folder=project.parent)
    assert "solve good" in joined.stdout
    older = project / "results/report/log"
    older.parent.mkdir(parents=True, exist_ok=True)
    older.write_text("All 3 solves passed.\n")
    for setting, told in [
        ("CASES=nowhere", f"{project}/nowhere: cases: no such folder"),
        ("CORES=0", "cores = 0: must be 1 or more"),
        ("CASE=nobody", "case = nobody: unknown"),
    ]:
        refused = make(project, "all-cases", setting)
        assert refused.returncode == 2
        assert told.replace(f"{project}/", "") in refused.stdout
        assert "passed" not in refused.stdout
        assert "Error in" not in refused.stdout
        assert "Traceback" not in refused.stdout


# What Snakemake's lint notes, and why it stays.
NOTED = {
    "Specify a conda environment": "packages are locked with hashes in requirements*.txt",
    "directly uses variable": "which Python runs, and settings that change no result",
    "Mixed rules and functions": "a function stays beside the one rule or hook that it serves",
    "Environment variable WARM_SOLVER": "set by the run itself, asked of nobody",
    "No log directive": "gates print one line",
}


def test_snakemakes_lint_notes_nothing_else(solved):
    notes = re.findall(r"^ {4}\* (.*)$", snakemake(solved, "--lint").stdout, re.MULTILINE)
    assert [note for note in notes if not any(known in note for known in NOTED)] == []
