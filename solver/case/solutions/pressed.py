"""Contacts of half-planes that are symmetric about x = origin: waves, Hertz's, a punch, a wedge.

The upper body fills y > 0, the lower one mirrors it. There is no friction. With z = x + i|y|,
Westergaard's function Z, its integral Ẑ and derivative Z′, in plane strain and with v pointing away
from the interface, x from the origin,

    σ_x = Re Z − |y| Im Z′,    σ_y = Re Z + |y| Im Z′,    τ = −|y| Re Z′
    2 μ u = (1 − 2ν) Re Ẑ − |y| Im Z,    2 μ v = 2 (1 − ν) Im Ẑ − |y| Re Z

hold in each body with its own μ, ν. In 3D the last axis is y, and nothing changes along the one
between. There is no shear at the interface, and the pressure −Re Z is the same from both sides.
With 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂ and the initial gap g₀, the gap is g₀ + (2/E*) Im Ẑ; Ẑ is
zero in the middle of the contact. With these fields as displacement and traction on the outside of
two blocks, their contact is an exact problem of linear elasticity.

The contact is |x| < a. With R = √(z − a) √(z + a) and L = ln((z + R)/(i a)) the functions are

    waves   Z = −2i p̄ cos ψ/(w + r),   Ẑ = −i (p̄ λ/π) (w/(w + r) + ln((w + r)/(i s)))
    Hertz   Z = −i p₀ a/(z + R),       Ẑ = −i (p₀ a/2) (z/(z + R) + L)
    punch   Z = −i K (z B − b A − α R),
            Ẑ = −i K ((z² + b²) B/2 − b z A − α (z R − a² L)/2 − b d L/2)
    wedge   Z = −i (E* m/π) asin(a/z),   Ẑ = −i (E* m/π) (z asin(a/z) + a L)

with ψ = πz/λ, w = sin ψ, s = sin(πa/λ), r = √(w − s) √(w + s); p₀ = E* a/(2 R₁); K = E*/(π R₁),
d = √(a² − b²), α = arccos(b/a), A = arctan(d/R), B = arctan(z d/(b R)). The waves are Hertz's
contact in sin(πx/λ). The punch and the wedge are sums of flat punches of half-widths t, each of the
load P′(t) dt: P′ = E* t arccos(b/t)/R₁ and E* m.

Sources: H. M. Westergaard, J. Appl. Mech. 6 (1939) A49–A53; K. L. Johnson, Contact Mechanics
(1985), §2.7, §5.2, §13.2; the punch: M. Ciavarella, D. A. Hills, G. Monno, Proc. IMechE C 212
(1998) 319–328.
"""

from dataclasses import dataclass
from math import acos, asin, isfinite, pi, sqrt
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ElasticSolution, Part, lame_of, parameter
from .hertz import ContactArea, HalfEllipse, half_ellipse

