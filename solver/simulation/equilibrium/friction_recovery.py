"""The recovered pressure with friction: where it slips, friction is that of the recovered pressure.

The traction is q* = q + Σ c ψ on the master, as the pressure is p*. What slips has q* = −μp* d, so
that its coefficients are −μ d times those of the pressure. What sticks has those of a
reconstruction among macro-elements that stick: the traction has a kink where slip begins. The
sweeps are those of `lac.recovery`; each solves for the state under the loads of the one before.
"""

import logging
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from ...case.acting import Step
from ...lac.errors import SolveError
from ...lac.friction import of_tractions
from ...lac.recovery import settled_means
from ..scene.scene import ZoneScene
from .friction import Search
from .problem import ContactProblem
from .recovery import ZoneFit, fit_of, recovered, settles
from .state import Equilibrium

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Loads:
    """What the reconstruction of a zone adds, in a state of friction.

    `sticks` (m,); `slide` (m, k): −μ d where it slips, d the direction of slip.
    """

    zone: ZoneScene
    fit: ZoneFit
    sticks: np.ndarray
    slide: np.ndarray

    @classmethod
    def of(cls, zone: ZoneScene, state: Equilibrium) -> "_Loads":
        """Those of a state."""
        assert state.friction is not None
        closed = state.status.closed
        slips = closed[zone.numbers] & state.friction.slipping[zone.numbers]
        traction = np.array([state.pressure[rows] for rows in zone.slips]).T
        traction = traction.reshape(len(slips), len(zone.slips))
        size = np.linalg.norm(traction, axis=1, keepdims=True)
        unit = np.divide(traction, size, out=np.zeros_like(traction), where=size > 0)
        slide = zone.zone.friction * unit * slips[:, None]
        return cls(zone, fit_of(zone, closed), closed[zone.numbers] & ~slips, slide)

    def tractions(self, values: np.ndarray) -> list[np.ndarray]:
        """The coefficients (m · k,) of q* by tangent, for pressures and tractions of all rows."""
        if not self.zone.slips:
            return []
        c = self.fit.coefficients(values).reshape(len(self.sticks), -1)
        sliding = [(slide[:, None] * c).ravel() for slide in self.slide.T]
        stuck = self._stuck @ np.concatenate([values[rows] for rows in self.zone.slips])
        pairs = zip(sliding, np.split(stuck, len(sliding)), strict=True)
        return [one + other for one, other in pairs]

    @cached_property
    def _stuck(self) -> sparse.csr_matrix:
        """The reconstruction among macro-elements that stick, of tractions by tangent."""
        recovery = self.fit.recovery
        return of_tractions(recovery.reconstruction(self.sticks).matrix, recovery.moments.normal)

    def couple(self, values: np.ndarray) -> np.ndarray:
        """The couple (3,) of q* − q where the surfaces are meshed apart."""
        levers = self.fit.recovery.levers
        if levers is None:  # a zone without friction
            return np.zeros(3)
        tractions = np.reshape(self.tractions(values), levers.shape[:3])
        return np.einsum("tmk,tmkd->d", tractions, levers)

    def force(self, values: np.ndarray) -> np.ndarray:
        """The forces (n_dofs,) by pressures and tractions (k,) of all rows."""
        recovery = self.fit.recovery
        total = recovery.loads.T @ self.fit.coefficients(values)
        for loads, c in zip(recovery.slip_loads, self.tractions(values), strict=True):
            total = total + loads.T @ c
        return np.asarray(total)


def solve_and_recover(
    problem: ContactProblem, step: Step, before: Equilibrium | None
) -> Equilibrium:
    """Equilibrium at a step after the state `before`, with its recovered pressure by zone.

    Where the state does not settle under the correction, it stays as it is and no pressure is
    recovered. Raises SolveError where there is no equilibrium.
    """
    search = Search(problem, step, before)
    state = search.settled()
    given = [zone for zone in problem.scene.zones if zone.operator.recovery]
    sweeps = max((z.operator.recovery.form.sweeps for z in given if z.operator.recovery), default=0)
    if not sweeps or not state.status.closed.any():
        return recovered(problem, state, step)
    latest, under_now = state, np.zeros(state.force.size)

    def added(values: np.ndarray) -> np.ndarray:
        forces = (_Loads.of(zone, latest).force(values) for zone in given)
        return sum(forces, np.zeros(state.force.size))

    def under(force: np.ndarray) -> Equilibrium:
        return search.settled(force.reshape(state.force.shape))

    def change(force: np.ndarray) -> np.ndarray:
        nonlocal latest, under_now
        under_now = under_now + force
        before, latest = latest, under(under_now)
        return latest.pressure - before.pressure

    nothing = np.zeros(state.force.size)
    try:
        values, first = settled_means(state.pressure, nothing, sweeps, added, change)
        loads = [_Loads.of(zone, latest) for zone in given]
        forces = [each.force(values) for each in loads]
        couples = (each.couple(values) for each in loads)
        found = replace(under(sum(forces, nothing)), couple=sum(couples, np.zeros(3)))
        if not settles(first, values, found):
            raise SolveError("the sweeps diverge")
    except SolveError:
        _LOG.info(
            "recovery: the state does not settle; pressure and traction stay constant by face"
        )
        return state
    fields = {}
    for each, force in zip(loads, forces, strict=True):
        read = each.fit.read(found.pressure, each.fit.coefficients(values))
        fields[each.zone.zone.name] = each.fit.field(read, force, each.tractions(values))
    return replace(found, fields=fields)
