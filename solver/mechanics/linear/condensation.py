"""Elasticity under closed contact constraints, condensed to a positive definite system.

Each closed macro-element owns a degree of freedom that no other constraint contains. The constraint
expresses it by the others, x = Z v + c, and the multiplier follows from the equilibrium of that
degree of freedom. ZᵀKZ is symmetric positive definite: there is no saddle point. Where the slave
surface of a zone is the master surface of another, the other's constraints contain it too: these
are taken first, and the degree of freedom is the only one's among those that are left.
"""

import logging
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol, Self, TypeVar

import numpy as np
from scipy import sparse

from ...lac.errors import SolveError
from .choice import LinearSolver, Solvers
from .condensed_matrix import CondensedMatrix, Symmetric
from .krylov import EPSILON, ROUGH
from .symmetric_blocks import Stiffness

_LOG = logging.getLogger(__name__)

# Each refinement must at least halve the residual, or it has reached round-off.
_MIN_GAIN = 0.5
_MAX_REFINEMENTS = 6
# A residual below this multiple of the machine precision, relative to the forces, is round-off.
ROUND_OFF = 8 * np.finfo(float).eps
# The residual by which the solution with the factor of a nearly singular system is one.
_CONVERGED = 1e-8
# A refinement aims at this share of round-off, and at no smaller a gain.
_WELL_BELOW, _LEAST_GAIN = 0.1, 1e-2
# A macro-element's own coefficient must not be a smaller share of its row's largest than the second
# one; smaller than the first only where no other is left, as the condensed matrix loses twice as
# many digits.
_GOOD_PIVOT, _SMALLEST_PIVOT = 1e-2, 1e-6
# Zones whose slave surface is a master surface, one after another.
_LAYERS = 4
_NO_MORE = np.empty(0)


AnyIterate = TypeVar("AnyIterate", bound="Iterate")


@dataclass(frozen=True, kw_only=True)
class ConstrainedSystem(ABC):
    """A factored system K x = f + Gᵀ p under constraints G x = b; `factor` is its solver.

    `about`: what to know of it beside its solver.
    """

    factor: LinearSolver
    about: str = ""

    @property
    def why(self) -> str:
        """Why the solver was chosen, and what there is to know."""
        return "; ".join(filter(None, [self.factor.why, self.about]))

    @property
    def warning(self) -> str:
        """Why a residual that stays large means no solution; empty for a sound factor."""
        return self.factor.warning

    @abstractmethod
    def correction(
        self, force: np.ndarray, violation: np.ndarray, accuracy: float = EPSILON
    ) -> np.ndarray:
        """The change of x (n,) that removes f − K x = `force` and b − G x = `violation`.

        Several at once by columns (n, c) and (m, c), as for the multipliers.
        The forces left may be `accuracy` of those given, where another correction follows.
        """

    @abstractmethod
    def multiplier(self, force: np.ndarray) -> np.ndarray:
        """The multipliers p (m,) that balance f − K x = `force`."""

    @abstractmethod
    def imbalance(self, force: np.ndarray, violation: np.ndarray) -> float:
        """The largest force that no multiplier balances, or that `violation` brings up."""