# Ẑ, Z and Z′ (n,).
Functions = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class HalfPlanes(ElasticSolution):
    """The common part: the fields, and what follows from the pressure's second moment."""

    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    dim: int = parameter("2 or 3", source="extruded", default=2)

    bottom: Material = parameter("of the lower body", source="material")
    top: Material = parameter("of the upper body", source="material")
    origin: float = parameter("x of the middle, from which the others are counted", default=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        both_rigid = not any(isfinite(material.young) for material in self.materials)
        self.require("must not be rigid: the other body is", top=not both_rigid)

    @property
    def modulus(self) -> float:
        """E*."""
        return 1 / sum((1 - m.poisson**2) / m.young for m in self.materials)

    def place(self, x: np.ndarray) -> np.ndarray:
        """Places (n,) along the interface from the origin, of points (n, dim)."""
        return x[:, 0] - self.origin

    def functions(self, z: np.ndarray) -> Functions:
        """Ẑ, Z and Z′ at points of the upper half-plane; Z′ may be infinite on the interface."""
        raise NotImplementedError

    def closed(self, x: np.ndarray) -> np.ndarray:
        """Whether (n,) the bodies touch at places (n,) along the interface."""
        raise NotImplementedError

    def initial_gap(self, x: np.ndarray) -> np.ndarray:
        """g₀ (n,) at places (n,) along the interface."""
        raise NotImplementedError

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """−Re Z where the bodies touch."""
        place = self.place(x)
        _, stress, _ = self.functions(place + 0j)
        return np.where(self.closed(place), np.maximum(-stress.real, 0.0), 0.0)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """g₀ + (2/E*) Im Ẑ where they do not."""
        place = self.place(x)
        opened = 2 / self.modulus * self.functions(place + 0j)[0].imag
        found = self.initial_gap(place) + opened
        return np.where(self.closed(place), 0.0, np.maximum(found, 0.0))

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Displacement u, v of each body, v with the sign of its side."""
        side, height, (whole, stress, _), (shear, poisson) = self.at(x, part)
        u = (1 - 2 * poisson) * whole.real - height * stress.imag
        v = 2 * (1 - poisson) * whole.imag - height * stress.real
        found = np.zeros((len(x), self.dim))
        found[:, 0], found[:, -1] = u, side * v
        return found / (2 * shear[:, None])

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """By differentiation."""
        side, _, (_, stress, rest), (shear, poisson) = self.at(x, part)
        both = 2 * (1 - poisson) * stress.imag
        found = np.zeros((len(x), self.dim, self.dim))
        found[:, 0, 0] = (1 - 2 * poisson) * stress.real - rest.imag
        found[:, 0, -1] = side * (-both - rest.real)
        found[:, -1, 0] = side * (both - rest.real)
        found[:, -1, -1] = (1 - 2 * poisson) * stress.real + rest.imag
        return found / (2 * shear[:, None, None])

    def at(self, x: np.ndarray, part: Part) -> tuple[np.ndarray, np.ndarray, Functions, np.ndarray]:
        """Side (n,), height (n,), Ẑ, Z and |y| Z′ (n,), and μ, ν (2, n) of points."""
        upper = self.part_of(x, part)
        side = np.where(upper == 1, 1.0, -1.0)
        height = np.maximum(side * x[:, -1], 0.0)
        whole, stress, slope = self.functions(self.place(x) + 1j * height)
        rest = np.where(height > 0, height * np.where(height > 0, slope, 0), 0)
        elastic = np.array([(lame_of(m)[1], m.poisson) for m in self.materials]).T
        return side, height, (whole, stress, rest), elastic[:, upper]


@dataclass(frozen=True, kw_only=True)
class ContactEdge(HalfPlanes):
    """The end of a contact of flat faces: p = C √(e − x), g = (4 C / (3 E*)) (x − e)^{3/2}."""

    name: ClassVar[str] = "contact_edge"

    edge: float = parameter("e, where the contact ends: it is closed below", default=0.0)
    factor: float = parameter("C, the factor of the pressure C √(e − x)", positive=True)

    def functions(self, z: np.ndarray) -> Functions:
        """Z = i C √z from the edge."""
        z = z - self.edge
        root = np.sqrt(z)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = 0.5j * self.factor / root
        return 2 / 3 * 1j * self.factor * z * root, 1j * self.factor * root, slope

    def closed(self, x: np.ndarray) -> np.ndarray:
        """Below the edge."""
        return x < self.edge

    def initial_gap(self, x: np.ndarray) -> np.ndarray:
        """None."""
        return np.zeros(len(x))


# A point at a singularity of Z is moved by this share of the half-width.
_ASIDE = 1e-14


@dataclass(frozen=True, kw_only=True)
class Pressed(ContactArea, HalfPlanes):
    """The common part: a contact from −a to a."""

    quantities: ClassVar[frozenset[str]] = HalfPlanes.quantities | {"half_width"}

    def closed(self, x: np.ndarray) -> np.ndarray:
        """Within the half-width."""
        return np.abs(x) < self.half_width

    def distance(self, x: np.ndarray) -> np.ndarray:
        """From the middle."""
        return np.abs(self.place(x))


@dataclass(frozen=True, kw_only=True)
class PartialWaves(Pressed):
    """Waves of the height 2Δ that a mean pressure closes in part (Westergaard)."""

    name: ClassVar[str] = "partial_waves"
    quantities: ClassVar[frozenset[str]] = Pressed.quantities | {"peak"}

    size: float = parameter(
        "half a wavelength: from the middle of a contact to the middle of a gap", positive=True
    )
    amplitude: float = parameter(
        "Δ, half the height of the waves: the gap is Δ (1 − cos(πx/size))", positive=True
    )
    mean_pressure: float = parameter("p̄, below π E* Δ/(2 size), which closes the waves")

    def __post_init__(self) -> None:
        super().__post_init__()
        least = f"must be positive and below {self._closing:g}"
        self.require(least, mean_pressure=0 < self.mean_pressure < self._closing)

    @property
    def _closing(self) -> float:
        """The mean pressure that closes the waves."""
        return pi * self.modulus * self.amplitude / (2 * self.size)

    @property
    def _share(self) -> float:
        """S = sin(πa/λ)."""
        return sqrt(self.mean_pressure / self._closing)

    @property
    def half_width(self) -> float:
        """a: half the width of each contact."""
        return 2 * self.size / pi * asin(self._share)

    @property
    def peak(self) -> float:
        """The pressure in the middle of a contact."""
        return 2 * self.mean_pressure / self._share

    def functions(self, z: np.ndarray) -> Functions:
        """Those of Hertz's contact in w."""
        angle = pi / (2 * self.size)
        w, cos, s = np.sin(angle * z), np.cos(angle * z), self._share
        r = np.sqrt(w - s) * np.sqrt(w + s)
        whole = w / (w + r) + np.log((w + r) / (1j * s))
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = 2j * self.mean_pressure * angle * (w + cos**2 / r) / (w + r)
        stress = -2j * self.mean_pressure * cos / (w + r)
        return -1j * self.mean_pressure / angle * whole, stress, slope

    def initial_gap(self, x: np.ndarray) -> np.ndarray:
        """Δ (1 − cos(πx/size))."""
        return self.amplitude * (1 - np.cos(pi * x / self.size))

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """Those of the half ellipse of p/cos ψ over sin ψ; at most the whole wave."""
        angle = pi / (2 * self.size)
        place, at = np.abs(np.sin(angle * self.place(x))), angle * self.place(centre)
        found = half_ellipse(place, force, np.abs(np.sin(at)), mean / np.cos(at), 0.25)
        if found:
            found["half_width"] = float(np.arcsin(min(found["half_width"], 1.0)) / angle)
        return found


@dataclass(frozen=True, kw_only=True)
class _Given(Pressed):
    """A contact whose half-width is given, and with it the force."""

    end: float = parameter("a, half the width of the contact", positive=True)

    @property
    def half_width(self) -> float:
        """a: half the width of the contact."""
        return self.end

    def _root(self, z: np.ndarray) -> np.ndarray:
        """R."""
        return np.sqrt(z - self.end) * np.sqrt(z + self.end)

    def _aside(self, z: np.ndarray, place: float) -> np.ndarray:
        """Points (n,), moved where they are at a singular place of the interface."""
        near = self.end * _ASIDE
        return np.where(np.abs(z - place) < near, place + near, z)


@dataclass(frozen=True, kw_only=True)
class HertzHalfPlanes(HalfEllipse, _Given):
    """Hertz's contact of a parabola x²/(2R₁), without an error of the theory."""

    name: ClassVar[str] = "hertz_half_planes"
    quantities: ClassVar[frozenset[str]] = Pressed.quantities | {"peak"}
    moment: ClassVar[float] = 0.25

    radius: float = parameter("R₁ of the parabola x²/(2R₁) that is the initial gap", positive=True)

    @property
    def peak(self) -> float:
        """p₀: the pressure in the middle."""
        return self.modulus * self.end / (2 * self.radius)

    @property
    def force(self) -> float:
        """The whole force per length."""
        return pi * self.end * self.peak / 2

    def functions(self, z: np.ndarray) -> Functions:
        """Those of a half ellipse of pressure."""
        a, root = self.end, self._root(z)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = 1j * self.peak * a / (root * (z + root))
        whole = z / (z + root) + np.log((z + root) / (1j * a))
        return -0.5j * self.peak * a * whole, -1j * self.peak * a / (z + root), slope

    def initial_gap(self, x: np.ndarray) -> np.ndarray:
        """The parabola."""
        return x**2 / (2 * self.radius)


@dataclass(frozen=True, kw_only=True)
class RoundedPunch(_Given):
    """A flat face of half-width b with parabolic shoulders (|x| − b)²/(2R₁)."""

    name: ClassVar[str] = "rounded_punch"

    flat: float = parameter("b, half the width of the flat part")
    radius: float = parameter("R₁ of the shoulders", positive=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be positive and below the end", flat=0 < self.flat < self.end)

    @property
    def _angle(self) -> float:
        """α = arccos(b/a)."""
        return acos(self.flat / self.end)

    @property
    def _rise(self) -> float:
        """D = √(a² − b²)."""
        return sqrt(self.end**2 - self.flat**2)

    @property
    def force(self) -> float:
        """The whole force per length."""
        area = self.end**2 * self._angle - self.flat * self._rise
        return self.modulus * area / (2 * self.radius)

    @property
    def moment(self) -> float:
        """Of flat punches of half-widths t, each with the mean t²/2."""
        a, b, d = self.end, self.flat, self._rise
        part = a**4 * self._angle - b * (d**3 / 3 + b**2 * d)
        return part / (4 * a**2 * (a**2 * self._angle - b * d))

    def functions(self, z: np.ndarray) -> Functions:
        """Those of the sum of flat punches; for x < 0, where A and B are not unique, mirrored."""
        left = z.real < 0
        z = self._aside(np.where(left, -z.conj(), z), self.flat)
        a, b, d, alpha = self.end, self.flat, self._rise, self._angle
        root = self._root(z)
        # R² + d² = z² − b² and b² R² + d² z² = a² (z² − b²): near z = b their logarithms cancel.
        shared = (np.log(z - b) + np.log(z + b)) / 2
        one = 1j * (shared - np.log(root + 1j * d))
        two = 1j * (shared - np.log((b * root + 1j * d * z) / a))
        factor = -1j * self.modulus / (pi * self.radius)
        log = np.log((z + root) / (1j * a))
        whole = (z**2 + b**2) * two / 2 - b * z * one - b * d * log / 2
        whole -= alpha * (z * root - a**2 * log) / 2
        stress = z * two - b * one - alpha * root
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = factor * (two - alpha * z / root)
        whole, stress = factor * whole, factor * stress
        return (
            np.where(left, -whole.conj(), whole),
            np.where(left, stress.conj(), stress),
            np.where(left, -slope.conj(), slope),
        )

    def initial_gap(self, x: np.ndarray) -> np.ndarray:
        """The shoulders."""
        return np.maximum(np.abs(x) - self.flat, 0.0) ** 2 / (2 * self.radius)


@dataclass(frozen=True, kw_only=True)
class Wedge(_Given):
    """A blunt wedge: the pressure has no bound at its tip."""

    name: ClassVar[str] = "wedge"
    moment: ClassVar[float] = 1 / 6

    slope: float = parameter("m: the initial gap is m |x|", positive=True)

    @property
    def force(self) -> float:
        """The whole force per length."""
        return self.modulus * self.slope * self.end

    def functions(self, z: np.ndarray) -> Functions:
        """Those of the sum of equal flat punches."""
        z = self._aside(z, 0.0)
        a, root = self.end, self._root(z)
        factor = -1j * self.modulus * self.slope / pi
        angle = -1j * (np.log(1j * a + root) - np.log(z))
        whole = z * angle + a * np.log((z + root) / (1j * a))
        with np.errstate(divide="ignore", invalid="ignore"):
            change = -factor * a / (z * root)
        return factor * whole, factor * angle, change

    def initial_gap(self, x: np.ndarray) -> np.ndarray:
        """The wedge."""
        return self.slope * np.abs(x)

    def regular(self, x: np.ndarray) -> np.ndarray:
        """Beyond 0.2 a from the tip, too."""
        return super().regular(x) & (self.distance(x) >= 0.2 * self.end)
