"""A stiffness matrix in blocks of nodes, of which some degrees of freedom are free.

An index for each pair of nodes takes a ninth of the memory of one for each entry, and a product
with blocks takes less time.
"""

from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ..fem.assembly import selected
from .products import in_pieces, multiply


class NodalMatrix:
    """The rows and columns `free` (n,), ascending, of `blocks` (n_dofs, n_dofs), symmetric.

    `blocks` have an edge of dim, their columns are sorted; those of held degrees of freedom stay.
    """

    def __init__(self, blocks: bsr_matrix, free: np.ndarray):
        self.blocks, self.free = blocks, free
        self.shape = len(free), len(free)

    @property
    def nnz(self) -> int:
        """How many entries of the blocks are between free degrees of freedom."""
        dim = self.blocks.blocksize[0]
        count = np.bincount(self.free // dim, minlength=self.blocks.shape[0] // dim)
        ones = np.ones(len(self.blocks.indices), dtype=np.float32)
        arrays = ones, self.blocks.indices, self.blocks.indptr
        beside = csr_matrix(arrays, shape=(len(count),) * 2) @ count.astype(np.float32)
        return int(count @ beside.astype(int))

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """The product with x (n,) or its columns (n, k)."""
        if x.ndim > 1:
            return np.stack([self @ column for column in x.T], axis=1)
        # In double precision, whatever that of the blocks.
        return multiply(self.blocks, self._on_all(x), np.zeros(self.blocks.shape[0]))[self.free]

    def _on_all(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) on all degrees of freedom, zero on held ones."""
        whole = np.zeros(self.blocks.shape[0], dtype=values.dtype)
        whole[self.free] = values
        return whole

    def __getitem__(self, rows: Any) -> csr_matrix:
        """Some of its rows, by mask, slice or numbers."""
        dim, chosen = self.blocks.blocksize[0], self.free[rows]
        nodes, local = np.unique(chosen // dim, return_inverse=True)
        starts = self.blocks.indptr[nodes]
        counts = self.blocks.indptr[nodes + 1] - starts
        ends = np.concatenate([[0], np.cumsum(counts)])
        entries = np.repeat(starts - ends[:-1], counts) + np.arange(ends[-1])
        arrays = self.blocks.data[entries], self.blocks.indices[entries], ends
        some = bsr_matrix(arrays, shape=(dim * len(nodes), self.blocks.shape[1]))
        return some.tocsr()[dim * local + chosen % dim][:, self.free]

    def scaled(self, scale: np.ndarray) -> bsr_matrix:
        """Its blocks in single precision, scaled on both sides by `scale` (n,), held rows zero."""
        by_node = self._on_all(scale).reshape(-1, self.blocks.blocksize[0])
        data = np.empty(self.blocks.data.shape, dtype=np.float32)

        def fill(first: int, last: int) -> None:
            some = slice(*self.blocks.indptr[[first, last]])
            counts = np.diff(self.blocks.indptr[first : last + 1])
            values = self.blocks.data[some] * by_node[self.blocks.indices[some], None, :]
            values *= np.repeat(by_node[first:last], counts, axis=0)[:, :, None]
            data[some] = values

        in_pieces(fill, self.blocks)
        arrays = data, self.blocks.indices, self.blocks.indptr
        return bsr_matrix(arrays, shape=self.blocks.shape)

    def diagonal(self) -> np.ndarray:
        """Its diagonal (n,)."""
        return np.asarray(self.blocks.diagonal()[self.free], dtype=float)

    def tocsr(self) -> csr_matrix:
        """All of it, entry by entry."""
        return selected(self.blocks, self.free)
