"""Work in threads. NumPy and SciPy release the interpreter's lock in most of their loops."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import cache
from threading import current_thread
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")
_NAME = "prefetch"


def cores() -> int:
    """The cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def workers() -> int:
    """The threads that this process may use: its cores, or fewer as OMP_NUM_THREADS says."""
    asked = os.environ.get("OMP_NUM_THREADS", "")
    return min(cores(), int(asked)) if asked.isdigit() and int(asked) else cores()


def prefetch(function: Callable[[Part], Result], parts: Iterable[Part]) -> Iterator[Result]:
    """`function` of each part, in the order of the parts; threads compute the next few ahead.

    A sum of the results thus has the same digits for any number of threads. An exception comes in
    its place. A single part, or a single thread, is computed here, and so is everything in one of
    these threads.

    >>> list(prefetch(lambda x: x * x, range(5)))
    [0, 1, 4, 9, 16]
    """
    parts = list(parts)
    if len(parts) < 2 or current_thread().name.startswith(_NAME):
        return map(function, parts)
    count = min(workers(), len(parts))
    return _ahead(function, parts, count) if count > 1 else map(function, parts)


def _ahead(
    function: Callable[[Part], Result], parts: Sequence[Part], count: int
) -> Iterator[Result]:
    """The results in the order of the parts, a few more than `count` of them computed ahead."""
    waiting: deque[Future[Result]] = deque()
    pool = _pool(count)
    try:
        for part in parts:
            waiting.append(pool.submit(function, part))
            if len(waiting) > count:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()
        wait(waiting)


@cache
def _pool(count: int) -> ThreadPoolExecutor:
    """So many threads, which wait for work from one call to the next."""
    return ThreadPoolExecutor(count, _NAME)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)
