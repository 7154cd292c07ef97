"""The state of a solved step: displacement, pressure, status of contact and friction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ...lac.reconstruction import Local
from ...lac.status import StatusResult, Trial
from .accuracy import Accuracy
from .iterate import ContactIterate


@dataclass(frozen=True)
class Friction:
    """The state of friction after a step.

    `slipping` (k,) of the multipliers of gaps; `jump`, `total` (k,) in the rows of slip: the mean
    jump between the surfaces, and what they slipped in all steps; `dissipation`: the work of
    friction in this step.
    """

    slipping: np.ndarray
    jump: np.ndarray
    total: np.ndarray
    dissipation: float


@dataclass(frozen=True, kw_only=True)
class PressureField:
    """A pressure p* = p + Σ c ψ on the macro-elements (m,) of a zone, beside the constants p.

    `form`: the name of its kind; `coefficients` c (m · k,) of its functions ψ in `local`
    coordinates; `degree` (m,); `error` (m,): the L2 norm of p* − p; `force` (n_dofs,): what it adds
    to the contact forces. With friction `tractions` are the coefficients (m · k,) of the traction
    on the master, by tangent.
    """

    form: str
    local: Local
    coefficients: np.ndarray
    degree: np.ndarray
    error: np.ndarray
    force: np.ndarray
    tractions: Sequence[np.ndarray] = ()


@dataclass(frozen=True, kw_only=True)
class Equilibrium:
    """A solved load factor: pressure (k,) and gap with their round-off, status, residual.

    `residual` is relative to `force_scale`, the size of the forces at work. Displacement and forces
    are those of the `iterate`. `fields`, by zone, are pressures of a higher order than the
    constants: `correction` (n, dim) are the contact forces that they add, `couple` (3,) is that of
    their tractions on surfaces that are apart. With `friction`, the rows of slip have the tractions
    on the master as pressures, and the slips of the step as gaps.
    """

    iterate: ContactIterate
    trial: Trial
    status: StatusResult
    residual: float
    force_scale: float
    accuracy: Accuracy
    correction: np.ndarray
    friction: Friction | None = None
    couple: np.ndarray = field(default_factory=partial(np.zeros, 3))
    fields: Mapping[str, PressureField] = field(default_factory=dict)

    @property
    def pressure(self) -> np.ndarray:
        """Contact pressure (k,)."""
        return self.trial.pressure

    @property
    def gap(self) -> np.ndarray:
        """Average gap (k,)."""
        return self.trial.gap

    @property
    def displacement(self) -> np.ndarray:
        """Displacement (n, dim)."""
        return self.iterate.displacement.total.reshape(self.force.shape)

    @property
    def force(self) -> np.ndarray:
        """Loads (n, dim)."""
        return self.iterate.force - self.correction
