"""Nested cylinders and spheres: several materials, press fits, rotation, a pressure that varies.

All of Lamé's states follow from u = (A + B/r^d − k r²) x, d being 2 around an axis (plane strain)
and 3 around a centre: without body force k = 0 and σ_rr = (dλ + 2μ) A − 2μ (d − 1) B/r^d. The body
force ρω² r of cylinders that rotate gives k = ρω²/(8 (λ + 2μ)), and takes (4λ + 6μ) k r² from σ_rr.
A and B follow by the pressures on both walls of a shell. The contact pressure makes the outer
shell's displacement at the interface exceed the inner one's by the interference. Of several tubes
each pressure opens the interfaces on both sides of the two that it acts on: a linear system for all
pressures. Source: Timoshenko, Goodier, Theory of Elasticity, §28 (cylinders, shrink fit), §32
(rotating discs, here in plane strain) and §136 (spheres).

Round oval cylinders the contact pressure varies: p = p₀ + c cos 2θ. To Lamé's state each part adds
the one of Muskhelishvili's potentials

    φ = α z³ + β / z,    ψ = γ z + δ / z³,    2 μ (u + i v) = κ φ − z φ̄′ − ψ̄,    κ = 3 − 4 ν.

They give, with factors cos 2θ for σ_rr and u_r and sin 2θ for σ_rθ,

    σ_rr = −4 β / r² − γ + 3 δ / r⁴,    σ_rθ = 6 α r² − 2 β / r² + γ + 3 δ / r⁴,
    2 μ u_r = (κ − 3) α r³ + (κ + 1) β / r − γ r − δ / r³.

The bore is free of the wave, the interface without shear or gap, and the outside without shear; a
normal traction there holds the outer part to its shape. Source: Muskhelishvili, Some Basic Problems
of the Mathematical Theory of Elasticity, §59.
"""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import FRICTION, ElasticSolution, Part, lame_of, parameter


