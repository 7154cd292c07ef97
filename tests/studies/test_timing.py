"""Times of repeated runs: how often, by which stage, and their spread."""

import gc

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.studies.timing import TOTAL, Spread, medians, repeated, spread
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
