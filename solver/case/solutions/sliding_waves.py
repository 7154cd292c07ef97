"""Waves in full contact that slide on each other: two layers with Coulomb friction and coupling.

The layers are those of `waves` in the plane; the upper one slides to +x, so that every point has
q = μp. With amplitudes of e^{ikx}, a layer of height H whose far face is on rollers moves its
surface by C_nn/(Gk) out of itself per σ_nn and by i C_nt/(Gk) per τ; friction makes of the wave of
pressure one of shear, and the gap closes with

    p = p̄ + Re(p₁ e^{ikx}),   p₁ = Δ/Σ [C_nn + i μ (±C_nt)]/(G k)

+ in the lower layer. The shear of the mean pressure, μp̄, is uniform. The field of a layer solves
Navier's equation: with z = kζ, ζ the height above its far face, and t = 3 − 4ν

    u_ζ = (A sinh z + B z cosh z + C cosh z + D z sinh z) e^{ikx}
    u_x = i (A cosh z + B (t cosh z + z sinh z) + C sinh z + D (t sinh z + z cosh z)) e^{ikx}

with zero u_ζ and shear at z = 0 and the tractions of the surface at kH. Own derivation.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import FRICTION, ElasticSolution, Part, lame_of, parameter


def _basis(z: np.ndarray, poisson: float) -> tuple[np.ndarray, ...]:
    """u_ζ and u_x/i of A, B, C, D (4, n), and their derivatives by z."""
    s, c, turn = np.sinh(z), np.cosh(z), 3 - 4 * poisson
    f = np.array([s, z * c, c, z * s])
    g = np.array([c, turn * c + z * s, s, turn * s + z * c])
    f_slope = np.array([c, c + z * s, s, s + z * c])
    g_slope = np.array([s, (turn + 1) * s + z * c, c, (turn + 1) * c + z * s])
    return f, g, f_slope, g_slope


@dataclass(frozen=True, kw_only=True)
class SlidingWaves(ElasticSolution):
    """Two layers pressed to full contact, of which the upper one slides to +x; plane strain."""

    name: ClassVar[str] = "sliding_waves"
    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    quantities: ClassVar[frozenset[str]] = ElasticSolution.quantities | FRICTION
    dim: int = field(default=2, init=False)

    bottom: Material = parameter("of the lower layer", source="material")
    top: Material = parameter("of the upper layer", source="material")
    height: float = parameter("height of each layer", positive=True)
    wave: float = parameter("length of a wave", positive=True)
    amplitude: float = parameter("Δ, half the height of the waves", positive=True)
    mean_pressure: float = parameter("p̄, larger than |p₁|")
    friction: float = parameter("μ", source="friction", positive=True)
    slide: float = parameter("by how much the upper layer slides", positive=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        least = abs(self.wave_pressure)
        self.require(f"must be above {least:g}", mean_pressure=self.mean_pressure > least)

    @property
    def _number(self) -> float:
        """K."""
        return 2 * np.pi / self.wave

    @cached_property
    def _layers(self) -> tuple[np.ndarray, ...]:
        """A, B, C, D (4,) of each layer, per p₁."""
        return tuple(
            self._amplitudes(material, side)
            for material, side in zip(self.materials, (1.0, -1.0), strict=True)
        )

    def _amplitudes(self, material: Material, side: float) -> np.ndarray:
        """Those of σ_nn = −1 and the shear of friction, over Gk."""
        nu = material.poisson
        ratio = 2 * nu / (1 - 2 * nu)
        rows = []
        for z, normal in ((0.0, False), (self._number * self.height, True)):
            f, g, f_slope, g_slope = _basis(np.array(z), nu)
            rows += [(ratio + 2) * f_slope - ratio * g if normal else f, g_slope + f]
        given = np.array([0, 0, -1.0, -1j * self.friction * side], complex)
        return np.linalg.solve(np.array(rows, complex), given)

    @cached_property
    def wave_pressure(self) -> complex:
        """p₁."""
        total = 0j
        for material, amplitudes in zip(self.materials, self._layers, strict=True):
            f, *_ = _basis(np.array(self._number * self.height), material.poisson)
            total -= amplitudes @ f / (lame_of(material)[1] * self._number)
        return complex(self.amplitude / total)

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """p̄ + Re(p₁ e^{ikx})."""
        return self.mean_pressure + (self.wave_pressure * self._phase(x)).real

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """μp on the lower layer, along the slide of the upper one."""
        found = np.zeros(x.shape)
        found[:, 0] = self.friction * self.contact_pressure(x)
        return found

    def slip(self, x: np.ndarray) -> np.ndarray:
        """The difference of both displacements along the interface."""
        on = np.column_stack([x[:, 0], np.zeros(len(x))])
        found = self.displacement(on, 1) - self.displacement(on, 0)
        found[:, 1] = 0.0
        return found

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Wave, uniform compression, uniform shear, and the slide."""
        upper = self.part_of(x, part) == 1
        found = np.empty(x.shape)
        for number, mine in enumerate((~upper, upper)):
            found[mine] = self._moved(x[mine], number)
        return found

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """By differentiation."""
        upper = self.part_of(x, part) == 1
        found = np.empty((len(x), 2, 2))
        for number, mine in enumerate((~upper, upper)):
            found[mine] = self._strained(x[mine], number)
        return found

    def _phase(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(np.exp(1j * self._number * x[:, 0]))

    def _of(self, x: np.ndarray, part: int) -> tuple[float, float, np.ndarray, np.ndarray, tuple]:
        """Side, M, ζ, wave over Gk, and the four profiles of a layer."""
        side, material = (1.0, -1.0)[part], self.materials[part]
        lame, shear = lame_of(material)
        zeta = self.height + side * x[:, 1]
        wave = self.wave_pressure * self._phase(x) / (shear * self._number)
        basis = _basis(self._number * zeta, material.poisson)
        return side, lame + 2 * shear, zeta, wave, tuple(self._layers[part] @ b for b in basis)

    def _moved(self, x: np.ndarray, part: int) -> np.ndarray:
        side, confined, zeta, wave, (f, g, _, _) = self._of(x, part)
        shear = self.friction * self.mean_pressure / lame_of(self.materials[part])[1]
        along = (1j * g * wave).real + shear * x[:, 1] + (self.slide if part else 0.0)
        normal = side * ((f * wave).real - self.mean_pressure / confined * zeta)
        return np.column_stack([along, normal - (self._approach if part else 0.0)])

    @property
    def _approach(self) -> float:
        """How far the upper layer's far face moves."""
        moduli = [lame + 2 * shear for lame, shear in map(lame_of, self.materials)]
        return self.amplitude + sum(self.mean_pressure * self.height / m for m in moduli)

    def _strained(self, x: np.ndarray, part: int) -> np.ndarray:
        side, confined, _, wave, (f, g, f_slope, g_slope) = self._of(x, part)
        k, shear = self._number, lame_of(self.materials[part])[1]
        found = np.empty((len(x), 2, 2))
        found[:, 0, 0] = (-k * g * wave).real
        found[:, 0, 1] = side * (1j * k * g_slope * wave).real
        found[:, 0, 1] += self.friction * self.mean_pressure / shear
        found[:, 1, 0] = side * (1j * k * f * wave).real
        found[:, 1, 1] = (k * f_slope * wave).real - self.mean_pressure / confined
        return found
