"""The systems that a contact problem solves: one for each group of bodies that contact joins.

A group is factored again only when its own closed multipliers change. A body outside every zone is
factored once, whatever the contact status of the others. Most systems are condensed; two kinds are
solved otherwise.

Augmented: multipliers of slave vertices overlap, so that no unknown belongs to one of them alone.
With the constraints added to the stiffness, A = K + Ĝᵀ w Ĝ, the solution does not change, A is
positive definite, and the multipliers follow from A by few steps p ← p + w (b − Ĝ x). Sources:
Fortin, Glowinski, Augmented Lagrangian methods, North-Holland 1983, ch. 1; Golub, Greif, On solving
block-structured indefinite linear systems, SIAM J. Sci. Comput. 24 (2003) 2076–2092.

Compliant: constraints give way to their pressures (`linear.compliant`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...lac.errors import SolveError
from ..fem.bodies import joined_bodies
from .choice import Solvers
from .compliant import Compliance, condense_compliant
from .condensation import ConstrainedSystem, condense
from .condensed_matrix import CondensedMatrix, Symmetric
from .factor import Factor, factorise
from .krylov import EPSILON
from .symmetric_blocks import Stiffness
from .unknowns import Unknowns

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

    `compliance` (n,): the inverse of the diagonal D of K, zero for rigid unknowns, which have no
    stiffness; the factor `gram` of Ĝ D⁻¹ Ĝᵀ; the `weight` w.
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
    solvers: Solvers | None = None,
) -> AugmentedSystem:
    """Prepare K x = f + Gᵀ p, G x = b; `matrix` K (n, n), `constraints` G (m, n).

    `solvers` of K, or a factor without any. Raises SolveError where constraints nearly depend on
    one another, or a factor finds that they leave a motion free.
    """
    compliance = _compliance(matrix)
    square = constraints.multiply(constraints) @ compliance
    size = np.sqrt(np.asarray(square).ravel())
    try:
        if not size.all():
            raise SolveError("a constraint holds no unknown")
        scaled = (sparse.diags(1 / size) @ constraints).tocsr()
        gram = factorise(scaled @ sparse.diags(compliance) @ scaled.T, least=_LEAST)
        weight = max(_WEIGHT, _REDUCTION / gram.smallest)
        factor = (solvers or Solvers()).prepare(_augmented(matrix, scaled, weight))
        if factor.warning:
            raise SolveError(factor.warning)
    except SolveError as error:
        raise SolveError(
            f"{error}: the {constraints.shape[0]} closed multipliers may depend on one "
            "another, as where they outnumber the slave nodes or supports hold these"
        ) from None
    return AugmentedSystem(
        factor=factor,
        about=_NOTHING_OWN,
        scaled=scaled,
        size=size,
        compliance=compliance,
        gram=gram,
        weight=weight,
    )


def _compliance(matrix: Stiffness) -> np.ndarray:
    """The inverse of the diagonal (n,); zero for rigid unknowns, which have no stiffness."""
    diagonal = matrix.diagonal()
    return np.divide(1.0, diagonal, out=np.zeros(len(diagonal)), where=diagonal > 0)


def _augmented(matrix: Stiffness, scaled: sparse.csr_matrix, weight: float) -> Symmetric:
    """K + Ĝᵀ w Ĝ."""
    if not scaled.shape[0]:
        return matrix
    everything = np.arange(matrix.shape[0])
    return CondensedMatrix(matrix, everything, (weight * (scaled.T @ scaled)).tocsr())


_MANY = "a factor serves many right-hand sides at once"
# A factor of so many unknowns takes too much memory to be tried for that.
_LARGEST = 300_000


@dataclass(frozen=True)
class Part:
    """A group of bodies: masks of its free unknowns (n,) and of its multipliers (k,)."""

    unknowns: np.ndarray
    multipliers: np.ndarray


def parts_of(constraints: sparse.csr_matrix, bodies: np.ndarray, n_bodies: int) -> list[Part]:
    """The groups of bodies that no row of `constraints` (k, n) joins; one part if that is all.

    `bodies` (n,) of the unknowns.
    """
    everything = Part(*(np.ones(n, dtype=bool) for n in reversed(constraints.shape)))
    if n_bodies == 1:
        return [everything]
    group = joined_bodies(constraints, bodies, n_bodies)[bodies]
    numbers = np.unique(group)
    if len(numbers) == 1:
        return [everything]
    mine = [group == number for number in numbers]
    return [Part(m, np.diff(constraints[:, np.flatnonzero(m)].tocsr().indptr) > 0) for m in mine]


@dataclass(frozen=True, kw_only=True)
class IndependentSystems(ConstrainedSystem):
    """Systems without common unknowns: `parts` with their unknowns and closed multipliers.

    `factor` is the solver of the largest system.
    """

    parts: Sequence[tuple[np.ndarray, np.ndarray, ConstrainedSystem]]
    n_multipliers: int

    @property
    def warning(self) -> str:
        """The first of its parts."""
        return next((system.warning for _, _, system in self.parts if system.warning), "")

    def correction(
        self, force: np.ndarray, violation: np.ndarray, accuracy: float = EPSILON
    ) -> np.ndarray:
        """See `ConstrainedSystem`."""
        change = np.zeros_like(force)
        for unknowns, mine, system in self.parts:
            change[unknowns] = system.correction(force[unknowns], violation[mine], accuracy)
        return change

    def multiplier(self, force: np.ndarray) -> np.ndarray:
        """See `ConstrainedSystem`."""
        found = np.zeros((self.n_multipliers, *force.shape[1:]))
        for unknowns, mine, system in self.parts:
            found[mine] = system.multiplier(force[unknowns])
        return found

    def imbalance(self, force: np.ndarray, violation: np.ndarray) -> float:
        """See `ConstrainedSystem`."""
        left = (part[2].imbalance(force[part[0]], violation[part[1]]) for part in self.parts)
        return max(left)


class Systems:
    """K x = f + Gᵀ p under the constraints of closed multipliers, factored and kept.

    `matrix` K (n, n), `constraints` (k, n) of all multipliers, `own` (n,) the unknowns that may be
    eliminated by condensation, None where some multiplier has none: then the constraints augment
    the stiffness. `unknowns` describes each. `compliance`: of the c multipliers that a mask (k,)
    has closed, where they give way.
    """

    def __init__(
        self,
        matrix: Stiffness,
        constraints: sparse.csr_matrix,
        own: np.ndarray | None,
        unknowns: Unknowns,
        parts: Sequence[Part],
        compliance: Callable[[np.ndarray], Compliance] | None = None,
    ):
        self._matrix, self._constraints, self._own = matrix, constraints, own
        self._parts, self._compliance = parts, compliance
        self._kept: dict[int, tuple[bytes, ConstrainedSystem]] = {}
        alone = len(parts) == 1
        mine = (unknowns if alone else unknowns.of(np.flatnonzero(p.unknowns)) for p in parts)
        self._solvers = [Solvers(each) for each in mine]
        self.latest: ConstrainedSystem | None = None

    def forget(self) -> None:
        """Keep no factor."""
        for number in list(self._kept):
            self._drop(number, self._solvers)
            self._solvers[number].forget()

    def _drop(self, number: int, solvers: Sequence[Solvers]) -> None:
        """Drop a part's system; its solvers remember why multigrid failed on it, if it did."""
        self.latest, factor = None, self._kept.pop(number)[1].factor
        if factor.gave_up:
            solvers[number].gave_up = factor.gave_up

    def closed(self, closed: np.ndarray) -> ConstrainedSystem:
        """The system with the multipliers `closed` (k,); raises SolveError where it is singular."""
        return self._closed(closed, self._solvers)

    def _closed(self, closed: np.ndarray, solvers: Sequence[Solvers]) -> ConstrainedSystem:
        """The same, with the solvers of each part for what is not kept."""
        for number, part in enumerate(self._parts):
            mine = closed & part.multipliers
            if number in self._kept and self._kept[number][0] != mine.tobytes():
                self._drop(number, solvers)  # releases its memory first
            if number in self._kept:
                continue
            (matrix, constraints, own), by = self._of(part, mine), solvers[number]
            system: ConstrainedSystem
            if own is None:
                system = augment(matrix, constraints, by)
            elif self._compliance and len((soft := self._compliance(mine)).weight):
                system = condense_compliant(matrix, constraints, own, soft, by)
            else:
                system = condense(matrix, constraints, own, by)
            self._kept[number] = mine.tobytes(), system
        self.latest = self._kept[0][1] if len(self._parts) == 1 else self._joined(closed)
        return self.latest

    def _of(
        self, part: Part, closed: np.ndarray
    ) -> tuple[Stiffness, sparse.csr_matrix, np.ndarray | None]:
        """Matrix, `closed` constraints and own unknowns of a part."""
        own, constraints = self._own, self._constraints[closed]
        if len(self._parts) == 1:
            return self._matrix, constraints, own
        chosen = np.flatnonzero(part.unknowns)
        matrix = self._matrix.tocsr()[chosen][:, chosen]
        return matrix, constraints[:, chosen], None if own is None else own[chosen]

    def _joined(self, closed: np.ndarray) -> "IndependentSystems":
        """The systems of all parts as one."""
        kept = [self._kept[number][1] for number in range(len(self._parts))]
        largest = kept[int(np.argmax([part.unknowns.sum() for part in self._parts]))]
        about = filter(None, [largest.about, f"largest of {len(kept)} systems"])
        parts = [
            (np.flatnonzero(part.unknowns), np.flatnonzero(part.multipliers[closed]), system)
            for part, system in zip(self._parts, kept, strict=True)
        ]
        return IndependentSystems(
            factor=largest.factor,
            about="; ".join(about),
            parts=parts,
            n_multipliers=int(closed.sum()),
        )

    def factored(self, closed: np.ndarray) -> ConstrainedSystem:
        """The same by a factor, which serves for many right-hand sides at once.

        Systems of `_LARGEST` unknowns and more keep their solver.
        """
        if self._matrix.shape[0] < _LARGEST:
            for number, (_, system) in list(self._kept.items()):
                if system.factor.iterative:
                    self._drop(number, self._solvers)
            return self._closed(closed, [Solvers(of.unknowns, _MANY) for of in self._solvers])
        return self.closed(closed)
