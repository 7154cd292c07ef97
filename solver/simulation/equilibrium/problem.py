"""The contact problem of a scene at one load factor: status, displacement, pressure."""

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.sparse.linalg import LinearOperator

from ...case.acting import Step
from ...lac.errors import SolveError
from ...lac.motions import rigid_motions, unsupported
from ...lac.status import StatusResult, Trial, find_status
from ...mechanics.fem.displacement import Displacement
from ...mechanics.linear.compliant import Compliance
from ...mechanics.linear.condensation import ROUND_OFF, ConstrainedSystem, solve
from ...mechanics.linear.systems import Systems, parts_of
from ...system.process import release
from ..scene.scene import Scene
from .accuracy import Accuracy, estimate, judged, roughness, rounding
from .compliance import compliance_of
from .constraints import (
    ContactConstraints,
    RigidMotions,
    contact_constraints,
    first_guess,
    free_motion,
    free_stiffness,
    free_unknowns,
    moved,
    refuse_unsolvable,
)
from .contact_stiffness import contact_stiffness, refuse_unbalanced, stiffness_of
from .iterate import ContactIterate
from .rest import AT_REST
from .state import Equilibrium

_LOG = logging.getLogger(__name__)

# An estimated error of the pressure from which residuals are summed in extended precision.
_EXTEND = 3e-11
# How exactly the change of a sweep of recovery is solved for; its own error is far larger.
_CHANGE = 1e-4
# The residual of a corrected state may be so many times what is otherwise taken for round-off.
_CORRECTED = 4.0
# A body that is moved, and hardly strained: below this share of what its motion would bring up
# where it is imposed, the forces that are left are the scale, and it is solved once more.
_MOVED = 1e-3
SINGLE_FROM = 1_000_000
"""Degrees of freedom from which the stiffness is stored in single precision where multigrid solves:
it takes half the memory, and refinement, by residuals of the cells in double precision, two steps
more."""
# Where refinement ends with a larger residual, the stiffness is assembled in double precision.
_SINGLE_SERVES = 1e-11
# From so many unknowns on, memory that was freed is given back before the matrix is made.
_LARGE = 100_000
# While the contact status is sought by an iterative solver: residuals of the first solve and of
# changes, and the share of pressures and motions below which such a solve decides nothing.
_ROUGH_STATUS, _ROUGH_CHANGE, _UNDECIDED = 1e-5, 1e-3, 1e-3


