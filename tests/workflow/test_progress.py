"""What a run reports: a line for each solve, its state on a terminal, almost nothing if quiet."""

import io
import logging
import os
import pty
import re
import subprocess
import sys

import pytest

from solver.system.files import last_line
from tests.workflow.projects import new_project, snakemake
from workflow.progress import Progress, State, duration, hides


class Time:
    """A clock that stands still until it is set."""

    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Time()


@pytest.fixture
def state(clock):
    """A run that is going to solve ten cases."""
    state = State(clock)
    state.expect({"mesh": 8, "solve": 10, "report": 1, "total": 19})
    return state


def log(tmp_path, *lines):
    path = tmp_path / "log"
    path.write_text("".join(f"{line}\n" for line in lines))
    return path


def test_solves_are_counted_and_nothing_else(state, tmp_path):
    state.start(1, "mesh", "mesh a", None)
    state.start(2, "solve", "solve a", log(tmp_path, "18:43:22 write", "a: passed, 0.25 s"))
    assert state.text() == "0 of 10 solves done, 2 running – mesh a"
    assert state.end(1) is None
    assert state.end(2) == "a: passed, 0.25 s [1/10]"
    assert state.text() == "1 of 10 solves done"


@pytest.mark.parametrize("word", ["failed", "unreliable", "refused", "crashed"])
def test_what_did_not_pass_is_counted(state, tmp_path, word):
    state.start(1, "solve", "solve a", log(tmp_path, f"a: {word}: b: passed, it said"))
    state.end(1)
    assert state.text() == "1 of 10 solves done, 1 not passed"
    state.start(2, "solve", "solve b", log(tmp_path, "b: passed, failed: 0"))
    state.end(2)
    assert state.not_passed == 1


def test_a_refused_solve_prints_its_reason_and_has_not_passed(state, tmp_path):
    line = "my/a.yaml: supports: this key is needed"
    state.start(1, "solve", "solve a", log(tmp_path, line))
    assert state.end(1) == f"{line} [1/10]"
    assert state.not_passed == 1
    state.start(2, "solve", "solve b", log(tmp_path, "b: solved: not verified"))
    state.end(2)
    assert state.not_passed == 1


def test_a_job_that_breaks_off_may_begin_once_more(state, tmp_path):
    state.start(1, "solve", "solve a", log(tmp_path, "a: passed, 0.25 s"))
    state.fail(1)
    assert state.text() == "0 of 10 solves done, 1 not passed"
    state.start(1, "solve", "solve a", tmp_path / "log")
    assert state.end(1) == "a: passed, 0.25 s [1/10]"
    assert state.text() == "1 of 10 solves done"


def test_the_job_that_runs_longest_tells_its_stage(state, clock, tmp_path):
    state.start(1, "solve", "solve big", log(tmp_path, "18:43:22 solution 1: residual 1.0e-12"))
    clock.now += 2
    assert state.text().endswith("1 running – solve big")
    clock.now += 118
    assert state.text().endswith("– solve big (2 min): 18:43:22 solution 1: residual 1.0e-12")


def record(event=None, message=None, **more):
    return logging.makeLogRecord({"event": event, "msg": message, "levelno": 20, **more})


def info(number, rule, log=()):
    return record("job_info", jobid=number, rule_name=rule, rule_msg=f"{rule} {number}", log=log)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def hear(status, *records):
    """What a run prints on both streams."""
    out = io.StringIO()
    progress = Progress(out, status)
    for each in records:
        assert progress.filter(each)  # never in the way of what others log
    progress.close()
    return out.getvalue(), status.getvalue()


def test_a_terminal_is_left_clean(tmp_path):
    said = str(log(tmp_path, "a: passed, 0.25 s"))
    events = [record("run_info", stats={"solve": 2}), info(1, "solve", [said])]
    out, status = hear(Terminal(), *events, record("job_finished", job_id=1))
    assert out == "a: passed, 0.25 s [1/2]\n"
    wipe = "\r\x1b[K"
    assert status == f"0 of 2 solves done, 1 running – solve 1{wipe}1 of 2 solves done{wipe}"


def test_jobs_that_print_by_themselves_have_the_terminal_alone(tmp_path):
    said = str(log(tmp_path, "a: passed, 0.25 s"))
    events = [record("run_info", stats={"solve": 2}), info(2, "report"), info(1, "solve", [said])]
    _, status = hear(Terminal(), *events, record("job_finished", job_id=1))
    assert status == ""


def test_a_file_gets_whole_lines(tmp_path):
    progress = Progress(io.StringIO(), io.StringIO())
    progress.filter(record("run_info", stats={"measure": 2}))
    progress._show()
    progress.close()
    assert re.fullmatch(r"\d\d:\d\d:\d\d 0 of 2 groups done\n", progress.status.getvalue())


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


def test_durations():
    assert [duration(s) for s in (0.4, 89, 90, 3600, 9000)] == [
        "0 s",
        "89 s",
        "2 min",
        "60 min",
        "2.5 h",
    ]


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project with a single solve."""
    project = new_project(tmp_path_factory.mktemp("project"))
    (project / "cases" / "tiny" / "tiny-a.yaml").unlink()
    return project


def test_a_run_on_a_terminal_rewrites_its_last_line(project):
    main, terminal = pty.openpty()
    run = subprocess.Popen(
        [sys.executable, "-m", "snakemake", "--cores", "1", "--forceall"],
        cwd=project,
        stdout=terminal,
        stderr=terminal,
    )
    os.close(terminal)
    shown = b""
    try:
        while part := os.read(main, 4096):
            shown += part
    except OSError:  # the other end is closed
        pass
    assert run.wait() == 0
    text = shown.decode()
    assert "0 of 1 solves done" in text
    # What stays on the screen: of each line what follows its last wipe.
    lines = [line.rpartition("\x1b[K")[2] for line in text.replace("\r\n", "\n").split("\n")]
    assert not any("solves done" in line for line in lines)
    assert sum(bool(re.fullmatch(r"tiny-b: passed, .* \[1/1\]", line)) for line in lines) == 1


def test_a_quiet_run_tells_its_outcome_alone(project):
    run = snakemake(project, "--forceall", "--quiet", "rules", "progress", "reason", "host")
    assert run.returncode == 0, run.stdout
    lines = run.stdout.splitlines()
    assert [line for line in lines if "specific profile" not in line] == [
        "Processor time by family (solves): tiny "
        + re.search(r"tiny (\d+\.\d s \(1\)\.)$", run.stdout, re.MULTILINE)[1],
        "The one solve passed. Report: results/report/summary.html",
    ]
