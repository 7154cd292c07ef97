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

from tests.workflow.projects import ROOT, jobs, new_project, snakemake, summary, write_case


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """A project whose batch has run."""
    project = new_project(tmp_path_factory.mktemp("solved"))
    done = snakemake(project)
    assert done.returncode == 0, done.stdout
    told = re.findall(r"^(\S+): passed, worst error .* \[(\d)/3\]$", done.stdout, re.MULTILINE)
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
    assert (solved / "results" / "tiny" / "tiny-a" / "mesh.vtkhdf").is_file()
    assert not (solved / "results" / "tiny" / "tiny-a-swapped" / "mesh.vtkhdf").exists()
    assert summary(solved).keys() == {"tiny-a", "tiny-a-swapped", "tiny-b"}
    assert "Tiny cases" in (solved / "results" / "report" / "summary.html").read_text()
    assert "<h1>Tiny cases</h1>" in (solved / "results" / "report" / "tiny.html").read_text()


def test_nothing_to_do_is_said(solved):
    again = snakemake(solved)
    assert again.returncode == 0
    assert "Nothing to be done" in again.stdout


REPORT = {"report of all cases", "all cases passed?"}


def test_a_changed_case_runs_alone(project):
    append(project / "cases" / "tiny" / "tiny-a.yaml", "# changed\n")
    expected = {"mesh tiny-a", "solve tiny-a", "solve tiny-a-swapped"} | REPORT
    assert jobs(project) == expected


def test_changed_accepted_values_check_their_solve_again(project):
    accepted = project / "cases" / "tiny" / "regression" / "tiny-a-swapped.json"
    accepted.parent.mkdir()
    accepted.write_text("{}")
    assert jobs(project) == {"solve tiny-a-swapped"} | REPORT


def test_a_changed_solver_runs_all_and_a_changed_report_only_itself(project):
    append(project / "solver" / "report" / "page.py", "# changed\n")
    assert jobs(project) == REPORT
    append(project / "solver" / "mechanics" / "mortar" / "__init__.py", "# changed\n")
    solves = {"solve tiny-a", "solve tiny-a-swapped", "solve tiny-b"}
    assert jobs(project) == solves | REPORT


def test_a_changed_solver_runs_all_also_where_snakemake_remembers_nothing(project):
    shutil.rmtree(project / ".snakemake")
    assert jobs(project) == set()
    append(project / "solver" / "mechanics" / "linear" / "direct.py", "# changed\n")
    assert jobs(project) == {"solve tiny-a", "solve tiny-a-swapped", "solve tiny-b"} | REPORT


def test_one_case_again_is_one_case(project):
    verdict = "results/tiny/tiny-a-swapped/verdict.json"
    assert jobs(project, "--forcerun", verdict) == {"solve tiny-a-swapped"} | REPORT
    assert jobs(project, verdict, "--forcerun", verdict) == {"solve tiny-a-swapped"}
    forced = ("--config", "case=tiny-b", "--forcerun", "solve")
    assert jobs(project, *forced) == {"solve tiny-b"} | REPORT


def test_another_family_joins_what_was_solved(project):
    write_case(project / "cases" / "other", "other-a")
    expected = {"mesh other-a", "solve other-a"} | REPORT
    assert jobs(project, "--config", "family=other") == expected
    assert jobs(project) == expected


def test_both_cuts_of_hexahedra(project):
    case = (project / "cases" / "tiny" / "tiny-b.yaml").read_text().replace("QUAD4", "HEXA8")
    (project / "cases" / "tiny" / "tiny-b.yaml").write_text(case)
    planned = jobs(project, "--config", "variants=true")
    assert {"solve tiny-b", "solve tiny-b-hexahedra"} <= planned
    assert not any("solve tiny-a" in job for job in planned)


def test_a_batch_with_every_kind_of_ending(project, tmp_path):
    mine = tmp_path / "my cases"
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

    run = snakemake(project, "--config", f"cases={mine}", "family=my cases")

    assert run.returncode != 0
    verdicts = {name: v["verdict"] for name, v in summary(project).items()}
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
    assert (project / "results/my cases/good/log").read_text().startswith("warm\n")
    for page in ("summary.html", "my cases.html"):
        text = (project / "results" / "report" / page).read_text()
        assert all(name in text for name in verdicts)
        assert "Cases of mine" in text
    assert not (project / "results" / "report" / "passed").exists()


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("family=tinny", "family = tinny: unknown; there are tiny"),
        ("famly=tiny", "'famly' was unexpected"),
        ("case=tiny-c", "case = tiny-c: unknown"),
        ("cases=/nowhere", "cases = /nowhere: no case file"),
    ],
)
def test_a_wrong_setting_is_refused(solved, setting, message):
    refused = snakemake(solved, "--dry-run", "--config", setting)
    assert refused.returncode != 0
    assert message in refused.stdout


def test_two_cases_of_one_name_are_refused(project):
    shutil.copy(project / "cases/tiny/tiny-b.yaml", project / "cases/tiny/other.yaml")
    refused = snakemake(project, "--dry-run")
    assert refused.returncode != 0
    assert "name = tiny-b: already taken by cases/tiny/other.yaml" in refused.stdout


def test_a_second_run_is_refused_while_one_lives_and_after_its_kill_it_works(tmp_path):
    project = new_project(tmp_path / "killed")
    command = [sys.executable, "-m", "snakemake"]
    with (tmp_path / "output").open("w") as output:
        run = subprocess.Popen(
            command, cwd=project, stdout=output, stderr=output, start_new_session=True
        )
        while not list(project.glob("results/tiny/*/log")):
            assert run.poll() is None
            time.sleep(0.02)
        # Stopped, so that it does not end while the second one starts.
        os.killpg(run.pid, signal.SIGSTOP)
        second = snakemake(project)
        assert second.returncode != 0
        assert f"another run is at work in this folder (process {run.pid} on " in second.stdout
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
    done = snakemake(project)
    assert done.returncode == 0, done.stdout
    assert "All 3 solves passed." in done.stdout


ORDERS = {"orders of convergence", "all orders reached?"}


def write_ladders(project, least, levels):
    family = project / "cases" / "ladders"
    family.mkdir(exist_ok=True)
    case = (ROOT / "cases" / "manufactured" / "tria3.yaml").read_text()
    (family / "tria3.yaml").write_text(re.sub(r"divisions: \[16, \d+\]", "divisions: [4, 4]", case))
    (family / "orders.yaml").write_text(
        f"levels: {levels}\nleast: {{linear: {{displacement_l2: {least}}}}}\n"
        "ladders: [{case: tria3.yaml}]\n"
    )


def test_ladders_are_solved_level_by_level_and_fitted(project):
    write_ladders(project, 1.5, [1, 2, 3])
    done = snakemake(project, "orders")
    assert done.returncode == 0, done.stdout
    assert "1 of 1 slopes asked for are reached, on 1 ladders." in done.stdout
    level = project / "results" / "orders" / "ladders" / "tria3" / "3"
    assert json.loads((level / "verdict.json").read_text())["macro_elements"] == 12
    assert snakemake(project, "report").returncode == 0
    assert not any(v["family"] == "orders" for v in summary(project).values())

    write_ladders(project, 1.5, [1, 2, 3, 4])
    assert jobs(project, "orders") == {"solve tria3 refined 4 times"} | ORDERS

    write_ladders(project, 5, [1, 2, 3])
    short = snakemake(project, "orders")
    assert short.returncode != 0
    assert re.search(r"ladders/tria3: displacement, L2: .* at least 5 is asked for", short.stdout)
    assert (project / "results" / "report" / "orders.html").is_file()
