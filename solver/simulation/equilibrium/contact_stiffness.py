"""What contact alone sees of a system with all closed: a stiffness matrix, or its products."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

from ...lac.errors import SolveError
from ...mechanics.linear.symmetric_blocks import Stiffness
from ...mechanics.linear.systems import Systems
from .constraints import ContactConstraints

# More rows than these make the matrix of the contact alone too large, or, where each column takes
# iterations, too long to make: 867 rows of 60,000 unknowns take 65 s, products alone 22 s.
_MOST_ROWS, _MOST_ITERATIVE = 4000, 400
# A row whose jump moves a free body brings up nothing, and gets this share of its nodes' stiffness.
_LEAST = 1e-3
# A share of the loads: what contact pressure may leave of them on free rigid motions.
_BALANCED = 1e-9
# Entries of the solutions that are kept at once.
_AT_ONCE = 1 << 23


def contact_stiffness(
    systems: Systems, matrix: Stiffness, constraints: ContactConstraints, diagonal: np.ndarray
) -> tuple[np.ndarray | LinearOperator, np.ndarray]:
    """`stiffness_of` all that may close or stick (e, e), and about its diagonal (e,), positive.

    `diagonal` (n_dofs,) is that of the stiffness. For a large contact S is a product, by one
    solution each.
    """
    rows, of_nodes = constraints.eligible, _of_slave_nodes(constraints, diagonal)
    iterative = systems.factored(rows).factor.iterative
    if rows.sum() > (_MOST_ITERATIVE if iterative else _MOST_ROWS):
        return _products(systems, matrix, constraints), of_nodes
    found = stiffness_of(systems, matrix, constraints, rows)
    found = (found + found.T) / 2
    return found, np.maximum(np.abs(np.diag(found)), _LEAST * of_nodes)


def _products(
    systems: Systems, matrix: Stiffness, constraints: ContactConstraints
) -> LinearOperator:
    rows = constraints.eligible
    system, area = systems.factored(rows), constraints.covered[rows]
    nothing, size = np.zeros(matrix.shape[0]), len(area)

    def product(jump: np.ndarray) -> np.ndarray:
        change = system.correction(nothing, area * jump.ravel())
        return area * system.multiplier(-(matrix @ change))

    return LinearOperator((size, size), matvec=product, dtype=float)


def _of_slave_nodes(constraints: ContactConstraints, diagonal: np.ndarray) -> np.ndarray:
    """The forces (e,) that average gaps and slips bring up where each slave node moves alone."""
    rows, stiff = constraints.eligible, diagonal > 0
    soft = np.asarray(constraints.moving[rows].power(2)[:, stiff] @ (1 / diagonal[stiff]))
    soft = np.where(soft > 0, soft, soft.max(initial=0.0) or 1.0)
    return np.asarray(constraints.covered[rows] ** 2 / soft)


def refuse_unbalanced(
    sought: sparse.csr_matrix, kept: sparse.csr_matrix, free: sparse.csc_matrix, loads: np.ndarray
) -> None:
    """Raise SolveError where no contact pressure balances `loads` (n_dofs,) on a free motion.

    `sought` (e, n_dofs): the rows of gaps that pressures act on; `kept` (j, n_dofs): those that
    resist whatever they see; `free` (n_dofs, f): rigid motions that supports leave free.
    """
    from scipy.optimize import nnls

    free = free[:, np.ravel(abs(kept @ free).sum(axis=0)) == 0]
    push = (sought @ free).toarray().T
    # Up to round-off the loads of parts, such as initial strain, have no resultant.
    loads = free.T @ loads
    largest, unit = (np.abs(each).max(initial=0.0) for each in (loads, push))
    if largest and (not unit or nnls(push / unit, -loads / largest)[1] > _BALANCED):
        raise SolveError("no contact pressure balances the loads")


def stiffness_of(
    systems: Systems,
    matrix: Stiffness,
    constraints: ContactConstraints,
    rows: np.ndarray,
    kept: np.ndarray | bool = False,
) -> np.ndarray:
    """The forces (e, e) that average gaps and slips in e `rows` bring up, all others closed.

    Those that are `kept` (k,) are closed too.
    """
    closed = rows | kept
    system, area, mine = systems.factored(closed), constraints.covered[rows], rows[closed]
    found, size, at = np.zeros((len(area), len(area))), matrix.shape[0], np.flatnonzero(mine)
    for some in np.array_split(np.arange(len(area)), 1 + len(area) * size // _AT_ONCE):
        imposed = np.zeros((len(mine), len(some)))
        imposed[at[some], np.arange(len(some))] = area[some]
        change = system.correction(np.zeros((size, len(some))), imposed)
        found[:, some] = area[:, None] * system.multiplier(-(matrix @ change))[mine]
    return found
