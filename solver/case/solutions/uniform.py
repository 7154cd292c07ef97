"""Uniform states: the patch test's compression, and the hydrostatic state for curved interfaces."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ElasticSolution, Part, parameter

_DIMENSION = "must be 2 (plane strain) or 3"


@dataclass(frozen=True, kw_only=True)
class UniformCompression(ElasticSolution):
    """Two blocks pressed together along the last axis, free to widen: the patch test.

    σ = −p e⊗e (in plane strain also σ_zz = −ν p). The axial strain is −p/E, in plane strain
    −p (1 − ν²)/E; the lateral one ν p/E, in plane strain ν (1 + ν) p/E. The displacement is zero
    along the axis at the level `base` and across it at `centre`.
    """

    name: ClassVar[str] = "uniform_compression"
    parts: ClassVar[tuple[str, ...]] = ("lower", "upper")

    pressure: float = parameter("pressure p on the top", source="pressure", positive=True)
    base: float = parameter("level at which the lower block stands")
    lower: Material = parameter("material below the interface", source="material")
    upper: Material = parameter("material above the interface", source="material")
    dim: int = parameter("2 or 3", source="dimension")
    interface: float = parameter("level of the interface", default=0.0)
    centre: tuple[float, ...] = parameter("where lateral displacement is zero", default=(0.0, 0.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(_DIMENSION, dim=self.dim in (2, 3))
        self.require("must lie below the interface", base=self.base < self.interface)
        self.require(
            "must have a number for each lateral axis", centre=len(self.centre) >= self.dim - 1
        )

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height above the interface."""
        return x[:, -1] - self.interface

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The pressure on the top."""
        return np.full(len(x), self.pressure)

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Linear in each block; what the lower one gives way carries the upper one down."""
        part = self.part_of(x, part)
        lateral, axial = self._strains(part)
        u = np.empty_like(x)
        u[:, :-1] = lateral[:, None] * (x[:, :-1] - np.array(self.centre[: self.dim - 1]))
        below = self._strains(np.zeros(1, dtype=int))[1] * (self.interface - self.base)
        low = part == 0
        start = np.where(low, self.base, self.interface)
        u[:, -1] = np.where(low, 0.0, below) + axial * (x[:, -1] - start)
        return u

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Constant in each block."""
        lateral, axial = self._strains(self.part_of(x, part))
        gradient = np.zeros((len(x), self.dim, self.dim))
        for i in range(self.dim - 1):
            gradient[:, i, i] = lateral
        gradient[:, -1, -1] = axial
        return gradient

    def _strains(self, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lateral and axial strain (n,) of the parts (n,)."""
        strains = []
        for material in self.materials:
            young, poisson = material.young, material.poisson
            if self.dim == 2:
                young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
            strains.append((poisson * self.pressure / young, -self.pressure / young))
        lateral, axial = np.array(strains).T
        return lateral[part], axial[part]


@dataclass(frozen=True, kw_only=True)
class Hydrostatic(ElasticSolution):
    """Pressure all round, σ = −p I (in plane strain in the plane; σ_zz = −2 ν p).

    u = −p (1 − 2ν)/E (x − centre), in plane strain −p (1 + ν)(1 − 2ν)/E (x − centre): across any
    interface, whatever its shape, the traction is −p n and the displacement is continuous.
    """

    name: ClassVar[str] = "hydrostatic"

    pressure: float = parameter("pressure p all round", source="pressure", positive=True)
    material: Material = parameter("of all bodies", source="material")
    dim: int = parameter("2 or 3", source="dimension")
    centre: tuple[float, ...] = parameter("the point that stays", default=(0.0, 0.0, 0.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(_DIMENSION, dim=self.dim in (2, 3))
        self.require("must have a number for each axis", centre=len(self.centre) >= self.dim)

    @property
    def strain(self) -> float:
        """The normal strain, the same along every axis (of the plane)."""
        young, poisson = self.material.young, self.material.poisson
        return -self.pressure * (1 - 2 * poisson) / young * (1 + poisson if self.dim == 2 else 1)

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The pressure all round."""
        return np.full(len(x), self.pressure)

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """A shrinking towards the centre."""
        return self.strain * (x - np.array(self.centre[: self.dim]))

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Constant."""
        return np.broadcast_to(self.strain * np.eye(self.dim), (len(x), self.dim, self.dim))
