"""Equilibrium of a step with Coulomb friction: which macro-elements are open, stick or slip.

The state is found on the contact alone, by Newton's method (`mortar.coulomb`). Its jumps are then
imposed on the whole system, with the factor of everything closed and stuck, and corrected by what
the law is off there: one factor serves all steps of a case. A solution need not be the only one:
for large coefficients there may be others.
"""

import logging
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...case.acting import Step
from ...lac.errors import SolveError
from ...lac.motions import holding, unseen
from ...lac.status import StatusResult
from ...mechanics.mortar.coulomb import CoulombContact
from .contacts import Contacts
from .problem import ContactProblem
from .rest import AT_REST, FAINT, forces_at_work
from .state import Equilibrium, Friction

_LOG = logging.getLogger(__name__)
# Corrections of the jumps, and the fault of the law by the largest force that ends them, or ends
# those of a state on the way; they end as well where it falls by less than the half. A larger fault
# than the last one is no state.
_CORRECTIONS, _EXACT, _ON_THE_WAY, _SLOW, _TOLERATED = 6, 1e-15, 1e-12, 0.5, 1e-6
# So often the status is found anew where it changes how contact gives way.
_ROUNDS = 8
_UNHELD = (
    "once its contact opens or slips: the loads part the bodies or overcome friction, or a support "
    "is missing"
)


class _Unmoved(NamedTuple):
    """Pressures (k,) with all closed and stuck under `correction` (n, dim), the force at work."""

    correction: np.ndarray
    pressure: np.ndarray
    at_work: float


