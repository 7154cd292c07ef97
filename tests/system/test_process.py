"""A process of its own: how it ended, and what it took."""

import subprocess
import sys
import time

import pytest

from solver.system.process import cores_for, run_in_subprocess


def python(text, limit=60.0, **options):
    return run_in_subprocess([sys.executable, "-c", text], cores_for(1), limit, **options)


def test_what_a_process_took():
    text = "import time; x = bytearray(80_000_000); t = time.process_time()\n"
    ended = python(text + "while time.process_time() < t + 0.2: pass\ntime.sleep(0.1)")
    assert ended.status == 0
    assert ended.cpu > 0.2
    assert ended.wall > 0.3
    assert ended.peak_memory_mb > 80


def test_it_is_pinned_with_as_many_threads():
    told = "import os; print(len(os.sched_getaffinity(0)), os.environ['OMP_NUM_THREADS'])"
    assert python(told).output.split() == ["1", "1"]


def test_how_it_died():
    assert python("print('a'); raise SystemExit('b')").reason.endswith("exit status 1: b")
    assert python("import os; os.kill(os.getpid(), 9)").reason.endswith("status -9: no word")


def test_one_without_an_end_is_stopped():
    ended = python("import time; time.sleep(60)", limit=0.3)
    assert ended.status is None
    assert 0.3 < ended.wall < 30


def test_more_memory_than_allowed_is_not_to_be_had():
    ended = python("bytearray(400_000_000)", memory=200e6)
    assert "MemoryError" in ended.reason


@pytest.mark.parametrize("threads", [1, 10_000])
def test_no_more_cores_than_there_are(threads):
    assert 1 <= len(cores_for(threads)) <= threads


def test_what_it_started_ends_with_it(tmp_path):
    """A child that outlives the limit would write the file."""
    file = tmp_path / "alive"
    child = f"import time; time.sleep(1); open({str(file)!r}, 'w')"
    text = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    assert python(text, limit=0.5).status is None
    time.sleep(1)
    assert not file.exists()


# Freed memory goes back to the system.


PROGRAM = """
from solver.system.process import release
def used():
    return int(open("/proc/self/statm").read().split()[1]) * 4096
blocks = [b"x" * 100_000 for _ in range(1000)]
last = b"x" * 100_000
full = used()
del blocks
release()
print(full - used())
"""


def test_freed_memory_is_given_back():
    """A hundred megabytes in small blocks, below one that stays: the C library would keep them."""
    run = [sys.executable, "-c", PROGRAM]
    assert int(subprocess.check_output(run)) > 90_000_000
