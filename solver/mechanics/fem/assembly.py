"""Sums of cell matrices, each entry written straight to its place in the sparse sum.

Which nodes share a cell is known before any matrix is. So the sum's pattern is made first, and no
list of all the entries of all cells is ever held: memory is for the sum and a few cells only.
Every degree of freedom belongs to a node (`dof = dim · node + component`).
"""

from collections.abc import Sequence

import numpy as np
from scipy import sparse


class CellSum:
    """A sum of matrices over cells, of all degrees of freedom or of those `kept` (k,), ascending.

    `cells`: the nodes (n, n_nodes) of all cells that will be added, by type. `diagonal`
    (dim · n_nodes,) is that of all degrees of freedom, kept or not.
    """

    def __init__(
        self, cells: Sequence[np.ndarray], n_nodes: int, dim: int, kept: np.ndarray | None = None
    ):
        chosen = np.full(n_nodes * dim, kept is None)
        chosen[slice(0) if kept is None else kept] = True
        self._dim, self._chosen = dim, chosen.reshape(n_nodes, dim)
        count = self._chosen.sum(axis=1, dtype=np.int32)
        self._near = _neighbours(cells, n_nodes)
        # Where the columns of each neighbour begin among those of all neighbours of all nodes.
        begin = np.concatenate([[0], np.cumsum(count[self._near.indices])])
        self._pattern = _rows(self._near, count, begin)
        within = np.repeat(begin[self._near.indptr[:-1]], np.diff(self._near.indptr))
        self._near.data = begin[:-1] - within
        # The start of each degree of freedom's row, and its place among those kept of its node.
        number = np.maximum(np.cumsum(chosen) - 1, 0)
        self._start = self._pattern.indptr[number].reshape(n_nodes, dim)
        self._rank = np.cumsum(self._chosen, axis=1) - 1
        # What is not kept is added up behind the end.
        self._data = np.zeros(self._pattern.indptr[-1] + 1)
        self.diagonal = np.zeros(n_nodes * dim)

    def add(self, cells: np.ndarray, matrices: np.ndarray) -> None:
        """Add cell matrices (n, dim · n_nodes, dim · n_nodes) of cells (n, n_nodes)."""
        n, k = cells.shape
        pairs = np.repeat(cells, k, axis=1).ravel(), np.tile(cells, k).ravel()
        offset = np.asarray(self._near[pairs]).reshape(n, k, 1, k, 1)
        place = self._start[cells][..., None, None] + offset
        place = place + self._rank[cells][:, None, None]
        chosen = self._chosen[cells]
        if not chosen.all():
            both = chosen[..., None, None] & chosen[:, None, None]
            place = np.where(both, place, len(self._data) - 1)
        np.add.at(self._data, place.ravel(), matrices.ravel())
        dofs = degrees_of_freedom(cells, self._dim)
        np.add.at(self.diagonal, dofs.ravel(), matrices.diagonal(axis1=1, axis2=2).ravel())

    @property
    def matrix(self) -> sparse.csr_matrix:
        """The sum (k, k), both halves stored, rows sorted; further sums are seen in it."""
        arrays = self._data[:-1], self._pattern.indices, self._pattern.indptr
        return sparse.csr_matrix(arrays, shape=self._pattern.shape)


def degrees_of_freedom(cells: np.ndarray, dim: int) -> np.ndarray:
    """Degrees of freedom (n, dim · n_nodes) of cells (n, n_nodes)."""
    return (dim * cells[:, :, None] + np.arange(dim)).reshape(len(cells), -1)


def _neighbours(cells: Sequence[np.ndarray], n_nodes: int) -> sparse.csr_matrix:
    """Which nodes share a cell (n_nodes, n_nodes), rows sorted."""
    nodes = np.concatenate([np.empty(0, dtype=int), *(c.ravel() for c in cells)])
    sizes = np.repeat([c.shape[1] for c in cells], [len(c) for c in cells])
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    ones = np.ones(len(nodes), dtype=bool)
    owned = sparse.csr_matrix((ones, nodes, starts), shape=(len(sizes), n_nodes))
    near = (owned.T.tocsr() @ owned).tocsr()
    near.sort_indices()
    return near


def _rows(near: sparse.csr_matrix, count: np.ndarray, begin: np.ndarray) -> sparse.csr_matrix:
    """The pattern of the rows of all kept degrees of freedom, `count` (n_nodes,) to a node."""
    first = np.cumsum(count) - count
    columns = np.repeat(first[near.indices] - begin[:-1], count[near.indices])
    columns = (columns + np.arange(begin[-1])).astype(np.int32)
    nothing = np.zeros(len(columns), dtype=np.int8)
    shape = (len(count), int(count.sum()))
    of_node = sparse.csr_matrix((nothing, columns, begin[near.indptr]), shape=shape)
    return of_node[np.repeat(np.arange(len(count)), count)]
