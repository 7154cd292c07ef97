"""Unknowns along contact frames: with friction one node of each macro-element moves along n and t.

Each row of the gap and of the slip then has an unknown of its own, and condensation works as
without friction. On a surface along the axes the unknowns are so already, and nothing changes.
"""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from ...lac.operator import GapOperator, without_round_off
from ...mechanics.fem.supports import FreeMotion
from .cut_groups import CutZone

# Coefficients below this share of the largest of a macro-element's node are round-off.
_ROUND_OFF = 1e-13


def with_contact_frames(
    free: FreeMotion, operators: Sequence[GapOperator], zones: Sequence[CutZone]
) -> FreeMotion:
    """The free motion with unknowns turned where rows of gap and slip share those of a node.

    The frame of a node is the factor Q of its coefficients C = L Qᵀ: row by row, each direction of
    the gap and of the slips adds one unknown.
    """
    frictional = [operator for operator in operators if operator.slip]
    dim = len(frictional[0].slip) + 1
    slave = np.zeros(free.basis.shape[0] // dim, dtype=bool)
    for faces in (faces for zone in zones for faces in zone.sub_faces):
        slave[faces.nodes] = True
    seen = sum(_columns(operator, dim) for operator in operators)
    alone = (seen == 1) & slave & _whole(free, dim)
    turned, frames = [], []
    for operator in frictional:
        nodes, coefficients = _own(operator, alone)
        size = np.abs(coefficients)
        there = size > _ROUND_OFF * size.max(axis=(1, 2), keepdims=True)
        several = (there.sum(axis=2) > 1).any(axis=1)
        turned.append(nodes[several])
        frames.append(_orthonormal(coefficients[several]))
    nodes = np.concatenate(turned)
    if not len(nodes):
        return free
    dofs = dim * nodes[:, None] + np.arange(dim)
    unknowns = free.basis.indices[free.basis.indptr[dofs]]
    rotation = _rotation(free.basis.shape[1], unknowns, np.concatenate(frames))
    return FreeMotion((free.basis @ rotation).tocsr(), free.offset, None)


def _orthonormal(rows: np.ndarray) -> np.ndarray:
    """Directions (m, dim, dim), in columns, of which the first k span the first k `rows`."""
    return np.asarray(np.linalg.qr(np.swapaxes(rows, 1, 2))[0])


def _columns(operator: GapOperator, dim: int) -> np.ndarray:
    """How many macro-elements see each node (n,)."""
    there = without_round_off(operator.matrix).tocoo()
    shape = (there.shape[0], there.shape[1] // dim)
    pairs = sparse.csr_matrix((np.ones(there.nnz), (there.row, there.col // dim)), shape=shape)
    return np.bincount(pairs.indices, minlength=shape[1])


def _whole(free: FreeMotion, dim: int) -> np.ndarray:
    """Which nodes (n,) have all of their degrees of freedom as unknowns."""
    basis = free.basis
    single = np.diff(basis.indptr) == 1
    used = np.diff(basis.tocsc().indptr)
    single[single] = used[basis.indices[basis.indptr[:-1][single]]] == 1
    return single.reshape(-1, dim).all(axis=1)


def _own(operator: GapOperator, alone: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (m,), and the coefficients (m, dim, dim) of the rows of gap and slip there.

    One for each macro-element that has nodes `alone` (n,): that with the largest coefficient.
    """
    dim = len(operator.slip) + 1
    entries = abs(operator.matrix).tocoo()
    node = entries.col // dim
    kept = alone[node]
    if not kept.any():  # the surfaces do not meet, which is refused later
        return np.empty(0, dtype=int), np.empty((0, dim, dim))
    order = np.flatnonzero(kept)[np.lexsort((entries.data[kept], entries.row[kept]))]
    row = entries.row[order]
    best = order[np.flatnonzero(np.diff(row, append=operator.matrix.shape[0]))]
    row, node = entries.row[best], node[best]
    rows = [matrix.tocsr() for matrix in (operator.matrix, *operator.slip)]
    dofs = dim * node[:, None] + np.arange(dim)
    places = row.repeat(dim), dofs.ravel()
    values = [np.asarray(matrix[places]).reshape(dofs.shape) for matrix in rows]
    return node, np.stack(values, axis=1)


def _rotation(size: int, unknowns: np.ndarray, frames: np.ndarray) -> sparse.csr_matrix:
    """The turn (n, n) of unknowns (m, dim) into frames (m, dim, dim), by column."""
    rows = np.repeat(unknowns, unknowns.shape[1], axis=1).ravel()
    columns = np.tile(unknowns, (1, unknowns.shape[1])).ravel()
    others = np.setdiff1d(np.arange(size), unknowns)
    entries = np.concatenate([frames.ravel(), np.ones(len(others))])
    places = np.concatenate([rows, others]), np.concatenate([columns, others])
    return sparse.csr_matrix((entries, places), shape=(size, size))
