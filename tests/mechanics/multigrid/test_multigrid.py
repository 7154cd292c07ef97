"""Multigrid on blocks of HEXA8: solutions known beforehand, iterations, and when it gives way."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import block_array, block_diag, bsr_matrix, csr_matrix, eye

from solver.lac import threads
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.errors import SolveError
from solver.mechanics.fem.block import Block
from solver.mechanics.fem.elasticity import lame_parameters, stiffness
from solver.mechanics.linear import choice, condensed_matrix, products
from solver.mechanics.linear.choice import Solvers
from solver.mechanics.linear.condensation import condense
from solver.mechanics.linear.krylov import ROUGH, two_steps
from solver.mechanics.linear.symmetric_blocks import NodalMatrix
from solver.mechanics.linear.systems import Part, Systems
from solver.mechanics.linear.unknowns import Unknowns
from solver.mechanics.multigrid import hierarchy
from solver.mechanics.multigrid.multigrid import Multigrid, Shared
from tests.patches import force_solver
from tests.scenes import grid


def block(count: int, stretch: float = 1.0, poisson: float = 0.3) -> tuple[np.ndarray, csr_matrix]:
    """Points (n, 3) and stiffness of a unit cube of count³ cells, stretched along z."""
    points, cells = grid(count)
    lame, shear = lame_parameters(np.full(len(cells), 2000.0), np.full(len(cells), poisson))
    points = points * [1.0, 1.0, stretch]
    return points, stiffness(points, [Block(BY_NAME["HEXA8"], cells, lame, shear)]).tocsr()


def motions(points: np.ndarray) -> np.ndarray:
    """Three translations and three rotations (3n, 6)."""
    rotations = [np.cross(axis, points) for axis in np.eye(3)]
    shifts = [np.tile(axis, (len(points), 1)) for axis in np.eye(3)]
    return np.stack([m.ravel() for m in shifts + rotations], axis=1)


def held(points: np.ndarray, matrix: csr_matrix, free: np.ndarray, body: np.ndarray):
    """The system of the free unknowns, and what they stand for."""
    kept = np.flatnonzero(free.ravel())
    unknowns = Unknowns(3, kept // 3, lambda: motions(points)[kept], body[kept // 3])
    return csr_matrix(matrix[kept][:, kept]), unknowns


def clamped(count: int, **options: float):
    points, matrix = block(count, **options)
    free = np.repeat(points[:, 2:] > 0, 3, axis=1)
    return held(points, matrix, free, np.zeros(len(points), dtype=int))


def on_rollers(count: int):
    """Three symmetry planes: nodes on them have one, two or no unknowns."""
    points, matrix = block(count)
    return held(points, matrix, points > 0, np.zeros(len(points), dtype=int))


def two_blocks(count: int):
    """One block sliding on another: their facing nodes share the vertical displacement."""
    points, matrix = block(count)
    n = len(points)
    both, top = block_diag([matrix, matrix]).tocsr(), np.flatnonzero(points[:, 2] == 1)
    bottom = n + np.flatnonzero(points[:, 2] == 0)
    follow = eye(6 * n, format="lil")
    follow[3 * bottom + 2, 3 * bottom + 2] = 0
    follow[3 * bottom + 2, 3 * top + 2] = 1
    follow = follow.tocsr()
    free = np.concatenate([points > 0, points > [0, 0, -1]])
    free[bottom, 2] = False
    body = np.repeat([0, 1], n)
    stacked = np.concatenate([points, points + np.array([0, 0, 1])])
    return held(stacked, follow.T @ both @ follow, free, body)


@pytest.mark.parametrize("system", [clamped, on_rollers, two_blocks])
def test_manufactured_solution_in_few_iterations(system):
    matrix, unknowns = system(8)
    exact = np.random.default_rng(0).standard_normal((matrix.shape[0], 2))
    solver = Multigrid(matrix, unknowns)
    solution = solver.solve(matrix @ exact)
    np.testing.assert_allclose(solution, exact, rtol=0, atol=1e-11)
    assert solver.iterations <= 40
    single = solver.solve(matrix @ exact[:, 1])
    np.testing.assert_allclose(single, exact[:, 1], rtol=0, atol=1e-11)


def test_iterations_hardly_grow_with_the_mesh():
    iterations = []
    for count in (8, 16):
        matrix, unknowns = clamped(count)
        solver = Multigrid(matrix, unknowns)
        solver.solve(np.ones(matrix.shape[0]))
        iterations.append(solver.iterations)
    assert iterations[1] <= iterations[0] + 8


def test_bodies_that_slide_share_no_aggregate():
    """Aggregates across the contact surface cannot slide: many more iterations."""
    matrix, unknowns = two_blocks(8)
    glued = Unknowns(3, unknowns.node, unknowns.motions, np.zeros_like(unknowns.body))
    apart, across = Multigrid(matrix, unknowns), Multigrid(matrix, glued)
    right = np.ones(matrix.shape[0])
    np.testing.assert_allclose(apart.solve(right), across.solve(right), rtol=1e-10)
    assert apart.iterations < across.iterations


def test_order_and_units_of_the_unknowns_do_not_matter():
    matrix, unknowns = on_rollers(8)
    exact = np.random.default_rng(1).standard_normal(matrix.shape[0])
    order = np.random.default_rng(2).permutation(matrix.shape[0])
    shuffled = unknowns.of(order)
    solver = Multigrid(1e-12 * matrix[order][:, order], shuffled)
    solution = solver.solve(1e-12 * (matrix @ exact)[order])
    np.testing.assert_allclose(solution, exact[order], rtol=0, atol=1e-11)


def test_zero_right_hand_side():
    matrix, unknowns = clamped(6)
    solver = Multigrid(matrix, unknowns)
    np.testing.assert_array_equal(solver.solve(np.zeros(matrix.shape[0])), 0.0)


def test_diagonal_that_is_not_positive_is_refused():
    matrix, unknowns = clamped(6)
    matrix[0, 0] = 0.0
    with pytest.raises(SolveError, match="not positive definite"):
        Multigrid(matrix, unknowns)


def test_rough_solution_is_as_rough_as_promised():
    matrix, unknowns = clamped(8)
    right = np.random.default_rng(3).standard_normal(matrix.shape[0])
    solver = Multigrid(matrix, unknowns)
    rough, exact = solver.solve(right, ROUGH), solver.solve(right)
    assert np.linalg.norm(rough - exact) < 1e-6 * np.linalg.norm(exact)
    assert (rough != exact).any()


def test_nodes_without_neighbours_do_not_coarsen():
    count = 4500
    node = np.arange(count) // 3
    unknowns = Unknowns(3, node, lambda: np.ones((count, 6)), np.zeros(count, dtype=int))
    with pytest.raises(SolveError, match="its levels end at 4500 unknowns: nothing coarsens"):
        Multigrid(csr_matrix(eye(count)), unknowns)


def test_right_hand_side_that_is_no_number():
    matrix, unknowns = clamped(6)
    with pytest.raises(SolveError, match=r"the solution by conjugate gradients .* is not finite"):
        Multigrid(matrix, unknowns).solve(np.full(matrix.shape[0], np.nan))


def test_choice_by_size_and_dimension(monkeypatch):
    matrix, unknowns = clamped(6)
    monkeypatch.setattr(choice, "MULTIGRID_FROM", matrix.shape[0])
    large = Solvers(unknowns).prepare(matrix)
    assert "multigrid" in large.name
    assert "unknowns or more in 3D" in large.why
    plane = Solvers(replace(unknowns, dim=2)).prepare(matrix)
    assert "multigrid" not in plane.name
    assert "2D" in plane.why
    monkeypatch.setattr(choice, "MULTIGRID_FROM", matrix.shape[0] + 1)
    small = Solvers(unknowns).prepare(matrix)
    assert "multigrid" not in small.name
    assert "fewer than" in small.why


def tied_to_one_node(count: int):
    """A clamped cube, all nodes of which feel one free node of another body."""
    matrix, unknowns = clamped(count)
    n = matrix.shape[0]
    link = csr_matrix(np.tile(np.eye(3), (n // 3, 1)))
    tied = block_array([[matrix + eye(n), -link], [-link.T, n * eye(3)]]).tocsr()
    node = np.append(unknowns.node, [unknowns.node.max() + 1] * 3)
    body, shifts = np.repeat([0, 1], [n, 3]), np.hstack([np.eye(3), np.zeros((3, 3))])
    return tied, Unknowns(3, node, lambda: np.vstack([unknowns.motions(), shifts]), body)


def test_coarse_levels_that_would_fill_in_are_not_formed(monkeypatch):
    def untouched(*_):
        raise AssertionError("the coarse level is formed")

    matrix, unknowns = tied_to_one_node(14)
    monkeypatch.setattr(hierarchy, "coarse", untouched)
    with pytest.raises(SolveError, match=r"its coarse levels would fill in, to \d+ neighbours"):
        Multigrid(matrix, unknowns)
    with force_solver("multigrid"):
        chosen = Solvers(unknowns).prepare(matrix)
    assert "multigrid" not in chosen.name
    assert chosen.gave_up == chosen.why


@pytest.mark.parametrize("slow", [False, True])
def test_threads_change_no_digit(monkeypatch, slow):
    monkeypatch.setattr(products, "_LEAST", 1000)
    monkeypatch.setattr(hierarchy, "COARSEST", 60)
    matrix, unknowns = two_blocks(8)
    right = np.random.default_rng(5).standard_normal(matrix.shape[0])
    found = []
    for count in (1, 2, 5):
        for module in (products, threads):
            monkeypatch.setattr(module, "workers", lambda n=count: n)
        shared = Shared()
        shared.slow = slow
        solver = Multigrid(matrix, unknowns, shared)
        assert len(solver._levels) > 1
        found.append(solver.solve(right))
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])


def test_two_steps_leave_the_least_energy_in_their_plane():
    rng = np.random.default_rng(6)
    root = rng.standard_normal((30, 30))
    matrix = (root @ root.T + 5 * np.eye(30)).astype(np.float32)
    residual, directions = rng.standard_normal(30).astype(np.float32), []

    def precondition(x):
        directions.append(np.float32(0.1) * np.tanh(x) + x / matrix.diagonal())
        return directions[-1].copy()

    found = two_steps(precondition, matrix.__matmul__, residual)
    assert len(directions) == 2
    plane = np.stack(directions, axis=1).astype(float)
    least = plane @ np.linalg.solve(plane.T @ matrix @ plane, plane.T @ residual)
    np.testing.assert_allclose(found, least, rtol=0, atol=1e-5 * np.abs(least).max())


def test_two_steps_for_nothing():
    nothing = np.zeros(4, np.float32)
    np.testing.assert_array_equal(two_steps(np.copy, np.copy, nothing), nothing)


def test_the_product_of_a_level_is_what_it_leaves_of_a_residual():
    """Under contact too."""
    matrix, unknowns = clamped(10)
    n = matrix.shape[0]
    rows = csr_matrix(([1.0, -1.0], ([0, 0], [0, 90])), shape=(1, n))
    with force_solver("multigrid"):
        solver = condense(matrix, rows, np.arange(n) == 0, Solvers(unknowns)).factor
    for level in solver._solver._levels:
        assert level.correction is not None
        x, b = np.random.default_rng(7).standard_normal((2, level.matrix.shape[0])).astype("f4")
        np.testing.assert_allclose(level.remaining(b, x), b - level.product(x), atol=1e-5)


def test_parts_of_a_setup_make_no_difference(monkeypatch):
    matrix, unknowns = two_blocks(8)
    right = np.random.default_rng(2).standard_normal(matrix.shape[0])
    whole = Multigrid(matrix, unknowns).solve(right)
    monkeypatch.setattr(condensed_matrix, "_ROWS_AT_ONCE", 90)
    monkeypatch.setattr(products, "_LEAST", 500)
    found = Multigrid(matrix, unknowns).solve(right)
    np.testing.assert_allclose(found, whole, rtol=0, atol=1e-12 * np.abs(whole).max())


@pytest.mark.parametrize("tied", [False, True])
def test_nodal_blocks_give_the_solution_of_the_entries(tied):
    """Condensed or not; most of the held nodes have no unknown at all."""
    points, entries = block(8)
    free = points > [0, 0, 0.3]
    matrix, unknowns = held(points, entries, free, np.zeros(len(points), dtype=int))
    nodal = NodalMatrix(bsr_matrix(entries, blocksize=(3, 3)), np.flatnonzero(free.ravel()))
    n = matrix.shape[0]
    rows = csr_matrix(([1.0, -0.4, -0.6], ([0, 0, 0], [5, 90, n - 1])), shape=(1, n))[: int(tied)]
    right, violation = np.random.default_rng(4).standard_normal(n), np.ones(int(tied))
    own = np.arange(n) == 5
    with force_solver("multigrid"):
        systems = [condense(each, rows, own, Solvers(unknowns)) for each in (matrix, nodal)]
    found = [system.correction(right, violation) for system in systems]
    assert "multigrid" in systems[1].factor.name
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-12 * np.abs(found[0]).max())
    assert systems[1].factor.iterations <= systems[0].factor.iterations + 3


def test_choice_as_asked_for():
    matrix, unknowns = clamped(6)
    for kind, name in (("multigrid", "multigrid"), ("cholmod", "CHOLMOD")):
        chosen = Solvers(replace(unknowns, solver=kind)).prepare(matrix)
        assert name in chosen.name
        assert chosen.why == "as asked for"


@pytest.mark.parametrize("options", [{"poisson": 0.49999}, {"stretch": 100.0}])
def test_a_factor_takes_over_where_multigrid_does_not_converge(options):
    matrix, unknowns = clamped(8, **options)
    with pytest.raises(SolveError, match="conjugate gradients leave a residual"):
        Multigrid(matrix, unknowns).solve(np.ones(matrix.shape[0]))
    exact = np.ones(matrix.shape[0])
    with force_solver("multigrid"):
        chosen = Solvers(unknowns).prepare(matrix)
        assert "multigrid" in chosen.name
        np.testing.assert_allclose(chosen.solve(matrix @ exact), exact, rtol=1e-6)
        assert "multigrid" not in chosen.name
        assert "conjugate gradients leave a residual" in chosen.why
        again = Solvers(unknowns, chosen.gave_up).prepare(matrix)
        assert (again.name, again.why) == (chosen.name, chosen.why)


def test_multigrid_that_gave_up_is_not_tried_for_another_status(gave_up):
    matrix, unknowns = clamped(4)
    n = matrix.shape[0]
    rows = csr_matrix(([1.0, -1.0, 1.0, -1.0], ([0, 0, 1, 1], [0, 90, 3, 93])), shape=(2, n))
    own = np.isin(np.arange(n), [0, 3])
    parts = [Part(np.ones(n, dtype=bool), np.ones(2, dtype=bool))]
    systems = Systems(matrix, rows, own, unknowns, parts)
    with force_solver("multigrid"):
        for closed in ([True, True], [True, False], [False, False]):
            system = systems.closed(np.array(closed))
            change = system.correction(np.ones(n), np.zeros(sum(closed)))
            left = np.ones(n) - matrix @ change
            assert system.imbalance(left, np.zeros(1)) < 1e-9
    assert len(gave_up) == 1


def test_free_body_is_in_doubt():
    points, matrix = block(6)
    everything = np.ones_like(points, dtype=bool)
    matrix, unknowns = held(points, matrix, everything, np.zeros(len(points), dtype=int))
    with force_solver("multigrid"):
        found = Solvers(unknowns).prepare(matrix)
        found.solve(np.ones(matrix.shape[0]))
    assert "singular" in found.warning or "not positive definite" in found.warning


def test_memory_beside_the_stiffness_is_less_than_one_and_a_half_of_its_own(monkeypatch):
    monkeypatch.setattr(condensed_matrix, "_ROWS_AT_ONCE", 3_000)
    monkeypatch.setattr(products, "_LEAST", 100_000)
    matrix, unknowns = clamped(24)
    size = matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes
    rows = csr_matrix(([1.0, -1.0], ([0, 0], [0, 90])), shape=(1, matrix.shape[0]))
    own = np.arange(matrix.shape[0]) == 0
    right = np.ones(matrix.shape[0])
    with force_solver("multigrid"):
        tracemalloc.start()
        system = condense(matrix, rows, own, Solvers(unknowns))
        system.correction(right, np.zeros(1))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert "multigrid" in system.factor.name
    assert peak < 1.5 * size
