"""A sphere that is pressed and then sheared: the problem of Cattaneo and Mindlin in space.

Two half-spaces of one material with ν = 0, whose gap before contact is r²/2R, are pressed by P and
then sheared by Q < μP along x. With the radius of contact a, that of the stick zone c and the
pressure p(r; a) = p₀ √(1 − r²/a²) of Hertz

    p₀ = 2 E* a/(π R),   P = 4 E* a³/(3 R),   c/a = (1 − Q/μP)^(1/3),   E* = E/2
    q = μ [p(r; a) − p(r; c)],   slip = μ [g(r; c) − g(r; a)]

where g is the gap beside the contact of that radius. With ν = 0 displacements along the surface are
those across it under the same traction, so the traction has one direction everywhere. The
displacement is the sum of those of forces on the surface (Boussinesq, Cerruti), by a rule for the
weight of the pressure: it is exact away from the contact. The upper body is moved as a whole, so
that what sticks does not slide. Sources: R. D. Mindlin, J. Appl. Mech. 16 (1949) 259–268;
K. L. Johnson, Contact Mechanics (1985), §3.2, §3.6, §4.2, §7.2.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import FRICTION, ExactSolution, Part, lame_of, parameter

# Points of the rule over a disc: along the radius, around.
_RADII, _ANGLES = 24, 48
# Points of the rule for the work of friction.
_POINTS = 4000


@dataclass(frozen=True, kw_only=True)
class ShearedSphere(ExactSolution):
    """Two bodies touch at the origin, the upper one above z = 0; ν = 0."""

    name: ClassVar[str] = "sheared_sphere"
    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    quantities: ClassVar[frozenset[str]] = FRICTION | {
        *("contact_pressure", "gap", "displacement", "stick_area", "dissipation"),
    }

    material: Material = parameter("of both bodies, with ν = 0", source="material")
    radius: float = parameter("R of the sphere on a plane", positive=True)
    end: float = parameter("a, the radius of the contact", positive=True)
    friction: float = parameter("μ", source="friction", positive=True)
    shear: float = parameter("Q/(μP), between 0 and 1", positive=True)
    share: float = parameter("of the contact, that is modelled", default=1.0, positive=True)
    dim: int = parameter("3", source="dimension", default=3)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be 3", dim=self.dim == 3)
        self.require("must have ν = 0", material=self.material.poisson == 0)
        self.require("must be less than 1", shear=self.shear < 1)

    @property
    def stick(self) -> float:
        """The radius c of the stick zone."""
        return self.end * (1 - self.shear) ** (1 / 3)

    @property
    def stick_area(self) -> float:
        """Of the part that is modelled."""
        return float(self.share * np.pi * self.stick**2)

    @property
    def dissipation(self) -> tuple[float, ...]:
        """∫ μp |w| over the ring that slips, in one step from rest."""
        r = self.stick + (self.end - self.stick) * (np.arange(_POINTS) + 0.5) / _POINTS
        work = self.friction * self._pressure(r, self.end) * self._slip(r) * 2 * np.pi * r
        return (float(self.share * work.sum() * (self.end - self.stick) / _POINTS),)

    def _pressure(self, r: np.ndarray, end: float) -> np.ndarray:
        """Hertz's pressure of a contact of that radius."""
        peak = self.material.young * end / (np.pi * self.radius)
        return peak * np.sqrt(np.maximum(1 - (r / end) ** 2, 0.0))

    def _gap(self, r: np.ndarray, end: float) -> np.ndarray:
        """Beside a contact of that radius."""
        t = np.maximum(r / end, 1.0)
        return end**2 / (np.pi * self.radius) * (np.sqrt(t**2 - 1) + (t**2 - 2) * np.arccos(1 / t))

    def _slip(self, r: np.ndarray) -> np.ndarray:
        return self.friction * (self._gap(r, self.stick) - self._gap(r, self.end))

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """Hertz's."""
        return self._pressure(np.hypot(x[:, 0], x[:, 1]), self.end)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Hertz's."""
        return self._gap(np.hypot(x[:, 0], x[:, 1]), self.end)

    def regular(self, x: np.ndarray) -> np.ndarray:
        """But for the edge of the contact."""
        return np.abs(np.hypot(x[:, 0], x[:, 1]) / self.end - 1) > 0.1

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """Q along x on the lower body (n, 3)."""
        r, found = np.hypot(x[:, 0], x[:, 1]), np.zeros(x.shape)
        found[:, 0] = self.friction * (self._pressure(r, self.end) - self._pressure(r, self.stick))
        return found

    def slip(self, x: np.ndarray) -> np.ndarray:
        """Of the upper body along x (n, 3)."""
        found = np.zeros(x.shape)
        found[:, 0] = self._slip(np.hypot(x[:, 0], x[:, 1]))
        return found

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Of points (n, 3) away from the contact."""
        upper = self.part_of(x, part) == 1
        below = np.column_stack([x[:, :2], np.where(upper, x[:, 2], -x[:, 2])])
        shearing, pressing = self._of_disc(below, self.end)
        sheared = self.friction * (shearing - self._of_disc(below, self.stick)[0])
        side = np.where(upper, -1.0, 1.0)
        found = pressing + side[:, None] * sheared
        found[:, 2] = -side * pressing[:, 2] - sheared[:, 2]
        # Hertz's approach of both bodies, and what the stick zone is carried along by.
        moved = np.array([self.friction * (self.end**2 - self.stick**2), 0.0, -(self.end**2)])
        return found + upper[:, None] * moved / self.radius

    def _of_disc(self, x: np.ndarray, end: float) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (n, 3) by a traction p(r; end) along x, and along z into the body z > 0."""
        node, weight = np.polynomial.legendre.leggauss(_RADII)
        slope = np.pi / 4 * (node + 1)
        radius = end * np.sin(slope)
        force = self._pressure(radius, end) * radius * end * np.cos(slope) * weight * np.pi / 4
        angle = 2 * np.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES
        along = x[:, :1] - np.outer(radius, np.cos(angle)).ravel()
        across = x[:, 1:2] - np.outer(radius, np.sin(angle)).ravel()
        force = np.repeat(force, _ANGLES) / (2 * _ANGLES * lame_of(self.material)[1])
        z = np.maximum(x[:, 2:], 0.0)
        far = np.sqrt(along**2 + across**2 + z**2)
        deep, cube = far + z, far**3
        # ν = 0 in the formulas of Johnson, (3.17) and (3.75).
        tangential = (
            1 / far + along**2 / cube + 1 / deep - along**2 / (far * deep**2),
            along * across / cube - along * across / (far * deep**2),
            along * z / cube + along / (far * deep),
        )
        normal = (
            along * z / cube - along / (far * deep),
            across * z / cube - across / (far * deep),
            z**2 / cube + 2 / far,
        )
        shearing, pressing = (np.stack(each, axis=1) for each in (tangential, normal))
        return np.einsum("ndk,k->nd", shearing, force), np.einsum("ndk,k->nd", pressing, force)
