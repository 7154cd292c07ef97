"""A solved load factor: displacement, pressure, status, and the state of friction."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..lac.status import StatusResult, Trial
from .accuracy import Accuracy
from .iterate import ContactIterate

if TYPE_CHECKING:
    from ..lac.friction import Slip


@dataclass(frozen=True)
class Friction:
    """The state of friction after a step.

    `slip`: see `lac.friction`; `slipping` (k,) of the multipliers of gaps; `jump`, `total` (k,) in
    the rows of slip: the mean jump between the surfaces, and what they slipped in all steps;
    `dissipation`: the work of friction in this step, `contraction`: the change of the bounds
    that pressures yield, over that of the bounds solved with (0: nothing slips).
    """

    slip: Slip
    slipping: np.ndarray
    jump: np.ndarray
    total: np.ndarray
    dissipation: float
    contraction: float


@dataclass(frozen=True, kw_only=True)
class Equilibrium:
    """A solved load factor: pressure (k,) and gap with their round-off, status, residual.

    `residual` is relative to `force_scale`, the size of the forces at work. Fields are those of the
    `iterate`. `correction` (n, dim) are the contact forces beside those of the pressures, of a
    recovered pressure; `couple` (3,) is that of their tractions on surfaces that are apart. With
    `friction`, the rows of slip have the tractions on the master as pressures, and the slips of the
    step as gaps.
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
