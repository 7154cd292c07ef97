"""Linear complementarity: x ≥ 0, W x + q ≥ 0, xᵀ (W x + q) = 0, W positive semidefinite.

These are the conditions of the least of ½ xᵀ W x + qᵀ x over x ≥ 0. An active set of free
unknowns grows where W x + q is negative, and shrinks where an unknown of the free minimum would be
negative: the step then ends at the first unknown that becomes zero. The function falls in every
step and no set comes twice, so the method ends. Source: Lawson, Hanson, Solving Least Squares
Problems, §23.3 (there for W = AᵀA).
"""

import numpy as np

from .errors import SolveError

# Added to the scaled diagonal of one: motions that nothing resists stay finite. The next ones serve
# where W as given is not semidefinite.
_SHIFTS = 1e-13, 1e-11, 1e-9
# Negative entries of W x + q above this share of their terms are round-off.
_ROUND_OFF = 1e-12


def complementary(matrix: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The unknowns x (k,) for W = `matrix` (k, k), symmetric, and q = `force` (k,).

    Raises SolveError where W is not positive semidefinite. With x = (1, 0), W x + q = (0, 1) here:

    >>> complementary(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-2.0, 0.0])).round(9)
    array([1., 0.])
    """
    scale = 1 / np.sqrt(np.diag(matrix))
    matrix = (matrix + matrix.T) / 2 * np.outer(scale, scale)
    for shift in _SHIFTS:
        try:
            return scale * _least(matrix + shift * np.eye(len(force)), force * scale)
        except np.linalg.LinAlgError:
            continue
    raise SolveError("the stiffness that the gaps see is not positive semidefinite")


def _least(matrix: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Where ½ xᵀ W x + qᵀ x is least, W positive definite with a diagonal of one."""
    x, free = np.zeros(len(force)), np.zeros(len(force), dtype=bool)
    for _ in range(10 * len(force) + 10):
        slope = matrix @ x + force
        size = np.abs(matrix) @ x + np.abs(force)
        falls = ~free & (slope < -_ROUND_OFF * size)
        if not falls.any():
            break
        # All at once if the function falls by that, else the steepest alone, which never fails.
        moved, kept = _free_minimum(matrix, force, x, free | falls)
        if not _value(matrix, force, moved) < _value(matrix, force, x):
            worst = np.arange(len(x)) == np.where(falls, slope, 0.0).argmin()
            moved, kept = _free_minimum(matrix, force, x, free | worst)
            if not _value(matrix, force, moved) < _value(matrix, force, x):
                break
        x, free = moved, kept
    return x


def _value(matrix: np.ndarray, force: np.ndarray, x: np.ndarray) -> float:
    return float(x @ (matrix @ x) / 2 + force @ x)


def _free_minimum(
    matrix: np.ndarray, force: np.ndarray, x: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """From x (k,) ≥ 0 to the minimum over unknowns that stay `free` (k,); both at the end."""
    from scipy.linalg import cho_factor, cho_solve

    x, free = x.copy(), free.copy()
    while free.any():
        target = np.zeros(len(x))
        block = matrix[np.ix_(free, free)]
        target[free] = cho_solve(cho_factor(block), -force[free])
        blocked = free & (target <= 0)
        if not blocked.any():
            return target, free
        step = x[blocked] / (x[blocked] - target[blocked] + np.finfo(float).tiny)
        x += step.min() * (target - x)
        free[np.flatnonzero(blocked)[step <= step.min()]] = False
        x[~free] = 0.0
    return x, free
