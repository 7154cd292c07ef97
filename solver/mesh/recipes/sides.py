"""The sides of a block and their groups."""

import numpy as np


def side_name(block: str, corners: np.ndarray) -> str:
    """Group of the side of the unit square or cube on which the corners (n, dim) lie.

    `block` is `bottom` (interface at height 1) or `top` (interface at height 0). Empty where the
    corners lie on no side.
    """
    dim = corners.shape[1]
    for axis in range(dim):
        height = corners[0, axis]
        if height not in (0, 1) or np.ptp(corners[:, axis]) > 0:
            continue
        if axis < dim - 1:
            return f"{'sym' if height == 0 else 'far'}{'xy'[axis]}"
        if (height == 0) == (block == "top"):
            return f"{block}_contact"
        return "base" if block == "bottom" else "press"
    return ""
