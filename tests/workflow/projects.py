"""Copies of the project with tiny cases, and real Snakemake in them."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
CASE = """\
name: {name}
mesh: {{recipe: blocks, size: 10, bottom: {{cells: QUAD4, divisions: [2, 2]}},
       top: {{cells: QUAD4, divisions: [3, 2]}}}}
plane: strain
materials: {{all: {{young: 2000.0, poisson: 0.3}}}}
supports: [{{group: symx, fix: [x]}}, {{group: base, fix: [y]}}]
loads: [{{group: press, pressure: 25.0}}]
contact: [{{name: interface, slave: bottom_contact, master: top_contact}}]
directions: {directions}
reference: {{kind: analytical, contact_pressure: {pressure}, gap: 0.0}}
"""
# As `make` starts it.
SNAKEMAKE = [sys.executable, "workflow/start.py", "--cores", "2"]


def write_case(folder, name, directions="first", pressure=25.0):
    folder.mkdir(parents=True, exist_ok=True)
    text = CASE.format(name=name, directions=directions, pressure=pressure)
    (folder / f"{name}.yaml").write_text(text)


# Importing Snakemake takes most of the time of a small run: one process has done so, and forks.
FORKS = """
import gc, json, os, runpy, signal, sys
import jsonschema, snakemake.cli
snakemake.cli.get_argument_parser()  # which imports its plugins
gc.freeze()
for line in sys.stdin:
    environment, folder, output, *arguments = json.loads(line)
    if not (run := os.fork()):
        signal.alarm(300)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(os.open(output, os.O_WRONLY), 1)
        os.dup2(1, 2)
        os.environ.clear()
        os.environ.update(environment)
        os.chdir(folder)
        sys.argv[1:] = arguments
        runpy.run_path("workflow/start.py", run_name="__main__")
    print(os.waitstatus_to_exitcode(os.waitpid(run, 0)[1]), flush=True)
"""


@cache
def _forks():
    command = [sys.executable, "-c", FORKS]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def snakemake(project, *arguments):
    """The finished process of a run, its output and errors as one text."""
    with tempfile.NamedTemporaryFile("r") as output:
        told = [dict(os.environ), str(project), output.name, *map(str, arguments)]
        print(json.dumps(told), file=_forks().stdin, flush=True)
        status = int(_forks().stdout.readline())
        return subprocess.CompletedProcess(told[3:], status, output.read())


def started(project, output):
    """A run that can be struck with all of its processes; it writes into an open file."""
    return subprocess.Popen(
        SNAKEMAKE, cwd=project, stdout=output, stderr=output, start_new_session=True
    )


def jobs(project, *arguments):
    """What a run would do, by the jobs' messages."""
    planned = snakemake(project, "--dry-run", *arguments)
    assert planned.returncode == 0, planned.stdout
    return set(re.findall(r"^Job \d+: (.*)$", planned.stdout, re.MULTILINE))


def copy_program(folder):
    """All that a batch needs but its cases."""
    folder.mkdir(exist_ok=True)
    shutil.copy(ROOT / "Snakefile", folder)
    for name in ("workflow", "profiles", "solver"):
        shutil.copytree(ROOT / name, folder / name)


def new_project(folder):
    copy_program(folder)
    write_case(folder / "cases" / "tiny", "tiny-a", "both")
    write_case(folder / "cases" / "tiny", "tiny-b")
    (folder / "cases" / "tiny" / "family.yaml").write_text("title: Tiny cases\n")
    return folder


def summary(project):
    content = json.loads((project / "results" / "report" / "summary.json").read_text())
    return {verdict["job"]: verdict for verdict in content}


# What differs from one run of the same solve to the next, and the hashes of files with such.
TIMES = {"seconds", "cpu_seconds", "stage_cpu_seconds", "peak_memory_mb", "time_utc"}
TIMES |= {"digest", "result_sha256"}


def without_times(content):
    """Parsed JSON without what measures time and memory."""
    if isinstance(content, dict):
        return {key: without_times(value) for key, value in content.items() if key not in TIMES}
    if isinstance(content, list):
        return [without_times(value) for value in content]
    return content
