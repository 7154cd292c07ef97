"""Direct solvers: solutions known beforehand, refusals, and the same answer from every backend."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import block_array, csc_matrix, csr_matrix, diags, eye, kron, tril, triu

from solver.lac.errors import SolveError
from solver.mechanics.linear.direct import (
    BACKENDS,
    factorise,
    factorise_indefinite,
    force_solver,
)


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


def saddle(count: int) -> csr_matrix:
    """A floating chain of springs tied to the ground by a multiplier at one end."""
    tie = csr_matrix(([1.0], ([0], [0])), shape=(1, count))
    return csr_matrix(block_array([[springs(count, 0.0), tie.T], [tie, None]]))


@pytest.fixture(params=BACKENDS)
def kind(request):
    return request.param


@pytest.mark.parametrize("columns", [None, 1, 3])
def test_manufactured_solution(kind, columns):
    matrix = laplacian(9)
    exact = np.random.default_rng(1).standard_normal((729,) if columns is None else (729, columns))
    with factorise(matrix, kind) as factor:
        solution = factor.solve(matrix @ exact)
    assert solution.shape == exact.shape
    np.testing.assert_allclose(solution, exact, rtol=0, atol=1e-13)
    assert factor.name


def test_units_do_not_matter(kind):
    """Scaling rows and columns alike by powers of two changes no digit."""
    matrix, right = laplacian(6), np.arange(216.0)
    powers = np.exp2(np.random.default_rng(3).integers(-60, 60, 216))
    with factorise(matrix, kind) as factor:
        plain = factor.solve(right)
    with factorise(diags(powers) @ matrix @ diags(powers), kind) as factor:
        np.testing.assert_array_equal(factor.solve(powers * right), plain / powers)


@given(stiffness=st.floats(1e-200, 1e200))
def test_one_unknown(stiffness):
    for kind in BACKENDS:
        with factorise(csr_matrix([[stiffness]]), kind) as factor:
            assert factor.solve(np.array([stiffness])) == pytest.approx([1.0], rel=4e-16)


def test_diagonal_matrix(kind):
    values = np.array([1e-9, 1.0, 3.0, 1e9])
    with factorise(diags(values), kind) as factor:
        np.testing.assert_allclose(factor.solve(values), 1.0, rtol=4e-16)


def test_columns_in_single_precision(kind):
    """As multigrid has them."""
    exact = np.arange(1, 8, dtype=np.float32)[:, None]
    matrix = springs(7)
    solve = BACKENDS[kind].factor(csr_matrix(triu(matrix)), True)
    np.testing.assert_allclose(solve((matrix @ exact).astype(np.float32)), exact, rtol=1e-6)


def test_no_unknowns():
    assert factorise(csr_matrix((0, 0))).solve(np.zeros(0)).shape == (0,)


def test_upper_triangle_alone_is_read(kind):
    matrix = laplacian(4)
    exact = np.arange(64.0)
    for given_matrix in (
        triu(matrix),
        csc_matrix(triu(matrix)),
        triu(matrix) + 7 * tril(matrix, -1),
    ):
        with factorise(given_matrix, kind) as factor:
            np.testing.assert_allclose(factor.solve(matrix @ exact), exact, atol=1e-12)


def test_unsorted_and_repeated_entries(kind):
    backwards = (np.array([1.0, 4.0, 4.0]), np.array([1, 0, 1]), np.array([0, 2, 3]))
    matrix = csr_matrix(backwards)  # (0, 1) = 1 is stored before (0, 0) = 4
    with factorise(matrix, kind) as factor:
        np.testing.assert_allclose(factor.solve(np.array([5.0, 5.0])), 1.0, rtol=1e-15)
    repeated = csr_matrix((2, 2))
    repeated.data, repeated.indices = np.array([3.0, 1.0, 1.0, 4.0]), np.array([0, 0, 1, 1])
    repeated.indptr = np.array([0, 3, 4])
    with factorise(repeated, kind) as factor:
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
def test_singular_is_refused(kind, matrix):
    with pytest.raises(SolveError, match=r"singular|not positive definite") as caught:
        factorise(matrix, kind)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "matrix", [[[1.0, 2.0], [2.0, 1.0]], [[1.0, 0], [0, -1]], [[1, 0], [0, 0]]]
)
def test_indefinite_is_refused_where_positive_definite_is_asked(kind, matrix):
    with pytest.raises(SolveError, match="not positive definite"):
        factorise(csr_matrix(np.array(matrix, dtype=float)), kind)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_entries_that_are_not_finite_are_refused(bad):
    with pytest.raises(SolveError, match="not finite"):
        factorise(csr_matrix([[1.0, bad], [bad, 1.0]]))


def test_nearly_singular_is_solved_while_digits_are_left(kind):
    """Held by a spring of 1e-12: twelve digits go, four stay."""
    matrix = springs(6, 0.0)
    matrix[0, 0] += 1e-12
    with factorise(matrix, kind) as factor:
        solution = factor.solve(np.array([0, 0, 0, 0, 0, 1.0]))
    np.testing.assert_allclose(solution, 1e12, rtol=1e-3)


def test_saddle_point():
    """Unit forces on a chain tied at its first mass: elongations by hand, multiplier = -sum."""
    count = 60
    right = np.append(np.ones(count), 0.0)
    with factorise_indefinite(saddle(count)) as factor:
        solution = factor.solve(right)
    tensions = np.arange(count - 1, 0, -1)
    np.testing.assert_allclose(solution[:count], np.append(0, np.cumsum(tensions)), rtol=1e-12)
    assert solution[count] == pytest.approx(count, rel=1e-12)


def test_saddle_point_in_any_units():
    matrix, exact = saddle(40), np.linspace(1.0, 2.0, 41)
    units = diags(np.append(np.full(40, 1e-6), 1e9))
    scaled = csr_matrix(units @ matrix @ units)
    with factorise_indefinite(scaled) as factor:
        solution = factor.solve(scaled @ exact)
    residual = np.abs(scaled @ (solution - exact))
    assert (residual <= 1e-13 * (abs(scaled) @ exact)).all()


def test_singular_saddle_point_is_refused():
    floating = csr_matrix(block_array([[springs(10, 0.0), None], [None, -eye(1)]]))
    with pytest.raises(SolveError, match=r"singular|not regular"):
        factorise_indefinite(floating)
    with pytest.raises(SolveError, match="row 1 is zero"):
        factorise_indefinite(csr_matrix([[1.0, 0.0], [0.0, 0.0]]))


def test_a_chosen_solver_stands_for_auto_within_its_block(kind):
    before = factorise(laplacian(3)).name
    with force_solver(kind):
        assert factorise(laplacian(3)).name == BACKENDS[kind].name
        assert factorise(laplacian(3), "superlu").name == "SuperLU"
    assert factorise(laplacian(3)).name == before


def test_what_a_chosen_solver_cannot_do_is_no_other_s_work():
    with (
        force_solver("cholmod"),
        pytest.raises(SolveError, match="CHOLMOD factors positive definite matrices only"),
    ):
        factorise_indefinite(saddle(4))