@dataclass(frozen=True, kw_only=True)
class CondensedSystem(ConstrainedSystem):
    """x = Z v + shift · b for constraints G x = b, and the factor of ZᵀKZ.

    v are the unknowns `kept` (k,), which `follow` (m, k) leads to the eliminated ones `pivot` (m,):
    the rows of Z. `inverse` (m, m): that of their columns of G; `coupling` (m, n): their rows of K.
    """

    kept: np.ndarray
    follow: sparse.csr_matrix
    pivot: np.ndarray
    inverse: sparse.csr_matrix
    coupling: sparse.csr_matrix

    @property
    def expansion(self) -> sparse.csr_matrix:
        """Z (n, k), formed anew at each call: a solve does without it."""
        k, rows = len(self.kept), np.concatenate([self.kept, self.pivot])
        return sparse.vstack([sparse.identity(k), self.follow], format="csr")[np.argsort(rows)]

    def correction(
        self, force: np.ndarray, violation: np.ndarray, accuracy: float = EPSILON
    ) -> np.ndarray:
        """The pivots alone meet the constraints; the others then restore equilibrium."""
        first = self.inverse @ violation
        right = self._on_kept(force - self.coupling.T @ first)
        found, change = self.factor.solve(right, accuracy), np.empty(force.shape)
        change[self.kept], change[self.pivot] = found, first + self.follow @ found
        return change

    def multiplier(self, force: np.ndarray) -> np.ndarray:
        """From the equilibrium of the pivots."""
        return -(self.inverse.T @ force[self.pivot])

    def imbalance(self, force: np.ndarray, violation: np.ndarray) -> float:  # noqa: ARG002
        """The largest force left on the unknowns v; no constraint is violated."""
        return float(np.abs(self._on_kept(force)).max(initial=0.0))

    def _on_kept(self, force: np.ndarray) -> np.ndarray:
        """Zᵀ f."""
        return np.asarray(force[self.kept] + self.follow.T @ force[self.pivot])


