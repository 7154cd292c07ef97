"""Times of repeated runs: how often, by which stage, and their spread."""

import gc
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.studies.timing import TOTAL, Spread, medians, repeated, run_compiled, spread
from solver.system.process import cores_for
from solver.system.progress import Clock


def test_median_and_range():
    assert spread([3.0, 1.0, 2.0]) == Spread(2.0, 1.0, 3.0)
    assert spread([4.0, 1.0, 2.0, 3.0]).median == pytest.approx(2.5)
    assert spread([7.0]) == Spread(7.0, 7.0, 7.0)


@given(st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=9))
def test_the_median_lies_within_the_range(values):
    found = spread(values)
    assert found.low <= found.median <= found.high
    assert found == spread(values[::-1])


def test_every_repetition_has_every_stage_and_their_whole():
    calls = []

    def run(clock: Clock) -> None:
        assert not gc.isenabled()
        calls.append(clock)
        with clock.stage("cut"):
            sum(range(20_000))
        if len(calls) == 2:
            with clock.stage("solve"):
                sum(range(20_000))

    times = repeated(run, 3)
    assert gc.isenabled()
    assert len(calls) == len(set(map(id, calls))) == 3
    assert times.keys() == {"cut", "solve", TOTAL}
    assert [t > 0 for t in times["solve"]["wall"]] == [False, True, False]
    for kind in ("wall", "cpu"):
        parts = zip(times["cut"][kind], times["solve"][kind], strict=True)
        assert all(
            cut + solve <= total
            for (cut, solve), total in zip(parts, times[TOTAL][kind], strict=True)
        )


def test_garbage_is_collected_again_after_a_failure():
    def run(clock: Clock) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        repeated(run, 2)
    assert gc.isenabled()


def test_medians_of_one_kind_by_stage():
    times = {"cut": {"wall": [1.0, 9.0, 2.0], "cpu": [0.0, 0.5, 1.0]}}
    assert medians(times, "wall") == {"cut": 2.0}
    assert medians(times, "cpu") == {"cut": 0.5}


# Runs that compile: they are measured again.


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
