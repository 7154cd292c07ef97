"""Elasticity under constraints without unknowns of their own: a definite factor, no saddle point.

Multipliers of slave vertices overlap, so that no unknown belongs to one of them alone. With the
constraints added to the stiffness, A = K + Ĝᵀ w Ĝ, the solution does not change, A is positive
definite, and the multipliers follow from A by few steps p ← p + w (b − Ĝ x). Sources: Fortin,
Glowinski, Augmented Lagrangian methods, North-Holland 1983, ch. 1; Golub, Greif, On solving
block-structured indefinite linear systems, SIAM J. Sci. Comput. 24 (2003) 2076–2092.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...system.errors import SolveError
from .direct import Factor, factorise
from .krylov import EPSILON

# A step leaves about 1/w of a violation; the factor loses as many digits, which refinement returns.
_WEIGHT = 1e4
# The smallest eigenvalue of Ĝ D⁻¹ Ĝᵀ, of diagonal one: constraints below it nearly depend.
_LEAST = 1e-3
_MOST_STEPS = 12
# A step that leaves more than this of the violation has reached round-off.
_GAIN = 0.5


@dataclass(frozen=True)
class AugmentedSystem:
    """`scaled` Ĝ (m, n): constraints, each divided by its `size` (m,); the `factor` of A.

    `compliant` Ĝ D⁻¹ (m, n) with the diagonal D of K, and the factor `gram` of Ĝ D⁻¹ Ĝᵀ.
    """

    scaled: sparse.csr_matrix
    size: np.ndarray
    factor: Factor
    compliant: sparse.csr_matrix
    gram: Factor
    why: str
    doubt: str = ""

    def correction(
        self, force: np.ndarray, violation: np.ndarray, accuracy: float = EPSILON
    ) -> np.ndarray:
        """Equilibrium under multipliers that are corrected until the constraints hold."""
        wanted = (violation.T / self.size).T
        change = self.factor.solve(force + _WEIGHT * (self.scaled.T @ wanted), accuracy)
        last, first = np.inf, 0.0
        for _ in range(_MOST_STEPS):
            left = wanted - self.scaled @ change
            size = float(np.abs(left).max(initial=0.0))
            first = first or size
            if size <= EPSILON * first or size > _GAIN * last:
                break
            last = size
            change = change + self.factor.solve(_WEIGHT * (self.scaled.T @ left), accuracy)
        return change

    def multiplier(self, force: np.ndarray) -> np.ndarray:
        """The multipliers that balance the force best: least squares with the weights 1/D."""
        return (-self.gram.solve(self.compliant @ force).T / self.size).T

    def imbalance(self, force: np.ndarray, violation: np.ndarray) -> float:  # noqa: ARG002
        """The largest force left with the multipliers acting; no constraint is violated."""
        acting = (self.multiplier(force).T * self.size).T
        return float(np.abs(force + self.scaled.T @ acting).max(initial=0.0))


def augment(
    matrix: sparse.csr_matrix, constraints: sparse.csr_matrix, dim: int, why: str
) -> AugmentedSystem:
    """Factor K x = f + Gᵀ p, G x = b; `matrix` K (n, n), `constraints` G (m, n), `why`: so solved.

    `dim`: of the mesh. Raises SolveError where constraints nearly depend on one another, or leave
    a motion free.
    """
    inverse = sparse.diags(1 / matrix.diagonal())
    size = np.sqrt(np.asarray(constraints.multiply(constraints @ inverse).sum(axis=1)).ravel())
    if not size.all():
        raise SolveError("a constraint holds no unknown")
    scaled = (sparse.diags(1 / size) @ constraints).tocsr()
    compliant = (scaled @ inverse).tocsr()
    gram = factorise(compliant @ scaled.T, dim=2, least=_LEAST)
    factor = factorise(matrix + _WEIGHT * (scaled.T @ scaled), dim=dim)
    return AugmentedSystem(scaled, size, factor, compliant, gram, why)
