"""Small dense linear algebra on stacks of matrices."""

import numpy as np


def invert(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Determinants (...) and inverses (..., d, d) of 1×1, 2×2 or 3×3 matrices, by cofactors.

    Entries are infinite or NaN where the determinant is zero; the caller looks at it.
    """
    d = matrix.shape[-1]
    if d == 1:
        determinant, adjugate = matrix[..., 0, 0], np.ones_like(matrix)
    elif d == 2:
        (a, b), (c, e) = np.moveaxis(matrix, (-2, -1), (0, 1))
        determinant = a * e - b * c
        adjugate = np.stack([np.stack([e, -b], -1), np.stack([-c, a], -1)], -2)
    else:
        rows = np.moveaxis(matrix, -2, 0)
        columns = [np.cross(rows[i - 2], rows[i - 1]) for i in range(3)]
        determinant = np.einsum("...i,...i->...", rows[0], columns[0])
        adjugate = np.stack(columns, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return determinant, adjugate / determinant[..., None, None]
