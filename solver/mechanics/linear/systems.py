"""The systems that a contact problem solves: one for each group of bodies that contact joins.

A group is factored again only when its own closed multipliers change. A body outside every zone is
factored once, whatever the contact status of the others.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...lac.errors import SolveError
from ..fem.bodies import joined_bodies
from .augmented import Compliance, augment, stabilise
from .choice import LinearSolver, Shared
from .condensation import ConstrainedSystem, condense
from .krylov import EPSILON
from .symmetric_blocks import Stiffness
from .unknowns import Unknowns

_MANY = "a factor serves many right-hand sides at once"
# A factor of so many unknowns takes too much memory to be tried for that.
_LARGEST = 300_000
_NOTHING_OWN = "constraints without an unknown of their own: added to the stiffness with a weight"


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


@dataclass(frozen=True)
class IndependentSystems:
    """Systems without common unknowns: `parts` with their unknowns and closed multipliers."""

    parts: Sequence[tuple[np.ndarray, np.ndarray, ConstrainedSystem]]
    n_multipliers: int

    @property
    def _largest(self) -> ConstrainedSystem:
        return max(self.parts, key=lambda part: len(part[0]))[2]

    @property
    def factor(self) -> LinearSolver:
        """The solver of the largest system."""
        return self._largest.factor

    @property
    def why(self) -> str:
        """Why it was chosen."""
        return f"{self._largest.why}; largest of {len(self.parts)} systems"

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
    has closed, where contact is stabilised.
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
        self._unknowns, self._parts, self._compliance = unknowns, parts, compliance
        self._kept: dict[int, tuple[bytes, ConstrainedSystem]] = {}
        self._gave_up: dict[int, str] = {}
        self._shared = [Shared() for _ in parts]
        self.latest: ConstrainedSystem | None = None

    def forget(self) -> None:
        """Keep no factor."""
        for number in list(self._kept):
            self._drop(number)
            self._shared[number].close()

    def _drop(self, number: int) -> None:
        """Drop a part's system, and remember why multigrid failed on it, if it did."""
        factor = self._kept.pop(number)[1].factor
        if factor.gave_up:
            self._gave_up[number] = factor.gave_up

    def closed(self, closed: np.ndarray) -> ConstrainedSystem:
        """The system with the multipliers `closed` (k,); raises SolveError where it is singular."""
        if len(self._parts) == 1:
            self.latest = self._of(0, None, closed)
            return self.latest
        found = []
        for number, part in enumerate(self._parts):
            unknowns = np.flatnonzero(part.unknowns)
            system = self._of(number, unknowns, closed & part.multipliers)
            found.append((unknowns, np.flatnonzero(part.multipliers[closed]), system))
        self.latest = IndependentSystems(found, int(closed.sum()))
        return self.latest

    def factored(self, closed: np.ndarray) -> ConstrainedSystem:
        """The same by a factor, which serves for many right-hand sides at once.

        Systems of `_LARGEST` unknowns and more keep their solver.
        """
        if self._matrix.shape[0] < _LARGEST:
            for number, (_, system) in list(self._kept.items()):
                if system.factor.iterative:
                    self._drop(number)
            before, self._gave_up = self._gave_up, dict.fromkeys(range(len(self._parts)), _MANY)
            try:
                return self.closed(closed)
            finally:
                self._gave_up = before
        return self.closed(closed)

    def _of(self, number: int, chosen: np.ndarray | None, closed: np.ndarray) -> ConstrainedSystem:
        """The system of one part, of the `chosen` unknowns; None: of all."""
        key = closed.tobytes()
        if number not in self._kept or self._kept[number][0] != key:
            # The previous factor releases its memory first.
            if number in self._kept:
                self._drop(number)
            self._kept[number] = key, self._factored(number, chosen, closed)
        return self._kept[number][1]

    def _factored(
        self, number: int, chosen: np.ndarray | None, closed: np.ndarray
    ) -> ConstrainedSystem:
        matrix, constraints = self._matrix, self._constraints[closed]
        own, unknowns = self._own, self._unknowns
        if chosen is not None:
            matrix, constraints = matrix.tocsr()[chosen][:, chosen], constraints[:, chosen]
            own, unknowns = None if own is None else own[chosen], unknowns.of(chosen)
        known = self._gave_up.get(number, ""), self._shared[number]
        if own is None:
            return _augmented(matrix, constraints, unknowns, *known)
        if self._compliance is not None and len((soft := self._compliance(closed)).weight):
            return stabilise(matrix, constraints, own, soft, unknowns, *known)
        return condense(matrix, constraints, own, unknowns, *known)


def _augmented(
    matrix: Stiffness, constraints: sparse.csr_matrix, unknowns: Unknowns, why: str, shared: Shared
) -> ConstrainedSystem:
    try:
        return augment(matrix, constraints, _NOTHING_OWN, unknowns, why, shared)
    except SolveError as error:
        raise SolveError(
            f"{error}: the {constraints.shape[0]} closed multipliers may depend on one "
            "another, as where they outnumber the slave nodes or supports hold these"
        ) from None
