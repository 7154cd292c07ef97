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

from ..material import Material
from .base import ExactSolution, parameter

# The pressure has a vertical tangent at the end of the contact, a cone's is infinite at its tip.
_REGULAR = 0.8
_TIP = 0.2


@dataclass(frozen=True, kw_only=True)
class Indenter(ExactSolution):
    """Point contact of bodies at the distance A ρⁿ, under a force."""

    name: ClassVar[str] = "indenter"
    parts: ClassVar[tuple[str, ...]] = ("lower", "upper")
    quantities: ClassVar[frozenset[str]] = frozenset({"contact_pressure", "half_width"})
    dim: int = field(default=3, init=False)

    power: float = parameter("n, at least 1: the distance grows like ρⁿ")
    factor: float = parameter("A: the distance at ρ = 1; of a cone its slope")
    force: float = parameter("the whole force F")
    lower: Material = parameter("material of the one body", source="material")
    upper: Material = parameter("material of the other body", source="material")
    centre: tuple[float, ...] = parameter("where the bodies touch", default=(0.0, 0.0, 0.0))

    def __post_init__(self) -> None:
        self.require("must be at least 1", power=self.power >= 1)
        self.require("must be positive", factor=self.factor > 0, force=self.force > 0)
        self.require("must have a number for each axis", centre=len(self.centre) >= self.dim)
        self.require("must not be rigid: the other body is", upper=self._compliance > 0)

    @property
    def _compliance(self) -> float:
        """1/E*."""
        return sum((1 - m.poisson**2) / m.young for m in (self.lower, self.upper))

    @property
    def _sinks(self) -> float:
        """A cₙ: δ/aⁿ."""
        n = self.power
        return self.factor * sqrt(pi) * gamma(n / 2 + 1) / gamma(n / 2 + 0.5)

    @property
    def half_width(self) -> float:
        """a: the radius of the contact area."""
        n = self.power
        whole = self.force * self._compliance * (n + 1) / (2 * self._sinks * n)
        return float(whole ** (1 / (n + 1)))

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """p(ρ); zero outside, infinite at the tip of a cone."""
        from scipy.special import hyp2f1

        n, a = self.power, self.half_width
        square = np.maximum(1 - (self._distance(x) / a) ** 2, 0.0)
        scale = self._sinks * n * a ** (n - 1) / (pi * self._compliance)
        return np.asarray(scale * np.sqrt(square) * hyp2f1(1, 1 - n / 2, 1.5, square))

    def regular(self, x: np.ndarray) -> np.ndarray:
        """Within 0.8 a; where n < 2, beyond 0.2 a."""
        share = self._distance(x) / self.half_width
        return (share <= _REGULAR) & ((share >= _TIP) | (self.power >= 2))

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """The radius of a computed pressure: its mean of ρ² is ⅔ (n + 1)/(n + 3) a²."""
        whole, n = force.sum(), self.power
        square = force @ self._distance(x) ** 2 / whole if whole > 0 else 0.0
        return {"half_width": float(np.sqrt(1.5 * (n + 3) / (n + 1) * square))}

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height above the point of contact."""
        return x[:, -1] - self.centre[self.dim - 1]

    def _distance(self, x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(x[:, :-1] - np.array(self.centre[: self.dim - 1]), axis=1)
