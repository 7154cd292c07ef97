"""Elasticity under constraints without unknowns of their own: a definite factor, no saddle point.

Multipliers of slave vertices overlap, so that no unknown belongs to one of them alone. With the
constraints added to the stiffness, A = K + Ĝᵀ w Ĝ, the solution does not change, A is positive
definite, and the multipliers follow from A by few steps p ← p + w (b − Ĝ x). Sources: Fortin,
Glowinski, Augmented Lagrangian methods, North-Holland 1983, ch. 1; Golub, Greif, On solving
block-structured indefinite linear systems, SIAM J. Sci. Comput. 24 (2003) 2076–2092.

Stabilised constraints give way to pressures that scatter: K x = f + Gᵀ p, G x + S p = b with a
compliance S = Lᵀ D L of the constraints. With s unknowns r = D L p more, those of springs of the
stiffness D⁻¹, these are the constraints [G Lᵀ] (x, r) = b of the stiffness diag(K, D⁻¹): the second
row of its equilibrium is D⁻¹ r = L p. They are condensed like any others, and the condensed matrix
is positive definite.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...lac.errors import SolveError
from .choice import Factor, Shared, factorise, prepare
from .condensation import CondensedSystem, ConstrainedSystem, condense
from .condensed_matrix import CondensedMatrix, Symmetric
from .krylov import EPSILON
from .symmetric_blocks import Stiffness
from .unknowns import Unknowns


@dataclass(frozen=True)
class Compliance:
    """S = Lᵀ D L of c closed multipliers: `scatter` L (s, c) and `weight` D (s,)."""

    scatter: sparse.csr_matrix
    weight: np.ndarray


@dataclass(frozen=True, kw_only=True)
class StabilisedSystem(ConstrainedSystem):
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
        """The largest force left, with that brought up by gaps that do not fit the pressures."""
        system, (force, violation) = self.condensed, self._left(force, violation)
        pulled = system.coupling.T @ (system.inverse @ violation)
        return system.imbalance(force - pulled, violation)

    @property
    def _size(self) -> int:
        return self.condensed.coupling.shape[1] - len(self.compliance.weight)

    def _left(self, force: np.ndarray, violation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n + s,) and violation (m,) left, the springs in equilibrium with the pressure."""
        stretch = self.compliance.scatter @ self.multiplier(force)
        moved = (stretch.T * self.compliance.weight).T
        return np.concatenate([force, -stretch]), violation - self.compliance.scatter.T @ moved


def stabilise(
    matrix: Stiffness,
    constraints: sparse.csr_matrix,
    own: np.ndarray,
    compliance: Compliance,
    unknowns: Unknowns | None = None,
    gave_up: str = "",
    shared: Shared | None = None,
) -> StabilisedSystem:
    """Condense K (n, n) and its springs by G (m, n) and the `compliance`; see `condense`.

    Raises SolveError where a constraint has no unknown of its own, or the system is singular.
    """
    whole = sparse.hstack([constraints, compliance.scatter.T], format="csr")
    springs = 1 / compliance.weight
    condensed = condense(matrix, whole, own, unknowns, gave_up, shared, springs)
    return StabilisedSystem(factor=condensed.factor, condensed=condensed, compliance=compliance)


_NOTHING_OWN = "constraints without an unknown of their own: added to the stiffness with a weight"
# A step leaves about 1 / (w λ) of a violation, with the smallest eigenvalue λ of Ĝ D⁻¹ Ĝᵀ, whose
# diagonal is one; the factor loses as many digits as w has, which refinement returns.
_WEIGHT, _REDUCTION = 1e4, 10.0
# Constraints with a smaller λ nearly depend on one another.
_LEAST = 1e-7
_MOST_STEPS = 12
# A step that leaves more than this of the violation has reached round-off.
_GAIN = 0.5


@dataclass(frozen=True, kw_only=True)
class AugmentedSystem(ConstrainedSystem):
    """`scaled` Ĝ (m, n): constraints, each divided by its `size` (m,); the `factor` of A.

    `compliance` (n,): the inverse of the diagonal D of K; the factor `gram` of Ĝ D⁻¹ Ĝᵀ;
    the `weight` w.
    """

    scaled: sparse.csr_matrix
    size: np.ndarray
    compliance: np.ndarray
    gram: Factor
    weight: float

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
    unknowns: Unknowns | None = None,
    gave_up: str = "",
    shared: Shared | None = None,
) -> AugmentedSystem:
    """Prepare K x = f + Gᵀ p, G x = b; `matrix` K (n, n), `constraints` G (m, n).

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
    return AugmentedSystem(
        factor=factor,
        about=_NOTHING_OWN,
        scaled=scaled,
        size=size,
        compliance=compliance,
        gram=gram,
        weight=weight,
    )


def _augmented(matrix: Stiffness, scaled: sparse.csr_matrix, weight: float) -> Symmetric:
    """K + Ĝᵀ w Ĝ."""
    if not scaled.shape[0]:
        return matrix
    everything = np.arange(matrix.shape[0])
    return CondensedMatrix(matrix, everything, (weight * (scaled.T @ scaled)).tocsr())
