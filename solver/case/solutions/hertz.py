"""Hertz's contact of a cylinder or sphere with another or with a plane: pressure only.

Two bodies of revolution of radii R₁, R₂ (∞: a plane) touch at `centre`, the common normal being
the last axis: 1/R = 1/R₁ + 1/R₂, 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂. The bodies are taken as
half-spaces, so the theory holds for a ≪ R only. Source: Johnson, Contact Mechanics, §4.2.
"""

from dataclasses import dataclass, field
from math import inf, isfinite, pi, sqrt
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ExactSolution, parameter

# The pressure has a vertical tangent at the end of the contact.
_REGULAR = 0.8


def half_ellipse(
    distance: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray, share: float
) -> dict[str, float]:
    """Half-width and peak of the half ellipse of a computed pressure, from this alone.

    The mean of ρ² over the forces (n,) at distances ρ (n,) is `share` a². Within 0.8 of that a,
    p² = p₀² − (p₀/a)² ρ² is a straight line in ρ²: p₀ by least squares over the means (m,) of
    macro-elements at distances `centre` (m,). Neither is known where fewer than three are there.
    """
    whole = force.sum()
    square = force @ distance**2 / whole if whole > 0 else 0.0
    half_width = float(np.sqrt(square / share))
    inside = centre <= _REGULAR * half_width
    if np.count_nonzero(inside) < 3:
        return {}
    top = np.polyfit(centre[inside] ** 2, mean[inside] ** 2, 1)[1]
    return {"half_width": half_width, "peak": float(np.sqrt(max(top, 0.0)))}


@dataclass(frozen=True, kw_only=True)
class Hertz(ExactSolution):
    """The common part: half an ellipse of pressure over the contact area."""

    parts: ClassVar[tuple[str, ...]] = ("lower", "upper")
    quantities: ClassVar[frozenset[str]] = frozenset({"contact_pressure", "half_width", "peak"})

    radius: float = parameter("radius R₁ of the one body")
    lower: Material = parameter("material of the one body", source="material")
    upper: Material = parameter("material of the other body", source="material")
    other_radius: float = parameter("radius R₂ of the other body", default=inf)
    centre: tuple[float, ...] = parameter("where the bodies touch", default=(0.0, 0.0, 0.0))

    def __post_init__(self) -> None:
        self.require("must be positive", radius=self.radius > 0, other_radius=self.other_radius > 0)
        self.require("must have a number for each axis", centre=len(self.centre) >= self.dim)
        both_rigid = not (isfinite(self.lower.young) or isfinite(self.upper.young))
        self.require("must not be rigid: the other body is", upper=not both_rigid)

    @property
    def modulus(self) -> float:
        """E*."""
        return 1 / sum((1 - m.poisson**2) / m.young for m in (self.lower, self.upper))

    @property
    def relative_radius(self) -> float:
        """R."""
        return 1 / (1 / self.radius + 1 / self.other_radius)

    @property
    def half_width(self) -> float:
        """a: half the width, or the radius, of the contact area."""
        raise NotImplementedError

    @property
    def peak(self) -> float:
        """p₀: the pressure in the middle."""
        raise NotImplementedError

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """p₀ √(1 − ρ²/a²), ρ being the distance from the common normal; zero outside."""
        share = self._distance(x) / self.half_width
        return self.peak * np.sqrt(np.maximum(1 - share**2, 0.0))

    def regular(self, x: np.ndarray) -> np.ndarray:
        """Within 0.8 a."""
        return self._distance(x) <= _REGULAR * self.half_width

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """Those of the half ellipse of a computed pressure: the mean of ρ² is a²/4, in 3D 2a²/5."""
        share = 0.25 if self.dim == 2 else 0.4
        return half_ellipse(self._distance(x), force, self._distance(centre), mean, share)

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height above the point of contact."""
        return x[:, -1] - self.centre[self.dim - 1]

    def _distance(self, x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(x[:, :-1] - np.array(self.centre[: self.dim - 1]), axis=1)


@dataclass(frozen=True, kw_only=True)
class HertzCylinder(Hertz):
    """Line contact under a force: a = √(4 F R/(π E*)), p₀ = 2 F/(π a), in plane strain."""

    name: ClassVar[str] = "hertz_cylinder"
    dim: int = field(default=2, init=False)

    force: float = parameter("the whole force F, per length")

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be positive", force=self.force > 0)

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

    force: float = parameter("the whole force F")

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be positive", force=self.force > 0)

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

    approach: float = parameter("how far δ distant points come nearer, both bodies together")

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be positive", approach=self.approach > 0)

    @property
    def half_width(self) -> float:
        """a: the radius of the contact area."""
        return sqrt(self.relative_radius * self.approach)

    @property
    def peak(self) -> float:
        """p₀: the pressure in the middle."""
        return 2 * self.modulus * self.half_width / (pi * self.relative_radius)
