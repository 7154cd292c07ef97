"""Points of studies: their meshes, and runs that compile."""

import sys
from math import prod
from pathlib import Path

import pytest

from solver.studies.points import run_compiled
from solver.studies.work_precision.description import read_study
from solver.system.compiled import available
from solver.system.process import cores_for

FILE = Path(__file__).parents[2] / "cases/study/study.yaml"


def test_unknowns_of_regular_grids_are_counted():
    pair = ("HEXA20", "HEXA20")
    points = read_study(FILE, "full").points
    point = next(p for p in points if (p.slave, p.master) == pair and p.level == 2)
    corners = [prod(2 * n + 1 for n in body) for body in point.problem.divisions]
    edges = [
        prod(2 * n + (i != k) for k, n in enumerate(body))
        for body in point.problem.divisions
        for i in range(3)
    ]
    nodes = [*corners, *edges]
    assert point.mesh.unknowns == 3 * sum(nodes)


_PROGRAM = """
import sys
with open({runs!r}, "a") as runs:
    runs.write("x")
sys.path.insert(0, {folder!r})
import loops, numpy
out = numpy.zeros(1)
loops.add(numpy.arange(5.0), out)
print("sum", out[0])
sys.exit({status})
"""


@pytest.fixture
def compiling(tmp_path, monkeypatch):
    """Runs a program with a compiled function; the runs, and how the last one ended."""
    (tmp_path / "loops.py").write_text(
        "from solver.system.compiled import compiled\n@compiled\ndef add(numbers, out):\n"
        "    for number in numbers:\n        out[0] += number\n"
    )
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))

    def run(status=0):
        runs = tmp_path / "runs"
        runs.write_text("")
        text = _PROGRAM.format(runs=str(runs), folder=str(tmp_path), status=status)
        done = run_compiled(lambda: [sys.executable, "-c", text], cores_for(1), 60.0)
        return len(runs.read_text()), done

    return run


@pytest.mark.skipif(not available(), reason="Numba is not installed")
def test_a_run_that_compiled_functions_is_not_measured(compiling):
    runs, done = compiling()
    assert (runs, done.status, done.output) == (2, 0, "sum 10.0\n")
    # They are kept: nothing is compiled any more.
    runs, done = compiling()
    assert (runs, done.status, done.output) == (1, 0, "sum 10.0\n")


@pytest.mark.skipif(not available(), reason="Numba is not installed")
def test_a_run_that_failed_is_not_repeated(compiling):
    runs, done = compiling(status=3)
    assert (runs, done.reason) == (1, "the process died with exit status 3: sum 10.0")
