"""Which macro-elements are neighbours: they share a vertex, and no kink parts them."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

SAME_SIDE = np.cos(np.radians(30)) + 1e-9
"""Normals across a kink lean by 30° or more: the pressure may jump there.

Meshes have kinks of exactly 30°: rounding does not decide.
"""


def vertex_neighbours(faces: Sequence[tuple[np.ndarray, np.ndarray]], m: int) -> sparse.csr_matrix:
    """Pairs (m, m) of macro-elements that share a vertex, each with itself too.

    `faces`, by block: macro-element (n,) and vertices (n, v).

    >>> vertex_neighbours([(np.arange(3), np.array([[0, 1], [1, 2], [2, 3]]))], 3).toarray()
    array([[ True,  True, False],
           [ True,  True,  True],
           [False,  True,  True]])
    """
    owner = np.concatenate([np.repeat(n, v.shape[1]) for n, v in faces])
    vertex = np.concatenate([v.ravel() for _, v in faces])
    ones = np.ones(len(owner))
    touches = sparse.csr_matrix((ones, (owner, vertex)), shape=(m, int(vertex.max()) + 1))
    return (touches @ touches.T).astype(bool).tocsr()
