"""Waves in full contact: two elastic layers, one of them wavy, pressed until no gap is left.

Their sides are symmetry planes; their far faces are held along the normal and slide freely. The
initial gap is Δ (1 − φ) with φ = cos(kₓ x) cos(k_y y); in two dimensions k_y = 0. With
k² = kₓ² + k_y², ζ the height above a layer's far face and H its height, the contact pressure
p̄ + p₁ φ makes

    u_ζ = (A sinh kζ + B kζ cosh kζ) φ,    u_t = ((A + (3 − 4ν) B) cosh kζ + B kζ sinh kζ) ∂ₜφ / k
    B = p₁ sinh kH / (2 μ k (sinh kH cosh kH + kH)),    A = −B (2 (1 − ν) + kH coth kH)

and the uniform state of confined compression by p̄. At the surface u_ζ = −(2 p₁ / (E′ k)) S φ with
S = sinh² kH / (sinh kH cosh kH + kH) and E′ = E / (1 − ν²), so that the gap closes with
p₁ = Δ / Σ 2 S / (E′ k), and everywhere if p̄ ≥ p₁. The far face of the upper layer then has moved by
Δ + p̄ Σ H / M, M the confined modulus. Derived from the Papkovich–Neuber potentials of a layer;
its limit of high layers is in Johnson, Contact Mechanics (1985), §13.2, and Johnson, Greenwood,
Higginson, Int. J. Mech. Sci. 27 (1985) 383–396.

Sliding waves: the layers in the plane with Coulomb friction. The upper one slides to +x, so that
every point has q = μp. With amplitudes of e^{ikx}, a layer of height H whose far face is on rollers
moves its surface by C_nn/(Gk) out of itself per σ_nn and by i C_nt/(Gk) per τ; friction makes of
the wave of pressure one of shear, and the gap closes with

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


@dataclass(frozen=True)
class _Layer:
    """One layer: its height and material, and the amplitudes A, B of its wave."""

    height: float
    lame: float
    shear: float
    poisson: float
    wave: float

    @property
    def confined(self) -> float:
        """The modulus M of confined compression."""
        return self.lame + 2 * self.shear

    @property
    def compliance(self) -> float:
        """2 S / (E′ k): the displacement of the surface by a unit wave of pressure."""
        q = self.wave * self.height
        share = np.sinh(q) ** 2 / (np.sinh(q) * np.cosh(q) + q)
        return float(share * (1 - self.poisson) / (self.shear * self.wave))

    def profile(self, zeta: np.ndarray, pressure: float) -> tuple[np.ndarray, ...]:
        """f, f′, g, g′ (n,) with u_ζ = f φ and u_t = g ∂ₜφ / k, for a wave of `pressure`."""
        k, nu, q = self.wave, self.poisson, self.wave * self.height
        b = pressure * np.sinh(q) / (2 * self.shear * k * (np.sinh(q) * np.cosh(q) + q))
        a = -b * (2 * (1 - nu) + q / np.tanh(q))
        z = k * zeta
        sinh, cosh = np.sinh(z), np.cosh(z)
        f = a * sinh + b * z * cosh
        g = (a + (3 - 4 * nu) * b) * cosh + b * z * sinh
        f_slope = k * ((a + b) * cosh + b * z * sinh)
        g_slope = k * ((a + (4 - 4 * nu) * b) * sinh + b * z * cosh)
        return f, f_slope, g, g_slope


@dataclass(frozen=True, kw_only=True)
class Waves2d(ElasticSolution):
    """Two layers, the lower below 0 and the upper above, pressed to full contact; plane strain."""

    name: ClassVar[str] = "waves_2d"
    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    dim: int = field(default=2, init=False)

    bottom: Material = parameter("of the lower layer", source="material")
    top: Material = parameter("of the upper layer", source="material")
    size: float = parameter("width and height of each layer", positive=True)
    amplitude: float = parameter("Δ, half the height of the waves", positive=True)
    mean_pressure: float = parameter("p̄, at least the amplitude p₁ of the pressure")
    half_waves: tuple[float, ...] = parameter("half waves within the size, by axis", default=(1.0,))

    def __post_init__(self) -> None:
        super().__post_init__()
        whole = all(n >= 0 and n == round(n) for n in self.half_waves) and any(self.half_waves)
        fits = len(self.half_waves) == self.dim - 1
        self.require("must be a whole number for each axis, not all 0", half_waves=whole and fits)
        least = self._wave_pressure
        self.require(f"must be at least {least:g}", mean_pressure=self.mean_pressure >= least)

    @cached_property
    def _numbers(self) -> np.ndarray:
        """K (dim − 1,) along each axis."""
        return np.pi * np.array(self.half_waves) / self.size

    @cached_property
    def _layers(self) -> tuple[_Layer, _Layer]:
        k = float(np.linalg.norm(self._numbers))
        lower, upper = (_Layer(self.size, *lame_of(m), m.poisson, k) for m in self.materials)
        return lower, upper

    @property
    def _wave_pressure(self) -> float:
        return self.amplitude / sum(layer.compliance for layer in self._layers)

    @property
    def approach(self) -> float:
        """How far the upper layer's far face moves."""
        strain = sum(self.mean_pressure / layer.confined for layer in self._layers)
        return self.amplitude + strain * self.size

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """p̄ + p₁ φ."""
        return self.mean_pressure + self._wave_pressure * self._wave(x)[0]

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """The wave and the uniform compression."""
        upper = self.part_of(x, part)[:, None] == 1
        lower, above = (self._moved(x, i) for i in (0, 1))
        return np.where(upper, above, lower)

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """By differentiation."""
        upper = self.part_of(x, part)[:, None, None] == 1
        lower, above = (self._strained(x, i) for i in (0, 1))
        return np.where(upper, above, lower)

    def _wave(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """φ (n,), its gradient (n, d − 1) and second derivatives (n, d − 1, d − 1)."""
        angle = self._numbers * x[:, :-1]
        cos, sin, k = np.cos(angle), np.sin(angle), self._numbers
        phi = cos.prod(axis=1)
        if self.dim == 2:
            return phi, -k * sin, -(k**2) * cos[:, :, None]
        slope = np.stack([-k[0] * sin[:, 0] * cos[:, 1], -k[1] * cos[:, 0] * sin[:, 1]], axis=1)
        mixed = k[0] * k[1] * sin[:, 0] * sin[:, 1]
        rows = [[-(k[0] ** 2) * phi, mixed], [mixed, -(k[1] ** 2) * phi]]
        return phi, slope, np.moveaxis(np.array(rows), -1, 0)

    def _zeta(self, x: np.ndarray, part: int) -> tuple[np.ndarray, float]:
        """The height (n,) above the far face, and the sign of ∂ζ/∂x_n."""
        sign = 1.0 if part == 0 else -1.0
        return self.size + sign * x[:, -1], sign

    def _moved(self, x: np.ndarray, part: int) -> np.ndarray:
        layer, (zeta, sign) = self._layers[part], self._zeta(x, part)
        phi, slope, _ = self._wave(x)
        f, _, g, _ = layer.profile(zeta, self._wave_pressure)
        rigid = 0.0 if part == 0 else -self.approach
        normal = sign * (f * phi - self.mean_pressure / layer.confined * zeta) + rigid
        return np.column_stack([g[:, None] * slope / layer.wave, normal])

    def _strained(self, x: np.ndarray, part: int) -> np.ndarray:
        layer, (zeta, sign) = self._layers[part], self._zeta(x, part)
        phi, slope, second = self._wave(x)
        f, f_slope, g, g_slope = layer.profile(zeta, self._wave_pressure)
        gradient = np.empty((len(x), self.dim, self.dim))
        gradient[:, :-1, :-1] = g[:, None, None] * second / layer.wave
        gradient[:, :-1, -1] = sign * g_slope[:, None] * slope / layer.wave
        gradient[:, -1, :-1] = sign * f[:, None] * slope
        gradient[:, -1, -1] = f_slope * phi - self.mean_pressure / layer.confined
        return gradient


@dataclass(frozen=True, kw_only=True)
class Waves3d(Waves2d):
    """The same in three dimensions, with waves along both axes of the interface."""

    name: ClassVar[str] = "waves_3d"
    dim: int = field(default=3, init=False)

    half_waves: tuple[float, ...] = parameter(
        "half waves within the size, by axis", default=(1.0, 1.0)
    )


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