class Search:
    """One step of a problem: the rows of its f macro-elements with friction, and its solves."""

    def __init__(self, problem: ContactProblem, step: Step, before: Equilibrium | None):
        zones = [zone for zone in problem.scene.zones if zone.slips]
        self.problem, self.step = problem, step
        numbers = np.arange(len(problem.constraints.area))
        self.gaps = np.concatenate([numbers[zone.numbers] for zone in zones])
        by_tangent = zip(*(zone.slips for zone in zones), strict=True)
        self.rows = np.array([np.concatenate([numbers[r] for r in rows]) for rows in by_tangent])
        counts = [len(zone.operator.initial) for zone in zones]
        self.coefficient = np.repeat([zone.zone.friction for zone in zones], counts)
        # Slip is what the jumps have more than those of the last step. Where bodies have moved,
        # jumps are counted from where that step left them.
        last = before.friction if before and not problem.moved else None
        self.jump = last.jump if last else np.zeros(len(numbers))
        self.total = last.total if last else np.zeros(len(numbers))
        self.last = before.pressure if before else None
        self.closed = before.status.closed if before else None
        self.count = 0
        self._unmoved: _Unmoved | None = None
        problem.gives_way_where(np.ones(len(numbers), dtype=bool))
        # Where nothing acts, what presses is rounding or is left from other steps.
        self._acts = self._act_on(np.ones(len(numbers), dtype=bool))

    def settled(
        self, correction: np.ndarray | float = 0.0, on_the_way: bool = False
    ) -> Equilibrium:
        """Equilibrium under the forces `correction` (n, dim) beside those of the constants.

        To the last digits, or to some if it is `on_the_way` to another one. Raises SolveError where
        none is found. Contact that gives way does so where it stays closed and is pressed.
        """
        for _ in range(_ROUNDS):
            found = self._settled(correction, on_the_way)
            if not self._bears(found) or not self.problem.gives_way_where(found.status.closed):
                return found
            self._unmoved = None
            del self._contact
        raise SolveError("the status of stabilised contact does not settle")

    def _bears(self, found: Equilibrium) -> bool:
        """Whether contact bears more than what rounding may leave of the forces at work."""
        assert self._unmoved is not None
        base = self.problem.constraints
        forces = (base.covered * found.pressure)[base.normal]
        return bool(forces.max(initial=0.0) > FAINT * self._unmoved.at_work)

    def _settled(self, correction: np.ndarray | float, on_the_way: bool) -> Equilibrium:
        base, contact = self.problem.constraints, self._contact
        area = base.covered[base.eligible]
        # Bodies that went on slip by about as much.
        gone = np.where(base.normal, 0.0, base.initial)[base.eligible] / area
        last = None if self.last is None else area * self.last[base.eligible]
        pressure, at_work = self._where_nothing_moves(correction)
        at_rest = area * pressure[base.eligible]

        def rest(gaps: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            unpressed = self._unpressed(gaps, z, at_work, correction)
            jump = (unpressed.gap - self.jump)[base.eligible]
            return unpressed.status.closed[base.eligible][: contact.m], jump

        scale = max(float(np.abs(at_rest).max(initial=0.0)), at_work)
        enough = _ON_THE_WAY if on_the_way else _EXACT
        for nothing in (AT_REST, FAINT) if self._acts else (FAINT,):
            solution = contact.solve(at_rest, gone, last, at_work, nothing * at_work, rest)
            if solution is None:
                break
            forces, z, steps = solution
            _LOG.info("friction: %d Newton steps", steps)
            corrected = self._corrected(z, scale, correction, enough)
            forces = corrected[1] if corrected else forces
            # What pressed by rounding has let go of a body, and is at rest.
            if corrected and (nothing > AT_REST or contact.faintest(forces) > AT_REST * at_work):
                found, forces, z = corrected
                found = self._freed(forces, z, correction) or found
                state = self._with_status(found, *contact.statuses(forces, z))
                return state if on_the_way else self._judged(found, state)
            if contact.faintest(forces) > FAINT * at_work:
                break
        return self._resting(at_work, correction)

    def _where_nothing_moves(self, correction: np.ndarray | float) -> tuple[np.ndarray, float]:
        """Pressures (k,) with all closed and stuck, and the force at work.

        Those under other forces follow from the first ones: what is found with them is corrected.
        """
        if self._unmoved is None:
            nowhere = np.zeros(int(self.problem.constraints.eligible.sum()))
            found = self._imposed(nowhere, correction)
            last = self.problem.constraints.covered * (0.0 if self.last is None else self.last)
            at_work = forces_at_work(self.problem.scene, found.displacement)
            at_work = max(at_work, float(np.abs(last).max()))
            self._unmoved = _Unmoved(found.correction, found.pressure, at_work)
            return found.pressure, at_work
        known = self._unmoved
        more = np.ravel(correction - known.correction)
        change = self.problem.pressure_change(self.problem.constraints.eligible, more)
        return known.pressure + change, known.at_work

    def _unpressed(
        self, gaps: np.ndarray, z: np.ndarray, at_work: float, correction: np.ndarray | float
    ) -> Equilibrium:
        """Equilibrium in which nothing presses some `gaps` (m,), without friction there.

        The others, of other bodies, keep what they have of z (r,). A body that its loads have left
        may be in many places: this one touches another body, and stays where no gap holds it.
        Raises SolveError if the search without friction finds no such state.
        """
        base = self.problem.constraints
        kept = self._of_all(self._contact.kept(~gaps))
        rests = self._of_all(self._contact.kept(gaps))
        slips = rests & ~base.normal & (not self._act_on(rests))
        seen = self._opened @ unseen(self._opened[kept | base.closable])
        still = holding(seen, slips)
        imposed = np.where(kept | still, self.jump + self._of_all(z), np.nan)
        try:
            found = self.problem.solve(self.step, self.closed, imposed, correction)
        except SolveError:
            raise SolveError(self._why_none()) from None
        if still.any():
            gap = found.gap + self._back(found.gap - self.jump, slips, seen)
            found = replace(found, trial=replace(found.trial, gap=gap))
        # Where all others may bear tension up to their limit, one may bear what balances them.
        limit = max(int((found.status.closed & ~kept).sum()), 1) * found.trial.pressure_limit
        pressed = base.covered * np.maximum(found.pressure - limit, 0.0)
        if (pressed[base.eligible][: len(gaps)][gaps] > AT_REST * at_work).any():
            raise SolveError(self._why_none())
        return found

    def _act_on(self, rows: np.ndarray) -> bool:
        """Whether loads or imposed displacements act on the bodies that some rows (k,) see."""
        scene = self.problem.scene
        seen = scene.body[self.problem.constraints.gaps[rows].indices // scene.space]
        mine, (force, offset) = np.isin(scene.body, seen), scene.acting(self.step)
        return bool(force[mine].any() or offset.reshape(force.shape)[mine].any())

    def _back(self, jump: np.ndarray, slips: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """What slips (k,) change by as bodies that no gap holds move to where they slip least.

        That is in the mean square of some `slips` (k,), which have a `jump` (k,); `seen` (k, f): by
        each motion that is free.
        """
        root = np.sqrt(self.problem.constraints.covered[slips])
        motion, *_ = np.linalg.lstsq(root[:, None] * seen[slips], -root * jump[slips])
        return np.where(slips, seen @ motion, 0.0)

    def _resting(self, at_work: float, correction: np.ndarray | float) -> Equilibrium:
        """Equilibrium in which nothing presses, so that nothing rubs.

        No more contact holds bodies than must: surfaces that do not fit by rounding would press.
        """
        base, everywhere = self.problem.constraints, np.ones(self._contact.m, dtype=bool)
        nowhere = np.zeros(int(base.eligible.sum()))
        found = self._unpressed(everywhere, nowhere, at_work, correction)
        touching = np.where(base.normal, found.status.closed, base.eligible)
        held = holding(self._opened, touching)
        jump = np.where(held, found.gap - self.jump, 0.0)
        found = self.problem.with_jumps(self.step, held, jump, self.jump, correction)
        nothing = np.zeros_like(found.pressure)
        found = replace(found, trial=replace(found.trial, pressure=nothing))
        touching |= found.gap <= AT_REST * np.abs(found.displacement).max()
        closed = touching[base.eligible][: self._contact.m]
        return self._judged(found, self._with_status(found, closed, closed[self._contact.of]))

    @cached_property
    def _opened(self) -> np.ndarray:
        """The mean gap or slip (k, r) of all rows by each motion that supports leave free."""
        base = self.problem.constraints
        seen = (base.gaps @ self.problem.unsupported).toarray()
        return np.asarray(seen / np.where(base.eligible, base.covered, np.inf)[:, None])

    def _corrected(
        self, z: np.ndarray, scale: float, correction: np.ndarray | float, enough: float
    ) -> tuple[Equilibrium, np.ndarray, np.ndarray] | None:
        """Equilibrium with jumps from z (r,) on that fulfil the law, its forces (r,) and z (r,).

        None where they do not come to fulfil it. `scale`: of the forces that would close
        everything, or that are at work; `enough`: the fault, by this, that ends it.
        """
        base, last = self.problem.constraints, np.inf
        for _ in range(_CORRECTIONS):
            found = self._imposed(z, correction)
            forces = (base.covered * found.pressure)[base.eligible]
            following, fault = self._contact.corrected(forces, z, scale)
            _LOG.info("friction: law off by %.1e", fault)
            if fault < enough or fault > _SLOW * last:
                break
            if fault > _TOLERATED and (anew := self._contact.again(forces, z)) is not None:
                following = anew
            z, last = following, fault
        return None if fault > _TOLERATED else (found, forces, z)

    def _freed(
        self, forces: np.ndarray, z: np.ndarray, correction: np.ndarray | float
    ) -> Equilibrium | None:
        """The same with open gaps left free, where they are so wide that their rounding counts.

        None where they are not, or where a body would move freely.
        """
        if not self._contact.opens_wide(forces, z):
            return None
        rows = self._of_all(self._contact.kept(self._contact.statuses(forces, z)[0]))
        return None if self.problem.free_motion(rows) else self._imposed(z, correction, rows)

    def _imposed(
        self, z: np.ndarray, correction: np.ndarray | float, rows: np.ndarray | None = None
    ) -> Equilibrium:
        """Equilibrium with the gaps and slips z (r,) of all that may close or stick.

        `rows` (k,): of these alone.
        """
        self.count += 1
        rows = self.problem.constraints.eligible if rows is None else rows
        return self.problem.with_jumps(self.step, rows, self._of_all(z), self.jump, correction)

    def _of_all(self, values: np.ndarray) -> np.ndarray:
        """Values (r,) of what may close or stick, among those of all rows (k,)."""
        found = np.zeros(len(self.jump), dtype=values.dtype)
        found[self.problem.constraints.eligible] = values
        return found

    @cached_property
    def _contact(self) -> Contacts:
        """The contacts alone, of the rows that may close or stick."""
        rows = self.problem.constraints.eligible
        number, there = np.cumsum(rows) - 1, rows[self.gaps]
        friction, of = self.coefficient[there], number[self.gaps[there]]
        stiffness, diagonal = self.problem.contact_stiffness()
        whole = CoulombContact(stiffness, diagonal, friction, of, number[self.rows[:, there]])
        group = np.zeros(len(rows), dtype=int)
        for joined, part in enumerate(self.problem.parts):
            group[part.multipliers] = joined
        return Contacts(whole, group[rows][: whole.m])

    def _why_none(self) -> str:
        """Why Newton's method found no state: a body that friction would have to hold, if any."""
        nothing = np.zeros(len(self.jump), dtype=bool)
        if moves := self.problem.free_motion(nothing):
            return f"{moves} {_UNHELD}; smaller steps may find one (substeps)"
        return "no frictional equilibrium found"

    def _with_status(
        self, found: Equilibrium, closable: np.ndarray, slipping: np.ndarray
    ) -> Equilibrium:
        """A state of imposed jumps as one of a status: exact zeros where these belong.

        `closable`, `slipping`: the statuses of the rows that may close or stick.
        """
        base, k = self.problem.constraints, len(self.jump)
        closed, slips = np.zeros(k, dtype=bool), np.zeros(len(self.gaps), dtype=bool)
        closed[np.flatnonzero(base.eligible)[: len(closable)]] = closable
        closed &= base.closable
        slips[base.eligible[self.gaps]] = slipping
        kept, rows = closed[self.gaps], closed.copy()
        rows[self.rows] = kept & ~slips
        pressure, gap = found.pressure.copy(), found.gap.copy()
        total, jump = self.total.copy(), self.jump.copy()
        jump[self.rows] += gap[self.rows]
        pressure[base.normal & ~closed], gap[closed] = 0.0, found.iterate.gap[closed]
        pressure[self.rows] = np.where(kept, pressure[self.rows], 0.0)
        gap[self.rows] = np.where(slips, gap[self.rows], 0.0)
        total[self.rows] += gap[self.rows]
        limits = [found.trial.pressure_limit.copy(), found.trial.gap_limit.copy()]
        for limit in limits:
            limit[self.rows] = np.inf
        of_gaps = np.zeros(k, dtype=bool)
        of_gaps[self.gaps] = slips
        work = _work(pressure[self.rows], gap[self.rows], base.covered[self.gaps])
        return replace(
            found,
            iterate=found.iterate.with_closed(rows),
            trial=replace(
                found.trial,
                pressure=pressure,
                gap=gap,
                pressure_limit=limits[0],
                gap_limit=limits[1],
            ),
            status=StatusResult(closed, self.count, []),
            friction=Friction(of_gaps, jump, total, work),
        )

    def _judged(self, found: Equilibrium, state: Equilibrium) -> Equilibrium:
        """The `state` that imposed jumps, as `found`, make, with its own accuracy.

        Open gaps are imposed so that nothing presses there: what does is what rounding leaves.
        """
        base, closed, residual = self.problem.constraints, state.status.closed, found.residual
        pressed = closed.copy()
        pressed[self.rows] = closed[self.gaps]
        iterate = found.iterate.with_closed(pressed, base.with_jumps(self.jump + found.gap))
        known = self.problem.accuracy(iterate, found.pressure, residual, found.force_scale)
        apart = base.closable & ~closed
        left = (np.abs(found.pressure) - found.trial.pressure_limit)[apart].max(initial=0.0)
        if left > 0:
            known = known.with_gap(left / np.abs(found.pressure).max())
        return replace(state, accuracy=known)


def _work(traction: np.ndarray, slip: np.ndarray, area: np.ndarray) -> float:
    """The work of friction, which resists the slip: of tractions and slips (k, f) on areas (f,)."""
    return float(-(traction * slip).sum(axis=0) @ area) + 0.0
