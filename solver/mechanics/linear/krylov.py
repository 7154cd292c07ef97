"""Conjugate gradients in double precision around a preconditioner in single precision.

Vectors are worked on in this thread, and not by BLAS, whose sums depend on the threads.
"""

import logging
from collections.abc import Callable

import numpy as np

from ...lac.errors import SolveError

_LOG = logging.getLogger(__name__)
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
    """Solve for `right` (n,); return the solution and the iterations.

    `accuracy` is residual over right-hand side, in 2-norms. Raises SolveError where `most`
    iterations do not reach it, or where one third (two thirds) of them reach less than one third
    (two thirds) of the digits. The flexible form (Golub and Ye, SIAM J. Sci. Comput. 21 (1999)
    1305): the preconditioner is rounded, so it is linear only to single precision. `watch` gets
    each number of iterations and the residual reached, and may change the preconditioner.
    """
    solution, residual = np.zeros_like(right), right.copy()
    improved, step = precondition(residual), np.empty_like(right)
    direction = improved.copy()
    start, energy = _inner(right, right) ** 0.5, _inner(residual, improved)
    iteration, reached, thirds = 0, float(start != 0), (most // 3, 2 * most // 3, most)
    while reached > accuracy:
        if iteration in thirds and reached > accuracy ** (iteration / most):
            text = (
                f"conjugate gradients leave a residual of {reached:.0e} in {iteration} iterations"
            )
            raise SolveError(text)
        image = multiply(direction)
        length = _ratio(energy, _inner(direction, image))
        solution += np.multiply(direction, length, out=step)
        residual -= np.multiply(image, length, out=step)
        iteration += 1
        reached = _ratio(_inner(residual, residual) ** 0.5, start)
        if iteration % _LOGGED == 0:
            _LOG.info("conjugate gradients: iteration %d, residual %.1e", iteration, reached)
        watch(iteration, reached)
        if reached > accuracy:
            previous, improved = improved, precondition(residual)
            change = _inner(residual, np.subtract(improved, previous, out=step))
            direction *= _ratio(change, energy)
            direction += improved
            energy = _inner(residual, improved)
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
    """The scalar product of two vectors (n,), summed in double precision."""
    return float(np.einsum("i,i->", one, other, dtype=float))


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
