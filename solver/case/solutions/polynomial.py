"""Polynomial states: uniform ones, bending, a polynomial pressure, a block on a rigid paraboloid.

Uniform: the patch test's compression, and the hydrostatic state for curved interfaces.

Polynomial pressure of two blocks on a flat interface without gap. Any harmonic φ that is even in
the height gives a displacement u = ∇φ / (2 μ) without volume change, body force or shear stress on
the interface, where its normal component vanishes. Here φ = Σₜ Re Z(xₜ + i x_n) over the axes t of
the interface, with Z″(x) = Σⱼ aⱼ (x / L)ʲ, so that

    p = Σₜ Σⱼ aⱼ (xₜ / L)ʲ,    the same in both materials, whatever their shear moduli.

The displacement has to be imposed on all faces but the interface.

Bending: the lower of two blocks stands on rollers at the level `base`, all sides are free, and the
top carries p = p₀ + Σₜ sₜ xₜ, positive where the blocks are. With ζ the height above the base, n
the last axis, t the others,

    σ_nn = −p, all other stresses zero (in plane strain σ_zz = −ν p)
    E′ u_n = −p ζ,    E′ u_t = ν′ (p xₜ − sₜ |x_t|²/2) + sₜ ζ²/2

in the lower block, where E′ = E and ν′ = ν; in plane strain E′ = E/(1 − ν²) and ν′ = ν/(1 − ν).
The interface stays plane and turns. The upper block has the same displacement with its own moduli
and the height above the interface, and moves with the interface as a rigid body. The stress
balances without body force and is compatible because it is linear.

Manufactured: a unit square or cube with ν = 0 is pressed onto the rigid paraboloid x_n = −κ ρ²,
with ρ the distance from the middle of the face x_n = 0 (n: the last axis). Chosen are

    u_n = −κ ρ² (1 + x_n) − c x_n        on the face −κ ρ², the obstacle: closed everywhere
    u_t = −4 κ x_n³ X_t                  X_t: distance from the middle along each other axis

With ν = 0 the stress is E times the strain, so that in the small-strain form with the fixed normal
e_n the contact pressure is p = −σ_nn = E (c + κ ρ²) > 0. The tangential traction on the face, −σ_tn
= E κ X_t, has to be applied, with the traction on the sides, the displacement on the top, and the
body force −div σ: f_t = E κ X_t (12 x_n + 1), f_n = E κ (dim − 1) (6 x_n² + x_n + 1).
In two dimensions, with κ = 0.05 and c = 0.01, this is the problem of Drouet, Hild, Numer. Math. 136
(2017) 467–502; the cube is derived the same way.
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


@dataclass(frozen=True, kw_only=True)
class Bending(ElasticSolution):
    """Two blocks under a linear pressure on the top, the lower one on rollers.

    Quadratic cells represent it exactly. `pressure` is that on the axis of `slope`, x = 0.
    """

    name: ClassVar[str] = "bending"
    parts: ClassVar[tuple[str, ...]] = ("lower", "upper")

    mean: float = parameter("p₀, the pressure at x = 0 (and y = 0)")
    slope: tuple[float, ...] = parameter("sₜ, by which it grows along each axis of the interface")
    base: float = parameter("level of the rollers; the interface is at 0")
    bottom: Material = parameter("of the lower block", source="material")
    top: Material = parameter("of the upper block", source="material")
    dim: int = parameter("2 or 3", source="extruded")

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be 2 (plane strain) or 3", dim=self.dim in (2, 3))
        self.require("must lie below the interface, at 0", base=self.base < 0)
        fits = len(self.slope) == self.dim - 1
        self.require("must have a number for each axis of the interface", slope=fits)

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """P."""
        return np.asarray(self.mean + x[:, :-1] @ np.array(self.slope))

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Quadratic in each block."""
        young, poisson, height, sunk = self._placed(x, part)
        along, p, s = x[:, :-1], self.contact_pressure(x), np.array(self.slope)
        across = p[:, None] * along - (along**2).sum(axis=1)[:, None] * s / 2
        lifted = (height**2 / (2 * young) + sunk * x[:, -1])[:, None] * s
        return np.column_stack(
            [(poisson / young)[:, None] * across + lifted, -p * (height / young + sunk)]
        )

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Linear in each block."""
        young, poisson, height, sunk = self._placed(x, part)
        along, p, s = x[:, :-1], self.contact_pressure(x), np.array(self.slope)
        gradient = np.empty((len(x), self.dim, self.dim))
        turned = along[:, :, None] * s - s[:, None] * along[:, None, :]
        spread = p[:, None, None] * np.eye(self.dim - 1) + turned
        gradient[:, :-1, :-1] = (poisson / young)[:, None, None] * spread
        gradient[:, :-1, -1] = (height / young + sunk)[:, None] * s
        gradient[:, -1, :-1] = -gradient[:, :-1, -1]
        gradient[:, -1, -1] = -p / young
        return gradient

    def _placed(self, x: np.ndarray, part: Part) -> tuple[np.ndarray, ...]:
        """E′, ν′, the height in the block (n,) and, over the pressure, how far it sinks."""
        upper = self.part_of(x, part)
        young, poisson = np.array([(m.young, m.poisson) for m in self.materials]).T
        if self.dim == 2:
            young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
        height, sunk = x[:, -1] - self.base * (1 - upper), -self.base / young[0] * upper
        return young[upper], poisson[upper], height, sunk


_MIDDLE = 0.5


@dataclass(frozen=True, kw_only=True)
class Parabola2d(ElasticSolution):
    """Unit square [0, 1]² on the rigid parabola y = −κ (x − ½)², ν = 0, plane strain."""

    name: ClassVar[str] = "parabola_2d"
    dim: int = field(default=2, init=False)

    material: Material = parameter("of the square or cube", source="material")
    curvature: float = parameter(
        "κ, half the curvature of the obstacle", default=0.05, positive=True
    )
    strain: float = parameter(
        "c, so that E c is the lowest contact pressure", default=0.01, positive=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must have a Poisson's ratio of 0", material=self.material.poisson == 0)

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """E (c + κ ρ²)."""
        return self.material.young * (self.strain + self.curvature * self._square(x))

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """As chosen."""
        height = x[:, -1]
        u = np.empty_like(x)
        u[:, :-1] = -4 * self.curvature * height[:, None] ** 3 * self._offset(x)
        u[:, -1] = -self.curvature * self._square(x) * (1 + height) - self.strain * height
        return u

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """By differentiation."""
        k, height, offset = self.curvature, x[:, -1], self._offset(x)
        gradient = np.zeros((len(x), self.dim, self.dim))
        for t in range(self.dim - 1):
            gradient[:, t, t] = -4 * k * height**3
            gradient[:, t, -1] = -12 * k * height**2 * offset[:, t]
            gradient[:, -1, t] = -2 * k * offset[:, t] * (1 + height)
        gradient[:, -1, -1] = -k * self._square(x) - self.strain
        return gradient

    def body_force(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """−div σ."""
        height = x[:, -1]
        force = np.empty_like(x)
        force[:, :-1] = (12 * height[:, None] + 1) * self._offset(x)
        force[:, -1] = (self.dim - 1) * (6 * height**2 + height + 1)
        return self.material.young * self.curvature * force

    @staticmethod
    def _offset(x: np.ndarray) -> np.ndarray:
        """X_t (n, dim − 1)."""
        return x[:, :-1] - _MIDDLE

    def _square(self, x: np.ndarray) -> np.ndarray:
        """ρ² (n,)."""
        return (self._offset(x) ** 2).sum(axis=1)


@dataclass(frozen=True, kw_only=True)
class Paraboloid3d(Parabola2d):
    """Unit cube [0, 1]³ on the rigid paraboloid z = −κ ((x − ½)² + (y − ½)²), ν = 0."""

    name: ClassVar[str] = "paraboloid_3d"
    dim: int = field(default=3, init=False)
