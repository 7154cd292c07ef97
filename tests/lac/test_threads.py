"""Work in threads: order, bounded waiting, exceptions, and who computes."""

import threading

import numpy as np
import pytest

from solver.lac import threads
from solver.lac.threads import prefetch, workers


@pytest.fixture(params=[1, 2, 5])
def count(request, monkeypatch):
    monkeypatch.setattr(threads, "workers", lambda: request.param)
    return request.param


@pytest.mark.parametrize("parts", [0, 1, 3, 100])
def test_results_come_in_the_order_of_the_parts(count, parts):
    values = np.random.default_rng(0).random(parts)
    assert list(prefetch(lambda i: 2 * values[i], range(parts))) == (2 * values).tolist()


def test_few_results_wait(count):
    begun = []
    results = prefetch(lambda i: begun.append(i) or i, range(1000))
    for _ in range(10):
        next(results)
    assert len(begun) <= 10 + 3 * count + 1


def test_an_exception_comes_in_its_place(count):
    def refuse(i):
        if i == 3:
            raise ValueError("three")
        return i

    results = prefetch(refuse, range(50))
    assert [next(results) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(ValueError, match="three"):
        next(results)


def test_threads_compute_together(monkeypatch):
    monkeypatch.setattr(threads, "workers", lambda: 2)
    both = threading.Barrier(2, timeout=10)
    assert len(set(prefetch(lambda _: both.wait(), range(2)))) == 2


def test_a_single_part_needs_no_thread(monkeypatch):
    monkeypatch.setattr(threads, "workers", lambda: 4)
    assert list(prefetch(lambda _: threading.current_thread(), [0])) == [threading.current_thread()]


@pytest.mark.parametrize(
    ("asked", "expected"), [("1", 1), ("3", 3), ("64", 4), ("", 4), ("0", 4), ("2,1", 4)]
)
def test_workers_are_the_cores_or_fewer(monkeypatch, asked, expected):
    monkeypatch.setattr(threads.os, "sched_getaffinity", lambda _: {0, 1, 2, 3}, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", asked)
    assert workers() == expected
