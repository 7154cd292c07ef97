"""Equilibrium of a step with Coulomb friction: which macro-elements are open, stick or slip.

The state is found on the contact alone, by Newton's method (`mortar.coulomb`), and solved for to
round-off by an iteration whose solves have the bounds and directions of slip of the one before
(`lac.friction`). Where the contact is too large for that, or Newton's method finds no state, the
iteration starts from the last step; then without friction; then with all of the contact stuck. What
does not settle is no solution. A solution need not be the only one: for large coefficients there
may be others.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from ...case.acting import Step
from ...lac.errors import SolveError
from ...lac.friction import (
    Response,
    Slip,
    following,
    sticking,
    violation,
    without_friction,
)
from ...lac.status import StatusResult
from ...mechanics.mortar.coulomb import CoulombContact
from ..scene.parts.springs import Springs
from .problem import ContactProblem
from .state import Equilibrium, Friction

_LOG = logging.getLogger(__name__)
# The change of bounds, by the largest, that is round-off; and that which may stall.
_SETTLED, _STALLED = 1e-13, 1e-10
# A change that falls by less is a stall, and so many of them without a record are no progress.
_SLOW, _PATIENCE = 0.5, 12
# Changes below this share of the bounds are too small to tell by what they contract.
_MEASURED = 1e-9
# Corrections of the jumps, and the fault of the law by the largest force that ends them; one that
# stands where rounding lets it fall no more.
_CORRECTIONS, _EXACT, _STANDS, _TOLERATED = 6, 1e-15, 1e-12, 1e-6
# Estimated errors of the pressure from which a status is solved for with its rows alone: those of
# sticking macro-elements cost digits where they slip.
_ACCURATE = 1e-9
# More rows than this make the matrix of the contact alone too large.
_MOST_ROWS = 4000


# Bounds that a solve has, and those that its pressures yield.
_Bounds = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Status:
    """`closed` (k,): multipliers of gaps that are so; `slip` of macro-elements with friction."""

    closed: np.ndarray
    slip: Slip

    @property
    def key(self) -> bytes:
        """Two with the same one are the same but for bounds and directions."""
        return self.closed.tobytes() + self.slip.slips.tobytes()


class Search:
    """One step of a problem: the rows of its f macro-elements with friction, and its solves.

    `correction` (n, dim): the forces of a recovered pressure beside those of the constants.
    """

    def __init__(self, problem: ContactProblem, step: Step, before: Equilibrium | None):
        zones = [zone for zone in problem.scene.zones if zone.slips]
        self.problem, self.step, self.before = problem, step, before
        numbers = np.arange(len(problem.constraints.area))
        self.gaps = np.concatenate([numbers[zone.numbers] for zone in zones])
        by_tangent = zip(*(zone.slips for zone in zones), strict=True)
        self.rows = np.array([np.concatenate([numbers[r] for r in rows]) for rows in by_tangent])
        counts = [len(zone.operator.initial) for zone in zones]
        self.coefficient = np.repeat([zone.zone.friction for zone in zones], counts)
        self.area = problem.constraints.covered[self.gaps]
        rows = problem.constraints.gaps[self.gaps]
        # Rigid unknowns have no stiffness.
        diagonal = problem.diagonal[rows.indices]
        self.softness = float(np.median(self.area) / np.median(diagonal[diagonal > 0]))
        last = before.friction if before else None
        self.jump = last.jump if last else np.zeros(len(numbers))
        self.total = last.total if last else np.zeros(len(numbers))
        self.count, self.changes = 0, list[int]()
        self.contraction = 0.0
        # A state by Newton's method whose digits do not suffice.
        self.inexact: Equilibrium | None = None
        self.correction = np.zeros(problem.scene.force.shape)
        problem.count_slip_from(self.jump)

    def starts(self) -> Iterator[Status]:
        """Statuses to start from; each is made when the search from the one before fails."""
        problem, k = self.problem, len(self.rows)
        closable = problem.constraints.closable
        if self.inexact:
            yield status_of(problem, self.inexact)
        if self.before and self.before.friction:
            yield status_of(problem, self.before)
        try:
            problem.hold_across(None)
            free = problem.solve(self.step, correction=self.correction)
            self.count += free.status.iterations
            closed = free.status.closed & closable
            yield self._between(closed, free.pressure[self.gaps])
            yield Status(closed, without_friction(closed[self.gaps], k))
        except SolveError as error:
            _LOG.info("no equilibrium without friction: %s", error)
        yield Status(closable, sticking(closable[self.gaps], k))

    def _between(self, closed: np.ndarray, pressure: np.ndarray) -> Status:
        """What slips by the tractions of a stuck contact, under the `pressure` without friction."""
        stuck = sticking(closed[self.gaps], len(self.rows))
        _, response, _ = self.solve(Status(closed, stuck))
        bounds = self._bounds(pressure)
        slips = violation(stuck, response, bounds) > 1
        slip, _ = following(stuck, response, bounds, slips, self.softness)
        return Status(closed, slip)

    def solve(self, status: Status) -> tuple[Equilibrium, Response, np.ndarray]:
        """Equilibrium with a status; the response, and the forces (n, dim) of what slips."""
        problem, slip = self.problem, status.slip
        stuck = status.closed[self.gaps] & ~slip.slips
        rows = status.closed.copy()
        rows[self.rows] = stuck
        values = np.zeros(len(rows))
        values[self.rows] = slip.traction.T
        across, stiff, rest = self._across(slip)
        force = (problem.constraints.gaps.T @ values + rest).reshape(problem.scene.force.shape)
        found = problem.equilibrium(self.step, rows, force + self.correction)
        self.count += 1
        moved = np.where(status.closed[self.gaps], found.gap[self.rows], 0.0).T
        traction = found.pressure[self.rows].T + slip.traction
        if stiff.any():
            traction -= (stiff * (across * moved).sum(axis=1))[:, None] * across
        limits = found.trial.pressure_limit[self.rows], found.trial.gap_limit[self.rows]
        response = Response(
            closed=status.closed[self.gaps],
            pressure=found.pressure[self.gaps],
            traction=traction,
            slip=np.where(stuck[:, None], 0.0, moved),
            traction_limit=limits[0].max(axis=0),
            slip_limit=limits[1].max(axis=0),
        )
        return found, response, force

    def _across(self, slip: Slip) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Directions across the slips, springs there, and the forces (n_dofs,) of these at rest."""
        gaps, none = self.problem.constraints.gaps, np.zeros(len(self.area))
        if len(self.rows) == 1:
            return np.zeros((len(none), 1)), none, np.zeros(gaps.shape[1])
        across, stiff = slip.across
        along = sum(sparse.diags(across[:, c]) @ gaps[rows] for c, rows in enumerate(self.rows))
        weight = stiff / self.area
        springs = (along.T @ sparse.diags(weight) @ along).tocsr()
        self.problem.hold_across(Springs(springs, self.problem.scene.points.shape))
        at_rest = self.area * (across * self.jump[self.rows].T).sum(axis=1)
        return across, stiff, along.T @ (weight * at_rest)

    def from_status(self, status: Status) -> Equilibrium | None:
        """Equilibrium from a first status; None where statuses repeat and bounds do not settle."""
        seen, single, best, without, last = {status.key}, False, np.inf, 0, np.inf
        earlier = None
        while without < _PATIENCE:
            found, response, force = self.solve(status)
            following, count, moved = self._following(status, found, response, single)
            settled = moved <= _SETTLED or _SLOW * last < moved <= _STALLED
            bounds = status.slip.bound, following.slip.bound
            if earlier and not count:
                self._measure(bounds, earlier)
            if not count and settled:
                return self._equilibrium(status, found, response, force)
            earlier = None if count else bounds
            self.changes.append(count)
            best, without = min(best, moved + count), 0 if moved + count < best else without + 1
            single = single or (count > 0 and following.key in seen)
            seen.add(following.key)
            status, last = following, moved
        return None

    def _following(
        self, status: Status, found: Equilibrium, response: Response, single: bool
    ) -> tuple[Status, int, float]:
        """The status of the next solve, how many changed, and by what share the bounds did.

        `single`: only the worst macro-element changes, which breaks a cycle.
        """
        closable, slip = self.problem.constraints.closable, status.slip
        fresh = self._bounds(response.pressure)
        wrong = np.where(closable, found.trial.violation(status.closed), 0.0)
        slipping = violation(slip, response, fresh)
        change, change_slip = wrong > 1, slipping > 1
        count = int(change.sum() + change_slip.sum())
        if single and count:
            change, change_slip = _worst(wrong, slipping)
        closed = status.closed ^ change
        kept = closed[self.gaps]
        new, moved = following(slip, response, fresh, change_slip & kept, self.softness)
        moved /= float(fresh.max(initial=0.0)) or 1.0
        _LOG.info(
            "friction: solve %d, %d closed, %d slip, %d change, bounds by %.1e",
            *(self.count, status.closed.sum(), slip.slips.sum(), count, moved),
        )
        return Status(closed, replace(new, slips=new.slips & kept)), count, moved

    def _measure(self, bounds: _Bounds, earlier: _Bounds) -> None:
        """Note by what bounds contract, as long as they change by more than round-off."""
        given, found = (
            float(np.abs(a - b).max(initial=0.0)) for a, b in zip(bounds, earlier, strict=True)
        )
        if given > _MEASURED * float(bounds[1].max(initial=0.0)):
            self.contraction = found / given

    def _bounds(self, pressure: np.ndarray) -> np.ndarray:
        """μp (f,)."""
        return self.coefficient * np.maximum(pressure, 0.0)

    def _equilibrium(
        self,
        status: Status,
        found: Equilibrium,
        response: Response,
        force: np.ndarray,
    ) -> Equilibrium:
        """The state with its tractions among the pressures, and the history for the next step."""
        self.problem.hold_across(None)
        scene = self.problem.scene
        own = found.iterate.inner[: len(scene.parts)]  # without that of the springs across
        pressure, gap = found.pressure.copy(), found.gap.copy()
        limits = [found.trial.pressure_limit.copy(), found.trial.gap_limit.copy()]
        pressure[self.rows], gap[self.rows] = response.traction.T, response.slip.T
        for limit in limits:
            limit[self.rows] = np.inf
        jump, total = self.jump.copy(), self.total.copy()
        jump[self.rows] += found.gap[self.rows]
        total[self.rows] += response.slip.T
        slipping = np.zeros(len(pressure), dtype=bool)
        slipping[self.gaps] = status.slip.slips
        return replace(
            found,
            iterate=replace(found.iterate, scene=scene, inner=own).under(
                found.iterate.force - force
            ),
            trial=replace(
                found.trial,
                pressure=pressure,
                gap=gap,
                pressure_limit=limits[0],
                gap_limit=limits[1],
            ),
            status=StatusResult(found.status.closed, self.count, self.changes),
            correction=self.correction,
            friction=Friction(
                status.slip, slipping, jump, total, _work(response, self.area), self.contraction
            ),
        )

    def settled(self) -> Equilibrium | None:
        """Equilibrium by Newton's method on the contact alone, and iterative refinement.

        Jumps are imposed on the whole system, with the factor of everything closed and stuck, and
        corrected by what the law is off then. None where the contact is too large, or the law is
        not fulfilled in the end: then the iteration over statuses has its turn.
        """
        problem, base = self.problem, self.problem.constraints
        rows = base.eligible
        if not 0 < rows.sum() <= _MOST_ROWS:
            return None
        problem.hold_across(None)
        area, contact = base.covered[rows], self._contact
        start = problem.with_jumps(self.step, np.zeros(len(rows)), self.correction)
        solution = contact.solve(area * start.pressure[rows])
        self.count += 1
        if solution is None:
            _LOG.info("friction: no state of the contact alone")
            return None
        _, z, steps = solution
        last = np.inf
        for _ in range(_CORRECTIONS):
            jump = np.zeros(len(rows))
            jump[rows] = z
            found = problem.with_jumps(self.step, jump, self.correction)
            self.count += 1
            forces = area * found.pressure[rows]
            following, fault = contact.corrected(forces, z)
            _LOG.info("friction: %d Newton steps, law off by %.1e", steps, fault)
            if fault < _EXACT or fault > _SLOW * last:
                break
            z, last = following, fault
        closed, slips = np.zeros(len(rows), dtype=bool), np.zeros(len(self.gaps), dtype=bool)
        closed[np.flatnonzero(rows)[: contact.m]], slips[rows[self.gaps]] = contact.statuses(
            forces, z
        )
        state = self._as_equilibrium(found, closed & base.closable, slips)
        if fault < _STANDS and state.accuracy.estimate < _ACCURATE:
            return state
        self.inexact = state if fault < _TOLERATED else None
        return None

    @cached_property
    def _contact(self) -> CoulombContact:
        """The contact alone, of the rows that may close or stick."""
        rows = self.problem.constraints.eligible
        number, there = np.cumsum(rows) - 1, rows[self.gaps]
        friction, of = self.coefficient[there], number[self.gaps[there]]
        stiffness = self.problem.contact_stiffness()
        return CoulombContact(stiffness, friction, of, number[self.rows[:, there]])

    def _as_equilibrium(
        self, found: Equilibrium, closed: np.ndarray, slips: np.ndarray
    ) -> Equilibrium:
        """A state of imposed jumps as one of a status: exact zeros where these belong."""
        stuck = closed[self.gaps] & ~slips
        pressure, gap = found.pressure.copy(), found.gap.copy()
        free = self.problem.constraints.normal & ~closed
        pressure[free], gap[closed] = 0.0, 0.0
        traction = np.where(closed[self.gaps], pressure[self.rows], 0.0).T
        slip, bound = np.where(slips, gap[self.rows], 0.0).T, self._bounds(pressure[self.gaps])
        far = np.linalg.norm(slip, axis=1)
        rows = closed.copy()
        rows[self.rows] = stuck
        size = np.linalg.norm(traction, axis=1)
        found = replace(
            found,
            iterate=found.iterate.with_closed(rows),
            trial=replace(found.trial, pressure=pressure, gap=gap),
            status=replace(found.status, closed=closed),
        )
        response = Response(
            closed=closed[self.gaps],
            pressure=pressure[self.gaps],
            traction=traction,
            slip=slip,
            traction_limit=found.trial.pressure_limit[self.rows].max(axis=0),
            slip_limit=found.trial.gap_limit[self.rows].max(axis=0),
        )
        about = Slip(
            slips=slips,
            bound=bound,
            direction=-traction / np.where(size > 0, size, 1.0)[:, None],
            distance=np.where(slips, far, np.inf),
        )
        return self._equilibrium(Status(closed, about), found, response, 0 * self.correction)