class ContactProblem:
    """Stiffness and contact constraints of a scene, with the factors kept between solves."""

    def __init__(self, scene: Scene, carried: np.ndarray | None = None):
        """Assemble; raises InputError where nothing can hold a body or a macro-element's node.

        `carried` (n_dofs,): a displacement that slips count beside that of the solve, from where
        the last step left the bodies, which have `moved` since.
        """
        self.scene, self.moved = scene, carried is not None
        self.constraints = contact_constraints(scene, carried)
        motions = rigid_motions(scene.points, scene.body, scene.case.axisymmetric)
        self._motions = RigidMotions.of(scene, self.constraints, motions)
        self._moves: dict[bytes, str] = {}
        self._contact_stiffness: tuple[np.ndarray | LinearOperator, np.ndarray] | None = None
        refuse_unsolvable(scene, self.free_motion(self.constraints.eligible), self.constraints)
        surface = np.diff(self.constraints.gaps.tocsc().indptr) > 0
        loose = unsupported(motions, self._motions.supports)
        self.at_rest = Displacement.zero(loose, surface, scene.options.safeguards.remainder)
        # How contact gives way depends on what is closed: of several states it is the one that is
        # found from all closed.
        self._gives_way = any(zone.zone.gives_way for zone in scene.zones)
        self._pressed = np.ones(len(self.constraints.area), dtype=bool)
        self.unsupported = loose
        if (resisting := scene.resisting).shape[0]:
            self.unsupported = unsupported(motions, self._motions.supports, resisting)
        refined = scene.options.safeguards.refinement
        self.single = refined and scene.n_dofs >= SINGLE_FROM
        del motions  # memory for the stiffness
        self._assemble()
        self._rough = roughness(scene)

    def _assemble(self) -> None:
        scene, on_free = self.scene, self.constraints.on_free
        own = None if len(self.constraints.dependent) else self.constraints.own
        unknowns = free_unknowns(scene)
        if scene.n_dofs > _LARGE:
            release()
        self.matrix, self.diagonal = free_stiffness(scene, unknowns, self.single)
        self.parts = parts_of(on_free, unknowns.body, scene.n_bodies)
        soft = self._compliance if self._gives_way else None
        self._systems_of = partial(
            Systems,
            constraints=on_free,
            own=own,
            unknowns=unknowns,
            parts=self.parts,
            compliance=soft,
        )
        self._systems = self._systems_of(self.matrix)

    @property
    def system(self) -> ConstrainedSystem | None:
        """The last system solved."""
        return self._systems.latest

    @property
    def linear_solver(self) -> str:
        """The name of the solver of the last system."""
        return self.system.factor.name if self.system else "none"

    @property
    def why_solver(self) -> str:
        """Why it was chosen."""
        return self.system.why if self.system else ""

    @property
    def linear_iterations(self) -> int:
        """The most iterations that one solution of the last system took; 0 by a factor alone."""
        return self.system.factor.iterations if self.system else 0

    def solve(
        self,
        step: Step,
        start: np.ndarray | None = None,
        imposed: np.ndarray | None = None,
        correction: np.ndarray | float = 0.0,
        before: Step | None = None,
    ) -> Equilibrium:
        """Equilibrium at a step, the status search starting from `start` (k,), a guess.

        `before`: the step that `start` is the status of, if it is another one. `imposed` (k,): mean
        gaps and slips that some rows keep, in tension too; NaN in those whose status is sought.
        `correction` (n, dim): see `Equilibrium`. Raises SolveError where no status fulfils p ≥ 0,
        ḡ ≥ 0, p ḡ = 0, or a system is singular.
        """
        scene, (imposed, kept, constraints) = self.scene, self._keeping(imposed)
        eligible = constraints.closable & ~kept

        def free_motion(closed: np.ndarray) -> str:
            return self.free_motion(closed | kept)

        guess: Callable[[], np.ndarray] | None
        guess = partial(first_guess, scene, constraints, step, free_motion)
        if self._gives_way or not scene.options.shortcuts.status:
            start = eligible
        elif start is None:
            start, guess = guess(), None
        elif before is not None:
            start = moved(start, before, step, scene, constraints, free_motion)
        latest: list[Equilibrium] = []
        rough, known = scene.options.shortcuts.status, None

        def attempt(closed: np.ndarray) -> Trial:
            nonlocal known
            closed = closed | kept
            if not scene.options.shortcuts.status:
                self._systems.forget()
            first = rest = self._at_rest(closed, step, correction, constraints)
            if rough and self._systems.closed(closed).factor.iterative:
                known, trial = self._roughly(rest, known)
                if (eligible & (trial.violation(closed) > 1)).any():
                    return trial
                first = known
            latest[:] = [self._refined(first, _force_scale(rest), correction)]
            return latest[0].trial

        def stiffness() -> np.ndarray:
            nonlocal rough
            rough = False
            return self._gap_stiffness(step, kept)

        area, confirm = self.constraints.covered, not scene.options.shortcuts.status
        status = find_status(attempt, start, eligible, area, stiffness, confirm, guess)
        trial = latest[0].trial
        touching = self.constraints.unloaded & (trial.gap <= trial.gap_limit)
        status = replace(status, closed=status.closed | kept | touching)
        trial = replace(trial, gap=np.where(kept, imposed, trial.gap))
        return replace(latest[0], trial=trial, status=status)

    def _keeping(
        self, imposed: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, ContactConstraints]:
        """What rows (k,) keep, NaN in others; which do, and the constraints with that."""
        if imposed is None:
            imposed = np.full(len(self.constraints.area), np.nan)
            return imposed, np.zeros(len(imposed), dtype=bool), self.constraints
        kept = ~np.isnan(imposed)
        return imposed, kept, self.constraints.with_jumps(np.where(kept, imposed, 0.0))

    def with_jumps(
        self,
        step: Step,
        rows: np.ndarray,
        jump: np.ndarray,
        before: np.ndarray,
        correction: np.ndarray | float,
    ) -> Equilibrium:
        """Equilibrium with mean gaps and slips imposed in some rows (k,).

        `jump` (k,): what they have more than `before` (k,).
        """
        base = self.constraints
        first = self._at_rest(rows, step, correction, base.with_jumps(jump + before))
        found = self._refined(first, _force_scale(first), correction)
        iterate = found.iterate.with_closed(rows, base)
        trial = replace(found.trial, gap=np.where(rows, jump, iterate.gap - before))
        return replace(found, iterate=iterate, trial=trial)

    def corrected(self, state: Equilibrium, correction: np.ndarray) -> Equilibrium:
        """The state with another `correction` (n, dim), its status kept.

        Only the change is solved for, on the factor that the state was solved with.
        """
        start = state.iterate.under(state.force + correction)
        scale = max(state.force_scale, np.abs(correction).max())
        found = self._refined(start, scale, correction, _CORRECTED * ROUND_OFF)
        return replace(found, status=state.status)

    def pressure_change(self, closed: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The change of pressure (k,) by forces (n_dofs,), with the `closed` (k,) kept closed.

        Two digits more than the change has, for a factor that iterates.
        """
        system, pushed = self._systems.closed(closed), self.scene.free.gathered(force)
        change = system.correction(pushed, np.zeros(int(closed.sum())), _CHANGE)
        found = np.zeros(len(closed))
        found[closed] = system.multiplier(pushed - self.matrix @ change)
        return found

    def pressure_of_gaps(self, closed: np.ndarray, gaps: np.ndarray) -> np.ndarray:
        """The change of pressure (k,) by average gaps (k,), with the `closed` (k,) kept closed."""
        system, found = self._systems.closed(closed), np.zeros(len(closed))
        imposed = (self.constraints.covered * gaps)[closed]
        change = system.correction(np.zeros(self.matrix.shape[0]), imposed, _CHANGE)
        found[closed] = system.multiplier(-(self.matrix @ change))
        return found

    def free_motion(self, closed: np.ndarray) -> str:
        """See `free_motion`; the last answer is kept, as a guess is asked about more than once."""
        key = closed.tobytes()
        if key not in self._moves:
            self._moves = {key: free_motion(self.scene, self._motions, closed)}
        return self._moves[key]

    def gives_way_where(self, pressed: np.ndarray) -> bool:
        """Let contact give way where it is `pressed` (k,) alone, of what a system has closed.

        Says whether that is something else than before.
        """
        giving = [zone.numbers for zone in self.scene.zones if zone.zone.gives_way]
        changed = any((pressed[mine] != self._pressed[mine]).any() for mine in giving)
        if changed:
            self._pressed, self._contact_stiffness = pressed, None
            self._systems.forget()
        return changed

    def _compliance(self, closed: np.ndarray) -> Compliance:
        return compliance_of(self.scene, self.constraints.normal, self._pressed, closed)

    def _at_rest(
        self,
        closed: np.ndarray,
        step: Step,
        correction: np.ndarray | float,
        constraints: ContactConstraints | None = None,
    ) -> ContactIterate:
        """The start of a solve with the given multipliers closed."""
        scene = self.scene
        if moves := self.free_motion(closed):
            count = int((~closed[self.constraints.normal]).sum())
            loads = f"once {count} macro-elements are open: the loads part the bodies"
            raise SolveError(f"{moves} {loads}, or a support is missing")
        acting, offset = scene.acting(step)
        return ContactIterate(
            scene=scene,
            constraints=constraints or self.constraints,
            closed=closed,
            force=acting + correction,
            displacement=self.at_rest.moved(offset),
            inner=tuple(part.start(step) for part in scene.parts),
        )

    def _roughly(
        self, start: ContactIterate, known: ContactIterate | None
    ) -> tuple[ContactIterate, Trial]:
        """An approximate solution, from the one `known` of another status, and its trial.

        What it leaves undecided counts as no violation: a solve to round-off then judges.
        """
        accuracy = _ROUGH_CHANGE if known else _ROUGH_STATUS
        start = known.with_closed(start.closed) if known else start
        system = self._systems.closed(start.closed)
        force = start.condensed(start.residual())
        found = start.advanced(system.correction(force, start.violation(), accuracy))
        pressure = np.zeros(len(start.closed))
        pressure[start.closed] = system.multiplier(found.residual())
        trial = judged(found, rounding(found), pressure, self.diagonal)
        gaps = self.constraints.gaps
        covered = np.where(self.constraints.eligible, self.constraints.covered, np.inf)
        motion = abs(gaps) @ np.abs(found.displacement.total) / covered
        return found, replace(
            trial,
            pressure_limit=trial.pressure_limit + _UNDECIDED * np.abs(pressure).max(initial=0.0),
            gap_limit=trial.gap_limit + _UNDECIDED * motion,
        )

    def _refined(
        self,
        start: ContactIterate,
        scale: float,
        correction: np.ndarray | float,
        round_off: float = ROUND_OFF,
    ) -> Equilibrium:
        """Equilibrium with the multipliers closed that are so at the start.

        Solved again where that gains digits: with the stiffness in double precision, or with
        residuals summed in extended precision.
        """
        safeguards = self.scene.options.safeguards
        correction = np.zeros(start.force.shape) + correction
        while True:
            system, refine = self._systems.closed(start.closed), safeguards.refinement
            # In a stretched model a force of the size of round-off may be a large one elsewhere.
            small = 0.0 if start.extended else round_off
            iterate, multiplier, residual = solve(system, start, scale, refine, small)
            if self.single and residual > _SINGLE_SERVES:
                _LOG.info("the stiffness is assembled again, in double precision")
                self.single = False
                self._systems.forget()
                # Nothing holds the first stiffness while the second is made.
                del system, self.matrix, self._systems
                self._assemble()
                continue
            works = _force_scale(iterate)
            if refine and AT_REST * scale < works < _MOVED * scale:
                start, scale = iterate, works
                continue
            pressure = np.zeros(len(start.closed))
            pressure[start.closed] = multiplier
            accuracy = self.accuracy(iterate, pressure, residual, scale)
            extends = refine and safeguards.extended and not start.extended
            if extends and accuracy.of_sums > _EXTEND:
                start = replace(iterate, extended=True)
                continue
            return Equilibrium(
                iterate=iterate,
                trial=judged(iterate, rounding(iterate), pressure, self.diagonal),
                status=StatusResult(start.closed, 1, []),
                residual=residual,
                force_scale=scale,
                accuracy=accuracy,
                correction=correction,
            )

    def accuracy(
        self, iterate: ContactIterate, pressure: np.ndarray, residual: float, scale: float
    ) -> Accuracy:
        """See `estimate`."""
        rounded, diagonal = rounding(iterate), self.diagonal
        return estimate(
            iterate, rounded, pressure, diagonal, self._rough, self.unsupported, residual, scale
        )

    def _gap_stiffness(self, step: Step, kept: np.ndarray) -> np.ndarray:
        """See `stiffness_of`: of all that may close, but for what is `kept` (k,) closed.

        Raises SolveError as `refuse_unbalanced` does.
        """
        base, sought = self.constraints, self.constraints.closable & ~kept
        loads = self.scene.given_loads(step)[0].ravel()
        refuse_unbalanced(base.gaps[sought], base.gaps[kept], self.unsupported, loads)
        return stiffness_of(self._systems, self.matrix, base, sought, kept)

    def contact_stiffness(self) -> tuple[np.ndarray | LinearOperator, np.ndarray]:
        """See `contact_stiffness`; made once, for all steps."""
        if self._contact_stiffness is None:
            self._contact_stiffness = contact_stiffness(
                self._systems, self.matrix, self.constraints, self.diagonal
            )
        return self._contact_stiffness


def _force_scale(start: ContactIterate) -> float:
    """The size of the forces at work: the loads, or those that imposed values bring up."""
    inside = start.internal - start.ground
    return float(max(np.abs(start.force).max(), np.abs(inside).max())) or 1.0
