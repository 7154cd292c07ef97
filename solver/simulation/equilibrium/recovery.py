"""The recovered pressure: an equilibrium corrected by a reconstruction of its pressure.

The sweeps that settle it (`lac.recovery`) run on the factor of the equilibrium; the last is solved
in full, so that means and loads are in equilibrium with the displacement.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...case.acting import Step
from ...lac.reconstruction import Reconstruction
from ...lac.recovery import (
    MOST_SWEEPS,
    SETTLED,
    Recovery,
    settled_means,
    unsettled,
    with_status,
)
from ..scene.scene import ZoneScene
from .problem import ContactProblem
from .state import Equilibrium, PressureField

_LOG = logging.getLogger(__name__)
# What ends the sweeps where each is a solve by iterations, which costs more and is less exact. If
# the last one, in full, changes more, they begin again from there.
_BY_ITERATIONS = 1e-6, 2


@dataclass(frozen=True, kw_only=True)
class ZoneFit:
    """A zone's reconstruction among the macro-elements that are closed."""

    numbers: slice
    recovery: Recovery
    reconstruction: Reconstruction

    def coefficients(self, pressure: np.ndarray) -> np.ndarray:
        """C (m · k,) of the pressures (k,) of all multipliers."""
        return np.asarray(self.reconstruction.matrix @ pressure[self.numbers])

    def field(
        self, coefficients: np.ndarray, force: np.ndarray, tractions: Sequence[np.ndarray] = ()
    ) -> PressureField:
        """The pressure of `coefficients` C (m · k,), as a result."""
        return PressureField(
            form=self.recovery.form.name,
            local=self.recovery.moments.local,
            coefficients=coefficients,
            degree=self.reconstruction.degree,
            error=self.recovery.error(coefficients, self.reconstruction),
            force=force,
            tractions=tractions,
        )


class _Corrected(NamedTuple):
    """A state under its reconstruction; by zone its fit, and its loads (n_dofs,)."""

    state: Equilibrium
    zones: list[ZoneFit]
    forces: list[np.ndarray]


def recovered(problem: ContactProblem, state: Equilibrium, step: Step) -> Equilibrium:
    """The equilibrium of a step under the recovered pressure, with this by zone.

    Where the status does not settle under the correction, the state stays as it is and no pressure
    is recovered, but the error of the constants is estimated.
    """
    given = [zone for zone in problem.scene.zones if zone.operator.recovery]
    if not most_sweeps(given) or not state.status.closed.any():
        return with_estimate(given, state)

    def recover(zones: list[ZoneScene]) -> Equilibrium | None:
        return _recovered(problem, state, step, zones)

    found = by_contact(problem, given, recover)
    if found is None:
        _LOG.info("recovery: status or pressure do not settle; the pressure stays constant by face")
    return with_estimate(given, found or state)


def by_contact(
    problem: ContactProblem,
    zones: list[ZoneScene],
    recover: Callable[[list[ZoneScene]], Equilibrium | None],
) -> Equilibrium | None:
    """What `recover` finds with all zones, or with those of the contacts that settle by themselves.

    None where none does, or none has sweeps.
    """
    if not most_sweeps(zones):
        return None
    if (found := recover(zones)) is not None:
        return found
    contacts = [
        [zone for zone in zones if part.multipliers[zone.numbers].any()] for part in problem.parts
    ]
    contacts = [contact for contact in contacts if most_sweeps(contact)]
    if len(contacts) < 2:
        return None
    settled = [zone for contact in contacts if recover(contact) for zone in contact]
    return recover(settled) if settled else None


def _recovered(
    problem: ContactProblem, state: Equilibrium, step: Step, given: list[ZoneScene]
) -> Equilibrium | None:
    """The equilibrium under the recovered pressure of the zones given; None where none settles."""
    most = most_sweeps(given)

    def correct(state: Equilibrium) -> _Corrected | None:
        fits = [fit_of(zone, state.status.closed) for zone in given]
        return _corrected(problem, state, fits, most)

    def wrong(found: _Corrected) -> bool:
        violation = found.state.trial.violation(found.state.status.closed)
        return bool(((violation > 1) & problem.constraints.eligible).any())

    def again(found: _Corrected) -> Equilibrium:
        closed = found.state.status.closed
        return problem.solve(step, closed, correction=found.state.correction)

    found = with_status(state, correct, wrong, again)
    if found is None:
        return None
    fields = {
        zone.zone.name: fit.field(fit.coefficients(found.state.pressure), force)
        for zone, fit, force in zip(given, found.zones, found.forces, strict=True)
    }
    return replace(found.state, fields=fields)


def most_sweeps(zones: Sequence[ZoneScene]) -> int:
    """The most sweeps for zones with a recovery, as their case says; 0 where none is applied."""
    asked = ((zone.operator.recovery, zone.zone.sweeps) for zone in zones)
    return max(
        (n or MOST_SWEEPS for recovery, n in asked if recovery and recovery.form.applied), default=0
    )


def largest_of_joined(problem: ContactProblem, pressure: np.ndarray) -> np.ndarray:
    """For each row (k,) the largest `pressure` (k,) on bodies that contact joins with its own."""
    found = np.zeros(len(pressure))
    for part in problem.parts:
        found[part.multipliers] = np.abs(pressure[part.multipliers]).max(initial=0.0)
    return found


def with_estimate(zones: Sequence[ZoneScene], state: Equilibrium) -> Equilibrium:
    """The state with the error of constants not recovered, by a reconstruction not applied."""
    fields, nothing = dict(state.fields), np.zeros(state.correction.size)
    for zone in zones if state.status.closed.any() else ():
        if zone.zone.name not in fields:
            fit = fit_of(zone, state.status.closed)
            field = fit.field(fit.coefficients(state.pressure), nothing)
            fields[zone.zone.name] = replace(field, form="none")
    return replace(state, fields=fields)


def fit_of(zone: ZoneScene, closed: np.ndarray) -> ZoneFit:
    """The reconstruction of a zone among the `closed` (k,) of all multipliers."""
    recovery = zone.operator.recovery
    assert recovery is not None
    reconstruction = recovery.reconstruction(closed[zone.numbers])
    return ZoneFit(numbers=zone.numbers, recovery=recovery, reconstruction=reconstruction)


def _corrected(
    problem: ContactProblem, state: Equilibrium, zones: list[ZoneFit], most: int
) -> _Corrected | None:
    """The state with the loads of its reconstruction; None where `most` sweeps do not settle."""
    closed, shape = state.status.closed, state.correction.shape
    unit = largest_of_joined(problem, state.pressure)
    enough, tries = _BY_ITERATIONS if problem.linear_iterations else (SETTLED, 1)

    def loads(pressure: np.ndarray) -> list[np.ndarray]:
        return [z.recovery.loads.T @ z.coefficients(pressure) for z in zones]

    def added(pressure: np.ndarray) -> np.ndarray:
        return np.asarray(sum(loads(pressure)))

    def change(force: np.ndarray) -> np.ndarray:
        return problem.pressure_change(closed, force)

    for _ in range(tries):
        start = state.pressure, state.correction.ravel()
        pressure, first = settled_means(*start, added, change, most, enough, unit)
        state = problem.corrected(state, added(pressure).reshape(shape))
        if not unsettled(first, state.pressure - pressure, state.trial, most):
            return _Corrected(state, zones, loads(pressure))
    return None
