"""Hertz's contact of a cylinder or sphere with another or with a plane: pressure only.

Two bodies of revolution of radii R₁, R₂ (∞: a plane) touch at `centre`, the common normal being
the last axis: 1/R = 1/R₁ + 1/R₂, 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂. The bodies are taken as
half-spaces, so the theory holds for a ≪ R only. Source: Johnson, Contact Mechanics, §4.2.
"""

from dataclasses import dataclass, field
from math import inf, pi, sqrt
from typing import ClassVar

import numpy as np

from .base import parameter
from .contact_area import HalfEllipse, TouchingBodies


@dataclass(frozen=True, kw_only=True)
class Hertz(HalfEllipse, TouchingBodies):
    """The common part: half an ellipse of pressure over the contact area."""

    radius: float = parameter("radius R₁ of the one body", positive=True)
    other_radius: float = parameter("radius R₂ of the other body", default=inf, positive=True)

    @property
    def moment(self) -> float:
        """¼, in 3D ⅖."""
        return 0.25 if self.dim == 2 else 0.4

    @property
    def relative_radius(self) -> float:
        """R."""
        return 1 / (1 / self.radius + 1 / self.other_radius)

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """p₀ √(1 − ρ²/a²), ρ being the distance from the common normal; zero outside."""
        share = self.distance(x) / self.half_width
        return self.peak * np.sqrt(np.maximum(1 - share**2, 0.0))


@dataclass(frozen=True, kw_only=True)
class HertzCylinder(Hertz):
    """Line contact under a force: a = √(4 F R/(π E*)), p₀ = 2 F/(π a), in plane strain."""

    name: ClassVar[str] = "hertz_cylinder"
    dim: int = field(default=2, init=False)

    force: float = parameter("the whole force F, per length", positive=True)

    @property
    def half_width(self) -> float:
        """a: half the width of the contact area."""
        return sqrt(4 * self.force * self.relative_radius / (pi * self.modulus))

    @property
    def peak(self) -> float:
        """p₀: the pressure in the middle."""
        return 2 * self.force / (pi * self.half_width)


@dataclass(frozen=True, kw_only=True)
class HertzSphere(Hertz):
    """Point contact under a force: a = (3 F R/(4 E*))^⅓, p₀ = 3 F/(2π a²)."""

    name: ClassVar[str] = "hertz_sphere"
    dim: int = field(default=3, init=False)

    force: float = parameter("the whole force F", positive=True)

    @property
    def half_width(self) -> float:
        """a: the radius of the contact area."""
        return (3 * self.force * self.relative_radius / (4 * self.modulus)) ** (1 / 3)

    @property
    def peak(self) -> float:
        """p₀: the pressure in the middle."""
        return 3 * self.force / (2 * pi * self.half_width**2)


@dataclass(frozen=True, kw_only=True)
class HertzApproach(Hertz):
    """Point contact, distant points brought nearer by δ: a = √(R δ), p₀ = 2 E* a/(π R)."""

    name: ClassVar[str] = "hertz_approach"
    dim: int = field(default=3, init=False)

    approach: float = parameter(
        "how far δ distant points come nearer, both bodies together", positive=True
    )

    @property
    def half_width(self) -> float:
        """a: the radius of the contact area."""
        return sqrt(self.relative_radius * self.approach)

    @property
    def peak(self) -> float:
        """p₀: the pressure in the middle."""
        return 2 * self.modulus * self.half_width / (pi * self.relative_radius)
