"""Products of block-sparse matrices with vectors, their rows shared out among the threads.

With Numba a kernel for each size of blocks runs at nearly the speed of memory; without it each
thread runs SciPy on its rows. One thread sums up a row, always in the same order: the number of
threads changes no digit.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ...system.compiled import available, compiled
from ...system.threads import workers

_LEAST = 200_000  # multiplications from which another thread pays for its start


def multiply(
    matrix: bsr_matrix, x: np.ndarray, base: np.ndarray | None = None, factor: float = 1.0
) -> np.ndarray:
    """`base` (m,) + `factor` · `matrix` (m, n) @ x (n,), in the precision of the matrix.

    >>> matrix = bsr_matrix(2 * np.eye(6), blocksize=(3, 3))
    >>> multiply(matrix, np.ones(6), np.ones(6), -1.0)
    array([-1., -1., -1., -1., -1., -1.])
    """
    out = np.zeros(matrix.shape[0], dtype=matrix.dtype) if base is None else base.copy()
    height = matrix.blocksize[0]
    kernel = _PRODUCTS.get(matrix.blocksize) if available() else None
    arrays = matrix.indptr, matrix.indices, matrix.data

    def rows(first: int, last: int) -> None:
        if kernel is not None:
            kernel(first, last, *arrays, x, matrix.dtype.type(factor), out)
        else:
            product = rows_of(matrix, first, last) @ x
            product *= matrix.dtype.type(factor)
            out[height * first : height * last] += product

    share_rows(rows, matrix.indptr, matrix.data[:1].size)
    return out


class Prolongation:
    """The way from coarse unknowns to fine ones, and by its transpose back: `matrix` (n, c)."""

    def __init__(self, matrix: bsr_matrix):
        self.matrix = matrix
        height, width = matrix.blocksize
        if available():
            # The transpose: for each of its rows the blocks of the matrix, which are not copied.
            places = np.arange(len(matrix.indices), dtype=np.int32)
            shape = matrix.shape[0] // height, matrix.shape[1] // width
            self._by_columns = csr_matrix((places, matrix.indices, matrix.indptr), shape).tocsc()
        else:
            self._restriction = matrix.T.tobsr((width, height))

    def prolong(self, coarse: np.ndarray, base: np.ndarray) -> np.ndarray:
        """`base` (n,) + P @ `coarse` (c,)."""
        return multiply(self.matrix, coarse, base)

    def restrict(self, fine: np.ndarray) -> np.ndarray:
        """Pᵀ @ `fine` (n,)."""
        if not available():
            return multiply(self._restriction, fine)
        out, kernel = np.empty(self.matrix.shape[1], fine.dtype), _RESTRICT[self.matrix.blocksize]
        places = self._by_columns
        arrays = places.indptr, places.indices, places.data, self.matrix.data

        def rows(first: int, last: int) -> None:
            kernel(first, last, *arrays, fine, out)

        share_rows(rows, places.indptr, self.matrix.data[:1].size)
        return out


def rows_of(matrix: bsr_matrix, first: int, last: int) -> bsr_matrix:
    """Some rows of blocks, without a copy of the blocks."""
    starts = matrix.indptr[first : last + 1]
    chosen = slice(starts[0], starts[-1])
    arrays = matrix.data[chosen], matrix.indices[chosen], starts - starts[0]
    return bsr_matrix(arrays, shape=(matrix.blocksize[0] * (len(starts) - 1), matrix.shape[1]))


def share_rows(work: Callable[[int, int], None], starts: np.ndarray, weight: int = 1) -> None:
    """Call `work` on ranges of rows, one for each thread, with about as many entries in each.

    `starts` (n + 1,) of the rows among the entries; `weight`: multiplications for an entry.
    """
    entries = int(starts[-1])
    count = min(workers(), 1 + weight * entries // _LEAST)
    cuts = np.searchsorted(starts, entries * np.arange(1, count) // count).tolist()
    ranges = list(zip([0, *cuts], [*cuts, len(starts) - 1], strict=True))
    if count == 1:
        work(*ranges[0])
        return
    with ThreadPoolExecutor(count - 1) as pool:
        others = [pool.submit(work, *some) for some in ranges[1:]]
        work(*ranges[0])
        for other in others:
            other.result()


def _product_of_three(width: int) -> Callable[..., None]:
    @compiled
    def kernel(first, last, starts, columns, blocks, x, factor, out):  # type: ignore[no-untyped-def]
        for i in range(first, last):
            a = b = c = factor - factor
            for k in range(starts[i], starts[i + 1]):
                j = width * columns[k]
                for m in range(width):
                    value = x[j + m]
                    a += blocks[k, 0, m] * value
                    b += blocks[k, 1, m] * value
                    c += blocks[k, 2, m] * value
            out[3 * i] += factor * a
            out[3 * i + 1] += factor * b
            out[3 * i + 2] += factor * c

    return kernel


@compiled
def _product_of_six(first, last, starts, columns, blocks, x, factor, out):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        a = b = c = d = e = f = factor - factor
        for k in range(starts[i], starts[i + 1]):
            j = 6 * columns[k]
            for m in range(6):
                value = x[j + m]
                a += blocks[k, 0, m] * value
                b += blocks[k, 1, m] * value
                c += blocks[k, 2, m] * value
                d += blocks[k, 3, m] * value
                e += blocks[k, 4, m] * value
                f += blocks[k, 5, m] * value
        out[6 * i] += factor * a
        out[6 * i + 1] += factor * b
        out[6 * i + 2] += factor * c
        out[6 * i + 3] += factor * d
        out[6 * i + 4] += factor * e
        out[6 * i + 5] += factor * f


def _restriction_of(height: int) -> Callable[..., None]:
    """To six unknowns."""

    @compiled
    def kernel(first, last, starts, rows, places, blocks, x, out):  # type: ignore[no-untyped-def]
        for i in range(first, last):
            a = b = c = d = e = f = x[0] - x[0]
            for q in range(starts[i], starts[i + 1]):
                j, k = height * rows[q], places[q]
                for m in range(height):
                    value = x[j + m]
                    a += blocks[k, m, 0] * value
                    b += blocks[k, m, 1] * value
                    c += blocks[k, m, 2] * value
                    d += blocks[k, m, 3] * value
                    e += blocks[k, m, 4] * value
                    f += blocks[k, m, 5] * value
            out[6 * i] = a
            out[6 * i + 1] = b
            out[6 * i + 2] = c
            out[6 * i + 3] = d
            out[6 * i + 4] = e
            out[6 * i + 5] = f

    return kernel


_PRODUCTS = {(3, 3): _product_of_three(3), (3, 6): _product_of_three(6), (6, 6): _product_of_six}
_RESTRICT = {(3, 6): _restriction_of(3), (6, 6): _restriction_of(6)}
