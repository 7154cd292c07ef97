"""Products of block-sparse matrices with vectors, their rows shared out among the threads.

A compiled kernel for each size of blocks runs at nearly the speed of memory. One thread sums up a
row, always in the same order: the number of threads changes no digit.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ...lac.threads import prefetch, workers
from ...system.compiled import compiled

_LEAST = 200_000  # multiplications from which another thread pays for its start
_PARTS = 16  # of a transposed product


def multiply(
    matrix: bsr_matrix,
    x: np.ndarray,
    base: np.ndarray | None = None,
    factor: float = 1.0,
    out: np.ndarray | None = None,
) -> np.ndarray:
    """`base` (m,) + `factor` · `matrix` (m, n) @ x (n,), in the precision of the matrix.

    `out` (m,), if given, takes the result; it may be `base`.

    >>> matrix = bsr_matrix(2 * np.eye(6), blocksize=(3, 3))
    >>> multiply(matrix, np.ones(6), np.ones(6), -1.0)
    array([-1., -1., -1., -1., -1., -1.])
    """
    if out is None:
        out = np.zeros(matrix.shape[0], dtype=matrix.dtype) if base is None else base.copy()
    elif out is not base:
        out[:] = 0 if base is None else base
    kernel, arrays = _PRODUCTS[matrix.blocksize], (matrix.indptr, matrix.indices, matrix.data)
    more = *arrays, x, matrix.dtype.type(factor), out
    share_rows(lambda *some: kernel(*some, *more), matrix.indptr, matrix.data[:1].size)
    return out


def multiply_transposed(matrix: bsr_matrix, x: np.ndarray) -> np.ndarray:
    """The transpose of `matrix` (m, n) @ x (m,), of a matrix with many more rows than columns.

    A fixed number of parts of the rows are added up in their order, whatever the threads.

    >>> multiply_transposed(bsr_matrix(np.ones((9, 6)), blocksize=(3, 6)), np.ones(9))
    array([9., 9., 9., 9., 9., 9.])
    """
    kernel, arrays = _TRANSPOSED[matrix.blocksize], (matrix.indptr, matrix.indices, matrix.data)

    def part(some: tuple[int, int]) -> np.ndarray:
        out = np.zeros(matrix.shape[1], dtype=matrix.dtype)
        kernel(*some, *arrays, x, out)
        return out

    parts = prefetch(part, ranges(matrix.indptr, matrix.data[:1].size, _PARTS))
    total = next(parts)
    for other in parts:
        total += other
    return total


class InParts:
    """A sparse matrix (m, n) for products by threads, a few rows in each."""

    def __init__(self, matrix: csr_matrix):
        """The parts depend on the matrix alone and share its memory."""
        self._parts = []
        for first, last in ranges(matrix.indptr, 1, _PARTS):
            starts = matrix.indptr[first : last + 1]
            some = slice(starts[0], starts[-1])
            arrays = matrix.data[some], matrix.indices[some], starts - starts[0]
            self._parts.append(csr_matrix(arrays, shape=(last - first, matrix.shape[1])))

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """The product (m,) with x (n,)."""
        return np.concatenate(list(prefetch(lambda part: part @ x, self._parts)))


def chosen_rows(matrix: bsr_matrix, rows: np.ndarray) -> csr_matrix:
    """Some rows (r,) of a matrix in blocks, one by one."""
    height = matrix.blocksize[0]
    nodes, local = np.unique(rows // height, return_inverse=True)
    starts = matrix.indptr[nodes]
    counts = matrix.indptr[nodes + 1] - starts
    ends = np.concatenate([[0], np.cumsum(counts)])
    entries = np.repeat(starts - ends[:-1], counts) + np.arange(ends[-1])
    arrays = matrix.data[entries], matrix.indices[entries], ends
    some = bsr_matrix(arrays, shape=(height * len(nodes), matrix.shape[1]))
    return some.tocsr()[height * local + rows % height]


def pattern(matrix: bsr_matrix) -> csr_matrix:
    """Which blocks are stored, a row and column for each row and column of blocks."""
    height, width = matrix.blocksize
    shape = matrix.shape[0] // height, matrix.shape[1] // width
    there = np.ones(len(matrix.indices), dtype=bool)
    return csr_matrix((there, matrix.indices, matrix.indptr), shape=shape)


def scale_blocks(
    matrix: bsr_matrix, left: np.ndarray, right: np.ndarray, out: np.ndarray | None = None
) -> None:
    """Multiply rows by `left` (m,), columns by `right` (n,); in place, or into the blocks `out`."""
    height, width = matrix.blocksize
    rows, columns = left.reshape(-1, height), right.reshape(-1, width)
    into = matrix.data if out is None else out
    arrays = matrix.indptr, matrix.indices, matrix.data, rows, columns, into
    share_rows(lambda *some: _scale(*some, *arrays), matrix.indptr, height * width)


def sums_of_sizes(matrix: bsr_matrix, weights: np.ndarray) -> np.ndarray:
    """The sums (m,) over the rows of a matrix (m, n) of |entry| · `weights` (n,) of its column.

    >>> sums_of_sizes(bsr_matrix([[1.0, -2.0], [0.0, 3.0]], blocksize=(2, 2)), np.ones(2))
    array([3., 3.])
    """
    height, width = matrix.blocksize
    sums, columns = np.zeros((matrix.shape[0] // height, height)), weights.reshape(-1, width)
    arrays = matrix.indptr, matrix.indices, matrix.data, columns, sums
    share_rows(lambda *some: _add_sizes(*some, *arrays), matrix.indptr, height * width)
    return sums.ravel()


def ranges(starts: np.ndarray, weight: int, most: int) -> list[tuple[int, int]]:
    """Ranges of rows with about as many entries in each, `most` or fewer where that is little work.

    `starts` (n + 1,) of the rows among the entries; `weight`: multiplications for an entry.
    """
    entries = int(starts[-1])
    count = min(most, 1 + weight * entries // _LEAST)
    cuts = np.searchsorted(starts, entries * np.arange(1, count) // count).tolist()
    return list(zip([0, *cuts], [*cuts, len(starts) - 1], strict=True))


def share_rows(work: Callable[[int, int], None], starts: np.ndarray, weight: int = 1) -> None:
    """Call `work` on a range of rows in each thread; see `ranges`."""
    for _ in prefetch(lambda some: work(*some), ranges(starts, weight, workers())):
        pass


@compiled
def _scale(first, last, starts, columns, blocks, left, right, into):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            for r in range(blocks.shape[1]):
                for m in range(blocks.shape[2]):
                    into[k, r, m] = left[i, r] * right[j, m] * blocks[k, r, m]


@compiled
def _add_sizes(first, last, starts, columns, blocks, weights, sums):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            for r in range(blocks.shape[1]):
                for m in range(blocks.shape[2]):
                    sums[i, r] += abs(blocks[k, r, m]) * weights[j, m]


def _product_of_three(width: int) -> Callable[..., None]:
    # Nine sums rather than three: none of them waits for the one before.
    @compiled
    def kernel(first, last, starts, columns, blocks, x, factor, out):  # type: ignore[no-untyped-def]
        for i in range(first, last):
            a = b = c = d = e = f = g = h = p = factor - factor
            for k in range(starts[i], starts[i + 1]):
                j = width * columns[k]
                for m in range(0, width, 3):
                    u, v, w = x[j + m], x[j + m + 1], x[j + m + 2]
                    a += blocks[k, 0, m] * u
                    b += blocks[k, 0, m + 1] * v
                    c += blocks[k, 0, m + 2] * w
                    d += blocks[k, 1, m] * u
                    e += blocks[k, 1, m + 1] * v
                    f += blocks[k, 1, m + 2] * w
                    g += blocks[k, 2, m] * u
                    h += blocks[k, 2, m + 1] * v
                    p += blocks[k, 2, m + 2] * w
            out[3 * i] += factor * (a + b + c)
            out[3 * i + 1] += factor * (d + e + f)
            out[3 * i + 2] += factor * (g + h + p)

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


@compiled
def _transposed_to_three(first, last, starts, columns, blocks, x, out):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        a, b, c = x[3 * i], x[3 * i + 1], x[3 * i + 2]
        for k in range(starts[i], starts[i + 1]):
            j = 3 * columns[k]
            for m in range(3):
                out[j + m] += blocks[k, 0, m] * a + blocks[k, 1, m] * b + blocks[k, 2, m] * c


def _transposed_to_six(height: int) -> Callable[..., None]:
    @compiled
    def kernel(first, last, starts, columns, blocks, x, out):  # type: ignore[no-untyped-def]
        for i in range(first, last):
            for k in range(starts[i], starts[i + 1]):
                a = b = c = d = e = f = x[0] - x[0]
                for m in range(height):
                    value = x[height * i + m]
                    a += blocks[k, m, 0] * value
                    b += blocks[k, m, 1] * value
                    c += blocks[k, m, 2] * value
                    d += blocks[k, m, 3] * value
                    e += blocks[k, m, 4] * value
                    f += blocks[k, m, 5] * value
                j = 6 * columns[k]
                out[j] += a
                out[j + 1] += b
                out[j + 2] += c
                out[j + 3] += d
                out[j + 4] += e
                out[j + 5] += f

    return kernel


_PRODUCTS = {(3, 3): _product_of_three(3), (3, 6): _product_of_three(6), (6, 6): _product_of_six}
_TRANSPOSED = {
    (3, 3): _transposed_to_three,
    (3, 6): _transposed_to_six(3),
    (6, 6): _transposed_to_six(6),
}
