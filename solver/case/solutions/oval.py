"""Nested cylinders whose contact pressure varies round the interface: p = p₀ + c cos 2θ.

To Lamé's state of nested cylinders each part adds the one of Muskhelishvili's potentials

    φ = α z³ + β / z,    ψ = γ z + δ / z³,    2 μ (u + i v) = κ φ − z φ̄′ − ψ̄,    κ = 3 − 4 ν.

They give, with factors cos 2θ for σ_rr and u_r and sin 2θ for σ_rθ,

    σ_rr = −4 β / r² − γ + 3 δ / r⁴,    σ_rθ = 6 α r² − 2 β / r² + γ + 3 δ / r⁴,
    2 μ u_r = (κ − 3) α r³ + (κ + 1) β / r − γ r − δ / r³.

The bore is free of the wave, the interface without shear or gap, and the outside without shear; a
normal traction there holds the outer part to its shape. Source: Muskhelishvili, Some Basic Problems
of the Mathematical Theory of Elasticity, §59.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from .base import Part, lame_of, parameter
from .nested import NestedCylinders


@dataclass(frozen=True, kw_only=True)
class OvalCylinders(NestedCylinders):
    """Two tubes, one in the other, with a wave of contact pressure: plane strain."""

    name: ClassVar[str] = "oval_cylinders"

    wave: float = parameter("c, the amplitude of cos 2θ in the contact pressure")

    def __post_init__(self) -> None:
        super().__post_init__()
        mean = self._interfaces[0][0]
        self.require(f"must be less than the mean pressure, {mean:g}", wave=abs(self.wave) < mean)

    @cached_property
    def _potentials(self) -> np.ndarray:
        """α, β, γ, δ (4, n_parts)."""
        (a, b, c), (inner, outer) = self.radii, (0, 1)
        free = np.array([_radial(a), _shear(a), _radial(b), _shear(b)])
        first = np.linalg.solve(free, np.array([0.0, 0.0, -self.wave, 0.0]))
        moved = self._moved(inner, b) @ first
        held = np.array([_radial(b), _shear(b), self._moved(outer, b), _shear(c)])
        second = np.linalg.solve(held, np.array([-self.wave, 0.0, moved, 0.0]))
        return np.array([first, second]).T

    def _moved(self, part: int, r: float) -> np.ndarray:
        """u_r by α, β, γ, δ."""
        kappa, shear = self._kappa[part], lame_of(self.materials[part])[1]
        return np.array([(kappa - 3) * r**3, (kappa + 1) / r, -r, -(r**-3)]) / (2 * shear)

    @property
    def _kappa(self) -> np.ndarray:
        return np.array([3 - 4 * m.poisson for m in self.materials])

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """p₀ + c cos 2θ."""
        double = (x[:, 0] ** 2 - x[:, 1] ** 2) / (x**2).sum(axis=1)
        return super().contact_pressure(x) + self.wave * double

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Lamé's with the wave's."""
        z, of = x[:, 0] + 1j * x[:, 1], self.part_of(x, part)
        alpha, beta, gamma, delta = self._potentials[:, of]
        phi, slope = alpha * z**3 + beta / z, 3 * alpha * z**2 - beta / z**2
        psi = gamma * z + delta / z**3
        moved = self._kappa[of] * phi - z * slope.conj() - psi.conj()
        moved /= 2 * np.array([lame_of(m)[1] for m in self.materials])[of]
        return super().displacement(x, part) + np.column_stack([moved.real, moved.imag])

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """By ∂/∂z and ∂/∂z̄."""
        z, of = x[:, 0] + 1j * x[:, 1], self.part_of(x, part)
        alpha, beta, gamma, delta = self._potentials[:, of]
        slope, second = 3 * alpha * z**2 - beta / z**2, 6 * alpha * z + 2 * beta / z**3
        psi_slope = gamma - 3 * delta / z**4
        shear = np.array([lame_of(m)[1] for m in self.materials])[of]
        by_z = (self._kappa[of] * slope - slope.conj()) / (2 * shear)
        by_conjugate = -(z * second.conj() + psi_slope.conj()) / (2 * shear)
        by_x, by_y = by_z + by_conjugate, 1j * (by_z - by_conjugate)
        rows = [[by_x.real, by_y.real], [by_x.imag, by_y.imag]]
        return super().gradient(x, part) + np.moveaxis(np.array(rows), -1, 0)


def _radial(r: float) -> np.ndarray:
    """σ_rr by α, β, γ, δ."""
    return np.array([0.0, -4 / r**2, -1.0, 3 / r**4])


def _shear(r: float) -> np.ndarray:
    """σ_rθ by α, β, γ, δ."""
    return np.array([6 * r**2, -2 / r**2, 1.0, 3 / r**4])
