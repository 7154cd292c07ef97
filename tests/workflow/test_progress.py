"""What a run reports: a line for each solve that ends, almost nothing if quiet."""

import io
import logging
import re

import pytest

from solver.commands.progress import Progress, hides
from solver.system.files import last_line
from tests.workflow.projects import new_project, snakemake


def log(tmp_path, *lines):
    path = tmp_path / "log"
    path.write_text("".join(f"{line}\n" for line in lines))
    return path


def record(event=None, message=None, **more):
    return logging.makeLogRecord({"event": event, "msg": message, "levelno": 20, **more})


def test_solves_are_counted_and_nothing_else(tmp_path):
    said = str(log(tmp_path, "18:43:22 write", "a: passed, 0.25 s"))
    progress = Progress(io.StringIO())
    for each in (
        record("run_info", stats={"mesh": 8, "solve": 10, "report": 1, "total": 19}),
        record("job_info", jobid=1, rule_name="mesh", log=[]),
        record("job_info", jobid=2, rule_name="solve", log=[said]),
        record("job_finished", job_id=1),
        record("job_finished", job_id=2),
    ):
        assert progress.filter(each)  # never in the way of what others log
    assert progress.out.getvalue() == "a: passed, 0.25 s [1/10]\n"


def test_what_is_hidden():
    assert hides(record("job_info"))
    assert hides(record(None, "Select jobs to execute..."))
    assert not hides(record("job_error"))
    assert not hides(record(None, "Nothing to be done (all requested files are present)."))


def test_last_lines(tmp_path):
    assert last_line(None) == last_line(tmp_path / "none") == ""
    assert last_line(log(tmp_path, "x" * 9000, "the last", "", " ")) == "the last"
    (tmp_path / "log").write_bytes(b"\xff\xfe cut")
    assert last_line(tmp_path / "log").endswith("cut")


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project with a single solve."""
    project = new_project(tmp_path_factory.mktemp("project"))
    (project / "cases" / "tiny" / "tiny-a.yaml").unlink()
    return project


def test_a_quiet_run_tells_its_outcome_alone(project):
    run = snakemake(project, "--forceall", "--quiet", "rules", "progress", "reason", "host")
    assert run.returncode == 0, run.stdout
    lines = run.stdout.splitlines()
    assert [line for line in lines if "specific profile" not in line] == [
        "Processor time by family (solves): tiny "
        + re.search(r"tiny (\d+\.\d s \(1\)\.)$", run.stdout, re.MULTILINE)[1],
        "The one solve passed. Report: results/report/summary.html",
    ]
