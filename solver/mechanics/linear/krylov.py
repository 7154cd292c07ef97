"""Conjugate gradients in double precision around a preconditioner in single precision.

The steps on long vectors are compiled passes, shared out among the threads. Scalar products are
added up by parts of the vectors, and these in their order: the number of threads changes no digit.
"""

import logging
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from ...lac.errors import SolveError
from ...lac.threads import prefetch, workers
from ...system.compiled import compiled, part_of_compiled

_LOG = logging.getLogger(__name__)
_LOGGED = 10  # iterations from one line of the log to the next
_SAFETY = 1.05  # of a bound from below
_PART = 1 << 13  # of a vector
_PARTS = 8  # of them from which another thread pays for its start

Operator = Callable[[np.ndarray], np.ndarray]

EPSILON = float(np.finfo(float).eps)
ROUGH = 1e-9
"""Residual over right-hand side of a solution that will be refined."""


def conjugate_gradients(
    multiply: Operator,
    precondition: Operator,
    right: np.ndarray,
    accuracy: float,
    most: int,
    watch: Callable[[int, float], None] = lambda *_: None,
) -> tuple[np.ndarray, int]:
    """Solve for `right` (n,); return the solution and the iterations.

    `accuracy` is residual over right-hand side, in 2-norms. Raises SolveError where `most`
    iterations do not reach it, or where one third (two thirds) of them reach less than one third
    (two thirds) of the digits. The flexible form (Golub and Ye, SIAM J. Sci. Comput. 21 (1999)
    1305): the preconditioner is rounded, so it is linear only to single precision. `watch` gets
    each number of iterations and the residual reached, and may change the preconditioner.
    """
    solution, residual = np.zeros_like(right), right.copy()
    improved = precondition(residual)
    direction = improved.copy()
    start, energy = product(right, right) ** 0.5, product(residual, improved)
    iteration, reached, thirds = 0, float(start != 0), (most // 3, 2 * most // 3, most)
    while reached > accuracy:
        if iteration in thirds and reached > accuracy ** (iteration / most):
            text = (
                f"conjugate gradients leave a residual of {reached:.0e} in {iteration} iterations"
            )
            raise SolveError(text)
        image = multiply(direction)
        step = _ratio(energy, product(direction, image))
        left = _summed(_advance, 1, solution, residual, direction, image, step)[0]
        iteration += 1
        reached = _ratio(float(left) ** 0.5, start)
        if iteration % _LOGGED == 0:
            _LOG.info("conjugate gradients: iteration %d, residual %.1e", iteration, reached)
        watch(iteration, reached)
        if reached > accuracy:
            previous, improved = improved, precondition(residual)
            change, following = _summed(_of_change, 2, residual, improved, previous)
            _shared(_turn, direction, _ratio(change, energy), improved)
            energy = following
    return solution, iteration


def _ratio(numerator: float, denominator: float) -> float:
    # What is solved exactly has a denominator of zero.
    return float(numerator / denominator) if denominator > 0 else 0.0


def two_steps(precondition: Operator, multiply: Operator, residual: np.ndarray) -> np.ndarray:
    """The change (n,) for a `residual` (n,): two steps of conjugate gradients from zero.

    The second direction is conjugate to the first, so the energy of the error is the least in their
    plane, whatever the preconditioner.
    """
    first = precondition(residual)
    image = multiply(first)
    energy = _inner(first, image)
    if not energy > 0:  # nothing to solve, or only round-off
        return first
    share = np.float32(_inner(first, residual) / energy)
    second = precondition(residual - share * image)
    second -= np.float32(_inner(second, image) / energy) * first
    turned = _inner(second, multiply(second))
    change = share * first
    if turned > 0:
        change += np.float32(_inner(second, residual) / turned) * second
    return change


def _inner(one: np.ndarray, other: np.ndarray) -> float:
    """The product of vectors in single precision; sums of BLAS depend on the threads."""
    return float(np.sum(one * other, dtype=float))


def in_single(solve: Operator, right: np.ndarray) -> np.ndarray:
    """A linear `solve` in single precision of `right` (n,) in double precision.

    Single precision has a small range of exponents: the vector is scaled to order one.
    """
    size = max(right.max(initial=0.0), -right.min(initial=0.0)) or 1.0
    single = np.divide(right, size, out=np.empty(right.shape, np.float32), casting="same_kind")
    return np.multiply(solve(single), size, dtype=float)


def eigenvalue_bound(
    multiplied: Callable[[np.ndarray, np.ndarray], np.ndarray], size: int, steps: int = 10
) -> np.float32:
    """A bound of the eigenvalues of a symmetric A, given A x + y for x and y (n,), in single.

    Lanczos' iteration approaches the largest one from below: a margin is added.
    """
    from scipy.linalg import eigh_tridiagonal

    vector: np.ndarray = np.random.default_rng(0).uniform(-1, 1, size).astype(np.float32)
    vector /= np.float32(np.sqrt(_inner(vector, vector)))
    previous = np.zeros_like(vector)
    diagonal, beside = [], [np.float32(0)]
    for _ in range(steps):
        image = multiplied(vector, -beside[-1] * previous)
        diagonal.append(np.float32(_inner(vector, image)))
        image -= diagonal[-1] * vector
        beside.append(np.float32(np.sqrt(_inner(image, image))))
        if beside[-1] < 1e-5:
            break
        previous, vector = vector, image / beside[-1]
    found = eigh_tridiagonal(diagonal, beside[1 : len(diagonal)], eigvals_only=True)
    return np.float32(_SAFETY * found[-1])


def product(x: np.ndarray, y: np.ndarray) -> float:
    """The scalar product of two vectors (n,) in double precision."""
    return float(_summed(_multiply, 1, x, y)[0])


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
def _dot(low, high, x, y):  # type: ignore[no-untyped-def]
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
        found[part, 0] = _dot(low, high, x, y)


@compiled
def _advance(  # type: ignore[no-untyped-def]
    first, last, size, solution, residual, direction, image, step, found
):  # fmt: skip
    for part in range(first, last):
        low, high = part * size, min((part + 1) * size, len(solution))
        for i in range(low, high):
            solution[i] += step * direction[i]
            residual[i] -= step * image[i]
        found[part, 0] = _dot(low, high, residual, residual)


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
