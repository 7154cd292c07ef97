"""Symmetric matrices in blocks, most pairs of rows and columns stored once: half the memory.

A product is as fast as memory is read, so half the blocks take about half the time.

The stiffness has blocks of nodes, of which some degrees of freedom are free. An index for each pair
of nodes takes a ninth of the memory of one for each entry, and a product with blocks takes less
time.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ...lac.threads import prefetch
from ...system.compiled import compiled
from ..fem.block import selected
from .products import chosen_rows, multiply, pattern, ranges, scale_blocks

_SLABS = 8  # the most threads that share a product


@dataclass(frozen=True)
class SymmetricBlocks:
    """A symmetric matrix W + U + Uᵀ of square blocks, (n, n).

    `upper` U: the blocks above the diagonal whose row and column are in the same slab of rows;
    `whole` W: all others. A thread writes the rows of its slab alone, and the matrix alone says
    what the slabs are: no sum depends on the number of threads. Without `upper` W is everything.
    """

    whole: bsr_matrix
    upper: bsr_matrix | None = None
    slabs: tuple[tuple[int, int], ...] = ()

    @property
    def shape(self) -> tuple[int, int]:
        """(n, n)."""
        return self.whole.shape

    @property
    def dtype(self) -> np.dtype:
        """The precision of the blocks."""
        return self.whole.dtype

    @property
    def blocksize(self) -> int:
        """The edge of a block."""
        return int(self.whole.blocksize[0])

    @property
    def parts(self) -> Iterator[bsr_matrix]:
        """W, and U if there is one."""
        yield self.whole
        if self.upper is not None:
            yield self.upper

    def multiply(
        self,
        x: np.ndarray,
        base: np.ndarray | None = None,
        factor: float = 1.0,
        share: float = 1.0,
        own: float = 0.0,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """`factor` · A x + `share` · `base` + `own` · x, for x and `base` (n,) of one precision.

        Computed in the precision of x. `out` (n,), if given, is neither x nor `base`.
        """
        if out is None:
            out = np.empty_like(x)
        numbers = tuple(x.dtype.type(c) for c in (factor, 0 if base is None else share, own))
        if self.upper is None:
            out[:] = numbers[2] * x if base is None else numbers[1] * base + numbers[2] * x
            return multiply(self.whole, x, out, factor, out)
        arrays = [a for part in self.parts for a in (part.indptr, part.indices, part.data)]
        vectors = x, x if base is None else base, out
        _on_slabs(_PRODUCTS[self.blocksize], self.slabs, *arrays, *vectors, *numbers)
        return out

    def chosen_rows(self, rows: np.ndarray) -> csr_matrix:
        """Some rows (r,), one by one."""
        found = chosen_rows(self.whole, rows)
        if self.upper is None:
            return found
        return (found + chosen_rows(self.upper, rows) + self._below(rows)).tocsr()

    def _below(self, rows: np.ndarray) -> csr_matrix:
        """Some rows (r,) of Uᵀ."""
        assert self.upper is not None
        edge, count = self.blocksize, len(self.upper.indptr) - 1
        chosen, local = np.unique(rows // edge, return_inverse=True)
        number = np.full(count, -1, dtype=np.int32)
        number[chosen] = np.arange(len(chosen))
        entries = np.flatnonzero(number[self.upper.indices] >= 0)
        row = number[self.upper.indices[entries]]
        order = np.argsort(row, kind="stable")
        column = np.searchsorted(self.upper.indptr, entries[order], side="right") - 1
        starts = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=len(chosen)))])
        arrays = self.upper.data[entries[order]].transpose(0, 2, 1), column, starts
        some = bsr_matrix(arrays, shape=(edge * len(chosen), self.shape[1]))
        return some.tocsr()[edge * local + rows % edge]

    def times_pattern(self, x: np.ndarray) -> np.ndarray:
        """The pattern of blocks, a one for each, times x (n / edge,)."""
        found = pattern(self.whole) @ x
        if self.upper is not None:
            near = pattern(self.upper)
            found = found + near @ x + near.T @ x
        return np.asarray(found)

    def diagonal(self) -> np.ndarray:
        """The diagonal (n,)."""
        return np.asarray(self.whole.diagonal())

    def tobsr(self) -> bsr_matrix:
        """All blocks, rows sorted."""
        if self.upper is None:
            return self.whole
        full = self.whole + self.upper + self.upper.T
        full.sort_indices()
        return full.tobsr((self.blocksize,) * 2)


def halved(matrix: bsr_matrix) -> SymmetricBlocks:
    """A symmetric `matrix`: its blocks below the diagonal are not read where one above serves.

    The blocks have an edge of three or six.
    """
    edge = matrix.blocksize[0]
    slabs = ranges(matrix.indptr, edge**2, _SLABS)
    counts = np.zeros((2, len(matrix.indptr)), dtype=matrix.indptr.dtype)
    starts, columns = matrix.indptr, matrix.indices
    _on_slabs(_count, slabs, starts, columns, counts)
    parts = []
    for own in np.cumsum(counts, axis=1, dtype=counts.dtype):
        data = np.empty((own[-1], edge, edge), dtype=matrix.dtype)
        parts.append((data, np.empty(own[-1], dtype=columns.dtype), own))
    _on_slabs(_part, slabs, starts, columns, matrix.data, *parts[0], *parts[1])
    whole, upper = (bsr_matrix(part, shape=matrix.shape) for part in parts)
    return SymmetricBlocks(whole, upper, tuple(slabs))


def _on_slabs(
    kernel: Callable[..., None], slabs: Iterable[tuple[int, int]], *about: object
) -> None:
    """Call a kernel for each slab of rows; threads do it."""
    for _ in prefetch(lambda some: kernel(*some, *about), slabs):
        pass


@compiled
def _count(first, last, starts, columns, counts):  # type: ignore[no-untyped-def]
    """How many blocks of each row of a slab go to W and to U, into the next row's `counts`."""
    for i in range(first, last):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            if j == i or j < first or j >= last:
                counts[0, i + 1] += 1
            elif j > i:
                counts[1, i + 1] += 1


