"""The matrices that smoothed aggregation forms: the smoothed prolongation and Pᵀ A P.

One pass over the rows of A forms each of them: A P is never stored.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from ...lac.threads import prefetch
from ...system.compiled import compiled
from ..linear.products import pattern, ranges, share_rows

_PARTS = 8  # in which threads find a pattern
_MARKS = 30  # neighbours that an entry of a pattern adds, as multiplications


def smoothed(matrix: bsr_matrix, tentative: bsr_matrix, weight: float) -> bsr_matrix:
    """T − `weight` · A T for `matrix` A (n, n) and `tentative` T (n, c) in single precision."""
    sizes = matrix.blocksize[0], tentative.blocksize[1]
    own = pattern(tentative)
    near = pattern(matrix)
    total = _empty(lambda some: near[some] @ own + own[some], matrix.indptr, tentative)
    kernel = _smooth_rows(*sizes)
    arrays = [a for m in (matrix, tentative, total) for a in (m.indptr, m.indices, m.data)]
    share_rows(lambda *some: kernel(*some, *arrays, np.float32(-weight)), matrix.indptr, 54)
    return total


def coarse(matrix: bsr_matrix, prolongation: bsr_matrix) -> bsr_matrix:
    """Pᵀ A P for a symmetric `matrix` A (n, n) and `prolongation` P (n, c) in single precision."""
    width = prolongation.blocksize[1]
    ways = pattern(prolongation)
    near, felt = pattern(matrix), ways.T.tocsr()
    total = _empty(lambda some: felt[some] @ near @ ways, felt.indptr, prolongation, width)
    kernel, most = _coarse_rows(*prolongation.blocksize), np.diff(total.indptr).max(initial=0)
    arrays = [a for m in (matrix, prolongation, total) for a in (m.indptr, m.indices, m.data)]
    share_rows(lambda *some: kernel(*some, *arrays, most), total.indptr, 1000)
    half = total.indptr, total.indices, total.data
    share_rows(lambda *some: _mirror(*some, *half), total.indptr, width**2)
    return total


def _empty(
    pattern: Callable[[slice], csr_matrix],
    starts: np.ndarray,
    like: bsr_matrix,
    height: int | None = None,
) -> bsr_matrix:
    """Zero blocks in the `pattern` of some rows, which threads find; rows sorted.

    `starts` (n + 1,): rows are shared out by these numbers of entries.
    """

    def part(some: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        found = pattern(slice(*some))
        found.sort_indices()
        return found.indices.astype(np.int32, copy=False), np.diff(found.indptr)

    parts = list(prefetch(part, ranges(starts, _MARKS, _PARTS)))
    indices = np.concatenate([columns for columns, _ in parts])
    counts = np.concatenate([[0], *(lengths for _, lengths in parts)])
    size = like.blocksize if height is None else (height, like.blocksize[1])
    data = np.zeros((len(indices), *size), dtype=np.float32)
    shape = (len(starts) - 1) * size[0], like.shape[1]
    return bsr_matrix((data, indices, np.cumsum(counts, dtype=np.int32)), shape=shape)


@cache
def _smooth_rows(height: int, width: int) -> Callable[..., None]:  # noqa: C901 -- one kernel
    @compiled
    def kernel(  # type: ignore[no-untyped-def]
        first, last, starts, columns, blocks, t_starts, t_columns, tentative,
        into, places, out, weight,
    ):  # fmt: skip
        """Rows of T + weight · A T, whose pattern is known."""
        for i in range(first, last):
            low, high = into[i], into[i + 1]
            for q in range(t_starts[i], t_starts[i + 1]):
                place = low + np.searchsorted(places[low:high], t_columns[q])
                for r in range(height):
                    for m in range(width):
                        out[place, r, m] += tentative[q, r, m]
            for k in range(starts[i], starts[i + 1]):
                j = columns[k]
                for q in range(t_starts[j], t_starts[j + 1]):
                    place = low + np.searchsorted(places[low:high], t_columns[q])
                    for r in range(height):
                        for c in range(height):
                            value = weight * blocks[k, r, c]
                            for m in range(width):
                                out[place, r, m] += value * tentative[q, c, m]

    return kernel


@cache
def _coarse_rows(height: int, width: int) -> Callable[..., None]:  # noqa: C901 -- one kernel
    @compiled
    def kernel(  # type: ignore[no-untyped-def]  # noqa: C901
        first, last, starts, columns, blocks, p_starts, p_columns, ways,
        into, places, out, most,
    ):  # fmt: skip
        """The upper half of rows of Pᵀ A P; a row of A P at a time, for all that it adds to."""
        slot = np.full(len(into) - 1, -1, dtype=np.int32)
        found = np.empty(most, dtype=np.int32)
        product = np.empty((most, height, width), dtype=out.dtype)
        for i in range(len(starts) - 1):
            least = last
            for q in range(p_starts[i], p_starts[i + 1]):
                if first <= p_columns[q]:
                    least = min(least, p_columns[q])
            if least == last:
                continue
            count = 0
            for k in range(starts[i], starts[i + 1]):
                j = columns[k]
                for q in range(p_starts[j], p_starts[j + 1]):
                    if p_columns[q] < least:
                        continue
                    s = slot[p_columns[q]]
                    if s < 0:
                        s = count
                        count += 1
                        slot[p_columns[q]] = s
                        found[s] = p_columns[q]
                        product[s] = 0
                    for r in range(height):
                        for m in range(0, width, 3):
                            u, v, w = product[s, r, m], product[s, r, m + 1], product[s, r, m + 2]
                            for c in range(height):
                                value = blocks[k, r, c]
                                u += value * ways[q, c, m]
                                v += value * ways[q, c, m + 1]
                                w += value * ways[q, c, m + 2]
                            product[s, r, m], product[s, r, m + 1], product[s, r, m + 2] = u, v, w
            for q in range(p_starts[i], p_starts[i + 1]):
                row = p_columns[q]
                if first <= row < last:
                    low, high = into[row], into[row + 1]
                    for s in range(count):
                        if found[s] < row:
                            continue
                        t = low + np.searchsorted(places[low:high], found[s])
                        for r in range(width):
                            for m in range(0, width, 3):
                                u, v, w = out[t, r, m], out[t, r, m + 1], out[t, r, m + 2]
                                for c in range(height):
                                    value = ways[q, c, r]
                                    u += value * product[s, c, m]
                                    v += value * product[s, c, m + 1]
                                    w += value * product[s, c, m + 2]
                                out[t, r, m], out[t, r, m + 1], out[t, r, m + 2] = u, v, w
            for s in range(count):
                slot[found[s]] = -1

    return kernel


@compiled
def _mirror(first, last, starts, columns, blocks):  # type: ignore[no-untyped-def]
    """Rows of the lower half from the upper one."""
    for i in range(first, last):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            if j < i:
                place = starts[j] + np.searchsorted(columns[starts[j] : starts[j + 1]], i)
                for r in range(blocks.shape[1]):
                    for m in range(blocks.shape[2]):
                        blocks[k, r, m] = blocks[place, m, r]
