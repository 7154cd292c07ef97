"""A polynomial contact pressure between two elastic blocks on a flat interface, without gap.

Any harmonic φ that is even in the height gives a displacement u = ∇φ / (2 μ) without volume change,
body force or shear stress on the interface, where its normal component vanishes. Here
φ = Σₜ Re Z(xₜ + i x_n) over the axes t of the interface, with Z″(x) = Σⱼ aⱼ (x / L)ʲ, so that

    p = Σₜ Σⱼ aⱼ (xₜ / L)ʲ,    the same in both materials, whatever their shear moduli.

The displacement has to be imposed on all faces but the interface.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial

from ..material import Material
from .base import ElasticSolution, Part, lame_of, parameter


@dataclass(frozen=True, kw_only=True)
class PolynomialPressure2d(ElasticSolution):
    """Two blocks, the lower below 0 and the upper above, with p = Σ aⱼ (x / L)ʲ; plane strain."""

    name: ClassVar[str] = "polynomial_pressure_2d"
    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    dim: int = field(default=2, init=False)

    bottom: Material = parameter("of the lower block", source="material")
    top: Material = parameter("of the upper block", source="material")
    size: float = parameter("L, the length that the polynomial is relative to", positive=True)
    coefficients: tuple[float, ...] = parameter("aⱼ, pressures by power, the constant first")

    def __post_init__(self) -> None:
        super().__post_init__()
        at = np.linspace(0.0, 1.0, 201)
        positive = len(self.coefficients) > 0 and (Polynomial(self.coefficients)(at) > 0).all()
        self.require("must give a positive pressure from 0 to L", coefficients=bool(positive))

    @property
    def _second(self) -> Polynomial:
        """Z″."""
        powers = self.size ** -np.arange(len(self.coefficients), dtype=float)
        return Polynomial(np.array(self.coefficients) * powers)

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The polynomial, summed over the axes of the interface."""
        return np.asarray(self._second(x[:, :-1]).sum(axis=1))

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """∇φ / (2 μ)."""
        slope = self._second.integ()(x[:, :-1] + 1j * x[:, -1:])
        u = np.column_stack([slope.real, -slope.imag.sum(axis=1)])
        return u / self._double_shear(x, part)[:, None]

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """∇∇φ / (2 μ)."""
        second = self._second(x[:, :-1] + 1j * x[:, -1:])
        gradient = np.zeros((len(x), self.dim, self.dim))
        for t in range(self.dim - 1):
            gradient[:, t, t] = second[:, t].real
            gradient[:, t, -1] = gradient[:, -1, t] = -second[:, t].imag
        gradient[:, -1, -1] = -second.real.sum(axis=1)
        return gradient / self._double_shear(x, part)[:, None, None]

    def _double_shear(self, x: np.ndarray, part: Part) -> np.ndarray:
        return 2 * np.array([lame_of(m)[1] for m in self.materials])[self.part_of(x, part)]


@dataclass(frozen=True, kw_only=True)
class PolynomialPressure3d(PolynomialPressure2d):
    """The same in three dimensions, with p = Σⱼ aⱼ ((x / L)ʲ + (y / L)ʲ)."""

    name: ClassVar[str] = "polynomial_pressure_3d"
    dim: int = field(default=3, init=False)
