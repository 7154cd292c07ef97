"""Compiled functions: only at their first call, and without a folder for the cache too."""

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

from solver.system.compiled import compiled


@compiled
def add(numbers, out):
    """The sum."""
    for number in numbers:
        out[0] += number


def test_the_function_is_compiled_and_keeps_its_name():
    import numpy as np

    out = np.zeros(1)
    add(np.arange(5.0), out)
    assert out == [10.0]
    assert (add.__name__, add.__doc__) == ("add", "The sum.")


def test_without_a_folder_for_the_cache_it_is_compiled_all_the_same(monkeypatch):
    import numba
    import numpy as np

    make = numba.njit

    def refuse(cache=False, **options):
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return make(**options)

    monkeypatch.setattr(numba, "njit", refuse)
    out = np.zeros(1)
    compiled(add.__wrapped__)(np.ones(3), out)
    assert out == [3.0]


def test_several_threads_compile_once(monkeypatch):
    import numba
    import numpy as np

    made = []

    def slow(**options):
        made.append(options)
        time.sleep(0.05)
        return lambda function: function

    monkeypatch.setattr(numba, "njit", slow)
    once, out = compiled(add.__wrapped__), [np.zeros(1) for _ in range(4)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(once, [np.ones(3)] * 4, out))
    assert len(made) == 1
    assert np.concatenate(out).tolist() == [3.0] * 4


def test_small_cases_import_no_numba():
    program = "import sys, solver.mechanics.multigrid.multigrid; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