@compiled
def _part(  # type: ignore[no-untyped-def]
    first, last, starts, columns, blocks,
    whole, w_columns, w_starts, upper, u_columns, u_starts,
):  # fmt: skip
    """Copy the blocks of a slab that go to W and to U."""
    edge = blocks.shape[1]
    for i in range(first, last):
        w, u = w_starts[i], u_starts[i]
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            if j == i or j < first or j >= last:
                w_columns[w] = j
                for r in range(edge):
                    for m in range(edge):
                        whole[w, r, m] = blocks[k, r, m]
                w += 1
            elif j > i:
                u_columns[u] = j
                for r in range(edge):
                    for m in range(edge):
                        upper[u, r, m] = blocks[k, r, m]
                u += 1


@compiled
def _product_of_three(  # type: ignore[no-untyped-def]
    first, last, w_starts, w_columns, whole, u_starts, u_columns, upper,
    x, base, out, factor, share, own,
):  # fmt: skip
    for i in range(3 * first, 3 * last):
        out[i] = 0
    for i in range(first, last):
        a = b = c = d = e = f = g = h = p = factor - factor
        for k in range(w_starts[i], w_starts[i + 1]):
            j = 3 * w_columns[k]
            u, v, w = x[j], x[j + 1], x[j + 2]
            a += whole[k, 0, 0] * u
            b += whole[k, 0, 1] * v
            c += whole[k, 0, 2] * w
            d += whole[k, 1, 0] * u
            e += whole[k, 1, 1] * v
            f += whole[k, 1, 2] * w
            g += whole[k, 2, 0] * u
            h += whole[k, 2, 1] * v
            p += whole[k, 2, 2] * w
        q = 3 * i
        r, s, t = x[q], x[q + 1], x[q + 2]
        for k in range(u_starts[i], u_starts[i + 1]):
            j = 3 * u_columns[k]
            u, v, w = x[j], x[j + 1], x[j + 2]
            a += upper[k, 0, 0] * u
            b += upper[k, 0, 1] * v
            c += upper[k, 0, 2] * w
            d += upper[k, 1, 0] * u
            e += upper[k, 1, 1] * v
            f += upper[k, 1, 2] * w
            g += upper[k, 2, 0] * u
            h += upper[k, 2, 1] * v
            p += upper[k, 2, 2] * w
            out[j] += upper[k, 0, 0] * r + upper[k, 1, 0] * s + upper[k, 2, 0] * t
            out[j + 1] += upper[k, 0, 1] * r + upper[k, 1, 1] * s + upper[k, 2, 1] * t
            out[j + 2] += upper[k, 0, 2] * r + upper[k, 1, 2] * s + upper[k, 2, 2] * t
        out[q] = factor * (out[q] + (a + b + c)) + share * base[q] + own * r
        out[q + 1] = factor * (out[q + 1] + (d + e + f)) + share * base[q + 1] + own * s
        out[q + 2] = factor * (out[q + 2] + (g + h + p)) + share * base[q + 2] + own * t


@compiled
def _product_of_six(  # type: ignore[no-untyped-def]
    first, last, w_starts, w_columns, whole, u_starts, u_columns, upper,
    x, base, out, factor, share, own,
):  # fmt: skip
    for i in range(6 * first, 6 * last):
        out[i] = 0
    for i in range(first, last):
        q = 6 * i
        for k in range(w_starts[i], w_starts[i + 1]):
            j = 6 * w_columns[k]
            u, v, w, x3, x4, x5 = x[j], x[j + 1], x[j + 2], x[j + 3], x[j + 4], x[j + 5]
            for m in range(6):
                out[q + m] += (
                    whole[k, m, 0] * u + whole[k, m, 1] * v + whole[k, m, 2] * w
                    + whole[k, m, 3] * x3 + whole[k, m, 4] * x4 + whole[k, m, 5] * x5
                )  # fmt: skip
        for k in range(u_starts[i], u_starts[i + 1]):
            j = 6 * u_columns[k]
            u, v, w, x3, x4, x5 = x[j], x[j + 1], x[j + 2], x[j + 3], x[j + 4], x[j + 5]
            a = b = c = d = e = f = factor - factor
            for m in range(6):
                value = x[q + m]
                out[q + m] += (
                    upper[k, m, 0] * u + upper[k, m, 1] * v + upper[k, m, 2] * w
                    + upper[k, m, 3] * x3 + upper[k, m, 4] * x4 + upper[k, m, 5] * x5
                )  # fmt: skip
                a += upper[k, m, 0] * value
                b += upper[k, m, 1] * value
                c += upper[k, m, 2] * value
                d += upper[k, m, 3] * value
                e += upper[k, m, 4] * value
                f += upper[k, m, 5] * value
            out[j] += a
            out[j + 1] += b
            out[j + 2] += c
            out[j + 3] += d
            out[j + 4] += e
            out[j + 5] += f
        for m in range(q, q + 6):
            out[m] = factor * out[m] + share * base[m] + own * x[m]


_PRODUCTS: dict[int, Callable[..., None]] = {3: _product_of_three, 6: _product_of_six}


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
            return np.array([self @ column for column in x.T]).reshape(x.T.shape).T
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
