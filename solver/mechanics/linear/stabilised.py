"""Elasticity under closed contact constraints that give way to pressures that scatter.

K x = f + Gᵀ p, G x + S p = b with S symmetric, positive semidefinite. The multipliers stay
unknowns: with S they cannot be condensed. K is singular where contact holds a body. With
w Gᵀ (G x + S p − b) added to the first equation, and the second times P = I − w S, the matrix

    K + w Gᵀ G    −Gᵀ P
    −P G          −P S

is symmetric again, and regular for w below the inverse of the largest eigenvalue of S.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...system.errors import SolveError
from .condensation import choose_pivots, inverse_of
from .direct import Factor, factorise_indefinite
from .krylov import EPSILON

# Pivots of indefinite matrices are perturbed, and a solution is refined while the residual falls.
_MOST_STEPS, _GAIN = 6, 0.5
# The weight w, in parts of the inverse of a bound of the largest eigenvalue of S.
_BELOW = 0.5
_WHY = "stabilised contact: its pressures are unknowns"


@dataclass(frozen=True)
class StabilisedSystem:
    """The `factor` of the `whole` matrix; see `ConstrainedSystem`.

    `scaled` (m, n): G with rows divided by their `size` (m,); `weight` w, `part` P (m, m); `pivot`
    (m,) and `inverse` (m, m) as of the `CondensedSystem`.
    """

    whole: sparse.csr_matrix
    constraints: sparse.csr_matrix
    scaled: sparse.csr_matrix
    size: np.ndarray
    weight: float
    part: sparse.csr_matrix
    pivot: np.ndarray
    inverse: sparse.csr_matrix
    factor: Factor
    why: str = _WHY
    doubt: str = "the system of stabilised contact is nearly singular"

    def correction(
        self, force: np.ndarray, violation: np.ndarray, accuracy: float = EPSILON
    ) -> np.ndarray:
        """The change of x under the whole pressure p, which the forces do not contain yet."""
        wanted = (violation.T / self.size).T
        pulled = force + self.weight * (self.scaled.T @ wanted)
        right = np.concatenate([pulled, -(self.part @ wanted)])
        found, left, last = np.zeros_like(right), right, np.inf
        for _ in range(_MOST_STEPS):
            following = found + self.factor.solve(left, accuracy)
            left = right - self.whole @ following
            size = float(np.abs(left).max(initial=0.0))
            if not size < _GAIN * last:
                break
            found, last = following, size
        return found[: len(force)]

    def multiplier(self, force: np.ndarray) -> np.ndarray:
        """From the equilibrium of the pivots."""
        return -(self.inverse.T @ force[self.pivot])

    def imbalance(self, force: np.ndarray) -> float:
        """The largest force left with the multipliers acting."""
        left = force + self.constraints.T @ self.multiplier(force)
        return float(np.abs(left).max(initial=0.0))


def stabilise(
    matrix: sparse.csr_matrix,
    constraints: sparse.csr_matrix,
    own: np.ndarray,
    compliance: sparse.csr_matrix,
) -> StabilisedSystem:
    """Factor K (n, n), G (m, n) and the `compliance` S (m, m); `own` (n,) may be pivots.

    Raises SolveError where a constraint has no unknown of its own, or the system is singular.
    """
    pivot, found = choose_pivots(constraints, own)
    if not found.all():
        raise SolveError(
            f"{int((~found).sum())} closed macro-elements have no unknown of their own"
        )
    size = np.sqrt(np.asarray(constraints.multiply(constraints).sum(axis=1)).ravel())
    scale = sparse.diags(1 / size)
    scaled, soft = (scale @ constraints).tocsr(), scale @ compliance @ scale
    largest = float(np.asarray(abs(soft).sum(axis=1)).max())
    weight = float(matrix.diagonal().max())
    weight = min(weight, _BELOW / largest) if largest else weight
    part = (sparse.identity(len(size)) - weight * soft).tocsr()
    pulled = part @ scaled
    blocks = [[matrix + weight * (scaled.T @ scaled), -pulled.T], [-pulled, -(part @ soft)]]
    whole = sparse.bmat(blocks, format="csr")
    return StabilisedSystem(
        whole=whole,
        constraints=constraints,
        scaled=scaled,
        size=size,
        weight=weight,
        part=part,
        pivot=pivot,
        inverse=inverse_of(constraints[:, pivot]),
        factor=factorise_indefinite(whole),
    )
