"""A system scaled as multigrid has it, in the rows of the first level.

Conjugate gradients pass over their vectors many times: scales and numbers of unknowns are for the
first and the last of these alone.
"""

import numpy as np
from scipy.sparse import csr_matrix

from .condensed_matrix import CondensedMatrix, Symmetric
from .contact_levels import scales_of
from .krylov import by_columns
from .nodal_matrix import NodalMatrix


class ScaledSystem:
    """D A D for a matrix A (n, n) and the `scale` D (n,); row i is `place[i]` of `size`.

    The other rows are idle: they are zero, in vectors (size, k) too.
    """

    def __init__(self, matrix: Symmetric, scale: np.ndarray, place: np.ndarray, size: int):
        """`scale` and `place` of `matrix`, or of the stiffness that it is condensed from.

        Springs are in the rows of the first eliminated unknowns.
        """
        self._matrix, self.scale, self.place, self._size = matrix, scale, place, size
        self._added: csr_matrix | None = None
        self._springs = place[:0]
        stiffness = matrix
        if isinstance(matrix, CondensedMatrix):
            stiffness, self.place = matrix.stiffness, place[matrix.places]
            self.scale = scales_of(matrix, scale)
            self._springs = self.place[len(matrix.kept) :]
            self._add(matrix.added)
        idle = np.ones(size, dtype=bool)
        idle[self.place] = False
        self._idle = np.flatnonzero(idle)
        self._blocks = self._around = None
        if isinstance(stiffness, NodalMatrix):
            self._blocks = stiffness.blocks
            if stiffness.scale is not scale:
                self._around = np.zeros(size)
                self._around[place] = scale if stiffness.scale is None else scale / stiffness.scale

    def _add(self, added: csr_matrix) -> None:
        """What is added to the stiffness, scaled, in the rows that have any of it."""
        rows = np.flatnonzero(np.diff(added.indptr))
        scale, some = self.scale[rows], added[rows][:, rows].tocsr()
        some.data *= np.repeat(scale, np.diff(some.indptr)) * scale[some.indices]
        self._rows, self._added = self.place[rows], some

    def placed(self, x: np.ndarray) -> np.ndarray:
        """Columns (n, k) in their rows (size, k)."""
        found = np.zeros((self._size, x.shape[1]))
        found[self.place] = x
        return found

    def lifted(self, right: np.ndarray) -> np.ndarray:
        """The right-hand side (size, k) of the scaled system for `right` (n, k)."""
        return self.placed(self.scale[:, None] * right)

    def solution(self, found: np.ndarray) -> np.ndarray:
        """The solution (n, k) of the system, from the scaled one (size, k)."""
        return np.asarray(self.scale[:, None] * found[self.place])

    def without_idle(self, x: np.ndarray) -> np.ndarray:
        """The same vectors (size, k), zero in idle rows from now on."""
        x[self._idle] = 0
        return x

    def multiply(self, x: np.ndarray) -> np.ndarray:
        """The product with vectors (size, k)."""
        if self._blocks is None:
            return self.lifted(self._matrix @ self.solution(x))
        return by_columns(self._product, x)

    def _product(self, x: np.ndarray) -> np.ndarray:
        """The product with a vector (size,) by the blocks of the stiffness."""
        assert self._blocks is not None
        bodies = x if self._around is None else self._around * x
        if len(self._springs):
            # The stiffness does not know what is in these rows.
            bodies = bodies.copy() if bodies is x else bodies
            bodies[self._springs] = 0
        found = self._blocks.multiply(bodies)
        if self._around is not None:
            found *= self._around
        found[self._idle] = found[self._springs] = 0
        if self._added is not None:
            found[self._rows] += self._added @ x[self._rows]
        return found
