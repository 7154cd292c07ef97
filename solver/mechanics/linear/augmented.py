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

from ...lac.errors import SolveError
from .choice import LinearSolver, prepare
from .condensed_matrix import CondensedMatrix, Symmetric
from .direct import Factor, factorise
from .krylov import EPSILON
from .nodal_matrix import Stiffness
from .shared import Shared
from .unknowns import Unknowns

# A step leaves about 1 / (w λ) of a violation, with the smallest eigenvalue λ of Ĝ D⁻¹ Ĝᵀ, whose
# diagonal is one; the factor loses as many digits as w has, which refinement returns.
_WEIGHT, _REDUCTION = 1e4, 10.0
# Constraints with a smaller λ nearly depend on one another.
_LEAST = 1e-7
_MOST_STEPS = 12
# A step that leaves more than this of the violation has reached round-off.
_GAIN = 0.5


@dataclass(frozen=True)
class AugmentedSystem:
    """`scaled` Ĝ (m, n): constraints, each divided by its `size` (m,); the `factor` of A.

    `compliance` (n,): the inverse of the diagonal D of K; the factor `gram` of Ĝ D⁻¹ Ĝᵀ;
    the `weight` w.
    """

    scaled: sparse.csr_matrix
    size: np.ndarray
    factor: LinearSolver
    compliance: np.ndarray
    gram: Factor
    weight: float
    reason: str

    @property
    def why(self) -> str:
        """Why it was chosen."""
        return f"{self.reason}; {self.factor.why}"

    @property
    def warning(self) -> str:
        """See `LinearSolver`."""
        return self.factor.warning

    def correction(
        self, force: np.ndarray, violation: np.ndarray, accuracy: float = EPSILON
    ) -> np.ndarray:
        """Equilibrium under multipliers that are corrected until the constraints hold."""
        # Multipliers of the present state leave forces that are as small as its error.
        wanted, force = (violation.T / self.size).T, self._left(force)
        pulled = self.scaled.T @ wanted
        # The weight makes no force that may be left larger.
        limit = accuracy * (self._norm(force) + self._norm(pulled))
        change = self._solved(force + self.weight * pulled, limit)
        last, first = np.inf, 0.0
        for _ in range(_MOST_STEPS):
            left = wanted - self.scaled @ change
            size = float(np.abs(left).max(initial=0.0))
            first = first or size
            if size <= EPSILON * first or size > _GAIN * last:
                break
            last, right = size, self.weight * (self.scaled.T @ left)
            if (self._norm(right) <= limit).all():
                break
            change = change + self._solved(right, limit)
        return change

    def _norm(self, force: np.ndarray) -> np.ndarray:
        """The norm of each column of forces (n, …), scaled as the system is."""
        return np.sqrt(self.compliance @ (force * force))

    def _solved(self, right: np.ndarray, limit: np.ndarray) -> np.ndarray:
        """Solved for `right` (n, …) until forces of the norm `limit` are left."""
        share = limit / np.maximum(self._norm(right), np.finfo(float).tiny)
        return self.factor.solve(right, min(max(float(np.min(share)), EPSILON), 1.0))

    def multiplier(self, force: np.ndarray) -> np.ndarray:
        """The multipliers that balance the force best: least squares with the weights 1/D."""
        return (-self.gram.solve(self.scaled @ (self.compliance * force.T).T).T / self.size).T

    def imbalance(self, force: np.ndarray, violation: np.ndarray) -> float:  # noqa: ARG002
        """The largest force left with the multipliers acting; no constraint is violated."""
        return float(np.abs(self._left(force)).max(initial=0.0))

    def _left(self, force: np.ndarray) -> np.ndarray:
        """The forces left with the multipliers acting."""
        return force + self.scaled.T @ (self.multiplier(force).T * self.size).T


def augment(
    matrix: Stiffness,
    constraints: sparse.csr_matrix,
    why: str,
    unknowns: Unknowns | None = None,
    gave_up: str = "",
    shared: Shared | None = None,
) -> AugmentedSystem:
    """Prepare K x = f + Gᵀ p, G x = b; `matrix` K (n, n), `constraints` G (m, n), `why`: so solved.

    `unknowns`, `gave_up`, `shared`: see `prepare`. Raises SolveError where constraints nearly
    depend on one another, or a factor finds that they leave a motion free.
    """
    compliance = 1 / matrix.diagonal()
    square = constraints.multiply(constraints) @ compliance
    size = np.sqrt(np.asarray(square).ravel())
    if not size.all():
        raise SolveError("a constraint holds no unknown")
    scaled = (sparse.diags(1 / size) @ constraints).tocsr()
    gram = factorise(scaled @ sparse.diags(compliance) @ scaled.T, least=_LEAST)
    weight = max(_WEIGHT, _REDUCTION / gram.smallest)
    factor = prepare(_augmented(matrix, scaled, weight), unknowns, gave_up, shared)
    if factor.warning:
        raise SolveError(factor.warning)
    return AugmentedSystem(scaled, size, factor, compliance, gram, weight, why)


def _augmented(matrix: Stiffness, scaled: sparse.csr_matrix, weight: float) -> Symmetric:
    """K + Ĝᵀ w Ĝ."""
    if not scaled.shape[0]:
        return matrix
    everything = np.arange(matrix.shape[0])
    return CondensedMatrix(matrix, everything, (weight * (scaled.T @ scaled)).tocsr())
