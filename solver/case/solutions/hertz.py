"""Contacts of which the pressure alone is known: Hertz's, and axisymmetric indenters.

Two bodies touch at `centre`, the common normal being the last axis. They are taken as half-spaces,
so the theory holds for contacts that are small beside them: 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂.

Hertz: cylinders or spheres of radii R₁, R₂ (∞: a plane), 1/R = 1/R₁ + 1/R₂. Source: Johnson,
Contact Mechanics, §4.2.

Indenters (cone, sphere, blunter ones): the distance of the bodies is A ρⁿ. Each increment of
contact from t to t + dt is a flat punch of radius t that sinks by δ'(t) dt, with δ(a) = A cₙ aⁿ and
cₙ = √π Γ(n/2 + 1)/Γ(n/2 + ½). So

    F = 2 E* A cₙ n/(n + 1) aⁿ⁺¹,    p(ρ) = (E*/π) ∫_ρ^a δ'(t)/√(t² − ρ²) dt,

    p(ρ) = (E* A cₙ n/π) aⁿ⁻¹ s ₂F₁(1, 1 − n/2; 3/2; s²),    s = √(1 − ρ²/a²).

n = 1 is a cone, p = (E* A/2) arcosh(a/ρ); n = 2 is Hertz's sphere of radius 1/(2A). Source:
I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47–57; Johnson, Contact Mechanics, §5.1–5.3.
"""

from dataclasses import dataclass, field
from math import gamma, inf, isfinite, pi, sqrt
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ExactSolution, parameter

# The pressure has a vertical tangent at the end of the contact.
REGULAR = 0.8


class ContactArea(ExactSolution):
    """A contact at distances ρ < a from a point or line, a being the half-width."""

    quantities: ClassVar[frozenset[str]] = frozenset({"contact_pressure", "half_width"})

    @property
    def moment(self) -> float:
        """The mean of ρ² over the contact force, in a²."""
        raise self._missing("moment")

    def distance(self, x: np.ndarray) -> np.ndarray:
        """ρ (n,), by default from x = 0."""
        return np.abs(x[:, 0])

    def regular(self, x: np.ndarray) -> np.ndarray:
        """Within 0.8 a."""
        return self.distance(x) <= REGULAR * self.half_width

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """The half-width of a pressure of this shape with the second moment of the computed one."""
        return {"half_width": width_of(self.distance(x), force, self.moment)}


class HalfEllipse(ContactArea):
    """A pressure that is half an ellipse, or half an ellipsoid, over the contact area."""

    quantities: ClassVar[frozenset[str]] = ContactArea.quantities | {"peak"}

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """Half-width and peak of the half ellipse of a computed pressure."""
        return half_ellipse(self.distance(x), force, self.distance(centre), mean, self.moment)


@dataclass(frozen=True, kw_only=True)
class TouchingBodies(ContactArea):
    """Two bodies that touch at `centre`, the common normal being the last axis."""

    parts: ClassVar[tuple[str, ...]] = ("lower", "upper")

    lower: Material = parameter("material of the one body", source="material")
    upper: Material = parameter("material of the other body", source="material")
    centre: tuple[float, ...] = parameter("where the bodies touch", default=(0.0, 0.0, 0.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must have a number for each axis", centre=len(self.centre) >= self.dim)
        both_rigid = not (isfinite(self.lower.young) or isfinite(self.upper.young))
        self.require("must not be rigid: the other body is", upper=not both_rigid)

    @property
    def modulus(self) -> float:
        """E*."""
        return 1 / sum((1 - m.poisson**2) / m.young for m in (self.lower, self.upper))

    def distance(self, x: np.ndarray) -> np.ndarray:
        """From the common normal."""
        return np.linalg.norm(x[:, :-1] - np.array(self.centre[: self.dim - 1]), axis=1)

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height above the point of contact."""
        return x[:, -1] - self.centre[self.dim - 1]


def width_of(distance: np.ndarray, force: np.ndarray, moment: float) -> float:
    """The half-width a of forces (n,) at distances ρ (n,), whose mean of ρ² is `moment` a².

    >>> width_of(np.array([1.0, 2.0]), np.array([5.0, 5.0]), 0.25)
    3.1622776601683795
    """
    whole = force.sum()
    square = force @ distance**2 / whole if whole > 0 else 0.0
    return float(np.sqrt(max(square, 0.0) / moment))


def half_ellipse(
    distance: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray, moment: float
) -> dict[str, float]:
    """Half-width and peak of the half ellipse of a computed pressure.

    Within 0.8 of the half-width a (see `width_of`) p² = p₀² − (p₀/a)² ρ² is a straight line in ρ²:
    p₀ by least squares over the means (m,) of macro-elements at distances `centre` (m,). Neither is
    known where fewer than three are there.
    """
    half_width = width_of(distance, force, moment)
    inside = centre <= REGULAR * half_width
    if np.count_nonzero(inside) < 3:
        return {}
    top = np.polyfit(centre[inside] ** 2, mean[inside] ** 2, 1)[1]
    return {"half_width": half_width, "peak": float(np.sqrt(max(top, 0.0)))}


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
