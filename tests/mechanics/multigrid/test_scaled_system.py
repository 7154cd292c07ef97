"""A scaled system in the rows of the first level: products against dense ones; symmetric cycles."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from solver.mechanics.linear.condensed_matrix import CondensedMatrix
from solver.mechanics.linear.symmetric_blocks import NodalMatrix, halved
from solver.mechanics.multigrid import hierarchy
from solver.mechanics.multigrid.multigrid import Multigrid, ScaledSystem
from tests.mechanics.linear.test_symmetric_blocks import symmetric
from tests.mechanics.multigrid.test_hierarchy import condensed, pressed

PLAIN, DOUBLE, SINGLE, OTHER = "entries", "blocks", "blocks scaled in place", "scaled otherwise"


@pytest.mark.parametrize("kind", [PLAIN, DOUBLE, SINGLE, OTHER])
@pytest.mark.parametrize("springs", [None, 0, 2])
def test_product_is_the_one_of_the_scaled_dense_matrix(kind, springs):
    """Of a stiffness, and of one of which seven unknowns are eliminated; springs in two of them."""
    single, rng = kind in (SINGLE, OTHER), np.random.default_rng(5)
    blocks = symmetric(3, np.float32 if single else float)
    free = np.flatnonzero(rng.random(blocks.shape[0]) < 0.8)
    n, scale = len(free), rng.uniform(0.5, 2, len(free))
    dense = blocks.toarray()[np.ix_(free, free)].astype(float)
    stiffness = csr_matrix(dense) if kind is PLAIN else NodalMatrix(blocks, free)
    place = free
    if kind is PLAIN:
        place = rng.permutation(blocks.shape[0])[:n]
    else:
        stiffness.halve(halved(stiffness.scaled(scale if kind is not OTHER else scale**2)))
    matrix, close = stiffness, 1e-6 if single else 1e-14
    if springs is not None:
        kept = np.delete(np.arange(n), rng.permutation(n)[:7])
        added = np.zeros((len(kept) + springs,) * 2)
        some = np.r_[3:9, len(kept) : len(added)]
        added[np.ix_(some, some)] = rng.standard_normal((len(some), len(some))) + 9 * np.eye(
            len(some)
        )
        matrix = CondensedMatrix(stiffness, kept, csr_matrix(added + added.T))
        held = np.zeros_like(added)
        held[: len(kept), : len(kept)] = dense[np.ix_(kept, kept)]
        dense = held + added + added.T
    system = ScaledSystem(matrix, scale, place, blocks.shape[0])
    exact = dense * np.outer(system.scale, system.scale)
    x = rng.standard_normal(len(dense))
    padded = system.placed(x)
    before = padded.copy()
    found = system.multiply(padded)
    np.testing.assert_array_equal(padded, before)
    np.testing.assert_allclose(found[system.place], exact @ x, atol=close * 9 * np.abs(exact).max())
    assert not np.delete(found, system.place).any()
    np.testing.assert_array_equal(system.solution(padded), x * system.scale)
    np.testing.assert_array_equal(system.lifted(x), system.placed(x * system.scale))
    ones = np.ones_like(padded)
    np.testing.assert_array_equal(system.without_idle(ones), system.placed(np.ones_like(x)))


def test_a_cycle_is_symmetric_and_positive():
    """With contact, an exact solve beside it, and pivots: to single precision."""
    matrix, gaps, own, unknowns = pressed(6, 5)
    solver = Multigrid(condensed(matrix, gaps, own, unknowns), unknowns)
    assert solver._levels[0].interface is not None
    system, rng = solver._system, np.random.default_rng(6)
    some = rng.standard_normal((len(system.scale), 6))
    cycles = [solver._precondition(system.placed(column)) for column in some.T]
    images = np.stack([cycle[system.place] for cycle in cycles], axis=1)
    energy = some.T @ images
    np.testing.assert_allclose(energy, energy.T, rtol=0, atol=1e-4 * np.abs(energy).max())
    assert (np.linalg.eigvalsh(energy + energy.T) > 0).all()


def test_smoothing_under_contact_is_the_polynomial():
    """x = W^½ p(W^½ A W^½) W^½ r with Lottes' weights, for A with its correction, in dense form."""
    matrix, gaps, own, unknowns = pressed(6, 5)
    solver = Multigrid(condensed(matrix, gaps, own, unknowns), unknowns)
    level = solver._levels[0]
    dense = level.matrix.tobsr().toarray().astype(float)
    rows, weight = level.correction.rows, np.ones(len(dense))
    dense[np.ix_(rows, rows)] += level.correction.matrix.toarray()
    weight[rows] = level.weight
    assert (weight == 0).any()
    assert ((weight > 0) & (weight != 1)).any()
    right = np.random.default_rng(7).standard_normal(len(dense))
    first, second, bound = 1.02387287570313, 1.26408905371085, float(level.bound)
    step = 4 / 3 / bound * weight * right
    following = step / 5 + 12 / 5 / bound * weight * (right - dense @ step)
    exact = first * step + second * following
    given, onto = right.astype(np.float32), np.float32(3.0) * np.ones(len(dense), np.float32)
    before = given.copy()
    for base in (None, onto):
        found = level.smooth(given, base)
        wanted = exact if base is None else exact + 3
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-5 * np.abs(exact).max())
        np.testing.assert_array_equal(given, before)


def test_solve_beside_contact_is_the_exact_one():
    """Before: x = A⁻¹ r in its rows, and r − A x is left. After: nothing is left in them."""
    matrix, gaps, own, unknowns = pressed(6, 5)
    solver = Multigrid(condensed(matrix, gaps, own, unknowns), unknowns)
    level = solver._levels[0]
    dense = level.matrix.tobsr().toarray().astype(float)
    rows = level.correction.rows
    dense[np.ix_(rows, rows)] += level.correction.matrix.toarray()
    chosen, rng = level.interface.chosen, np.random.default_rng(8)
    residual, change = rng.standard_normal((2, len(dense))).astype(np.float32)
    first, left = level.interface.before(residual)
    exact = np.linalg.solve(dense[np.ix_(chosen, chosen)], residual[chosen])
    close = {"rtol": 0, "atol": 2e-3 * np.abs(exact).max()}
    np.testing.assert_allclose(first, exact, **close)
    np.testing.assert_allclose(left, residual - dense[:, chosen] @ first, **close)
    assert (np.delete(left, chosen) != np.delete(residual, chosen)).any()
    outside = np.delete(change, chosen)
    level.interface.after(residual, change, first)
    np.testing.assert_array_equal(np.delete(change, chosen), outside)
    remaining = (residual - dense @ change)[chosen]
    np.testing.assert_allclose(remaining, 0, atol=2e-3 * np.abs(dense @ change).max())


def test_springs_are_scaled_to_one():
    added = csr_matrix(np.diag([2.0, 3.0, 16.0]))
    condensed = CondensedMatrix(csr_matrix(np.eye(4)), np.array([0, 2]), added)
    found = hierarchy.scales_of(condensed, np.array([5.0, 6.0, 7.0, 8.0]))
    np.testing.assert_array_equal(found, [5.0, 7.0, 0.25])
    np.testing.assert_array_equal(condensed.places, [0, 2, 1])
