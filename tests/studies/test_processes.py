"""Runs that compile: they are measured again."""

import sys

import pytest

from solver.studies.timing import run_compiled
from solver.system.process import cores_for

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


def test_a_run_that_compiled_functions_is_not_measured(compiling):
    runs, done = compiling()
    assert (runs, done.status, done.output) == (2, 0, "sum 10.0\n")
    # They are kept: nothing is compiled any more.
    runs, done = compiling()
    assert (runs, done.status, done.output) == (1, 0, "sum 10.0\n")


def test_a_run_that_failed_is_not_repeated(compiling):
    runs, done = compiling(status=3)
    assert (runs, done.reason) == (1, "the process died with exit status 3: sum 10.0")
