"""Lamé's nested cylinders (plane strain) and spheres: different materials, press fit, rotation.

All follow from u = (A + B/r^d − k r²) x, d being 2 around an axis and 3 around a centre: without
body force k = 0 and σ_rr = (dλ + 2μ) A − 2μ (d − 1) B/r^d. The body force ρω² r of cylinders that
rotate gives k = ρω²/(8 (λ + 2μ)), and takes (4λ + 6μ) k r² from σ_rr. A and B follow by the
pressures on both walls of a shell. The contact pressure makes the outer shell's displacement at the
interface exceed the inner one's by the interference. Source: Timoshenko, Goodier, Theory of
Elasticity, §28 (cylinders, shrink fit), §32 (rotating discs, here in plane strain) and §136
(spheres).
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
    spin: float = parameter("ρω² of both parts: their body force over the radius", default=0.0)
    around: ClassVar[int] = 2

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
        inner, outer = self._at(0, b, self.pressure, 0.0), self._at(1, b, 0.0, 0.0)
        free_gap = outer - inner - self.interference
        per_pressure = self._at(1, b, 1.0, 0.0, 0.0) - self._at(0, b, 0.0, 1.0, 0.0)
        pressure = max(-free_gap / per_pressure, 0.0)
        return pressure, 0.0 if pressure > 0 else free_gap

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """A and B (2, n_parts)."""
        pressure, _ = self._interface
        inner = self._shell(0, self.pressure, pressure)
        return np.array([inner, self._shell(1, pressure, 0.0)]).T

    def _shell(
        self, part: int, inside: float, outside: float, spun: float = 1.0
    ) -> tuple[float, float]:
        """A and B of a part under pressures on its walls, and a share of the rotation."""
        d, walls = self.around, self.radii[part : part + 2]
        lame, shear = lame_of(self.materials[part])
        body = spun * self._spun[part] * (4 * lame + 6 * shear)
        inside, outside = inside - body * walls[0] ** 2, outside - body * walls[1] ** 2
        near, far = (r**-d for r in walls)
        b = (inside - outside) / (2 * shear * (d - 1) * (near - far))
        return (2 * shear * (d - 1) * b * far - outside) / (d * lame + 2 * shear), b

    def _at(
        self, part: int, radius: float, inside: float, outside: float, spun: float = 1.0
    ) -> float:
        """Radial displacement of a part under the same."""
        a, b = self._shell(part, inside, outside, spun)
        found = a * radius + b * radius ** (1 - self.around)
        return found - spun * self._spun[part] * radius**3

    @cached_property
    def _spun(self) -> np.ndarray:
        """The k (n_parts,) of rotation."""
        moduli = (lame_of(material) for material in self.materials)
        return np.array([self.spin / (8 * (lame + 2 * shear)) for lame, shear in moduli])

    @property
    def _axes(self) -> np.ndarray:
        """Which axes (dim,) the radius is measured along, as 0 or 1."""
        return np.arange(self.dim) < self.around

    def level(self, x: np.ndarray) -> np.ndarray:
        """Distance outside of the interface."""
        return np.linalg.norm(x * self._axes, axis=1) - self.radii[1]

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The same all round."""
        return np.full(len(x), self._interface[0])

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Zero unless the parts do not touch."""
        return np.full(len(x), self._interface[1])

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """(A + B/r^d − k r²) x."""
        part, x = self.part_of(x, part), x * self._axes
        (a, b), k = self._coefficients[:, part], self._spun[part]
        r = np.linalg.norm(x, axis=1)
        return (a + b / r**self.around - k * r**2)[:, None] * x

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """(A + B/r^d − k r²) I − (d B/r^(d+2) + 2 k) x⊗x."""
        d, part, x = self.around, self.part_of(x, part), x * self._axes
        (a, b), k = self._coefficients[:, part], self._spun[part]
        r = np.linalg.norm(x, axis=1)
        stretch = (a + b / r**d - k * r**2)[:, None, None] * np.diag(self._axes.astype(float))
        across = d * b / r ** (d + 2) + 2 * k
        return stretch - across[:, None, None] * (x[:, :, None] * x[:, None, :])

    def body_force(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """ρω² x."""
        return self.spin * x * self._axes


@dataclass(frozen=True, kw_only=True)
class NestedTubes(NestedCylinders):
    """The nested cylinders in three dimensions: the last axis is theirs, their ends are held.

    A negative interference is an initial gap, and the pressure is zero while it does not close.
    """

    name: ClassVar[str] = "nested_tubes"
    dim: int = field(default=3, init=False)


@dataclass(frozen=True, kw_only=True)
class NestedSpheres(NestedCylinders):
    """Two hollow spheres, one in the other, under internal pressure and pressed together.

    The centre is the origin. A negative interference is an initial gap, and the pressure is zero
    while it does not close.
    """

    name: ClassVar[str] = "nested_spheres"
    dim: int = field(default=3, init=False)
    around: ClassVar[int] = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("spheres do not rotate here: must be left out", spin=self.spin == 0)
