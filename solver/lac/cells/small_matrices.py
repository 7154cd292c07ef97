"""Small dense linear algebra on stacks of matrices."""

import numpy as np


def invert(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Determinants (...) and inverses (..., d, d) of 1×1, 2×2 or 3×3 matrices, by cofactors.

    Entries are infinite or NaN where the determinant is zero; the caller looks at it.
    """
    d = matrix.shape[-1]
    m = np.moveaxis(matrix, (-2, -1), (0, 1))
    if d == 1:
        determinant, adjugate = m[0, 0], np.ones_like(m)
    elif d == 2:
        (a, b), (c, e) = m
        determinant = a * e - b * c
        adjugate = np.stack([np.stack([e, -b]), np.stack([-c, a])])
    else:
        one, two = [1, 2, 0], [2, 0, 1]  # the next row or column, and the one after it
        cofactor = m[one][:, one] * m[two][:, two] - m[one][:, two] * m[two][:, one]
        determinant = np.einsum("i...,i...->...", m[0], cofactor[0])
        adjugate = cofactor.swapaxes(0, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return determinant, np.moveaxis(adjugate / determinant, (0, 1), (-2, -1))
