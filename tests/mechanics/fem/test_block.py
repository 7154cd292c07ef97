"""Sums of cell matrices: against a dense sum entry by entry, whatever is kept; and their memory."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import solver.lac.threads
import solver.mechanics.fem.block
import solver.mechanics.fem.elasticity
from solver.lac.cells.catalogue import BY_NAME
from solver.mechanics.fem.block import Block, CellSum, degrees_of_freedom, selected
from solver.mechanics.fem.elasticity import stiffness
from tests.scenes import grid


def random_cells(rng, n_nodes, sizes):
    """Some cells of each size, any nodes in any order: neighbours both ways, repeatedly."""
    return [
        np.array([rng.permutation(n_nodes)[:size] for _ in range(rng.integers(3, 6))])
        for size in sizes
    ]


@given(
    seed=st.integers(0, 10**6), dim=st.sampled_from([1, 2, 3]), share=st.sampled_from([0, 0.5, 1])
)
def test_sum_is_the_dense_sum(seed, dim, share):
    rng, n_nodes = np.random.default_rng(seed), 9
    cells = random_cells(rng, n_nodes, (2, 4, 5))
    kept = np.flatnonzero(rng.random(n_nodes * dim) < share)
    dense, total = np.zeros((n_nodes * dim,) * 2), CellSum(cells, n_nodes, dim)
    for group in cells:
        size = dim * group.shape[1]
        matrices = rng.standard_normal((len(group), size, size))
        for dofs, matrix in zip(degrees_of_freedom(group, dim), matrices, strict=True):
            dense[np.ix_(dofs, dofs)] += matrix
        total.add(group, matrices.__getitem__, [slice(0, 2), slice(2, None)])
    some = selected(total.matrix, kept)
    np.testing.assert_allclose(total.matrix.toarray(), dense, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(some.toarray(), dense[np.ix_(kept, kept)], atol=1e-13)
    assert total.matrix.has_canonical_format
    assert total.matrix.blocksize == (dim, dim)
    assert some.has_canonical_format
    assert total.matrix.indices.dtype == some.indices.dtype == np.int32


def test_no_cells():
    assert CellSum([], 4, 3).matrix.shape == (12, 12)


def cube(count):
    points, cells = grid(count)
    unit = np.ones(len(cells))
    return points, Block(BY_NAME["HEXA8"], cells, unit, unit)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("size", [1, 10_000, 1 << 30])
def test_cells_and_nodes_in_parts_of_any_size_by_any_threads(monkeypatch, size, threads):
    points, block = cube(5)
    whole = stiffness(points, [block])
    monkeypatch.setattr(solver.lac.threads, "workers", lambda: threads)
    monkeypatch.setattr(solver.mechanics.fem.elasticity, "_MATRIX_BYTES", size)
    monkeypatch.setattr(solver.mechanics.fem.block, "_NODES_AT_ONCE", max(1, size // 1000))
    parts = stiffness(points, [block])
    assert (parts.indices == whole.indices).all()
    assert (parts.indptr == whole.indptr).all()
    np.testing.assert_allclose(parts.data, whole.data, rtol=1e-13, atol=1e-15)


def test_memory_stays_under_two_and_a_half_times_the_matrix():
    points, block = cube(24)
    tracemalloc.start()
    matrix = stiffness(points, [block])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2.5 * (matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes)
