"""The recovered pressure with friction: where it slips, friction is that of the recovered pressure.

The traction is q* = q + Σ c ψ on the master, as the pressure is p*. What slips has q* = −μp* d, so
that its coefficients are −μ d times those of the pressure. What sticks keeps those of the last
step; what its traction changes by is reconstructed among macro-elements that stick, as it has a
kink where slip begins. None of it varies by more than the bound of its mean, or by a larger share
of the pressure than in the last step. The sweeps are those of `lac.recovery`. They go on from those
of the last step until they settle: nothing changes where loads stay the same.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from ...case.acting import Step
from ...lac.errors import SolveError
from ...lac.friction import of_tractions
from ...lac.recovery import SETTLED, settled_means, unsettled
from ..scene.scene import ZoneScene
from .friction import Search
from .problem import ContactProblem
from .recovery import (
    ZoneFit,
    by_contact,
    fit_of,
    largest_of_joined,
    most_sweeps,
    with_estimate,
)
from .state import Equilibrium, PressureField

_LOG = logging.getLogger(__name__)
# Axes of macro-elements that differ by less, as a share of them, are the same.
_TURNED = 1e-9


@dataclass(frozen=True)
class _Loads:
    """What the reconstruction of a zone adds, in a state of friction.

    `sticks` (m,); `slide` (m, k): −μ d where it slips, d the direction of slip. `before`: the last
    step's state, if what sticks keeps its tractions.
    """

    zone: ZoneScene
    fit: ZoneFit
    sticks: np.ndarray
    slide: np.ndarray
    before: Equilibrium | None

    @classmethod
    def of(cls, zone: ZoneScene, state: Equilibrium, before: Equilibrium | None) -> "_Loads":
        """Those of a state after another one."""
        assert state.friction is not None
        closed = state.status.closed
        slips = closed[zone.numbers] & state.friction.slipping[zone.numbers]
        traction = np.array([state.pressure[rows] for rows in zone.slips]).T
        traction = traction.reshape(len(slips), len(zone.slips))
        size = np.linalg.norm(traction, axis=1, keepdims=True)
        unit = np.divide(traction, size, out=np.zeros_like(traction), where=size > 0)
        slide = zone.zone.friction * unit * slips[:, None]
        return cls(zone, fit_of(zone, closed), closed[zone.numbers] & ~slips, slide, before)

    def tractions(self, values: np.ndarray) -> list[np.ndarray]:
        """The coefficients (m · k,) of q* by tangent, for pressures and tractions of all rows."""
        if not self.zone.slips:
            return []
        c = self.fit.coefficients(values).reshape(len(self.sticks), -1)
        pressure = np.maximum(values[self.zone.numbers], 0.0)
        bound = self.zone.zone.friction * pressure
        sliding = self.slide.T[..., None] * c
        held = np.zeros_like(sliding)
        if self.before:
            values = values - self.before.pressure
            last = np.array(self.before.fields[self.zone.zone.name].tractions)
            held += self.sticks[:, None] * last.reshape(held.shape)
            then = self.before.pressure[self.zone.numbers]
            share = np.divide(pressure, then, out=np.zeros_like(then), where=then > 0)
            bound = np.maximum(bound, share * _largest(held))
        changed = self._stuck @ np.concatenate([values[rows] for rows in self.zone.slips])
        held += changed.reshape(held.shape)
        size = _largest(held)
        held *= np.divide(bound, size, out=np.ones_like(size), where=size > bound)[:, None]
        return list((sliding + held).reshape(len(held), -1))

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


def _largest(tractions: np.ndarray) -> np.ndarray:
    """The largest coefficient (m,) of tractions by tangent (dim − 1, m, k)."""
    return np.asarray(np.linalg.norm(tractions, axis=0).max(axis=-1))


def solve_and_recover(
    problem: ContactProblem, step: Step, before: Equilibrium | None
) -> Equilibrium:
    """Equilibrium at a step after the state `before`, with its recovered pressure by zone.

    Where the state of a contact does not settle under the correction, its pressure stays constant
    by face, in the steps that follow too. Raises SolveError where there is no equilibrium.
    """
    search = Search(problem, step, before)
    given = [zone for zone in problem.scene.zones if zone.operator.recovery]
    going = [zone for zone in given if not _constant(zone, before)]

    def recover(zones: list[ZoneScene]) -> Equilibrium | None:
        for start in _starts(zones, before):
            try:
                return _Sweeping(search, zones, start).settled(most_sweeps(zones))
            except SolveError:
                continue
        return None

    found = by_contact(problem, going, recover)
    if found is None:
        found = search.settled()
        if most_sweeps(given):
            _LOG.info("recovery: the state does not settle; pressure and traction stay constant")
    return with_estimate(given, found)


def _constant(zone: ZoneScene, before: Equilibrium | None) -> bool:
    """Whether a zone had constants in the last step in place of a recovered pressure."""
    field, recovery = _last(zone, before), zone.operator.recovery
    return bool(field and recovery and field.form != recovery.form.name)


def _starts(zones: Sequence[ZoneScene], before: Equilibrium | None) -> list[Equilibrium | None]:
    """What sweeps go on from: the last step, where its axes are those of now; then nothing."""
    for zone in zones:
        field, recovery = _last(zone, before), zone.operator.recovery
        if not field or not recovery:
            return [None]
        axes = recovery.moments.local.axes
        if np.abs(axes - field.local.axes).max() > _TURNED * np.abs(axes).max():
            return [None]
    return [before, None]


def _last(zone: ZoneScene, before: Equilibrium | None) -> PressureField | None:
    """The pressure that a zone had in the last step, if there is one."""
    return before.fields.get(zone.zone.name) if before else None


class _Sweeping:
    """The sweeps of a step: each solves for the state under the loads of the one before.

    They go on from the state `before`, the last step's, if it is given.
    """

    def __init__(self, search: Search, zones: Sequence[ZoneScene], before: Equilibrium | None):
        self.search, self.zones, self.before = search, zones, before
        self.shape = search.problem.scene.points.shape
        self.force = np.zeros(np.prod(self.shape)) if before is None else before.correction.ravel()
        self.state: Equilibrium

    def settled(self, most: int) -> Equilibrium:
        """The state with its recovered pressure; SolveError where `most` sweeps do not settle."""
        self.state = self._under(self.force)
        if not self.state.status.closed.any():
            if self.before:
                raise SolveError("what pressed in the last step is open")
            return self.state
        start = self.state.pressure, self.force
        unit = largest_of_joined(self.search.problem, self.state.pressure)
        values, first = settled_means(*start, self._added, self._change, most, SETTLED, unit)
        loads = [_Loads.of(zone, self.state, self.before) for zone in self.zones]
        forces = [each.force(values) for each in loads]
        couples = (each.couple(values) for each in loads)
        found = self._under(np.sum(forces, axis=0))
        if unsettled(first, found.pressure - values, found.trial, most):
            raise SolveError("the sweeps do not settle")
        fields = {}
        for each, force in zip(loads, forces, strict=True):
            coefficients = each.fit.coefficients(found.pressure)
            fields[each.zone.zone.name] = each.fit.field(
                coefficients, force, each.tractions(values)
            )
        return replace(found, couple=sum(couples, np.zeros(3)), fields=fields)

    def _under(self, force: np.ndarray, on_the_way: bool = False) -> Equilibrium:
        return self.search.settled(force.reshape(self.shape), on_the_way)

    def _added(self, values: np.ndarray) -> np.ndarray:
        """The forces (n_dofs,) of the reconstruction of pressures and tractions (k,)."""
        loads = (_Loads.of(zone, self.state, self.before) for zone in self.zones)
        return np.sum([each.force(values) for each in loads], axis=0)

    def _change(self, force: np.ndarray) -> np.ndarray:
        """By how much (k,) further forces (n_dofs,) change pressures and tractions."""
        self.force = self.force + force
        last, self.state = self.state, self._under(self.force, on_the_way=True)
        return self.state.pressure - last.pressure
