"""Symmetric matrices of which one half is stored, against dense ones; threads change no digit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import bsr_matrix, csr_matrix

from solver.lac import threads
from solver.mechanics.linear import products, symmetric_blocks
from solver.mechanics.linear.condensed_matrix import CondensedMatrix
from solver.mechanics.linear.products import _PRODUCTS, _TRANSPOSED, scale_blocks
from solver.mechanics.linear.symmetric_blocks import NodalMatrix, SymmetricBlocks, halved


@pytest.fixture(autouse=True)
def _shared_out(monkeypatch):
    monkeypatch.setattr(products, "_LEAST", 1)


def symmetric(edge, precision=np.float32, nodes=41):
    """Random blocks: near ones, some far ones, and a node without any."""
    rng = np.random.default_rng(edge)
    apart = np.abs(np.subtract.outer(np.arange(nodes), np.arange(nodes)))
    near = (apart < 4) | (rng.random((nodes, nodes)) < 0.05)
    near |= near.T
    near[7] = near[:, 7] = False
    dense = rng.standard_normal((nodes * edge,) * 2) * np.kron(near, np.ones((edge, edge)))
    return bsr_matrix((dense + dense.T).astype(precision), blocksize=(edge, edge))


@pytest.mark.parametrize("edge", [3, 6])
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_every_operation_is_the_one_of_the_dense_matrix(edge, precision):
    matrix = symmetric(edge, precision)
    half, dense, rng = halved(matrix), matrix.toarray(), np.random.default_rng(1)
    # Of pairs in one slab, one block of two.
    assert len(half.slabs) == symmetric_blocks._SLABS
    assert half.whole.nnz + 2 * half.upper.nnz == matrix.nnz
    assert (half.shape, half.dtype, half.blocksize) == (matrix.shape, precision, edge)
    np.testing.assert_array_equal(half.tobsr().toarray(), dense)
    assert half.tobsr().blocksize == (edge, edge)
    np.testing.assert_array_equal(half.diagonal(), dense.diagonal())
    there = np.abs(dense).reshape(41, edge, 41, edge).max(axis=(1, 3)) > 0
    count = rng.integers(0, 4, 41)
    np.testing.assert_array_equal(half.times_pattern(count), there @ count)
    for rows in (rng.permutation(len(dense))[:30], np.array([0]), np.arange(0)):
        np.testing.assert_array_equal(half.chosen_rows(rows).toarray(), dense[rows])


@pytest.mark.parametrize("edge", [3, 6])
@pytest.mark.parametrize("precisions", [(np.float32,) * 2, (np.float32, float), (float, float)])
def test_product_is_the_dense_one(edge, precisions, monkeypatch):
    matrix, rng = symmetric(edge, precisions[0]), np.random.default_rng(2)
    half, dense = halved(matrix), matrix.toarray().astype(float)
    x, base = (rng.standard_normal(len(dense)).astype(precisions[1]) for _ in range(2))
    close = 200 * np.finfo(precisions[1]).eps

    def check(found, exact):
        assert found.dtype == precisions[1]
        np.testing.assert_allclose(found, exact, rtol=0, atol=close * np.abs(exact).max())

    check(half.multiply(x), dense @ x)
    check(half.multiply(x, own=3), dense @ x + 3 * x)
    found, out = half.multiply(x, base, -1.5, 0.5, 0.25), np.full_like(x, np.nan)
    check(found, 0.5 * base - 1.5 * (dense @ x) + 0.25 * x)
    assert half.multiply(x, base, -1.5, 0.5, 0.25, out) is out
    np.testing.assert_array_equal(out, found)
    for count in (2, 3, 40):
        for module in (products, threads):
            monkeypatch.setattr(module, "workers", lambda count=count: count)
        again = halved(matrix)
        np.testing.assert_array_equal(again.multiply(x, base, -1.5, 0.5, 0.25), found)


def test_product_is_symmetric_to_round_off():
    half, rng = halved(symmetric(3)), np.random.default_rng(3)
    one, other = (rng.standard_normal(half.shape[0]) for _ in range(2))
    assert abs(one @ half.multiply(other) - other @ half.multiply(one)) < 1e-12


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_nodal_matrix_of_one_half_is_still_the_matrix(precision):
    """Also scaled for a second time, which needs both halves again."""
    blocks, rng = symmetric(3, precision), np.random.default_rng(4)
    free = np.flatnonzero(rng.random(blocks.shape[0]) < 0.8)
    dense, matrix = blocks.toarray()[np.ix_(free, free)].astype(float), NodalMatrix(blocks, free)
    nnz, close = matrix.nnz, {"rtol": 1e-6, "atol": 1e-6 * np.abs(dense).max()}
    for _ in range(2):
        scaled = matrix.scaled(rng.uniform(0.5, 2, len(free)))
        matrix.halve(halved(scaled))
        assert matrix.blocks.upper is not None
        assert matrix.nnz == nnz
        np.testing.assert_allclose(matrix @ np.eye(len(free)), dense, **close)
        np.testing.assert_allclose(matrix.diagonal(), dense.diagonal(), **close)
        np.testing.assert_allclose(matrix.tocsr().toarray(), dense, **close)
        np.testing.assert_allclose(matrix[[5, 2]].toarray(), dense[[5, 2]], **close)


def test_without_one_half_there_are_no_slabs():
    matrix = symmetric(3)
    assert SymmetricBlocks(matrix).tobsr() is matrix


# A matrix in blocks with free degrees of freedom: every operation against a dense matrix.


def example(seed, share):
    """Symmetric blocks of six nodes, some pairs apart, one node with no cell; and free dofs."""
    rng, n = np.random.default_rng(seed), 6
    near = rng.random((n, n)) < 0.5
    near |= near.T | np.eye(n, dtype=bool)
    near[n - 1] = near[:, n - 1] = False
    there = np.kron(near, np.ones((3, 3)))
    dense = rng.standard_normal((3 * n, 3 * n)) * there
    dense += dense.T
    free = np.flatnonzero(rng.random(3 * (n - 1)) < share)
    matrix = NodalMatrix(bsr_matrix(dense, blocksize=(3, 3)), free)
    return matrix, dense[np.ix_(free, free)], there


@given(seed=st.integers(0, 10**6), share=st.sampled_from([0.3, 0.8, 1]))
def test_all_operations_are_those_of_the_dense_matrix(seed, share):
    matrix, dense, there = example(seed, share)
    rng, n = np.random.default_rng(seed), len(dense)
    assert matrix.shape == dense.shape
    x = rng.standard_normal((n, 2))
    np.testing.assert_allclose(matrix @ x, dense @ x, atol=1e-12)
    np.testing.assert_allclose(matrix @ x[:, 0], dense @ x[:, 0], atol=1e-12)
    np.testing.assert_array_equal(matrix.diagonal(), np.diag(dense))
    np.testing.assert_array_equal(matrix.tocsr().toarray(), dense)
    rows = rng.permutation(n)[: n // 2]
    for some in (rows, slice(1, 4), rng.random(n) < 0.5):
        np.testing.assert_array_equal(matrix[some].toarray(), dense[some])
    assert matrix.nnz == there[np.ix_(matrix.free, matrix.free)].sum() == matrix.tocsr().nnz


def test_a_condensed_matrix_of_blocks_is_that_of_entries():
    matrix, dense, _ = example(3, 0.9)
    kept = np.arange(len(dense)) % 4 > 0
    added = csr_matrix(np.diag(np.arange(kept.sum(), dtype=float)))
    condensed = CondensedMatrix(matrix, np.flatnonzero(kept), added)
    expected = dense[np.ix_(kept, kept)] + added.toarray()
    x = np.eye(len(expected))
    np.testing.assert_allclose(condensed @ x, expected, atol=1e-12)
    np.testing.assert_allclose(condensed[2:5].toarray(), expected[2:5], atol=1e-12)
    np.testing.assert_allclose(condensed.diagonal(), np.diag(expected), atol=1e-12)
    np.testing.assert_allclose(condensed.tocsr().toarray(), expected, atol=1e-12)


def test_blocks_scaled_in_place_are_still_the_matrix():
    """Also once the caller has scaled them further, and when they are scaled for a second time."""
    matrix, dense, _ = example(3, 0.8)
    single = NodalMatrix(matrix.blocks.tobsr().astype(np.float32), matrix.free)
    n, rng = len(dense), np.random.default_rng(1)
    nnz, close = single.nnz, {"rtol": 1e-6, "atol": 1e-6 * np.abs(dense).max()}
    for _ in range(2):
        scale, further = rng.uniform(0.1, 2, n), np.zeros(matrix.blocks.shape[0])
        further[matrix.free] = rng.uniform(0.1, 2, n)
        blocks = single.scaled(scale)
        assert np.shares_memory(blocks.data, single.blocks.tobsr().data)
        scale_blocks(blocks, further, further)
        total = scale * further[matrix.free]
        single.now_scaled(total)
        scaled = blocks.toarray()
        expected = np.zeros_like(scaled, dtype=float)
        expected[np.ix_(matrix.free, matrix.free)] = dense * np.outer(total, total)
        np.testing.assert_allclose(scaled, expected, rtol=1e-6, atol=1e-5)
        np.testing.assert_allclose(single @ np.eye(n), dense, **close)
        np.testing.assert_allclose(single.diagonal(), np.diag(dense), **close)
        np.testing.assert_allclose(single.tocsr().toarray(), dense, **close)
        np.testing.assert_allclose(single[[2, 0]].toarray(), dense[[2, 0]], **close)
        assert single.nnz == nnz


def test_blocks_in_double_precision_stay_as_they_are():
    matrix, dense, _ = example(3, 0.8)
    blocks = matrix.blocks.tobsr()
    assert not np.shares_memory(matrix.scaled(np.full(len(dense), 2.0)).data, blocks.data)
    np.testing.assert_array_equal(matrix.tocsr().toarray(), dense)


@pytest.mark.parametrize("transposed", [False, True])
def test_kernels_reach_entries_past_two_to_the_31(transposed):
    """As ten million unknowns of HEXA20 have; only the last pages of the arrays are touched."""
    count = 2**31 // 9 + 10
    try:
        blocks, columns = np.zeros((count, 3, 3), np.float32), np.zeros(count, np.int32)
    except MemoryError:
        pytest.skip("the system reserves no memory beyond what it has")
    rng, starts = np.random.default_rng(0), np.array([count - 2, count], np.int32)
    blocks[-2:], columns[-2:] = rng.integers(1, 9, (2, 3, 3)), [0, 1]
    row = np.concatenate(list(blocks[-2:]), axis=1).astype(float)
    if transposed:
        x, out = np.arange(1.0, 4.0), np.zeros(6)
        _TRANSPOSED[3, 3](0, 1, starts, columns, blocks, x, out)
        np.testing.assert_array_equal(out, row.T @ x)
    else:
        x, out = np.arange(1.0, 7.0), np.zeros(3)
        _PRODUCTS[3, 3](0, 1, starts, columns, blocks, x, np.float32(1), out)
        np.testing.assert_array_equal(out, row @ x)
