"""What contact alone sees of a system with all closed: a stiffness matrix, or its products."""

import numpy as np
from scipy.sparse.linalg import LinearOperator

from ...mechanics.linear.symmetric_blocks import Stiffness
from ...mechanics.linear.systems import Systems
from .constraints import ContactConstraints

# More rows than these make the matrix of the contact alone too large, or, where each column takes
# iterations, too long to make: 867 rows of 60,000 unknowns take 65 s, products alone 22 s.
_MOST_ROWS, _MOST_ITERATIVE = 4000, 400
# Entries of the solutions that are kept at once.
_AT_ONCE = 1 << 23


def contact_stiffness(
    systems: Systems, matrix: Stiffness, constraints: ContactConstraints, diagonal: np.ndarray
) -> tuple[np.ndarray | LinearOperator, np.ndarray]:
    """`stiffness_of` all that may close or stick (e, e), and about its diagonal (e,).

    `diagonal` (n_free,) is that of the `matrix`. For a large contact it is a product, by one
    solution each.
    """
    rows = constraints.eligible
    iterative = systems.factored(rows).factor.iterative
    if rows.sum() > (_MOST_ITERATIVE if iterative else _MOST_ROWS):
        return _products(systems, matrix, constraints, diagonal)
    found = stiffness_of(systems, matrix, constraints, rows)
    found = (found + found.T) / 2
    return found, np.diag(found)


def _products(
    systems: Systems, matrix: Stiffness, constraints: ContactConstraints, diagonal: np.ndarray
) -> tuple[LinearOperator, np.ndarray]:
    rows = constraints.eligible
    system, area = systems.factored(rows), constraints.covered[rows]
    nothing, size = np.zeros(matrix.shape[0]), len(area)

    def product(jump: np.ndarray) -> np.ndarray:
        change = system.correction(nothing, area * jump.ravel())
        return area * system.multiplier(-(matrix @ change))

    stiff = diagonal > 0  # rigid unknowns have none
    moving = constraints.gaps[rows].power(2)[:, stiff]
    soft = np.asarray(moving @ (1 / diagonal[stiff]))
    found = area**2 / np.where(soft > 0, soft, soft.max(initial=0.0) or 1.0)
    return LinearOperator((size, size), matvec=product, dtype=float), found


def stiffness_of(
    systems: Systems, matrix: Stiffness, constraints: ContactConstraints, rows: np.ndarray
) -> np.ndarray:
    """The forces (e, e) that average gaps and slips in e `rows` bring up, all others closed."""
    system, area = systems.factored(rows), constraints.covered[rows]
    found, size = np.zeros((len(area), len(area))), matrix.shape[0]
    for some in np.array_split(np.arange(len(area)), 1 + len(area) * size // _AT_ONCE):
        imposed = np.zeros((len(area), len(some)))
        imposed[some, np.arange(len(some))] = area[some]
        change = system.correction(np.zeros((size, len(some))), imposed)
        found[:, some] = area[:, None] * system.multiplier(-(matrix @ change))
    return found
