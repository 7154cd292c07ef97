"""A stiffness matrix in blocks of nodes, of which some degrees of freedom are free.

An index for each pair of nodes takes a ninth of the memory of one for each entry, and a product
with blocks takes less time.
"""

from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ..fem.assembly import selected
from .krylov import by_columns
from .products import scale_blocks
from .symmetric_blocks import SymmetricBlocks, halved


class NodalMatrix:
    """The rows and columns `free` (n,), ascending, of `blocks` (n_dofs, n_dofs), symmetric.

    `blocks` have an edge of dim, their columns are sorted; those of held degrees of freedom stay.
    Where the blocks have been scaled in place by `scaled`, `scale` (n,) says how, and every
    operation divides by it: the matrix is still the one given, up to single precision.
    """

    def __init__(self, blocks: bsr_matrix, free: np.ndarray):
        self.blocks, self.free = SymmetricBlocks(blocks), free
        self.shape = len(free), len(free)
        self.scale: np.ndarray | None = None

    @property
    def single(self) -> bool:
        """Whether the blocks are stored in single precision."""
        return bool(self.blocks.dtype == np.float32)

    @property
    def nnz(self) -> int:
        """How many entries of the blocks are between free degrees of freedom."""
        edge = self.blocks.blocksize
        count = np.bincount(self.free // edge, minlength=self.blocks.shape[0] // edge)
        beside = self.blocks.times_pattern(count.astype(np.float32))
        return int(count @ beside.astype(int))

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """The product with x (n,) or its columns (n, k)."""
        if x.ndim > 1:
            return by_columns(self.__matmul__, x)
        x = x if self.scale is None else x / self.scale
        # In double precision, whatever that of the blocks.
        found = self.blocks.multiply(self._on_all(np.asarray(x, dtype=float)))[self.free]
        return found if self.scale is None else found / self.scale

    def _on_all(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) on all degrees of freedom, zero on held ones."""
        whole = np.zeros(self.blocks.shape[0], dtype=values.dtype)
        whole[self.free] = values
        return whole

    def __getitem__(self, rows: Any) -> csr_matrix:
        """Some of its rows, by mask, slice or numbers."""
        chosen = self.blocks.chosen_rows(self.free[rows])[:, self.free]
        return chosen if self.scale is None else _unscaled(chosen, self.scale[rows], self.scale)

    def scaled(self, scale: np.ndarray) -> bsr_matrix:
        """Its blocks in single precision, scaled on both sides by `scale` (n,), held rows zero.

        Blocks in single precision are scaled in place: no second copy of them is made. What the
        caller scales in them further goes to `now_scaled`.
        """
        factor = scale if self.scale is None else scale / self.scale
        blocks = self.blocks.tobsr()
        data = blocks.data
        if self.single:
            self.scale, self.blocks = scale, SymmetricBlocks(blocks)
        else:
            data = np.empty(data.shape, dtype=np.float32)
        whole = self._on_all(factor)
        scale_blocks(blocks, whole, whole, data)
        return bsr_matrix((data, blocks.indices, blocks.indptr), shape=blocks.shape)

    def now_scaled(self, scale: np.ndarray) -> None:
        """Take note that the blocks which `scaled` returned are now scaled by `scale` (n,) in all.

        The array is kept, not a copy.
        """
        if self.scale is not None:
            self.scale = scale

    def halve(self, scaled: SymmetricBlocks) -> None:
        """Keep one half, given the one of what `scaled` returned: itself, in single precision."""
        self.blocks = scaled if self.single else halved(self.blocks.tobsr())

    def diagonal(self) -> np.ndarray:
        """Its diagonal (n,)."""
        found = self.blocks.diagonal()[self.free].astype(float)
        return found if self.scale is None else found / self.scale**2

    def tocsr(self) -> csr_matrix:
        """All of it, entry by entry."""
        found = selected(self.blocks.tobsr(), self.free)
        return found if self.scale is None else _unscaled(found, self.scale, self.scale)


def _unscaled(matrix: csr_matrix, rows: np.ndarray, columns: np.ndarray) -> csr_matrix:
    """The matrix (r, n) with its rows divided by `rows` (r,), its columns by `columns` (n,)."""
    factors = np.repeat(1 / rows, np.diff(matrix.indptr)) / columns[matrix.indices]
    return csr_matrix((matrix.data * factors, matrix.indices, matrix.indptr), shape=matrix.shape)


Stiffness: TypeAlias = csr_matrix | NodalMatrix
