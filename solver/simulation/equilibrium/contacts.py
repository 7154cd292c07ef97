"""The contacts of bodies that nothing joins, each with Coulomb's law found by itself.

What acts on one of them is no measure for another one, and one that nothing presses may rest while
another one rubs.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator

from ...mechanics.mortar.coulomb import CoulombContact

Rest = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Which gaps (m,) touch, and the jumps (r,), where nothing presses some gaps (m,).

The others keep their jumps (r,).
"""


class _Contact(NamedTuple):
    """One of them: its gaps, macro-elements with friction and rows among those of all."""

    gaps: np.ndarray
    rubbing: np.ndarray
    rows: np.ndarray | slice
    law: CoulombContact


class Contacts:
    """The contacts that a `whole` one consists of, with its methods.

    `group` (m,): which contact each gap belongs to.
    """

    def __init__(self, whole: CoulombContact, group: np.ndarray):
        self.m, self.of, self._count = whole.m, whole.of, len(whole.c)
        self._resting: dict[int, np.ndarray] = {}
        self._contacts = [_contact(whole, group == number) for number in np.unique(group)]

    def solve(
        self,
        forces: np.ndarray,
        guess: np.ndarray | float,
        last: np.ndarray | None,
        scale: float,
        nothing: float,
        rest: Rest,
    ) -> tuple[np.ndarray, np.ndarray, int] | None:
        """The same for each; None where all of them rest.

        One rests, as `rest` says, if no force on its gaps exceeds `nothing`, or it has no solution.
        """
        found, z, most = np.zeros_like(forces), np.zeros_like(forces), 0
        guess = np.zeros_like(forces) + guess
        self._resting = {}
        for number, one in enumerate(self._contacts):
            mine = one.rows
            before = None if last is None else last[mine]
            solution = one.law.solve(forces[mine], guess[mine], before, scale)
            if solution is None or solution[0][: len(one.gaps)].max(initial=0.0) <= nothing:
                self._resting[number] = np.zeros(len(one.gaps), dtype=bool)
            else:
                found[mine], z[mine], steps = solution
                most = max(most, steps)
        if len(self._resting) == len(self._contacts):
            return None
        if self._resting:
            some = np.zeros(self.m, dtype=bool)
            some[np.concatenate([self._contacts[number].gaps for number in self._resting])] = True
            touching, jump = rest(some, z)
            for number in self._resting:
                one = self._contacts[number]
                self._resting[number], z[one.rows] = touching[one.gaps], jump[one.rows]
        return found, z, most

    def faintest(self, forces: np.ndarray) -> float:
        """The largest force on the gaps of the one that is pressed least and does not rest."""
        return min(float(forces[one.gaps].max()) for one in self._acting())

    def corrected(
        self, forces: np.ndarray, jump: np.ndarray, scale: float
    ) -> tuple[np.ndarray, float]:
        """The same for those that do not rest, and the largest fault."""
        found, faults = jump.copy(), [0.0]
        for one in self._acting():
            found[one.rows], fault = one.law.corrected(forces[one.rows], jump[one.rows], scale)
            faults.append(fault)
        return found, max(faults)

    def again(self, forces: np.ndarray, jump: np.ndarray) -> np.ndarray | None:
        """The same for those that do not rest; None where one of them has no solution."""
        found = jump.copy()
        for one in self._acting():
            following = one.law.again(forces[one.rows], jump[one.rows])
            if following is None:
                return None
            found[one.rows] = following
        return found

    def opens_wide(self, forces: np.ndarray, jump: np.ndarray) -> bool:
        """Whether one of them does, or is open at rest."""
        if any(not touching.all() for touching in self._resting.values()):
            return True
        return any(one.law.opens_wide(forces[one.rows], jump[one.rows]) for one in self._acting())

    def kept(self, closed: np.ndarray) -> np.ndarray:
        """The rows (r,) of closed gaps (m,), and of their slips."""
        rows = np.zeros(self._count, dtype=bool)
        for one in self._contacts:
            rows[one.rows] = one.law.kept(closed[one.gaps])
        return rows

    def statuses(self, forces: np.ndarray, jump: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which gaps are closed (m,), which macro-elements slip (f,); all that touch at rest do."""
        closed, slips = np.zeros(self.m, dtype=bool), np.zeros(len(self.of), dtype=bool)
        for number, one in enumerate(self._contacts):
            if number in self._resting:
                closed[one.gaps] = self._resting[number]
                slips[one.rubbing] = closed[self.of[one.rubbing]]
            else:
                own = one.law.statuses(forces[one.rows], jump[one.rows])
                closed[one.gaps], slips[one.rubbing] = own
        return closed, slips

    def _acting(self) -> Sequence[_Contact]:
        return [one for n, one in enumerate(self._contacts) if n not in self._resting]


def _contact(whole: CoulombContact, mine: np.ndarray) -> _Contact:
    """The one whose gaps (m,) are `mine`."""
    gaps, rubbing = np.flatnonzero(mine), np.flatnonzero(mine[whole.of])
    if mine.all():
        return _Contact(gaps, rubbing, slice(None), whole)
    slips = np.array([along[rubbing] for along in whole.rows])
    rows = np.concatenate([gaps, slips.ravel()])
    law = CoulombContact(
        _part_of(whole.stiffness, rows),
        whole.c[rows],
        whole.friction[rubbing],
        np.searchsorted(gaps, whole.of[rubbing]),
        len(gaps) + np.arange(slips.size).reshape(slips.shape),
    )
    return _Contact(gaps, rubbing, rows, law)


def _part_of(
    stiffness: np.ndarray | LinearOperator, rows: np.ndarray
) -> np.ndarray | LinearOperator:
    """The stiffness that some rows (s,) bring up in themselves."""
    if isinstance(stiffness, np.ndarray):
        return stiffness[np.ix_(rows, rows)]

    def product(jump: np.ndarray) -> np.ndarray:
        whole = np.zeros(stiffness.shape[0])
        whole[rows] = jump.ravel()
        return np.asarray((stiffness @ whole)[rows])

    return LinearOperator((len(rows), len(rows)), matvec=product, dtype=float)
