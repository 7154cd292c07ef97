"""Quadratic cells as linear ones on the same vertices: interpolation of the other nodes.

Where cells are slender, nodes in the middle of long edges stay beside the vertices. An error that
alternates along such an edge and is smooth along the short ones has little energy: no smoother of
single nodes reduces it, and linear cells do not have it.
"""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from .block import Block

# Half-edges at a node differ by more than this where cells are slender. Between 3 and 5 the
# iterations differ by a tenth.
_LONG = 3.5


def from_vertices(
    points: np.ndarray, blocks: Sequence[Block]
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Which nodes (n_nodes,) stay, and all nodes (n_nodes, n_nodes) as means of these.

    Of `points` (n_nodes, dim). Vertices stay, and nodes `_LONG` times further from their vertices
    than the nearest node from one of these.

    >>> from ...mesh.catalogue import BY_NAME
    >>> kind = BY_NAME["TRIA6"]
    >>> cell = Block(kind, np.arange(6)[None], np.ones(1), np.ones(1))
    >>> from_vertices(kind.nodes, [cell])[1].toarray()[3:, :3].tolist()
    [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]]
    >>> from_vertices(kind.nodes * [1, 9], [cell])[0].tolist()  # x is short
    [True, True, True, False, True, True]
    """
    vertex, means = _means_of_vertices(len(points), blocks)
    own = means.tocoo()
    row, column = own.row[~vertex[own.row]], own.col[~vertex[own.row]]
    distance = np.linalg.norm(points[row] - points[column], axis=1)
    short = np.full(len(points), np.inf)  # from a vertex, later from those of a node
    np.minimum.at(short, column, distance)
    np.minimum.at(short, row, short[column])
    stays = vertex.copy()
    stays[row[distance > _LONG * short[row]]] = True
    rest = sparse.diags((vertex | ~stays).astype(float))
    return stays, (rest @ means + sparse.diags((stays & ~vertex).astype(float))).tocsr()


def _means_of_vertices(
    n_nodes: int, blocks: Sequence[Block]
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Which nodes (n_nodes,) are vertices, and all nodes (n_nodes, n_nodes) as means of these."""
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
    basis: sparse.csr_matrix, dim: int, stays: np.ndarray, means: sparse.csr_matrix
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """The free unknowns (m,) of nodes that stay, and the interpolation (n_free, m) from these.

    `basis` (dim · n_nodes, n_free) has orthonormal columns; `stays`, `means`: see `from_vertices`.
    """
    vertices = np.flatnonzero(abs(basis).T @ np.repeat(stays, dim).astype(float))
    means = sparse.kron(means, sparse.identity(dim), format="csr")
    return vertices, (basis.T @ (means @ basis[:, vertices])).tocsr()
