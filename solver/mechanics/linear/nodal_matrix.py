"""A stiffness matrix in blocks of nodes, of which some degrees of freedom are free.

An index for each pair of nodes takes a ninth of the memory of one for each entry, and a product
with blocks takes less time.
"""

from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ..fem.assembly import selected
from .products import chosen_rows, multiply, pattern, scale_blocks


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
        near = pattern(self.blocks)
        count = np.bincount(self.free // self.blocks.blocksize[0], minlength=near.shape[0])
        beside = near @ count.astype(np.float32)
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
        return chosen_rows(self.blocks, self.free[rows])[:, self.free]

    def scaled(self, scale: np.ndarray) -> bsr_matrix:
        """Its blocks in single precision, scaled on both sides by `scale` (n,), held rows zero."""
        whole, data = self._on_all(scale), np.empty(self.blocks.data.shape, dtype=np.float32)
        scale_blocks(self.blocks, whole, whole, data)
        arrays = data, self.blocks.indices, self.blocks.indptr
        return bsr_matrix(arrays, shape=self.blocks.shape)

    def diagonal(self) -> np.ndarray:
        """Its diagonal (n,)."""
        return np.asarray(self.blocks.diagonal()[self.free], dtype=float)

    def tocsr(self) -> csr_matrix:
        """All of it, entry by entry."""
        return selected(self.blocks, self.free)
