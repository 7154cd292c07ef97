"""Steps of conjugate gradients on long vectors, each in one compiled pass over the threads.

Scalar products are added up by parts of the vectors, and these in their order: the number of
threads changes no digit.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from ...lac.threads import prefetch, workers
from ...system.compiled import compiled, part_of_compiled

_PART = 1 << 13  # of a vector
_PARTS = 8  # of them from which another thread pays for its start


def product(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The scalar product (1,) of two vectors (n,)."""
    return _summed(_multiply, 1, x, y)


def advance(
    step: float,
    solution: np.ndarray,
    residual: np.ndarray,
    direction: np.ndarray,
    image: np.ndarray,
) -> np.ndarray:
    """Add `step` times the direction (n,), take that of its image from the residual; its square."""
    return _summed(_advance, 1, solution, residual, direction, image, step)


def products_of_change(residual: np.ndarray, new: np.ndarray, old: np.ndarray) -> np.ndarray:
    """The products (2,) of a residual (n,) with `new` − `old` and with `new`."""
    return _summed(_of_change, 2, residual, new, old)


def turn(share: float, direction: np.ndarray, new: np.ndarray) -> None:
    """`share` times the direction (n,), plus `new`."""
    _shared(_turn, direction, share, new)


def _summed(kernel: Callable[..., None], count: int, *about: Any) -> np.ndarray:
    """The sums (count,) over all parts of what a kernel finds in each."""
    found = np.zeros((-(-len(about[0]) // _PART), count))
    _shared(kernel, *about, found)
    return np.asarray(found.sum(axis=0))


def _shared(kernel: Callable[..., None], *about: Any) -> None:
    """Call a kernel for the parts of vectors; each thread has some of them."""
    parts = -(-len(about[0]) // _PART)
    count = min(workers(), 1 + parts // _PARTS)
    cuts = [parts * k // count for k in range(count + 1)]
    for _ in prefetch(lambda mine: kernel(*mine, _PART, *about), pairwise(cuts)):
        pass


@part_of_compiled
def _inner(low, high, x, y):  # type: ignore[no-untyped-def]
    """The product of entries from `low` to `high`, in four sums that do not wait for each other."""
    a = b = c = d = 0.0
    for i in range(low, high - 3, 4):
        a += x[i] * y[i]
        b += x[i + 1] * y[i + 1]
        c += x[i + 2] * y[i + 2]
        d += x[i + 3] * y[i + 3]
    for i in range(high - (high - low) % 4, high):
        a += x[i] * y[i]
    return (a + b) + (c + d)


@compiled
def _multiply(first, last, size, x, y, found):  # type: ignore[no-untyped-def]
    for part in range(first, last):
        low, high = part * size, min((part + 1) * size, len(x))
        found[part, 0] = _inner(low, high, x, y)


@compiled
def _advance(  # type: ignore[no-untyped-def]
    first, last, size, solution, residual, direction, image, step, found
):  # fmt: skip
    for part in range(first, last):
        low, high = part * size, min((part + 1) * size, len(solution))
        for i in range(low, high):
            solution[i] += step * direction[i]
            residual[i] -= step * image[i]
        found[part, 0] = _inner(low, high, residual, residual)


@compiled
def _of_change(first, last, size, residual, new, old, found):  # type: ignore[no-untyped-def]
    for part in range(first, last):
        a = b = c = d = 0.0
        low, high = part * size, min((part + 1) * size, len(new))
        for i in range(low, high - 1, 2):
            a += residual[i] * (new[i] - old[i])
            b += residual[i + 1] * (new[i + 1] - old[i + 1])
            c += residual[i] * new[i]
            d += residual[i + 1] * new[i + 1]
        if (high - low) % 2:
            a += residual[high - 1] * (new[high - 1] - old[high - 1])
            c += residual[high - 1] * new[high - 1]
        found[part, 0], found[part, 1] = a + b, c + d


@compiled
def _turn(first, last, size, direction, share, new):  # type: ignore[no-untyped-def]
    for i in range(first * size, min(last * size, len(new))):
        direction[i] = share * direction[i] + new[i]
