"""Symmetric matrices of which one half is stored, against dense ones; threads change no digit."""

import numpy as np
import pytest
from scipy.sparse import bsr_matrix

from solver.lac import threads
from solver.mechanics.linear import products, symmetric_blocks
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
