"""Bodies seen by the unknowns of a system: their nodes, and which of them contact joins."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components


def nodes_of_unknowns(basis: sparse.csr_matrix, dim: int) -> np.ndarray:
    """The node (n_free,) of each free unknown, `dim` at most per node.

    `basis` (dim · n_nodes, n_free). The six motions of a rigid body belong to its first two nodes:

    >>> nodes_of_unknowns(sparse.csr_matrix(np.ones((12, 5))), 3).tolist()
    [0, 0, 0, 1, 1]
    """
    columns = basis.tocsc()
    start = columns.indptr[:-1]
    nodes = columns.indices[start] // dim
    order = np.argsort(nodes, kind="stable")
    rank = np.empty(len(nodes), dtype=int)
    rank[order] = np.arange(len(nodes)) - np.searchsorted(nodes[order], nodes[order])
    return columns.indices[start + dim * (rank // dim)] // dim


def joined_bodies(gaps: sparse.csr_matrix, bodies: np.ndarray, n_bodies: int) -> np.ndarray:
    """The group (n_bodies,) of each body: those joined by rows of `gaps` (k, n_free) share one.

    `bodies` (n_free,) of the unknowns. A body without free unknowns joins no others.
    """
    entries = gaps.tocoo()
    # Bodies first, then multipliers, as nodes of one graph.
    size = n_bodies + gaps.shape[0]
    joins = (np.ones(entries.nnz), (bodies[entries.col], n_bodies + entries.row))
    graph = sparse.coo_matrix(joins, shape=(size, size))
    return connected_components(graph, directed=False)[1][:n_bodies]