@dataclass(frozen=True, kw_only=True)
class _Shells(ElasticSolution):
    """Shells in one another under internal pressure, pressed together by their overlaps.

    A pressure is zero where its interface opens.
    """

    around: ClassVar[int] = 2

    radii: tuple[float, ...] = parameter("inner, interface and outer radius")
    pressure: float = parameter("pressure inside", source="pressure", default=0.0)
    spin: float = parameter("ρω² of all parts: their body force over the radius", default=0.0)

    @property
    def _overlaps(self) -> tuple[float, ...]:
        """By how much the part inside each interface is too large."""
        raise NotImplementedError

    @cached_property
    def _interfaces(self) -> tuple[np.ndarray, np.ndarray]:
        """Contact pressures and gaps (n_parts − 1,)."""
        n, inside = len(self._overlaps), [self.pressure] + [0.0] * len(self._overlaps)
        free, opened = np.empty(n), np.zeros((n, n))  # the latter by a unit pressure at each
        for i, (b, overlap) in enumerate(zip(self.radii[1:-1], self._overlaps, strict=True)):
            free[i] = self._at(i + 1, b, 0.0, 0.0) - self._at(i, b, inside[i], 0.0) - overlap
            opened[i, i] = self._at(i + 1, b, 1.0, 0.0, 0.0) - self._at(i, b, 0.0, 1.0, 0.0)
            if i > 0:
                opened[i, i - 1] = -self._at(i, b, 1.0, 0.0, 0.0)
            if i + 1 < n:
                opened[i, i + 1] = self._at(i + 1, b, 0.0, 1.0, 0.0)
        # a pressure closes the interfaces beside its own: what is closed once stays so
        pressure, gap, closed = np.zeros(n), free, np.zeros(n, dtype=bool)
        while (gap < 0).any():
            closed |= gap < 0
            pressure[closed] = np.linalg.solve(opened[np.ix_(closed, closed)], -free[closed])
            gap = np.where(closed, 0.0, free + opened @ pressure)
        return pressure, gap

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """A and B (2, n_parts)."""
        walls = [self.pressure, *self._interfaces[0], 0.0]
        return np.array([self._shell(i, *walls[i : i + 2]) for i in range(len(walls) - 1)]).T

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
        """The axes (dim,) of the radius, as 0 or 1."""
        return np.arange(self.dim) < self.around

    def _radius(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(np.linalg.norm(x * self._axes, axis=1))

    def _interface_of(self, x: np.ndarray) -> np.ndarray:
        """The number (n,) of the interface next to each point."""
        return np.abs(self._radius(x)[:, None] - np.array(self.radii[1:-1])).argmin(axis=1)

    def level(self, x: np.ndarray) -> np.ndarray:
        """Distance outside of the interface."""
        return self._radius(x) - np.array(self.radii[1:-1])[self._interface_of(x)]

    def body_part(self, nodes: np.ndarray) -> int:
        """The part between whose walls the nodes (n, dim) are."""
        middle = self._radius(nodes).mean()
        return int(np.searchsorted(self.radii[1:-1], middle))

    def part_of(self, x: np.ndarray, part: Part) -> np.ndarray:
        """The part (n,) of each point; where it is not given, by place."""
        if part is None:
            return np.searchsorted(self.radii[1:-1], self._radius(x))
        return np.broadcast_to(part, len(x))

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The same all round."""
        return self._interfaces[0][self._interface_of(x)]

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Zero unless the parts do not touch."""
        return self._interfaces[1][self._interface_of(x)]

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
class NestedCylinders(_Shells):
    """Two tubes, one in the other, under internal pressure and pressed together: plane strain.

    The axis is the origin. A negative interference is an initial gap, and the pressure is zero
    while it does not close.
    """

    name: ClassVar[str] = "nested_cylinders"
    parts: ClassVar[tuple[str, ...]] = ("inner", "outer")
    dim: int = field(default=2, init=False)

    inner: Material = parameter("material of the inner part", source="material")
    outer: Material = parameter("material of the outer part", source="material")
    interference: float = parameter(
        "what the inner part is too large by", source="interference", default=0.0
    )

    def __post_init__(self) -> None:
        allowed = "must be three radii that increase: inner, interface, outer"
        self.require(allowed, radii=len(self.radii) == 3)
        a, b, c = self.radii
        self.require(allowed, radii=0 < a < b < c)

    @property
    def _overlaps(self) -> tuple[float, ...]:
        return (self.interference,)


@dataclass(frozen=True, kw_only=True)
class CompoundTube(_Shells):
    """Any number of tubes in one another, under internal pressure and pressed together.

    The axis is the origin in 2D (plane strain); in 3D it is the last axis, and the ends are held. A
    negative interference is an initial gap; the pressure of an interface is zero while it is open.
    """

    name: ClassVar[str] = "compound_tube"
    dim: int = parameter("2 or 3", source="dimension")

    radii: tuple[float, ...] = parameter("of all walls, the bore first")
    young: tuple[float, ...] = parameter("Young's modulus of each tube")
    poisson: tuple[float, ...] = parameter("Poisson's ratio of each tube")
    interferences: tuple[float, ...] = parameter(
        "what the tubes inside each interface are too large by"
    )

    def __post_init__(self) -> None:
        walls = (0.0, *self.radii)
        increase = len(walls) > 3 and all(a < b for a, b in pairwise(walls))
        self.require("must be at least three positive radii that increase", radii=increase)
        n = len(self.radii) - 1
        self.require("must have one for each tube", young=len(self.young) == n)
        self.require("must have one for each tube", poisson=len(self.poisson) == n)
        fits = len(self.interferences) == n - 1
        self.require("must have one for each interface", interferences=fits)

    @property
    def parts(self) -> tuple[str, ...]:  # type: ignore[override]
        """The tubes by number."""
        return tuple(f"tube {i}" for i in range(1, len(self.radii)))

    @property
    def materials(self) -> tuple[Material, ...]:
        """Of the tubes."""
        return tuple(map(Material, self.young, self.poisson))

    @property
    def _overlaps(self) -> tuple[float, ...]:
        return self.interferences


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


@dataclass(frozen=True, kw_only=True)
class PulledTubes(NestedTubes):
    """The nested tubes, of which the outer one is pulled along the axis against friction.

    The tractions τ = μp along the axis make the shear τ b/r of both tubes, b the radius of the
    interface, and move them by (τ b/μ) ln(r/b); the outer one slides by `slide` besides.
    """

    name: ClassVar[str] = "pulled_tubes"
    quantities: ClassVar[frozenset[str]] = ElasticSolution.quantities | FRICTION

    friction: float = parameter("coefficient", source="friction", positive=True)
    slide: float = parameter("by how much the outer tube slides along the axis", positive=True)

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """The shear and the slide beside the nested tubes'."""
        part = self.part_of(x, part)
        found = super().displacement(x, part)
        radius = np.linalg.norm(x[:, :2], axis=1)
        found[:, 2] += self._shear(part) * np.log(radius / self.radii[1])
        found[:, 2] += np.where(part == 1, self.slide, 0.0)
        return found

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """By differentiation."""
        part = self.part_of(x, part)
        found = super().gradient(x, part)
        square = (x[:, :2] ** 2).sum(axis=1)
        found[:, 2, :2] += (self._shear(part) / square)[:, None] * x[:, :2]
        return found

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """μp along the axis on the inner tube."""
        found = np.zeros(x.shape)
        found[:, 2] = self.friction * self.contact_pressure(x)
        return found

    def slip(self, x: np.ndarray) -> np.ndarray:
        """The slide."""
        found = np.zeros(x.shape)
        found[:, 2] = self.slide
        return found

    def _shear(self, part: np.ndarray) -> np.ndarray:
        """τ b/μ (n,) of parts (n,)."""
        b = self.radii[1]
        traction = self.friction * self.contact_pressure(np.array([[b, 0.0, 0.0]]))[0]
        return traction * b / np.array([lame_of(m)[1] for m in self.materials])[part]


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