def status_of(problem: ContactProblem, state: Equilibrium) -> Status:
    """The status of a state with friction."""
    assert state.friction is not None
    return Status(state.status.closed & problem.constraints.closable, state.friction.slip)


def _worst(wrong: np.ndarray, slipping: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The single worst of all violations, as changes of gaps (k,) and of slips (f,)."""
    change, change_slip = np.zeros(len(wrong), dtype=bool), np.zeros(len(slipping), dtype=bool)
    if wrong.max(initial=0.0) >= slipping.max(initial=0.0):
        change[wrong.argmax()] = True
    else:
        change_slip[slipping.argmax()] = True
    return change, change_slip


def _work(found: Response, area: np.ndarray) -> float:
    """The work of friction, which resists the slip."""
    return float(-(found.traction * found.slip).sum(axis=1) @ area) + 0.0


def solve_with_friction(
    problem: ContactProblem, step: Step, before: Equilibrium | None
) -> Equilibrium:
    """Equilibrium at a step that comes after `before`, or from rest.

    Raises SolveError where none is found, or a body moves freely once its contact slips.
    """
    search, failure = Search(problem, step, before), None
    if found := search.settled():
        return found
    for start in search.starts():
        try:
            if found := search.from_status(start):
                return found
        except SolveError as error:
            failure = failure or error
    problem.hold_across(None)
    if search.inexact:
        return search.inexact
    raise failure or SolveError("no frictional equilibrium found")
