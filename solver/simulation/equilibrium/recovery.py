"""The recovered pressure: an equilibrium corrected by a reconstruction of its pressure.

The sweeps that settle it (`lac.recovery`) run on the factor of the equilibrium; the last is solved
in full, so that means and loads are in equilibrium with the displacement.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...case.acting import Step
from ...lac.reconstruction import Reconstruction
from ...lac.recovery import Recovery, grows, settled_means, with_status
from ..scene.scene import ZoneScene
from .problem import ContactProblem
from .state import Equilibrium, PressureField

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class ZoneFit:
    """A zone's reconstruction among the macro-elements that are closed."""

    numbers: slice
    recovery: Recovery
    reconstruction: Reconstruction

    def coefficients(self, pressure: np.ndarray) -> np.ndarray:
        """C (m · k,) of the pressures (k,) of all multipliers."""
        return np.asarray(self.reconstruction.matrix @ pressure[self.numbers])

    def read(self, pressure: np.ndarray, applied: np.ndarray) -> np.ndarray:
        """C (m · k,) as read: of a quadratic the one applied, else by the last pressures.

        Three sweeps settle what is applied; after two the last pressures are a sweep ahead of it.
        """
        form = self.recovery.form
        quadratic = form.degree == 2 and form.keeps_means
        return applied if quadratic else self.coefficients(pressure)

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
    """A state under its reconstruction; by zone its fit, coefficients, and loads (n_dofs,)."""

    state: Equilibrium
    zones: list[ZoneFit]
    read: list[np.ndarray]
    forces: list[np.ndarray]


def recovered(problem: ContactProblem, state: Equilibrium, step: Step) -> Equilibrium:
    """The equilibrium of a step under the recovered pressure, with this by zone.

    Where the status does not settle under the correction, the state stays as it is and no pressure
    is recovered, but the error of the constants is estimated.
    """
    given = [zone for zone in problem.scene.zones if zone.operator.recovery]
    applied = any((asked := zone.operator.recovery) and asked.form.sweeps for zone in given)
    if not applied or not state.status.closed.any():
        return with_estimate(given, state)

    def correct(state: Equilibrium) -> _Corrected | None:
        return _corrected(problem, state, [fit_of(zone, state.status.closed) for zone in given])

    def wrong(found: _Corrected) -> bool:
        violation = found.state.trial.violation(found.state.status.closed)
        return bool(((violation > 1) & problem.constraints.eligible).any())

    def again(found: _Corrected) -> Equilibrium:
        closed = found.state.status.closed
        return problem.solve(step, closed, correction=found.state.correction)

    found = with_status(state, correct, wrong, again)
    if found is None:
        _LOG.info("recovery: status or pressure do not settle; the pressure stays constant by face")
        return with_estimate(given, state)
    fields = {
        zone.zone.name: fit.field(coefficients, force)
        for zone, fit, coefficients, force in zip(
            given, found.zones, found.read, found.forces, strict=True
        )
    }
    return replace(found.state, fields=fields)


def with_estimate(zones: Sequence[ZoneScene], state: Equilibrium) -> Equilibrium:
    """The state with the error of its constants, by a reconstruction that is not applied."""
    fields, nothing = {}, np.zeros(state.correction.size)
    for zone in zones if state.status.closed.any() else ():
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
    problem: ContactProblem, state: Equilibrium, zones: list[ZoneFit]
) -> _Corrected | None:
    """The state with the loads of its reconstruction; None where the sweeps diverge."""
    sweeps = max(zone.recovery.form.sweeps for zone in zones)

    def loads(pressure: np.ndarray) -> list[np.ndarray]:
        return [z.recovery.loads.T @ z.coefficients(pressure) for z in zones]

    pressure, first = settled_means(
        state.pressure,
        state.correction.ravel(),
        sweeps,
        lambda pressure: sum(loads(pressure), np.zeros(state.correction.size)),
        lambda force: problem.pressure_change(state.status.closed, force),
    )
    applied = [zone.coefficients(pressure) for zone in zones]
    added = [z.recovery.loads.T @ c for z, c in zip(zones, applied, strict=True)]
    correction = np.sum(added, axis=0).reshape(state.correction.shape)
    state = problem.corrected(state, correction)
    if grows(first, state.pressure - pressure, state.trial):
        return None
    read = [z.read(state.pressure, c) for z, c in zip(zones, applied, strict=True)]
    return _Corrected(state, zones, read, added)
