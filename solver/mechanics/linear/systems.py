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
from .choice import Shared
from .condensation import ConstrainedSystem, condense
from .krylov import EPSILON
from .symmetric_blocks import Stiffness
from .unknowns import Unknowns

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
        self.latest, factor = None, self._kept.pop(number)[1].factor
        if factor.gave_up:
            self._gave_up[number] = factor.gave_up

    def closed(self, closed: np.ndarray) -> ConstrainedSystem:
        """The system with the multipliers `closed` (k,); raises SolveError where it is singular."""
        for number, part in enumerate(self._parts):
            mine = closed & part.multipliers
            if number not in self._kept or self._kept[number][0] != mine.tobytes():
                if number in self._kept:  # releases its memory first
                    self._drop(number)
                self._kept[number] = mine.tobytes(), self._factored(number, part, mine)
        if len(self._parts) == 1:
            self.latest = self._kept[0][1]
            return self.latest
        kept = [self._kept[number][1] for number in range(len(self._parts))]
        largest = kept[int(np.argmax([part.unknowns.sum() for part in self._parts]))]
        about = filter(None, [largest.about, f"largest of {len(kept)} systems"])
        parts = [
            (np.flatnonzero(part.unknowns), np.flatnonzero(part.multipliers[closed]), system)
            for part, system in zip(self._parts, kept, strict=True)
        ]
        self.latest = IndependentSystems(
            factor=largest.factor,
            about="; ".join(about),
            parts=parts,
            n_multipliers=int(closed.sum()),
        )
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

    def _factored(self, number: int, part: Part, closed: np.ndarray) -> ConstrainedSystem:
        """The system of one part, factored."""
        matrix, constraints = self._matrix, self._constraints[closed]
        own, unknowns = self._own, self._unknowns
        if len(self._parts) > 1:
            chosen = np.flatnonzero(part.unknowns)
            matrix, constraints = matrix.tocsr()[chosen][:, chosen], constraints[:, chosen]
            own, unknowns = None if own is None else own[chosen], unknowns.of(chosen)
        known = unknowns, self._gave_up.get(number, ""), self._shared[number]
        if own is not None:
            if self._compliance is not None and len((soft := self._compliance(closed)).weight):
                return stabilise(matrix, constraints, own, soft, *known)
            return condense(matrix, constraints, own, *known)
        try:
            return augment(matrix, constraints, *known)
        except SolveError as error:
            raise SolveError(
                f"{error}: the {constraints.shape[0]} closed multipliers may depend on one "
                "another, as where they outnumber the slave nodes or supports hold these"
            ) from None
