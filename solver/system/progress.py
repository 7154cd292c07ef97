"""What a solve tells while it works: lines with the time on the terminal, or where asked for.

Modules log to the logger of their own name, each stage, each solution and its residual; nobody sees
that, unless `telling` is around it or the program that uses the solver listens to `solver`.
"""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from logging.handlers import MemoryHandler
from threading import Timer

# A solve that ends sooner tells nothing on a terminal.
PATIENCE = 2.0


@contextmanager
def telling(verbose: bool, quiet: bool = False) -> Iterator[None]:
    """Write what the solver logs to the standard error: where it is a terminal, or `verbose`.

    On a terminal nothing is written before `PATIENCE` seconds are over, then all of it.
    """
    if quiet or not (verbose or sys.stderr.isatty()):
        yield
        return
    lines = logging.StreamHandler(sys.stderr)
    lines.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
    held = MemoryHandler(0 if verbose else sys.maxsize, sys.maxsize, lines, flushOnClose=False)
    patience = Timer(PATIENCE, _release, [held])
    patience.daemon = True
    logger = logging.getLogger("solver")
    before = logger.level, logger.propagate
    logger.addHandler(held)
    logger.setLevel(logging.INFO)
    logger.propagate = False
    if not verbose:
        patience.start()
    try:
        yield
    finally:
        patience.cancel()
        logger.removeHandler(held)
        logger.setLevel(before[0])
        logger.propagate = before[1]


def _release(held: MemoryHandler) -> None:
    held.capacity = 0
    held.flush()
