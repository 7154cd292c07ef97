"""Conjugate gradients in double precision around a preconditioner in single precision."""

import logging
from collections.abc import Callable
from typing import Any

import numpy as np

from ...lac.errors import SolveError
from ...lac.threads import prefetch
from ...system.compiled import worthwhile
from . import vectors

_LOG = logging.getLogger(__name__)
_ROWS = 1 << 16  # of vectors at once
_LOGGED = 10  # iterations from one line of the log to the next
_SAFETY = 1.05  # of a bound from below

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
    """Solve for the columns of `right` (n, k) at once; return the solution and the iterations.

    `accuracy` is residual over right-hand side, in 2-norms. Raises SolveError where `most`
    iterations do not reach it, or where one third (two thirds) of them reach less than one third
    (two thirds) of the digits. The flexible form (Golub and Ye, SIAM J. Sci. Comput. 21 (1999)
    1305): the preconditioner is rounded, so it is linear only to single precision. `watch` gets
    each number of iterations and the residual reached, and may change the preconditioner.
    """
    solution, residual = np.zeros_like(right), right.copy()
    start = np.sqrt(_total(lambda some: _dot(right[some], right[some]), len(right)))
    improved = precondition(residual)
    direction = improved.copy()
    energy = _total(lambda some: _dot(residual[some], improved[some]), len(right))
    iteration, reached = 0, float(start.any())
    while reached > accuracy:
        _give_up("conjugate gradients", iteration, reached, accuracy, most)
        left = _advance(solution, residual, direction, multiply(direction), energy)
        iteration += 1
        reached = float(_ratio(left, start).max())
        _log_progress("conjugate gradients", iteration, reached)
        watch(iteration, reached)
        if reached > accuracy:
            previous, improved = improved, precondition(residual)
            energy = _turn(direction, residual, improved, previous, energy)
    return solution, iteration


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


def _advance(
    solution: np.ndarray,
    residual: np.ndarray,
    direction: np.ndarray,
    image: np.ndarray,
    energy: np.ndarray,
) -> np.ndarray:
    """One step along a direction, in place; the norms (k,) of the residual."""
    if _compiled(solution):
        step = _ratio(energy, vectors.product(direction[:, 0], image[:, 0]))
        about = (each[:, 0] for each in (solution, residual, direction, image))
        return np.sqrt(vectors.advance(float(step[0]), *about))
    step = _ratio(energy, _total(lambda some: _dot(direction[some], image[some]), len(image)))

    def part(some: slice) -> np.ndarray:
        solution[some] += step * direction[some]
        residual[some] -= step * image[some]
        return _dot(residual[some], residual[some])

    return np.sqrt(_total(part, len(image)))


def _turn(
    direction: np.ndarray,
    residual: np.ndarray,
    improved: np.ndarray,
    previous: np.ndarray,
    energy: np.ndarray,
) -> np.ndarray:
    """The next direction, in place, and its energy (k,)."""
    if _compiled(direction):
        about = (each[:, 0] for each in (residual, improved, previous))
        change, following = vectors.products_of_change(*about)[:, None]
        vectors.turn(float(_ratio(change, energy)[0]), direction[:, 0], improved[:, 0])
        return following

    def part(some: slice) -> np.ndarray:
        change = improved[some] - previous[some]
        return np.stack([_dot(residual[some], change), _dot(residual[some], improved[some])])

    change, following = _total(part, len(residual))
    share = _ratio(change, energy)

    def turn(some: slice) -> None:
        direction[some] *= share
        direction[some] += improved[some]

    _in_parts(turn, len(direction))
    return following


def _compiled(columns: np.ndarray) -> bool:
    """Whether compiled loops serve: for a single column."""
    return columns.shape[1] == 1 and worthwhile(columns.size)


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The products (k,) of the columns of both."""
    return np.asarray(np.sum(one * other, axis=0))


def _total(found: Callable[[slice], Any], size: int) -> np.ndarray:
    """The sum of what is `found` for some rows at a time, few enough for the processor's cache.

    Threads find it; the sum is in the order of the rows.
    """
    return np.asarray(sum(_in_parts(found, size), 0.0))


def _in_parts(work: Callable[[slice], Any], size: int) -> list[Any]:
    """What `work` returns for some rows at a time, in their order; threads do it."""
    parts = (slice(first, first + _ROWS) for first in range(0, size, _ROWS))
    return list(prefetch(work, parts))


def by_columns(function: Operator, x: np.ndarray) -> np.ndarray:
    """What `function` makes of each column of x (n, k); a single one is not copied."""
    if x.shape[1] == 1:
        return function(x[:, 0])[:, None]
    return np.stack([function(np.ascontiguousarray(column)) for column in x.T], axis=1)


def in_single(solve: Operator) -> Operator:
    """A linear `solve` of float32 columns as one of float64 columns, each scaled to order one.

    Single precision has a small range of exponents.
    """

    def lifted(right: np.ndarray) -> np.ndarray:
        single, result = np.empty(right.shape, np.float32), np.empty_like(right)

        def largest(some: slice) -> np.ndarray:
            return np.maximum(right[some].max(axis=0), -right[some].min(axis=0))

        size = np.max(_in_parts(largest, len(right)), axis=0)
        size[size == 0] = 1.0

        def lower(some: slice) -> None:
            np.divide(right[some], size, out=single[some], casting="same_kind")

        _in_parts(lower, len(right))
        found = solve(single)
        _in_parts(lambda some: np.multiply(found[some], size, out=result[some]), len(right))
        return result

    return lifted


def _give_up(method: str, iteration: int, reached: float, accuracy: float, most: int) -> None:
    thirds = most // 3, 2 * most // 3, most
    if iteration in thirds and reached > accuracy ** (iteration / most):
        raise SolveError(f"{method} leave a residual of {reached:.0e} in {iteration} iterations")


def _log_progress(method: str, iteration: int, reached: float) -> None:
    if iteration % _LOGGED == 0:
        _LOG.info("%s: iteration %d, residual %.1e", method, iteration, reached)


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    # A column that is solved exactly has a denominator of zero.
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)


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
