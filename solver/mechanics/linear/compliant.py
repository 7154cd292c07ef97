"""Systems whose constraints give way to their pressures.

K x = f + Gᵀ p, G x + S p = b with a compliance S = Lᵀ D L of the constraints. With s unknowns
r = D L p more, those of springs of the stiffness D⁻¹, these are the constraints [G Lᵀ] (x, r) = b
of the stiffness diag(K, D⁻¹): the second row of its equilibrium is D⁻¹ r = L p. They are condensed
like any others, and the condensed matrix is positive definite.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from .choice import Solvers
from .condensation import CondensedSystem, ConstrainedSystem, condense
from .factor import Factor, factorise
from .krylov import EPSILON
from .symmetric_blocks import Stiffness


@dataclass(frozen=True)
class Compliance:
    """S = Lᵀ D L of c closed multipliers: `scatter` L (s, c) and `weight` D (s,)."""

    scatter: sparse.csr_matrix
    weight: np.ndarray


@dataclass(frozen=True, kw_only=True)
class CompliantSystem(ConstrainedSystem):
    """The system `condensed` of displacement and springs (n + s,), for a displacement (n,).

    The springs are the ones of the pressures that balance the forces. See `ConstrainedSystem`.
    """

    condensed: CondensedSystem
    compliance: Compliance

    def correction(
        self, force: np.ndarray, violation: np.ndarray, accuracy: float = EPSILON
    ) -> np.ndarray:
        """The change of x under the whole pressure p, which the forces do not contain yet."""
        force, violation = self._left(force, violation)
        return self.condensed.correction(force, violation, accuracy)[: self._size]

    def multiplier(self, force: np.ndarray) -> np.ndarray:
        """From the equilibrium of the pivots."""
        return self.condensed.multiplier(force)

    def imbalance(self, force: np.ndarray, violation: np.ndarray) -> float:
        """The largest force left, or brought up by gaps that do not fit the pressures.

        Springs and bodies give way to such a gap together: where springs are soft and a body is
        stiff, it is a small pressure that rounding leaves in the forces.
        """
        system, (force, violation) = self.condensed, self._left(force, violation)
        brought_up = self._flexibility.solve(violation) / system.inverse.diagonal()
        return max(system.imbalance(force, violation), float(np.abs(brought_up).max(initial=0.0)))

    @cached_property
    def _flexibility(self) -> Factor:
        """Gaps by pressures (m, m): S, and about what each one deforms the body."""
        system, scatter = self.condensed, self.compliance.scatter
        rows = np.arange(len(system.pivot))
        stiffness = np.asarray(system.coupling[rows, system.pivot]).ravel()
        body = 1 / (stiffness * system.inverse.diagonal() ** 2)
        soft = scatter.T @ sparse.diags(self.compliance.weight) @ scatter
        return factorise(sparse.csr_matrix(soft + sparse.diags(body)), least=0.0)

    @property
    def _size(self) -> int:
        return self.condensed.coupling.shape[1] - len(self.compliance.weight)

    def _left(self, force: np.ndarray, violation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n + s,) and violation (m,) left, the springs in equilibrium with the pressure."""
        stretch = self.compliance.scatter @ self.multiplier(force)
        moved = (stretch.T * self.compliance.weight).T
        return np.concatenate([force, -stretch]), violation - self.compliance.scatter.T @ moved


def condense_compliant(
    matrix: Stiffness,
    constraints: sparse.csr_matrix,
    own: np.ndarray,
    compliance: Compliance,
    solvers: Solvers | None = None,
) -> CompliantSystem:
    """Condense K (n, n) and its springs by G (m, n) and the `compliance`; see `condense`.

    Raises SolveError where a constraint has no unknown of its own, or the system is singular.
    """
    whole = sparse.hstack([constraints, compliance.scatter.T], format="csr")
    condensed = condense(matrix, whole, own, solvers, extra=1 / compliance.weight)
    return CompliantSystem(factor=condensed.factor, condensed=condensed, compliance=compliance)
