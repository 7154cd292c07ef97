"""Freed memory goes back to the system."""

import subprocess
import sys

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
