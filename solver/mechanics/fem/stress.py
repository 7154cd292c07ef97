"""Stress as six components xx, yy, zz, xy, yz, xz, seen along directions."""

import numpy as np

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")


def traction(stress: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """σ·v (n, dim) of stress (n, 6) and vectors (n, dim)."""
    xx, yy, zz, xy, yz, xz = stress.T
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    dim = vector.shape[-1]
    return np.einsum("ijn,nj->ni", tensor[:dim, :dim], vector)


def normal_stress(stress: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """d·σ·d (n,) of stress (n, 6) and unit directions (dim,) or (n, dim)."""
    direction = np.broadcast_to(direction, (len(stress), direction.shape[-1]))
    return np.einsum("ni,ni->n", traction(stress, direction), direction)
