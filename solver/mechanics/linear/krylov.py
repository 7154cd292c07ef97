"""Conjugate gradients in double precision around a preconditioner in single precision."""

import logging
from collections.abc import Callable

import numpy as np

from ...system.errors import SolveError

_LOG = logging.getLogger(__name__)
_TOLD = 10  # iterations from one line of the log to the next
_KEPT = 10  # directions of conjugate residuals; 40 save a tenth of the iterations, all no more

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
    while reached > accuracy:
        _give_up("conjugate gradients", iteration, reached, accuracy, most)
        image = multiply(direction)
        step = _ratio(energy, np.sum(direction * image, axis=0))
        solution += step * direction
        residual -= step * image
        iteration += 1
        reached = float(_ratio(np.linalg.norm(residual, axis=0), start).max())
        _tell("conjugate gradients", iteration, reached)
        if reached > accuracy:
            previous, improved = improved, precondition(residual)
            change = np.sum(residual * (improved - previous), axis=0)
            direction = improved + _ratio(change, energy) * direction
            energy = np.sum(residual * improved, axis=0)
    return solution, iteration


def conjugate_residuals(
    multiply: Operator,
    precondition: Operator,
    right: np.ndarray,
    measure: Callable[[np.ndarray], float],
    accuracy: float,
    most: int,
) -> tuple[np.ndarray, int]:
    """Solve for one `right` (n,), with any regular matrix; return the solution and the iterations.

    Until the `measure` of the residual is `accuracy` times the first one; raises SolveError as
    `conjugate_gradients`. Each residual is the smallest over the latest directions (Eisenstat,
    Elman and Schultz, SIAM J. Numer. Anal. 20 (1983) 345: Orthomin). The preconditioner need not be
    linear, nor symmetric.
    """
    solution, residual = np.zeros_like(right), right.copy()
    directions = np.zeros((_KEPT, len(right)))
    images = np.zeros_like(directions)
    start = measure(residual)
    iteration, reached = 0, float(start != 0)
    while reached > accuracy:
        _give_up("conjugate residuals", iteration, reached, accuracy, most)
        direction = precondition(residual)
        image = multiply(direction)
        # No BLAS, whose sums depend on the number of threads.
        shares = np.einsum("kn,n->k", images, image)
        image -= np.einsum("k,kn->n", shares, images)
        direction -= np.einsum("k,kn->n", shares, directions)
        size = float(np.sqrt(np.sum(image * image)))
        if not size:
            raise SolveError(f"conjugate residuals break down after {iteration} iterations")
        place = iteration % _KEPT
        np.divide(image, size, out=images[place])
        np.divide(direction, size, out=directions[place])
        step = np.sum(residual * images[place])
        solution += step * directions[place]
        residual -= step * images[place]
        iteration += 1
        reached = measure(residual) / start
        _tell("conjugate residuals", iteration, reached)
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


def _give_up(method: str, iteration: int, reached: float, accuracy: float, most: int) -> None:
    thirds = most // 3, 2 * most // 3, most
    if iteration in thirds and reached > accuracy ** (iteration / most):
        raise SolveError(f"{method} leave a residual of {reached:.0e} in {iteration} iterations")


def _tell(method: str, iteration: int, reached: float) -> None:
    if iteration % _TOLD == 0:
        _LOG.info("%s: iteration %d, residual %.1e", method, iteration, reached)


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    # A column that is solved exactly has a denominator of zero.
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
