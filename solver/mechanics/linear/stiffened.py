"""Nearly incompressible material: a soft matrix and a stiff resistance to changes of volume.

With the mean stress eliminated, the stiffness is A = K + Bᵀ W B: K of the same material with a
moderate λ, B x the changes of volume, W the large rest of λ. Multigrid fails on A. It serves on K
in the equivalent system

    K    Bᵀ
    B   −W⁻¹

which is solved by conjugate residuals with the block-triangular preconditioner of multigrid for K
and of a diagonal S for the Schur complement W⁻¹ + B K⁻¹ Bᵀ. The volume of the cells divided by
2μ + λ of K approximates the second term; so the number of iterations hardly depends on Poisson's
ratio. It grows with the mesh where pressures that alternate from cell to cell are hardly seen by
the displacement, as in HEXA8. Sources: Klawonn, SIAM J. Sci. Comput. 19 (1998) 172–184; Benzi and
Olshanskii, SIAM J. Sci. Comput. 28 (2006) 2095–2113, for the λ left in K.
"""

from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csr_matrix, diags

from ...lac.errors import SolveError
from .condensed_matrix import Symmetric
from .hierarchy import Shared
from .krylov import EPSILON, conjugate_residuals
from .multigrid import MAX_ITERATIONS, Multigrid
from .nodal_matrix import NodalMatrix
from .unknowns import Unknowns

# Iterations where pressures that alternate are hardly seen: HEXA8 takes 339 at 280,000 unknowns.
_MOST_UNSTABLE = 600


@dataclass
class StiffenedMatrix:
    """K + Bᵀ W B: `soft` K (n, n), `divergence` B (s, n), `weight` W (s,); `schur` is S (s,).

    `stable`: whether displacements see all pressures, so that few iterations suffice; `locks`:
    whether there are more pressures than they can follow, so that iterations do not converge.
    """

    soft: Any
    divergence: csr_matrix
    weight: np.ndarray
    schur: np.ndarray
    stable: bool = True
    locks: bool = False

    def __post_init__(self) -> None:
        self.shape: tuple[int, int] = self.soft.shape

    @property
    def nnz(self) -> int:
        """How many entries K has: those of the sum, but for cells that were cut."""
        return int(self.soft.nnz)

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """See `Symmetric`."""
        stretched = (self.divergence @ x).T * self.weight
        return self.soft @ x + self.divergence.T @ stretched.T

    def __getitem__(self, rows: Any) -> csr_matrix:
        """See `Symmetric`."""
        stiff = self.divergence[:, rows].T @ diags(self.weight) @ self.divergence
        return (self.soft[rows] + stiff).tocsr()

    def diagonal(self) -> np.ndarray:
        """See `Symmetric`."""
        return np.asarray(self.soft.diagonal() + self.divergence.power(2).T @ self.weight)

    def tocsr(self) -> csr_matrix:
        """See `Symmetric`."""
        return self[:]

    def changed(self, soft: Symmetric, divergence: csr_matrix) -> "StiffenedMatrix":
        """The same for the unknowns that constraints leave."""
        return replace(self, soft=soft, divergence=divergence)


Stiffness: TypeAlias = csr_matrix | NodalMatrix | StiffenedMatrix


def part_of(matrix: Stiffness, chosen: np.ndarray) -> csr_matrix | StiffenedMatrix:
    """The rows and columns `chosen` (m,) of a matrix; without B where no volume depends on these.

    The others belong to other bodies.
    """
    if not isinstance(matrix, StiffenedMatrix):
        return matrix.tocsr()[chosen][:, chosen]
    divergence = matrix.divergence[:, chosen].tocsr()
    mine, soft = np.diff(divergence.indptr) > 0, part_of(matrix.soft, chosen)
    if not mine.any():
        return soft
    parts = divergence[mine], matrix.weight[mine], matrix.schur[mine]
    return StiffenedMatrix(soft, *parts, matrix.stable, matrix.locks)


class Stiffened:
    """The solver of a `StiffenedMatrix` with multigrid of its soft part; see `Multigrid`."""

    def __init__(self, matrix: StiffenedMatrix, unknowns: Unknowns, shared: Shared | None = None):
        """Set up; raises SolveError as `Multigrid` of the soft part."""
        self._matrix, self._soft = matrix, Multigrid(matrix.soft, unknowns, shared)
        self._transposed = matrix.divergence.T.tocsr()
        self.iterations = 0
        self.name = f"conjugate residuals with {self._soft.name.partition(' with ')[2]}"

    def solve(self, right: np.ndarray, accuracy: float = EPSILON) -> np.ndarray:
        """Solve for `right` (n,) or (n, k), to a residual of `accuracy` times that; see there."""
        columns = np.asarray(right, dtype=float)
        columns = columns if columns.ndim == 2 else columns[:, None]
        found = [self._solved(column, accuracy) for column in columns.T]
        return np.stack(found, axis=1).reshape(np.shape(right))

    def close(self) -> None:
        """Release the hierarchy; it solves no more."""
        self._soft.close()

    def _solved(self, right: np.ndarray, accuracy: float) -> np.ndarray:
        """The solution (n,). Unknowns are scaled, by multigrid and by the root of S."""
        matrix, scale = self._matrix, self._soft.scale
        n, root = len(right), 1 / np.sqrt(matrix.schur)

        def multiply(x: np.ndarray) -> np.ndarray:
            move, stress = scale * x[:n], root * x[n:]
            opened = matrix.divergence @ move - stress / matrix.weight
            force = matrix.soft @ move + self._transposed @ stress
            return np.concatenate([scale * force, root * opened])

        def precondition(residual: np.ndarray) -> np.ndarray:
            stress = -residual[n:]
            force = residual[:n] - scale * (self._transposed @ (root * stress))
            return np.concatenate([self._soft.cycle(force), stress])

        def left(residual: np.ndarray) -> float:
            """The residual of A, once the stress is eliminated."""
            stress = matrix.weight * (residual[n:] / root)
            return float(np.linalg.norm(residual[:n] + scale * (self._transposed @ stress)))

        start = np.concatenate([scale * right, np.zeros(len(root))])
        most = MAX_ITERATIONS if matrix.stable else _MOST_UNSTABLE
        solution, iterations = conjugate_residuals(
            multiply, precondition, start, left, accuracy, most
        )
        if not np.isfinite(solution).all():
            raise SolveError(f"the solution by {self.name} is not finite")
        self.iterations = max(self.iterations, iterations)
        return np.asarray(scale * solution[:n])
