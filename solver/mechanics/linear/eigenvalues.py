"""A bound of the eigenvalues of a symmetric matrix, by Lanczos' iteration in single precision."""

from collections.abc import Callable

import numpy as np

# The iteration approaches the largest eigenvalue from below.
_SAFETY = 1.05


def upper_bound(
    multiplied: Callable[[np.ndarray, np.ndarray], np.ndarray], size: int
) -> np.float32:
    """A bound of the eigenvalues of A, given A x + y for x and y (n,)."""
    return np.float32(_SAFETY * _largest_eigenvalue(multiplied, size))


def _largest_eigenvalue(
    multiplied: Callable[[np.ndarray, np.ndarray], np.ndarray], size: int, steps: int = 10
) -> float:
    """Largest eigenvalue by Lanczos' iteration, from below.

    No BLAS: its threads would keep a core busy for a while, idle as they are.
    """
    from scipy.linalg import eigh_tridiagonal

    vector: np.ndarray = np.random.default_rng(0).uniform(-1, 1, size).astype(np.float32)
    vector /= _norm(vector)
    previous = np.zeros_like(vector)
    diagonal, beside = [], [np.float32(0)]
    for _ in range(steps):
        image = multiplied(vector, -beside[-1] * previous)
        diagonal.append(np.sum(vector * image))
        image -= diagonal[-1] * vector
        beside.append(_norm(image))
        if beside[-1] < 1e-5:
            break
        previous, vector = vector, image / beside[-1]
    return float(eigh_tridiagonal(diagonal, beside[1 : len(diagonal)], eigvals_only=True)[-1])


def _norm(vector: np.ndarray) -> np.float32:
    return np.float32(np.sqrt(np.sum(vector * vector)))
