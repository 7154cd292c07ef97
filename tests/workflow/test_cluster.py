"""Jobs sent elsewhere: what they ask for.

The batch on a real cluster is tried by `make cluster-test`.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

from tests.workflow.cluster import missing
from tests.workflow.projects import ROOT, new_project, snakemake


def asked(project, *calls):
    """What calls in the Snakefile return."""
    told = "\n".join(f'print("ASKED", {call})' for call in calls)
    snakefile = project / "Snakefile"
    snakefile.write_text(f"{(ROOT / 'Snakefile').read_text()}\n{told}\n")
    run = snakemake(project, "--dry-run")
    assert run.returncode == 0, run.stdout
    return [json.loads(line) for line in re.findall(r"^ASKED (.*)$", run.stdout, re.MULTILINE)]


def test_jobs_ask_for_memory_and_time_by_size_and_again_for_more(tmp_path):
    project = new_project(tmp_path / "project")
    tiny = project / "cases" / "tiny" / "tiny-b.yaml"
    case = yaml.safe_load(tiny.read_text())
    case["name"] = "large"
    for side in ("bottom", "top"):
        case["mesh"][side] = {"cells": "HEXA8", "divisions": [50, 50, 35]}
    del case["plane"]
    tiny.with_name("large.yaml").write_text(yaml.safe_dump(case))
    tiny.with_name("broken.yaml").write_text("name: [broken\n")
    name = 'BATCH["tiny", "{}"]'.format
    small, broken, large, twice = asked(
        project,
        *(f"memory({name(each)}, 1)" for each in ("tiny-b", "broken", "large")),
        f"memory({name('large')}, 2)",
    )
    # 525,000 unknowns of HEXA8 take 5.4 GB.
    assert 900 <= broken <= small < 1100
    assert 6000 < large < 12000
    assert twice == 2 * large
    first, second = asked(
        project,
        f"minutes({name('large')}, 1)",
        f"minutes({name('large')}, 2)",
    )
    assert 10 < first < second == 2 * first


def test_the_profile_keeps_what_every_run_needs():
    profiles = {
        name: yaml.safe_load((ROOT / "profiles" / name / "config.yaml").read_text())
        for name in ("default", "slurm")
    }
    kept = {key: value for key, value in profiles["default"].items() if key != "cores"}
    assert kept.items() <= profiles["slurm"].items()
    assert profiles["slurm"]["executor"] == "slurm"


def test_a_machine_without_slurm_is_told_its_packages(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.workflow.cluster.SYSTEM", [])
    monkeypatch.setenv("PATH", str(tmp_path))
    assert re.match(r"no munged, .*; Debian's packages are munge slurm-wlm$", missing())


def runs(process):
    """Whether there is such a process that has not ended, waited for or not."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


HOLD = """
import pathlib, sys, time
from tests.workflow.cluster import Cluster
with Cluster(pathlib.Path(sys.argv[1])) as cluster:
    print(*(daemon.pid for daemon in cluster.daemons), flush=True)
    {then}
"""


@pytest.mark.skipif(bool(missing()), reason=missing() or "there is a SLURM")
@pytest.mark.parametrize(
    ("then", "number"), [("raise KeyError", None), ("time.sleep(60)", signal.SIGKILL)]
)
def test_daemons_end_with_what_started_them(then, number, tmp_path):
    tmp_path.chmod(0o755)
    command = [sys.executable, "-c", HOLD.format(then=then), tmp_path]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as holder:
        daemons = holder.stdout.readline().split()
        if number:
            os.kill(holder.pid, number)
    assert len(daemons) == 3
    deadline = time.monotonic() + 30
    while any(map(runs, daemons)):
        assert time.monotonic() < deadline
        time.sleep(0.1)
