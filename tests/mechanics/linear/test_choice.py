"""Which way a constrained system is solved, and that every way gives the same answer."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse import block_array, csc_matrix, csr_matrix, diags, eye, kron, tril, triu
from scipy.sparse.linalg import spsolve

from solver.lac.errors import SolveError
from solver.mechanics.linear.choice import Solvers
from solver.mechanics.linear.condensation import condense
from solver.mechanics.linear.condensed_matrix import CondensedMatrix
from solver.mechanics.linear.factor import factorise, factorise_roughly
from solver.mechanics.linear.unknowns import Unknowns


def chain_over_floor(count):
    """A chain of springs that floats, and one held unknown that is the mean of all of it."""
    line = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(count, count)).tolil()
    line[0, 0] = line[-1, -1] = 1.0
    matrix = sparse.block_diag([[[3.0]], line]).tocsr()
    row = np.concatenate([[1.0], np.full(count, -1 / count)])[None]
    return matrix, sparse.csr_matrix(row)


def stands_for(matrix, dim=3):
    n = matrix.shape[0]
    return Unknowns(dim, np.arange(n), lambda: np.ones((n, 6)), np.zeros(n, dtype=int))


def test_condensed_correction_meets_the_constraint_in_equilibrium():
    """Compared with the system of displacement and multiplier, solved as it is."""
    matrix, constraints = chain_over_floor(30)
    force, violation = np.random.default_rng(0).standard_normal(31), np.array([0.2])
    system = condense(matrix, constraints, np.arange(31) == 0, Solvers(stands_for(matrix)))
    saddle = sparse.bmat([[matrix, -constraints.T], [constraints, None]]).toarray()
    expected = np.linalg.solve(saddle, np.concatenate([force, violation]))
    found = system.correction(force, violation)
    np.testing.assert_allclose(found, expected[:-1], rtol=1e-10, atol=1e-10)
    multiplier = system.multiplier(force - matrix @ found)
    np.testing.assert_allclose(multiplier, expected[-1:], rtol=1e-9)


def between_two_chains(count):
    """Two chains, the facing ends of which stay together through three multipliers."""
    line = sparse.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(count, count))
    matrix = sparse.block_diag([line, 3 * line]).tocsr()
    columns = [[0, count, count + 1], [1, count + 1, count + 2], [2, count + 2, count + 3]]
    rows = np.repeat(np.arange(3), 3)
    weights = np.tile([1.0, -0.3, -0.7], 3)
    return matrix, sparse.csr_matrix((weights, (rows, np.ravel(columns))), shape=(3, 2 * count))


def test_condensed_matrix_is_that_of_the_expansion():
    matrix, constraints = between_two_chains(12)
    own = np.arange(24) < 12
    system = condense(matrix, constraints, own, Solvers(stands_for(matrix, dim=2)))
    expected = (system.expansion.T @ matrix @ system.expansion).toarray()
    np.testing.assert_allclose((constraints @ system.expansion).toarray(), 0, atol=1e-15)
    kept = np.setdiff1d(np.arange(24), system.pivot)
    added = sparse.csr_matrix(expected) - matrix[kept][:, kept]
    condensed = CondensedMatrix(matrix, kept, added.tocsr())
    x = np.random.default_rng(1).standard_normal((21, 2))
    np.testing.assert_allclose(condensed @ x, expected @ x, atol=1e-14)
    np.testing.assert_allclose(condensed.diagonal(), expected.diagonal(), atol=1e-15)
    np.testing.assert_allclose(condensed.tocsr().toarray(), expected, atol=1e-15)
    some = np.array([20, 3, 7])
    np.testing.assert_allclose(condensed[some].toarray(), expected[some], atol=1e-15)
    right = np.random.default_rng(2).standard_normal(21)
    np.testing.assert_allclose(expected @ system.factor.solve(right), right, atol=1e-13)


# The direct solver: solutions known beforehand, and refusals.


def springs(count: int, ends: float = 1.0) -> csr_matrix:
    """A chain of unit springs, each end held by a spring of stiffness `ends`."""
    main = np.full(count, 2.0)
    main[[0, -1]] = 1.0 + ends
    return csr_matrix(diags([-np.ones(count - 1), main, -np.ones(count - 1)], [-1, 0, 1]))


def laplacian(count: int, ends: float = 1.0) -> csr_matrix:
    """Seven-point Laplacian on count³ points."""
    line, unit = springs(count, ends), eye(count)
    return csr_matrix(
        kron(kron(line, unit), unit) + kron(kron(unit, line), unit) + kron(kron(unit, unit), line)
    )


@pytest.mark.parametrize("columns", [None, 1, 3])
def test_manufactured_solution(columns):
    matrix = laplacian(9)
    exact = np.random.default_rng(1).standard_normal((729,) if columns is None else (729, columns))
    with factorise(matrix) as factor:
        solution = factor.solve(matrix @ exact)
    assert solution.shape == exact.shape
    np.testing.assert_allclose(solution, exact, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        solution, spsolve(matrix.tocsc(), matrix @ exact).reshape(exact.shape), atol=1e-12
    )


def test_units_do_not_matter():
    """Scaling rows and columns alike by powers of two changes no digit."""
    matrix, right = laplacian(6), np.arange(216.0)
    powers = np.exp2(np.random.default_rng(3).integers(-60, 60, 216))
    with factorise(matrix) as factor:
        plain = factor.solve(right)
    with factorise(diags(powers) @ matrix @ diags(powers)) as factor:
        np.testing.assert_array_equal(factor.solve(powers * right), plain / powers)


@given(stiffness=st.floats(1e-200, 1e200))
def test_one_unknown(stiffness):
    with factorise(csr_matrix([[stiffness]])) as factor:
        assert factor.solve(np.array([stiffness])) == pytest.approx([1.0], rel=4e-16)


def test_diagonal_matrix():
    values = np.array([1e-9, 1.0, 3.0, 1e9])
    with factorise(diags(values)) as factor:
        np.testing.assert_allclose(factor.solve(values), 1.0, rtol=4e-16)


def test_columns_in_single_precision():
    """As multigrid has them."""
    exact = np.arange(1, 8, dtype=np.float32)[:, None]
    matrix = springs(7)
    solve = factorise_roughly(matrix)
    np.testing.assert_allclose(solve((matrix @ exact).astype(np.float32)), exact, rtol=1e-6)


def test_no_unknowns():
    assert factorise(csr_matrix((0, 0))).solve(np.zeros(0)).shape == (0,)


def test_upper_triangle_alone_is_read():
    matrix = laplacian(4)
    exact = np.arange(64.0)
    for given_matrix in (
        triu(matrix),
        csc_matrix(triu(matrix)),
        triu(matrix) + 7 * tril(matrix, -1),
    ):
        with factorise(given_matrix) as factor:
            np.testing.assert_allclose(factor.solve(matrix @ exact), exact, atol=1e-12)


def test_unsorted_and_repeated_entries():
    backwards = (np.array([1.0, 4.0, 4.0]), np.array([1, 0, 1]), np.array([0, 2, 3]))
    matrix = csr_matrix(backwards)  # (0, 1) = 1 is stored before (0, 0) = 4
    with factorise(matrix) as factor:
        np.testing.assert_allclose(factor.solve(np.array([5.0, 5.0])), 1.0, rtol=1e-15)
    repeated = csr_matrix((2, 2))
    repeated.data, repeated.indices = np.array([3.0, 1.0, 1.0, 4.0]), np.array([0, 0, 1, 1])
    repeated.indptr = np.array([0, 3, 4])
    with factorise(repeated) as factor:
        np.testing.assert_allclose(factor.solve(np.array([5.0, 5.0])), 1.0, rtol=1e-15)
    assert repeated.nnz == 4, "the matrix given is left as it was"


def test_threads_solve_side_by_side():
    def work(seed: int) -> float:
        matrix = laplacian(6 + seed)
        exact = np.random.default_rng(seed).standard_normal(matrix.shape[0])
        with factorise(matrix) as factor:
            return float(np.abs(factor.solve(matrix @ exact) - exact).max())

    with ThreadPoolExecutor(4) as pool:
        assert max(pool.map(work, [0, 1, 2, 3])) < 1e-13


@pytest.mark.parametrize(
    "matrix",
    [
        springs(5, 0.0),
        laplacian(7, 0.0),
        csr_matrix(np.ones((2, 2))),
        block_array([[springs(300), None], [None, springs(300, 0.0)]]),
    ],
    ids=["chain", "block", "ones", "one body free"],
)
def test_singular_is_refused(matrix):
    with pytest.raises(SolveError, match=r"singular|not positive definite") as caught:
        factorise(matrix)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "matrix", [[[1.0, 2.0], [2.0, 1.0]], [[1.0, 0], [0, -1]], [[1, 0], [0, 0]]]
)
def test_indefinite_is_refused_where_positive_definite_is_asked(matrix):
    with pytest.raises(SolveError, match="not positive definite"):
        factorise(csr_matrix(np.array(matrix, dtype=float)))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_entries_that_are_not_finite_are_refused(bad):
    with pytest.raises(SolveError, match="not finite"):
        factorise(csr_matrix([[1.0, bad], [bad, 1.0]]))


def test_nearly_singular_is_solved_while_digits_are_left():
    """Held by a spring of 1e-12: twelve digits go, four stay."""
    matrix = springs(6, 0.0)
    matrix[0, 0] += 1e-12
    with factorise(matrix) as factor:
        solution = factor.solve(np.array([0, 0, 0, 0, 0, 1.0]))
    np.testing.assert_allclose(solution, 1e12, rtol=1e-3)