def choose_pivots(constraints: sparse.csr_matrix, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each row the largest entry in a column that is its own: pivot, found (m,).

    `own` (n,) marks the columns that may be pivots (unknowns of slave nodes). Rows without a column
    of their own may have one among themselves, and so on. Rows that are left without, or have a
    negligible coefficient there, have found = False. Found rows depend on no other ones.
    """
    m, n = constraints.shape
    found, pivot = np.zeros(m, dtype=bool), np.zeros(m, dtype=int)
    rows = np.repeat(np.arange(m), np.diff(constraints.indptr))
    columns, size = constraints.indices, np.abs(constraints.data)
    largest = np.zeros(m)
    np.maximum.at(largest, rows, size)
    least = _GOOD_PIVOT
    for _ in range(2 * _LAYERS):
        seen = np.bincount(columns, minlength=n)
        usable = np.flatnonzero(own[columns] & (seen[columns] == 1))
        # Sorted by row, then size: the last of each row is its largest.
        order = usable[np.lexsort((size[usable], rows[usable]))]
        best = order[np.flatnonzero(np.diff(rows[order], append=m + 1))]
        best = best[size[best] > least * largest[rows[best]]]
        found[rows[best]], pivot[rows[best]] = True, columns[best]
        if found.all() or (not len(best) and least == _SMALLEST_PIVOT):
            break
        if not len(best):
            least = _SMALLEST_PIVOT
        left = ~found[rows]
        rows, columns, size = rows[left], columns[left], size[left]
    return pivot, found


def inverse_of(pivots: sparse.csr_matrix) -> sparse.csr_matrix:
    """The inverse of the columns (m, m) of `choose_pivots`: D (1 + N) with Nᵏ = 0."""
    diagonal = pivots.diagonal()
    beside = (pivots - sparse.diags(diagonal)).tocsr()
    beside.eliminate_zeros()
    term = total = sparse.diags(1 / diagonal).tocsr()
    while (term := -(sparse.diags(1 / diagonal) @ beside @ term)).nnz:
        total = total + term
    return total


def condense(
    matrix: Stiffness,
    constraints: sparse.csr_matrix,
    own: np.ndarray,
    solvers: Solvers | None = None,
    extra: np.ndarray = _NO_MORE,
) -> CondensedSystem:
    """Condense K x = f under G x = b; `matrix` K (n, n), `constraints` G (m, n).

    `own` (n,) marks the unknowns that may be eliminated; `solvers` of K, or factors without any.
    With `extra` (s,), their stiffnesses, K has s unknowns more; the constraints (m, n + s) may
    hold these.

    Raises SolveError where a constraint has no unknown of its own, or ZᵀKZ is singular.
    """
    n = matrix.shape[0]
    pivot, found = choose_pivots(constraints[:, :n], own)
    if not found.all():
        raise SolveError(
            f"{int((~found).sum())} closed macro-elements have no unknown of their own to condense"
        )
    kept = np.ones(constraints.shape[1], dtype=bool)
    kept[pivot] = False
    kept_columns = np.flatnonzero(kept)
    inverse = inverse_of(constraints[:, pivot])
    follow = -(inverse @ constraints[:, kept_columns])
    condensed: Symmetric = matrix
    if len(pivot):
        condensed = _condensed(matrix, kept_columns, pivot, follow, extra)
    return CondensedSystem(
        factor=(solvers or Solvers()).prepare(condensed),
        kept=kept_columns,
        follow=follow.tocsr(),
        pivot=pivot,
        inverse=inverse,
        coupling=_wide(matrix[pivot], len(extra)),
    )


def _condensed(
    matrix: Stiffness,
    kept: np.ndarray,
    pivot: np.ndarray,
    follow: sparse.csr_matrix,
    extra: np.ndarray,
) -> Symmetric:
    """ZᵀKZ for the unknowns `kept` (k,), which others `follow` (m, k); `extra` ones come last."""
    s = len(extra)
    coupling = _wide(matrix[pivot], s)
    pulled = (coupling[:, kept].T @ follow).tocsr()
    added = pulled + pulled.T + follow.T @ (coupling[:, pivot] @ follow)
    if s:
        added = added + sparse.diags(np.concatenate([np.zeros(len(kept) - s), extra]))
    return CondensedMatrix(matrix, kept[: len(kept) - s], added.tocsr())


def _wide(rows: sparse.csr_matrix, more: int) -> sparse.csr_matrix:
    """Rows of a matrix with so many columns more, which are zero."""
    found = sparse.csr_matrix(rows)
    found.resize((found.shape[0], found.shape[1] + more))
    return found


class Iterate(Protocol):
    """An approximate solution x of K x = f + Gᵀ p, G x = b, kept as exactly as its owner can."""

    def residual(self) -> np.ndarray:
        """The forces f − K x (n,)."""

    def condensed(self, force: np.ndarray) -> np.ndarray:
        """The forces (n,) that a correction has to balance, for residual forces (n,).

        They differ where other unknowns, with residuals of their own, were eliminated from K.
        """

    def violation(self) -> np.ndarray:
        """The gaps b − G x (m,)."""

    def advanced(self, change: np.ndarray) -> Self:
        """The iterate at x + change (n,)."""


def solve(
    system: ConstrainedSystem,
    iterate: AnyIterate,
    scale: float,
    refine: bool = True,
    round_off: float = ROUND_OFF,
) -> tuple[AnyIterate, np.ndarray, float]:
    """Solve from an iterate; return the last one, multipliers (m,) and the relative residual.

    `scale` is the size of the forces. Newton's method with a fixed factor: one step solves, further
    ones refine until the residual no longer falls (Higham, Accuracy and Stability of Numerical
    Algorithms, §12), or is less than `round_off` of the forces. Raises SolveError where the
    solution is not finite, or the system nearly singular and the residual stays large.
    """
    force, last, accuracy = iterate.residual(), np.inf, ROUGH if refine else EPSILON
    for step in range(_MAX_REFINEMENTS if refine else 1):
        correction = system.correction(iterate.condensed(force), iterate.violation(), accuracy)
        following = iterate.advanced(correction)
        following_force = following.residual()
        size = system.imbalance(following_force, following.violation()) / scale
        if not np.isfinite(size):
            raise SolveError("the solution is not finite")
        _LOG.info("solution %d: residual %.1e", step + 1, size)
        if size < last:
            iterate, force = following, following_force
        enough = size <= round_off or size > _MIN_GAIN * last
        last = min(size, last)
        if enough:
            break
        # No more than it takes from here to well below round-off.
        accuracy = min(max(_WELL_BELOW * round_off / last, ROUGH), _LEAST_GAIN)
    if system.warning and last > _CONVERGED:
        raise SolveError(system.warning)
    return iterate, system.multiplier(force), last
