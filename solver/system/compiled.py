"""Functions compiled for this machine by Numba, if it is installed: large solves alone need them.

Numba is imported and a function compiled at its first call, so small cases pay for neither. The
machine code is kept in `__pycache__` beside the source, or in the user's cache if that folder is
read-only. A compiled function holds no lock of the interpreter: it may run in several threads.
"""

import sys
from collections.abc import Callable
from functools import cache, wraps
from importlib.util import find_spec
from threading import Lock
from typing import Any

_WORTH = 5_000_000  # numbers: 60,000 unknowns of HEXA8
_PARTS: list[Callable[..., Any]] = []  # that Numba does not know yet


@cache
def available() -> bool:
    """Whether Numba is installed."""
    return find_spec("numba") is not None


def worthwhile(numbers: int) -> bool:
    """Whether compiled functions pay for a matrix of so many `numbers`.

    Numba takes half a second of processor time to load, and then serves smaller matrices too.
    """
    return available() and (numbers >= _WORTH or "numba" in sys.modules)


def part_of_compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, which compiled functions of its file may call."""
    _PARTS.append(function)
    return function


def compiled(function: Callable[..., None]) -> Callable[..., None]:
    """The function compiled at its first call; ImportError there where Numba is missing.

    A product and a sum may be rounded together; the order of sums is kept.
    """

    @cache
    def machine_code() -> Any:
        from numba import njit
        from numba.extending import register_jitable

        while _PARTS:
            register_jitable(_PARTS.pop())
        options: dict[str, Any] = {"nogil": True, "fastmath": {"contract"}}
        try:
            return njit(cache=True, **options)(function)
        except RuntimeError:  # no folder for the cache
            return njit(**options)(function)

    lock = Lock()

    @wraps(function)
    def call(*arguments: Any) -> None:
        with lock:  # several threads compile it once
            code = machine_code()
        code(*arguments)

    return call
