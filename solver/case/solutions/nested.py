"""Lamé's nested cylinders (plane strain) and spheres, with different materials and press fit.

Both follow from u = (A + B/r^d) x, the only radial displacement without body force, d being the
number of dimensions: σ_rr = (dλ + 2μ) A − 2μ (d − 1) B/r^d, from which A and B follow by the
pressures on both walls of a shell. The contact pressure makes the outer shell's displacement at
the interface exceed the inner one's by the interference. Source: Timoshenko, Goodier, Theory of
Elasticity, §28 (cylinders, shrink fit) and §136 (spheres).
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ElasticSolution, Part, lame_of, parameter


@dataclass(frozen=True, kw_only=True)
class NestedCylinders(ElasticSolution):
    """Two tubes, one in the other, under internal pressure and pressed together: plane strain.

    The axis is the origin. A negative interference is an initial gap, and the pressure is zero
    while it does not close.
    """

    name: ClassVar[str] = "nested_cylinders"
    parts: ClassVar[tuple[str, ...]] = ("inner", "outer")
    dim: int = field(default=2, init=False)

    radii: tuple[float, ...] = parameter("inner, interface and outer radius")
    inner: Material = parameter("material of the inner part", source="material")
    outer: Material = parameter("material of the outer part", source="material")
    pressure: float = parameter("pressure inside", source="pressure", default=0.0)
    interference: float = parameter(
        "what the inner part is too large by", source="interference", default=0.0
    )

    def __post_init__(self) -> None:
        allowed = "must be three radii that increase: inner, interface, outer"
        self.require(allowed, radii=len(self.radii) == 3)
        a, b, c = self.radii
        self.require(allowed, radii=0 < a < b < c)

    @property
    def materials(self) -> tuple[Material, ...]:
        """Inner and outer part."""
        return self.inner, self.outer

    @cached_property
    def _interface(self) -> tuple[float, float]:
        """Contact pressure and gap."""
        _, b, _ = self.radii
        free_gap = -self._at(0, b, self.pressure, 0.0) - self.interference
        per_pressure = self._at(1, b, 1.0, 0.0) - self._at(0, b, 0.0, 1.0)
        pressure = max(-free_gap / per_pressure, 0.0)
        return pressure, 0.0 if pressure > 0 else free_gap

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """A and B (2, n_parts)."""
        pressure, _ = self._interface
        inner = self._shell(0, self.pressure, pressure)
        return np.array([inner, self._shell(1, pressure, 0.0)]).T

    def _shell(self, part: int, inside: float, outside: float) -> tuple[float, float]:
        """A and B of a part under pressures on its walls."""
        d = self.dim
        lame, shear = lame_of(self.materials[part])
        near, far = (r**-d for r in self.radii[part : part + 2])
        b = (inside - outside) / (2 * shear * (d - 1) * (near - far))
        return (2 * shear * (d - 1) * b * far - outside) / (d * lame + 2 * shear), b

    def _at(self, part: int, radius: float, inside: float, outside: float) -> float:
        """Radial displacement of a part under pressures on its walls."""
        a, b = self._shell(part, inside, outside)
        return a * radius + b * radius ** (1 - self.dim)

    def level(self, x: np.ndarray) -> np.ndarray:
        """Distance outside of the interface."""
        return np.linalg.norm(x, axis=1) - self.radii[1]

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The same all round."""
        return np.full(len(x), self._interface[0])

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Zero unless the parts do not touch."""
        return np.full(len(x), self._interface[1])

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """(A + B/r^d) x."""
        a, b = self._coefficients[:, self.part_of(x, part)]
        r = np.linalg.norm(x, axis=1)
        return (a + b / r**self.dim)[:, None] * x

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """(A + B/r^d) I − d B/r^(d+2) x⊗x."""
        d = self.dim
        a, b = self._coefficients[:, self.part_of(x, part)]
        r = np.linalg.norm(x, axis=1)
        stretch = (a + b / r**d)[:, None, None] * np.eye(d)
        return stretch - (d * b / r ** (d + 2))[:, None, None] * (x[:, :, None] * x[:, None, :])


@dataclass(frozen=True, kw_only=True)
class NestedSpheres(NestedCylinders):
    """Two hollow spheres, one in the other, under internal pressure and pressed together.

    The centre is the origin. A negative interference is an initial gap, and the pressure is zero
    while it does not close.
    """

    name: ClassVar[str] = "nested_spheres"
    dim: int = field(default=3, init=False)
