"""Contact areas: their half-width and peak, found in a computed pressure alone."""

from dataclasses import dataclass
from math import isfinite
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
    return float(np.sqrt(square / moment))


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
