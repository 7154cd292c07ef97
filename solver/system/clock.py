"""Time by stage: wall time, and processor time of all threads and of processes that have ended."""

import resource
import time
from collections.abc import Iterator
from contextlib import contextmanager

# The stages of `simulate`, in the order of the work; `pairing` holds the intersections too.
SOLVING = ("cut", "pairing", "assembly", "solve", "recovery")


def now() -> float:
    """Seconds on a clock that all processes of the machine share."""
    return time.clock_gettime(time.CLOCK_MONOTONIC)


def processor_time() -> float:
    """Seconds of this process and of those that it started and waited for, as to read a mesh."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + ended.ru_utime + ended.ru_stime


class Clock:
    """Adds up wall time `seconds` and processor time `cpu_seconds` spent in each named stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.cpu_seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time within the block to the stage `name`."""
        wall, cpu = time.perf_counter(), processor_time()
        try:
            yield
        finally:
            spent = processor_time() - cpu
            self.cpu_seconds[name] = self.cpu_seconds.get(name, 0.0) + spent
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - wall
