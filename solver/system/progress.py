"""The progress of a solve, by the standard library's logging.

Modules log to the logger of their own name: outcomes at the level `OUTCOME`, which
`report_outcomes` hands to a function, and details (each stage, each solution and its residual) as
information, which `details` writes with the time. Without either nothing is written, unless the
program that uses the solver listens to the package's logger, `solver` or `mortarcheck`.

A clock adds up wall time by stage, and processor time of all threads and of ended processes.
"""

import logging
import resource
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import get_ident

from .package import PACKAGE

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


OUTCOME = 25
"""The level of the outcomes of a solve, between information and warnings."""
_LOG = logging.getLogger(__name__)


@contextmanager
def stage(clock: Clock, name: str) -> Iterator[None]:
    """Log a stage of the work when it begins for the first time, and count its time."""
    if name not in clock.seconds:
        _LOG.info("%s", name)
    with clock.stage(name):
        yield


class _Saying(logging.Handler):
    """Hands outcomes that this thread logs to a function."""

    def __init__(self, say: Callable[[str], object]):
        super().__init__(OUTCOME)
        self._say, self._thread = say, get_ident()

    def emit(self, record: logging.LogRecord) -> None:
        if record.thread == self._thread:
            self._say(record.getMessage())


@contextmanager
def report_outcomes(say: Callable[[str], object]) -> Iterator[None]:
    """Hand each outcome that is logged to a function, such as `print`."""
    logger, handler = logging.getLogger(PACKAGE), _Saying(say)
    before = logger.level
    logger.setLevel(min(logger.getEffectiveLevel(), OUTCOME))
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)


@contextmanager
def details(verbose: bool) -> Iterator[None]:
    """If `verbose`, write the details that the solver logs to standard error, with the time."""
    if not verbose:
        yield
        return
    lines = logging.StreamHandler(sys.stderr)
    lines.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    lines.addFilter(lambda record: record.levelno < OUTCOME)
    logger = logging.getLogger(PACKAGE)
    before = logger.level, logger.propagate
    logger.addHandler(lines)
    logger.setLevel(logging.INFO)
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(lines)
        logger.setLevel(before[0])
        logger.propagate = before[1]
