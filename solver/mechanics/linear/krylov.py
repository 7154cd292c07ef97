"""Conjugate gradients in double precision around a preconditioner in single precision."""

import logging
from collections.abc import Callable

import numpy as np

from ...system.errors import SolveError

_LOG = logging.getLogger(__name__)
_TOLD = 10  # iterations from one line of the log to the next

Operator = Callable[[np.ndarray], np.ndarray]

EPSILON = float(np.finfo(float).eps)
ROUGH = 1e-9
"""Residual over right-hand side of a solution that will be refined."""


def conjugate_gradients(
    multiply: Operator, precondition: Operator, right: np.ndarray, accuracy: float, most: int
) -> tuple[np.ndarray, int]:
    """Solve for the columns of `right` (n, k) at once; return the solution and the iterations.

    `accuracy` is residual over right-hand side, in 2-norms. Raises SolveError where `most`
    iterations do not reach it, or where one third (two thirds) of them reach less than one third
    (two thirds) of the digits. The flexible form (Golub and Ye, SIAM J. Sci. Comput. 21 (1999)
    1305): the preconditioner is rounded, so it is linear only to single precision.
    """
    solution, residual = np.zeros_like(right), right.copy()
    start = np.linalg.norm(right, axis=0)
    improved = precondition(residual)
    direction = improved
    energy = np.sum(residual * improved, axis=0)
    iteration, reached = 0, float(start.any())
    thirds = most // 3, 2 * most // 3, most
    while reached > accuracy:
        if iteration in thirds and reached > accuracy ** (iteration / most):
            raise SolveError(
                f"conjugate gradients leave a residual of {reached:.0e} in {iteration} iterations"
            )
        image = multiply(direction)
        step = _ratio(energy, np.sum(direction * image, axis=0))
        solution += step * direction
        residual -= step * image
        iteration += 1
        reached = float(_ratio(np.linalg.norm(residual, axis=0), start).max())
        if iteration % _TOLD == 0:
            _LOG.info("conjugate gradients: iteration %d, residual %.1e", iteration, reached)
        if reached > accuracy:
            previous, improved = improved, precondition(residual)
            change = np.sum(residual * (improved - previous), axis=0)
            direction = improved + _ratio(change, energy) * direction
            energy = np.sum(residual * improved, axis=0)
    return solution, iteration


def in_single(solve: Operator) -> Operator:
    """A linear `solve` of float32 columns as one of float64 columns, each scaled to order one.

    Single precision has a small range of exponents.
    """

    def lifted(right: np.ndarray) -> np.ndarray:
        size = np.abs(right).max(axis=0)
        size[size == 0] = 1.0
        return solve((right / size).astype(np.float32)) * size

    return lifted


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    # A column that is solved exactly has a denominator of zero.
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
