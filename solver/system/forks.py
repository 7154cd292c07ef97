"""Work that is shared among forks of this process."""

import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager


def fork() -> int:
    """A fork, as `os.fork` makes it, in a process whose threads hold no locks."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads beside a fork
        return os.fork()


@contextmanager
def in_forks(tasks: Sequence[Callable[[], object]], count: int) -> Iterator[None]:
    """While the block runs, `count` forks do the tasks; the block ends when they have ended.

    Each fork does every `count`-th task. It leaves its results in files. A fork that dies, or whose
    task raises, leaves its remaining tasks undone and says nothing. With a `count` of 1, and on
    systems where libraries do not survive a fork, nothing is done.
    """
    forks = []
    if count > 1 and sys.platform == "linux":
        shares = [tasks[first::count] for first in range(min(count, len(tasks)))]
        forks = [_start(share) for share in shares]
    try:
        yield
    finally:
        for process in forks:
            os.waitpid(process, 0)


def _start(tasks: Sequence[Callable[[], object]]) -> int:
    process = fork()
    if process == 0:
        try:
            for task in tasks:
                task()
        finally:
            os._exit(0)
    return process
