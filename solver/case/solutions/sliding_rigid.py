"""Rigid bodies that slide on a half-plane: friction skews their pressure.

The half-plane y < 0 is pressed by the force P and dragged along +x by μp. Tractions along the
surface bend it, by β = (1 − 2ν)/(2 (1 − ν)): with ε = arctan(μβ)/π and E' = E/(1 − ν²), a cylinder
has the pressure

    p = 2 P cos πε/(π (1 − 4ε²) a²) (a + x)^(1/2 − ε) (a − x)^(1/2 + ε)
    a² = 4 P R/(π E' (1 − 4ε²))

with x from the middle of the contact, which is −2εa from the apex; and a flat punch of the width 2a
that is held upright

    p = P cos πε/π (a + x)^(−1/2 − ε) (a − x)^(−1/2 + ε)

whose resultant is at −2εa. The displacement is the sum of those of forces (X, Y) on the surface,
for each of which

    2 G (u + i v) = κ A ln z − z Ā/z̄ + A conj(ln z),   A = −(X + i Y)/2π,   κ = 3 − 4ν

summed by a rule for the weight of the pressure: it is exact away from the contact, to a rigid
motion. Sources: K. L. Johnson, Contact Mechanics (1985), §2.2, §8.2; N. I. Muskhelishvili, Some
Basic Problems of the Mathematical Theory of Elasticity (1953), §90.
"""

from dataclasses import dataclass
from math import atan, cos, pi, sqrt
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ExactSolution, Part, lame_of, parameter

_POINTS = 200


@dataclass(frozen=True, kw_only=True)
class _Sliding(ExactSolution):
    """A pressure f (1 + t)^(e − ε) (1 − t)^(e + ε) of t = (x − middle)/a, e the `exponent`."""

    quantities: ClassVar[frozenset[str]] = frozenset(
        {"contact_pressure", "friction_traction", "displacement"}
    )
    exponent: ClassVar[float]

    material: Material = parameter("of the half-plane", source="material")
    force: float = parameter("P per length", positive=True)
    friction: float = parameter("μ", source="friction", positive=True)
    dim: int = parameter("2", source="extruded", default=2)
    origin: float = parameter("x of the apex, or of the middle of the punch", default=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be 2 (plane strain)", dim=self.dim == 2)

    @property
    def skew(self) -> float:
        """ε."""
        poisson = self.material.poisson
        return atan(self.friction * (1 - 2 * poisson) / (2 * (1 - poisson))) / pi

    @property
    def half_width(self) -> float:
        """A."""
        raise NotImplementedError

    @property
    def middle(self) -> float:
        """Where the middle of the contact is."""
        return self.origin

    @property
    def _factor(self) -> float:
        raise NotImplementedError

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """Steeper in front; zero beside the contact."""
        t = (x[:, 0] - self.middle) / self.half_width
        inside = np.abs(t) < 1
        t = np.where(inside, t, 0.0)
        behind, front = self.exponent - self.skew, self.exponent + self.skew
        return inside * self._factor * (1 + t) ** behind * (1 - t) ** front

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """μp along +x."""
        found = np.zeros(x.shape)
        found[:, 0] = self.friction * self.contact_pressure(x)
        return found

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Of points (n, 2) away from the contact."""
        from scipy.special import roots_jacobi  # it loads slowly

        with np.errstate(invalid="ignore"):  # a term 0/0 of a punch, which SciPy replaces
            t, weight = roots_jacobi(_POINTS, self.exponent + self.skew, self.exponent - self.skew)
        force = self._factor * self.half_width * weight * (self.friction - 1j)
        away = x[:, :1] - (self.middle + self.half_width * t)
        below = np.minimum(x[:, 1:], -0.0)
        log = np.log(np.hypot(away, below)) + 1j * np.arctan2(below, away)
        z, a = away + 1j * below, -force / (2 * pi)
        moved = (3 - 4 * self.material.poisson) * a * log - z * a.conj() / z.conj() + a * log.conj()
        total = moved.sum(axis=1) / (2 * lame_of(self.material)[1])
        return np.column_stack([total.real, total.imag])


@dataclass(frozen=True, kw_only=True)
class SlidingCylinder(_Sliding):
    """A rigid cylinder, its apex at x = origin, on the half-plane below; plane strain."""

    name: ClassVar[str] = "sliding_cylinder"
    exponent: ClassVar[float] = 0.5

    radius: float = parameter("R of the cylinder, or of its parabola", positive=True)

    @property
    def half_width(self) -> float:
        """A."""
        modulus = self.material.young / (1 - self.material.poisson**2)
        return sqrt(4 * self.force * self.radius / (pi * modulus * (1 - 4 * self.skew**2)))

    @property
    def middle(self) -> float:
        """Where the middle of the contact is."""
        return self.origin - 2 * self.skew * self.half_width

    @property
    def _factor(self) -> float:
        skew = self.skew
        return 2 * self.force * cos(pi * skew) / (pi * (1 - 4 * skew**2) * self.half_width)


@dataclass(frozen=True, kw_only=True)
class SlidingPunch(_Sliding):
    """A rigid flat punch, its middle at x = origin, on the half-plane below; plane strain."""

    name: ClassVar[str] = "sliding_punch"
    exponent: ClassVar[float] = -0.5

    width: float = parameter("a, half of its width", positive=True)

    @property
    def half_width(self) -> float:
        """A."""
        return self.width

    @property
    def _factor(self) -> float:
        return self.force * cos(pi * self.skew) / (pi * self.half_width)
