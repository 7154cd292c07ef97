"""Axisymmetric indenters of the shape A ρⁿ on an elastic half-space: cone, sphere, blunter ones.

Two bodies touch at `centre`, the common normal being the last axis; their distance is A ρⁿ, and
1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂. Each increment of contact from t to t + dt is a flat punch of
radius t that sinks by δ'(t) dt, with δ(a) = A cₙ aⁿ and cₙ = √π Γ(n/2 + 1)/Γ(n/2 + ½). So

    F = 2 E* A cₙ n/(n + 1) aⁿ⁺¹,    p(ρ) = (E*/π) ∫_ρ^a δ'(t)/√(t² − ρ²) dt,

    p(ρ) = (E* A cₙ n/π) aⁿ⁻¹ s ₂F₁(1, 1 − n/2; 3/2; s²),    s = √(1 − ρ²/a²).

n = 1 is a cone, p = (E* A/2) arcosh(a/ρ); n = 2 is Hertz's sphere of radius 1/(2A). Source:
I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47–57; Johnson, Contact Mechanics, §5.1–5.3.
"""

from dataclasses import dataclass, field
from math import gamma, pi, sqrt
from typing import ClassVar

import numpy as np

from .base import parameter
from .contact_area import TouchingBodies

# The pressure of a cone is infinite at its tip.
_TIP = 0.2


@dataclass(frozen=True, kw_only=True)
class Indenter(TouchingBodies):
    """Point contact of bodies at the distance A ρⁿ, under a force."""

    name: ClassVar[str] = "indenter"
    dim: int = field(default=3, init=False)

    power: float = parameter("n, at least 1: the distance grows like ρⁿ")
    factor: float = parameter("A: the distance at ρ = 1; of a cone its slope", positive=True)
    force: float = parameter("the whole force F", positive=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be at least 1", power=self.power >= 1)

    @property
    def _sinks(self) -> float:
        """A cₙ: δ/aⁿ."""
        n = self.power
        return self.factor * sqrt(pi) * gamma(n / 2 + 1) / gamma(n / 2 + 0.5)

    @property
    def half_width(self) -> float:
        """a: the radius of the contact area."""
        n = self.power
        whole = self.force * (n + 1) / (2 * self.modulus * self._sinks * n)
        return float(whole ** (1 / (n + 1)))

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """p(ρ); zero outside, infinite at the tip of a cone."""
        from scipy.special import hyp2f1

        n, a = self.power, self.half_width
        square = np.maximum(1 - (self.distance(x) / a) ** 2, 0.0)
        scale = self.modulus * self._sinks * n * a ** (n - 1) / pi
        return np.asarray(scale * np.sqrt(square) * hyp2f1(1, 1 - n / 2, 1.5, square))

    def regular(self, x: np.ndarray) -> np.ndarray:
        """Within 0.8 a; where n < 2, beyond 0.2 a."""
        beyond = self.distance(x) >= _TIP * self.half_width
        return super().regular(x) & (beyond | (self.power >= 2))

    @property
    def moment(self) -> float:
        """⅔ (n + 1)/(n + 3)."""
        return 2 * (self.power + 1) / (3 * (self.power + 3))
