"""Which slave sub-faces and master faces may meet: a spatial search by enclosing balls."""

import numpy as np
from scipy.spatial import cKDTree


def candidate_pairs(
    slave_centre: np.ndarray,
    slave_radius: np.ndarray,
    master_centre: np.ndarray,
    master_radius: np.ndarray,
    reach: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (slave number, master number) whose balls come within `reach` of each other.

    Centres (n, dim), radii (n,), in units of length. Each side is sorted into classes of similar
    radius, so that a few large faces do not make every small one search far: the work stays
    near-linear in the number of faces also where one side is much finer.
    """
    found = [(np.empty(0, dtype=int), np.empty(0, dtype=int))]
    masters = [(members, cKDTree(master_centre[members])) for members in _classes(master_radius)]
    for slaves in _classes(slave_radius):
        tree = cKDTree(slave_centre[slaves])
        for members, master_tree in masters:
            distance = slave_radius[slaves].max() + master_radius[members].max() + reach
            near = tree.sparse_distance_matrix(master_tree, distance, output_type="ndarray")
            s, m = slaves[near["i"]], members[near["j"]]
            close = near["v"] <= slave_radius[s] + master_radius[m] + reach
            found.append((s[close], m[close]))
    slave, master = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((master, slave))
    return slave[order], master[order]


def _classes(radius: np.ndarray) -> list[np.ndarray]:
    """Members of each class of radii within a factor of two."""
    if not len(radius):
        return []
    size = np.floor(np.log2(np.maximum(radius, np.finfo(float).tiny))).astype(int)
    return [np.flatnonzero(size == k) for k in np.unique(size)]
