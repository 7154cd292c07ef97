"""Sums of cell matrices: against a dense sum entry by entry, whatever is kept; and their memory."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import solver.mechanics.fem.elasticity
from solver.mechanics.fem.assembly import CellSum, degrees_of_freedom
from solver.mechanics.fem.elasticity import Block, stiffness
from solver.mesh.catalogue import BY_NAME
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
    dense = np.zeros((n_nodes * dim, n_nodes * dim))
    whole, some = CellSum(cells, n_nodes, dim), CellSum(cells, n_nodes, dim, kept)
    for group in cells:
        size = dim * group.shape[1]
        matrices = rng.standard_normal((len(group), size, size))
        for dofs, matrix in zip(degrees_of_freedom(group, dim), matrices, strict=True):
            dense[np.ix_(dofs, dofs)] += matrix
        for total in (whole, some):
            total.add(group[:2], matrices[:2])
            total.add(group[2:], matrices[2:])
    np.testing.assert_allclose(whole.matrix.toarray(), dense, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(some.matrix.toarray(), dense[np.ix_(kept, kept)], atol=1e-13)
    for total in (whole, some):
        np.testing.assert_allclose(total.diagonal, np.diag(dense), rtol=1e-13, atol=1e-13)
        assert total.matrix.has_canonical_format
        assert total.matrix.indices.dtype == np.int32


def test_no_cells():
    assert CellSum([], 4, 3).matrix.shape == (12, 12)


def cube(count):
    points, cells = grid(count)
    unit = np.ones(len(cells))
    return points, Block(BY_NAME["HEXA8"], cells, unit, unit)


@pytest.mark.parametrize("size", [1, 10_000, 1 << 30])
def test_cells_in_chunks_of_any_size(monkeypatch, size):
    points, block = cube(5)
    whole, _ = stiffness(points, [block])
    monkeypatch.setattr(solver.mechanics.fem.elasticity, "_CHUNK_BYTES", size)
    parts, _ = stiffness(points, [block])
    np.testing.assert_allclose(parts.toarray(), whole.toarray(), rtol=1e-13, atol=1e-15)


def test_memory_stays_under_three_times_the_matrix():
    points, block = cube(16)
    tracemalloc.start()
    matrix, _ = stiffness(points, [block])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3 * (matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes)
