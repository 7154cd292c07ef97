"""Multigrid under contact: the levels of the bodies, corrected; one hierarchy for all statuses."""

import numpy as np
import pytest
from scipy.sparse import block_diag, bsr_matrix, csr_matrix, eye, random_array
from scipy.sparse.linalg import spsolve

from solver.mechanics.linear.choice import Solvers
from solver.mechanics.linear.condensation import condense
from solver.mechanics.linear.condensed_matrix import CondensedMatrix
from solver.mechanics.linear.symmetric_blocks import halved
from solver.mechanics.linear.systems import Part, Systems
from solver.mechanics.linear.unknowns import Unknowns
from solver.mechanics.multigrid import multigrid
from solver.mechanics.multigrid.hierarchy import Correction, Hierarchy, Level, correction_of
from solver.mechanics.multigrid.multigrid import Multigrid
from tests.mechanics.multigrid.test_multigrid import block, motions
from tests.patches import force_solver


def pressed(slave: int, master: int):
    """Stiffness, gaps, own unknowns and their meaning: a cube held below, another one on it.

    Every upper node of the slave (of slave³ cells) stays on the face of the master that it meets.
    """
    (low, first), (high, second) = block(slave), block(master)
    points = np.vstack([low, high + np.eye(3)[2]])
    matrix = block_diag([first, second]).tocsr()
    free = points > 0
    # The master is guided: it moves along z alone.
    free[np.flatnonzero(points[:, 2] == 2), :2] = False
    top = np.flatnonzero(low[:, 2] == 1)
    rows, columns, values = [np.arange(len(top))], [3 * top + 2], [np.ones(len(top))]
    cell = np.minimum((low[top, :2] * master).astype(int), master - 1)
    at = low[top, :2] * master - cell
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        corner = (cell + np.array([i, j])) @ [(master + 1) ** 2, master + 1] + len(low)
        weight = np.where(i, at[:, 0], 1 - at[:, 0]) * np.where(j, at[:, 1], 1 - at[:, 1])
        rows.append(np.arange(len(top)))
        columns.append(3 * corner + 2)
        values.append(-weight)
    where = np.concatenate(rows), np.concatenate(columns)
    gaps = csr_matrix((np.concatenate(values), where), shape=(len(top), len(points) * 3))
    kept = np.flatnonzero(free.ravel())
    own = np.isin(kept, 3 * top + 2)
    body = np.repeat([0, 1], [len(low), len(high)])
    unknowns = Unknowns(3, kept // 3, lambda: motions(points)[kept], body[kept // 3], points)
    return csr_matrix(matrix[kept][:, kept]), csr_matrix(gaps[:, kept]), own, unknowns


def condensed(matrix, gaps, own, unknowns) -> CondensedMatrix:
    with force_solver("multigrid"):
        return condense(matrix, gaps, own, Solvers(unknowns)).factor._matrix


def test_corrected_matrix_is_the_condensed_one():
    matrix, gaps, own, unknowns = pressed(3, 2)
    found = condensed(matrix, gaps, own, unknowns)
    n = matrix.shape[0]
    order = np.random.default_rng(0).permutation(n)
    correction = correction_of(found, np.ones(n), order)
    whole = matrix.toarray()
    rows = np.argsort(order)[correction.rows]
    whole[np.ix_(rows, rows)] += correction.matrix.toarray()
    expected = np.zeros((n, n))
    expected[np.ix_(found.kept, found.kept)] = found.tocsr().toarray()
    np.testing.assert_allclose(whole, expected, atol=1e-6 * np.abs(matrix.data).max())


def test_coarser_correction_is_that_of_the_prolongation():
    rng = np.random.default_rng(1)
    rows = np.array([1, 4, 5, 11])
    dense = rng.standard_normal((4, 4)).astype(np.float32)
    way = bsr_matrix(random_array((12, 12), density=0.4, rng=rng), blocksize=(3, 6))
    found = Correction(rows, csr_matrix(dense + dense.T)).coarser(way)
    whole = np.zeros((12, 12))
    whole[np.ix_(rows, rows)] = dense + dense.T
    expected, coarse = way.toarray().T @ whole @ way.toarray(), np.zeros((12, 12))
    coarse[np.ix_(found.rows, found.rows)] = found.matrix.toarray()
    np.testing.assert_allclose(coarse, expected, atol=1e-5)


@pytest.mark.parametrize(("slave", "master"), [(10, 8), (8, 10), (14, 1), (1, 14)])
def test_condensed_system_in_few_iterations(slave, master):
    """Also where one face meets 196: contact fills no coarse level in."""
    matrix, gaps, own, unknowns = pressed(slave, master)
    found = condensed(matrix, gaps, own, unknowns)
    exact = np.random.default_rng(2).standard_normal(found.shape[0])
    solver = Multigrid(found, unknowns)
    solution = solver.solve((found @ exact[:, None])[:, 0])
    np.testing.assert_allclose(solution, exact, rtol=0, atol=1e-10)
    assert solver.iterations <= 35
    assert all(level.interface is not None for level in solver._levels)


@pytest.mark.parametrize("count", [12, 9])
def test_where_all_is_beside_contact_nothing_is_left_to_smooth(count):
    matrix = (
        np.diag(np.full(12, 1.0)) - np.diag(np.full(11, 0.4), 1) - np.diag(np.full(11, 0.4), -1)
    )
    way = bsr_matrix(np.kron(np.ones((4, 1)), np.eye(3, 6)), blocksize=(3, 6), dtype=np.float32)
    whole = halved(bsr_matrix(matrix, blocksize=(3, 3), dtype=np.float32))
    nothing = Correction(np.arange(count), csr_matrix((count, count), dtype=np.float32))
    level = Level(whole, np.float32(2.0), way).corrected(nothing, most=np.inf)
    _, left = level.interface.before(np.ones(12, np.float32))
    assert level.all_beside == (count == 12) == bool(np.abs(left).max() < 1e-5)


def test_bound_of_a_corrected_level_is_that_of_the_whole_matrix():
    """Though it comes from the bodies and from the rows beside contact, one without the other."""
    matrix, gaps, own, unknowns = pressed(6, 5)
    level = Multigrid(condensed(matrix, gaps, own, unknowns), unknowns)._levels[0]
    assert level.correction is not None
    whole, rows = level.matrix.tobsr().toarray().astype(float), level.correction.rows
    whole[np.ix_(rows, rows)] += level.correction.matrix.toarray()
    half = np.ones(len(whole))
    half[rows] = np.sqrt(level.weight)
    largest = np.linalg.eigvalsh(half[:, None] * whole * half)[-1]
    assert largest < level.bound < 1.1 * largest


@pytest.mark.parametrize(("changed", "expected"), [(1.0, 2.0), (0.0, 1.5)])
def test_bound_by_hand(changed, expected):
    """Of rows (1, -1/2, -1/2), where contact turns the sign beside the diagonal of the first."""
    node = np.full((3, 3), -0.5) + 1.5 * np.eye(3)
    matrix = bsr_matrix(block_diag([node] * 4), blocksize=(3, 3)).astype(np.float32)
    change = csr_matrix(changed * (np.ones((3, 3)) - np.eye(3)), dtype=np.float32)
    level = Level(halved(matrix), np.float32(1.05 * 1.5), matrix)
    found = level.corrected(Correction(np.arange(3), change), most=0)
    assert found.bound == pytest.approx(1.05 * expected, rel=1e-6)


def test_exact_solve_beside_contact_saves_iterations(monkeypatch):
    matrix, gaps, own, unknowns = pressed(12, 9)
    found, iterations = condensed(matrix, gaps, own, unknowns), []
    for share in (0.0, 1 / 4):
        monkeypatch.setattr(multigrid, "_MOST_BESIDE", share)
        solver = Multigrid(found, unknowns)
        solver.solve(np.ones(found.shape[0]))
        iterations.append(solver.iterations)
    assert iterations[1] < iterations[0]


def test_one_hierarchy_serves_all_statuses(monkeypatch):
    """And the correction of each status is its own: solutions are those of a direct solver."""
    built = []
    setup = Hierarchy.__init__

    def counted(self, matrix, unknowns):
        built.append(matrix)
        setup(self, matrix, unknowns)

    monkeypatch.setattr(Hierarchy, "__init__", counted)
    matrix, gaps, own, unknowns = pressed(6, 5)
    n, m = matrix.shape[0], gaps.shape[0]
    parts = [Part(np.ones(n, dtype=bool), np.ones(m, dtype=bool))]
    systems = Systems(matrix, gaps, own, unknowns, parts)
    force = np.random.default_rng(3).standard_normal(n)
    with force_solver("multigrid"):
        for closed in (np.ones(m, dtype=bool), np.arange(m) % 7 > 0, np.arange(m) < 20):
            system = systems.closed(closed)
            assert "multigrid" in system.factor.name
            change = system.correction(force, np.zeros(int(closed.sum())))
            assert "multigrid" in system.factor.name
            rows = gaps[closed]
            weighted = (matrix + 1e6 * (rows.T @ rows)).tocsc()
            rough = spsolve(weighted, force)
            np.testing.assert_allclose(change, rough, atol=1e-2 * np.abs(rough).max())
            np.testing.assert_allclose(rows @ change, 0.0, atol=1e-13 * np.abs(change).max())
            assert (
                system.imbalance(force - matrix @ change, rows @ change)
                < 1e-11 * np.abs(force).max()
            )
    assert len(built) == 1
    systems.forget()
    with force_solver("multigrid"):
        systems.closed(np.ones(m, dtype=bool))
    assert len(built) == 2


def test_slender_cells_are_gathered_along_short_edges():
    """Cells fifty times wider than high: neighbours by the mesh alone do not converge."""
    points, matrix = block(12, stretch=1 / 50)
    kept = np.flatnonzero(np.repeat(points[:, 2] > 0, 3))
    about = 3, kept // 3, lambda: motions(points)[kept], np.zeros(len(kept), dtype=int)
    free = csr_matrix(matrix[kept][:, kept])
    exact = np.random.default_rng(4).standard_normal(len(kept))
    iterations = []
    for known in (points, None):
        solver = Multigrid(free, Unknowns(*about, known))
        solution = solver.solve(free @ exact, 1e-10)
        np.testing.assert_allclose(solution, exact, rtol=0, atol=1e-4)
        iterations.append(solver.iterations)
    assert iterations[0] < iterations[1] / 2


def test_no_contact_needs_no_correction():
    matrix, gaps, own, unknowns = pressed(4, 3)
    grounded = csr_matrix(matrix + eye(matrix.shape[0]))
    with force_solver("multigrid"):
        system = condense(grounded, gaps[:0], own, Solvers(unknowns))
        right = np.ones(matrix.shape[0])
        change = system.correction(right, np.zeros(0))
    np.testing.assert_allclose(grounded @ change, right, atol=1e-10)
