"""Functions compiled for this machine by Numba: large solves in 3D alone need them.

Numba is imported and a function compiled at its first call, so small cases pay for neither. The
machine code is kept in `__pycache__` beside the source, or in the user's cache if that folder is
read-only. A compiled function holds no lock of the interpreter: it may run in several threads.
"""

from collections.abc import Callable
from functools import cache, wraps
from threading import Lock
from typing import Any

_PARTS: list[Callable[..., Any]] = []  # that Numba does not know yet


def part_of_compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, which compiled functions of its file may call."""
    _PARTS.append(function)
    return function


def compiled(function: Callable[..., None]) -> Callable[..., None]:
    """The function compiled at its first call.

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
