"""Products in blocks against dense ones, on one thread and on several."""

import numpy as np
import pytest
from scipy.sparse import bsr_matrix, eye, kron, random_array

from solver.lac import threads
from solver.mechanics.linear import products
from solver.mechanics.multigrid import galerkin


def on_threads(count, monkeypatch):
    """So many threads, however small the work."""
    monkeypatch.setattr(products, "_LEAST", 1)
    for module in (products, threads):
        monkeypatch.setattr(module, "workers", lambda: count)


def blocks(rows, columns, size, density=0.3, precision=np.float32, seed=0):
    """Random blocks; some rows of blocks are empty."""
    rng = np.random.default_rng(seed)
    where = random_array((rows, columns), density=density, rng=rng, format="csr")
    where.data[:] = 1.0
    matrix = kron(where, np.ones(size)).tobsr(size)
    matrix.data = rng.standard_normal(matrix.data.shape).astype(precision)
    return matrix


@pytest.mark.parametrize("size", [(3, 3), (3, 6), (6, 6)])
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_product_is_the_dense_one(size, precision, monkeypatch):
    matrix = blocks(23, 17, size, 0.1, precision)
    rng = np.random.default_rng(1)
    x, base = (rng.standard_normal(n).astype(precision) for n in reversed(matrix.shape))
    exact = base - 2.5 * (matrix.toarray().astype(float) @ x)
    found = products.multiply(matrix, x, base, -2.5)
    assert found.dtype == precision
    close = 50 * np.finfo(precision).eps
    np.testing.assert_allclose(found, exact, rtol=close, atol=close * np.abs(exact).max())
    np.testing.assert_allclose(
        products.multiply(matrix, x), matrix.toarray() @ x, rtol=close, atol=close * 10
    )
    for count in (2, 3, 40):
        on_threads(count, monkeypatch)
        np.testing.assert_array_equal(products.multiply(matrix, x, base, -2.5), found)


@pytest.mark.parametrize("size", [(3, 3), (3, 6), (6, 6)])
def test_transposed_product_is_the_dense_one(size, monkeypatch):
    monkeypatch.setattr(products, "_LEAST", 1)
    matrix = blocks(31, 9, size)
    x = np.random.default_rng(2).standard_normal(matrix.shape[0]).astype(np.float32)
    found = products.multiply_transposed(matrix, x)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, matrix.toarray().T.astype(float) @ x, atol=1e-5)
    for count in (2, 3):
        on_threads(count, monkeypatch)
        np.testing.assert_array_equal(products.multiply_transposed(matrix, x), found)


def test_rows_are_shared_out_by_their_entries(monkeypatch):
    on_threads(4, monkeypatch)
    ranges = []
    products.share_rows(lambda *some: ranges.append(some), np.array([0, 4, 4, 6, 8, 8, 12, 16]))
    first, last = zip(*sorted(ranges), strict=True)
    assert (first[0], last[-1]) == (0, 7)
    assert first[1:] == last[:-1]
    assert len(ranges) == 4


def test_an_error_in_a_thread_is_raised(monkeypatch):
    on_threads(2, monkeypatch)

    def fail(first, last):
        if first:
            raise MemoryError("no room")

    with pytest.raises(MemoryError, match="no room"):
        products.share_rows(fail, np.arange(10))


@pytest.mark.parametrize("height", [3, 6])
def test_galerkin_products_are_the_dense_ones(height, monkeypatch):
    half = blocks(40, 40, (height, height), 0.1)
    matrix = (half + half.T + 20 * eye(40 * height)).tobsr((height, height)).astype(np.float32)
    tentative = blocks(40, 7, (height, 6), 0.15)
    dense, start = (m.toarray().astype(float) for m in (matrix, tentative))
    way = galerkin.smoothed(matrix, tentative, 0.25)
    assert (way.blocksize, way.dtype) == ((height, 6), np.float32)
    exact = start - 0.25 * dense @ start
    np.testing.assert_allclose(way.toarray(), exact, rtol=0, atol=1e-5 * np.abs(exact).max())
    found = galerkin.coarse(matrix, way)
    assert (found.blocksize, found.dtype) == ((6, 6), np.float32)
    exact = way.toarray().astype(float).T @ dense @ way.toarray()
    np.testing.assert_allclose(found.toarray(), exact, rtol=0, atol=1e-5 * np.abs(exact).max())
    for count in (2, 5):
        on_threads(count, monkeypatch)
        again = galerkin.smoothed(matrix, tentative, 0.25), galerkin.coarse(matrix, way)
        for one, other in zip((way, found), again, strict=True):
            np.testing.assert_array_equal(one.toarray(), other.toarray())


def test_pattern_has_an_entry_for_each_block():
    matrix = bsr_matrix(kron(np.eye(4), np.ones((3, 6))), blocksize=(3, 6))
    np.testing.assert_array_equal(galerkin.pattern(matrix).toarray(), np.eye(4, dtype=bool))


@pytest.mark.parametrize("size", [(3, 3), (3, 6), (6, 6)])
def test_scaled_blocks_and_sums_are_the_dense_ones(size, monkeypatch):
    monkeypatch.setattr(products, "_LEAST", 1)
    matrix, rng = blocks(23, 17, size, 0.1), np.random.default_rng(1)
    left, right = (rng.uniform(1, 2, n).astype(np.float32) for n in matrix.shape)
    dense = matrix.toarray()
    found = products.sums_of_sizes(matrix, right)
    np.testing.assert_allclose(found, np.abs(dense) @ right, rtol=1e-6)
    scaled = np.empty_like(matrix.data)
    products.scale_blocks(matrix, left, right, scaled)
    np.testing.assert_array_equal(matrix.toarray(), dense)
    products.scale_blocks(matrix, left, right)
    np.testing.assert_array_equal(matrix.data, scaled)
    np.testing.assert_allclose(matrix.toarray(), left[:, None] * dense * right, rtol=1e-6)


def test_parts_of_a_matrix_multiply_as_all_of_it(monkeypatch):
    matrix = random_array((97, 31), density=0.2, rng=np.random.default_rng(3), format="csr")
    x, exact = np.arange(31.0), matrix.toarray() @ np.arange(31.0)
    np.testing.assert_allclose(products.InParts(matrix) @ x, exact, rtol=1e-14)
    for count in (1, 2, 3):
        on_threads(count, monkeypatch)
        parts = products.InParts(matrix)
        np.testing.assert_array_equal(parts @ x, matrix @ x)
    assert len(parts._parts) == products._PARTS
    np.testing.assert_array_equal(products.InParts(matrix[:0]) @ x, np.zeros(0))
