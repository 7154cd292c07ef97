"""Quadratic cells as linear ones on the same vertices: interpolation of the other nodes."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from .elasticity import Block


def from_vertices(n_nodes: int, blocks: Sequence[Block]) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Which nodes (n_nodes,) are vertices, and all nodes (n_nodes, n_nodes) as means of these.

    >>> from ...mesh.catalogue import BY_NAME
    >>> line = Block(BY_NAME["TRIA6"], np.arange(6)[None], np.ones(1), np.ones(1))
    >>> from_vertices(6, [line])[1].toarray()[3:, :3].tolist()
    [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]]
    """
    vertex = np.zeros(n_nodes, dtype=bool)
    for block in blocks:
        vertex[block.cells[:, : block.type.n_vertices]] = True
    done, own = vertex.copy(), np.flatnonzero(vertex)
    rows, columns, weights = [own], [own], [np.ones(len(own))]
    for block in blocks:
        for local in range(block.type.n_vertices, block.type.n_nodes):
            owners = block.type.owners[local]
            nodes, cell = np.unique(block.cells[:, local], return_index=True)
            nodes, cell = nodes[~done[nodes]], cell[~done[nodes]]
            done[nodes] = True
            rows.append(np.repeat(nodes, len(owners)))
            columns.append(block.cells[cell][:, owners].ravel())
            weights.append(np.full(len(nodes) * len(owners), 1 / len(owners)))
    where = np.concatenate(rows), np.concatenate(columns)
    return vertex, sparse.csr_matrix((np.concatenate(weights), where), shape=(n_nodes, n_nodes))


def linear_unknowns(
    basis: sparse.csr_matrix, dim: int, vertex: np.ndarray, means: sparse.csr_matrix
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """The free unknowns (m,) of vertices, and the interpolation (n_free, m) from these to all.

    `basis` (dim · n_nodes, n_free) has orthonormal columns; `vertex`, `means`: see `from_vertices`.
    """
    vertices = np.flatnonzero(abs(basis).T @ np.repeat(vertex, dim).astype(float))
    means = sparse.kron(means, sparse.identity(dim), format="csr")
    return vertices, (basis.T @ (means @ basis[:, vertices])).tocsr()
