"""A sample of the kills that `make kills` does by the hundred, and Ctrl-C.

A whole batch is killed in `test_workflow`.
"""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from tests.workflow.kills import kill_at_random
from tests.workflow.projects import ROOT, new_project, started


def test_what_is_killed_recovers(tmp_path):
    targets = ["batch's job", "batch's server", "report"]
    failures, struck = kill_at_random(tmp_path / "project", len(targets), 1, targets)
    assert failures == []
    assert struck.total() == len(targets)


def test_ctrl_c_leaves_no_verdict_and_nothing_runs_on(tmp_path):
    project = new_project(tmp_path / "project")
    case = project / "cases" / "tiny" / "tiny-a.yaml"
    long = case.read_text().replace("[2, 2]", "[400, 300]").replace("[3, 2]", "[500, 200]")
    case.write_text(long)
    log = project / "results" / "tiny" / "tiny-a" / "log"
    with (tmp_path / "output").open("w") as output:
        run = started(project, output)
        while not (log.exists() and "assembly" in log.read_text()):
            assert run.poll() is None, (tmp_path / "output").read_text()
            time.sleep(0.05)
        os.killpg(run.pid, signal.SIGINT)
        assert run.wait(timeout=60) != 0
    verdicts = [json.loads(f.read_text()) for f in project.glob("results/tiny/*/verdict.json")]
    time.sleep(1)
    assert not list(log.parent.glob("*.vtkhdf*"))
    assert {verdict["verdict"] for verdict in verdicts} <= {"passed"}
    assert "crashed:" not in (tmp_path / "output").read_text()


START = str(ROOT / "workflow" / "start.py"), "--version"
SOLVER = str(ROOT / "solver")
VALIDATE = SOLVER, "validate", "cases/ssnp170/e.yaml"
# It runs a program, and sends the interrupt when a module is imported, or from an exit handler:
# there Python ignores it, with a traceback.
INTERRUPTED = """
import atexit, os, runpy, signal, sys
when = sys.argv[1]
def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
class Finder:
    @staticmethod
    def find_spec(name, *_):
        if name == when:
            interrupt()
sys.meta_path.insert(0, Finder)
if when == "exit":
    atexit.register(interrupt)
del sys.argv[:2]
runpy.run_path(sys.argv[0], run_name="__main__")
"""


@pytest.mark.parametrize(
    ("when", "program", "status"),
    [
        ("snakemake", START, -signal.SIGINT),
        ("argparse", VALIDATE, -signal.SIGINT),
        ("msgspec", VALIDATE, 130),  # the command is at work
        ("exit", START, -signal.SIGINT),
        ("exit", VALIDATE, -signal.SIGINT),
        ("exit", (SOLVER, "--help"), -signal.SIGINT),
    ],
)
def test_ctrl_c_prints_no_traceback(when, program, status):
    run = [sys.executable, "-c", INTERRUPTED, when, *program]
    ended = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (status, "")
