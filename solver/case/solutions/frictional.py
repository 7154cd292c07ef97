"""Exact solutions with Coulomb friction.

The twin of a contact of half-planes (Jäger, Ciavarella): the force P presses, then Q < μP shears
the bodies. With Z(P) the function Z of `pressed` for the contact that a force P presses,

    Z_q = μ [Z(P) − Z(P − Q/μ)]
    2 μ u = ± [2 (1 − ν) Im Ẑ_q + |y| Re Z_q],    2 μ v = −(1 − 2ν) Re Ẑ_q − |y| Im Z_q

are added in each body, + in the upper one. The traction q = −Re Z_q pulls the upper body along +x,
the lower one along −x. The contact of P − Q/μ sticks; outside it q = μp, and the slip of the upper
body is (2/E*) Im Ẑ_q = −μ g, with g the gap of that contact. Back from Q* by ΔQ, twice the solution
for ΔQ/2 is taken off (Masing's rule). It holds where both bodies are equally compliant along and
across, (1 − 2ν₁)/μ₁ = (1 − 2ν₂)/μ₂. Sources: J. Jäger, J. Appl. Mech. 65 (1998) 758–766;
M. Ciavarella, Int. J. Solids Struct. 35 (1998) 2349–2362; K. L. Johnson, Contact Mechanics (1985),
§7.2.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
from scipy.optimize import brentq

from ..material import Material
from .base import FRICTION, ElasticSolution, Part, parameter
from .pressed import PartialWaves, Pressed

# Points of a rule over the contact, in θ of x = a sin θ.
_POINTS = 4000
# Bodies whose compliances differ by less are equal in this.
_SAME = 1e-12


@dataclass(frozen=True, kw_only=True)
class ShearedBlocks(ElasticSolution):
    """Two blocks of one material, pressed and sheared: the patch test with friction.

    σ = −p n⊗n + τ (t⊗n + n⊗t), in plane strain also σ_zz = −ν p. The upper block slides by `slide`
    along t: with 0 it sticks. The interface is the plane through the origin with the normal n.
    """

    name: ClassVar[str] = "sheared_blocks"
    parts: ClassVar[tuple[str, ...]] = ("lower", "upper")
    quantities: ClassVar[frozenset[str]] = ElasticSolution.quantities | FRICTION

    pressure: float = parameter("pressure p on the interface", positive=True)
    traction: float = parameter("shear τ on the lower block along t")
    along: tuple[float, ...] = parameter("t, a unit vector")
    normal: tuple[float, ...] = parameter("n, a unit vector across t")
    material: Material = parameter("of both blocks", source="material")
    dim: int = parameter("2 or 3", source="dimension")
    slide: float = parameter("by how much the upper block slides along t", default=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("along", "normal"):
            vector = np.array(getattr(self, name))
            fits = len(vector) == self.dim and abs(np.linalg.norm(vector) - 1) < 1e-9
            self.require("must be a unit vector", **{name: bool(fits)})
        self.require("must lie across the normal", along=abs(self._n @ self._t) < 1e-9)

    @property
    def materials(self) -> tuple[Material, ...]:
        """The same twice."""
        return self.material, self.material

    @property
    def _n(self) -> np.ndarray:
        return np.array(self.normal)

    @property
    def _t(self) -> np.ndarray:
        return np.array(self.along)

    @property
    def _slope(self) -> np.ndarray:
        """The displacement gradient (dim, dim)."""
        young, poisson = self.material.young, self.material.poisson
        shear = young / (2 * (1 + poisson))
        if self.dim == 2:
            young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
        across = np.outer(self._n, self._n)
        wide = poisson * self.pressure / young * (np.eye(self.dim) - across)
        return (
            wide
            - self.pressure / young * across
            + self.traction / shear * np.outer(self._t, self._n)
        )

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height above the interface."""
        return x @ self._n

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """Uniform."""
        return np.full(len(x), self.pressure)

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Linear, and the slide of the upper block."""
        slide = np.where(self.part_of(x, part) == 1, self.slide, 0.0)
        return x @ self._slope.T + slide[:, None] * self._t

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Constant."""
        return np.broadcast_to(self._slope, (len(x), self.dim, self.dim))

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """τ t on the lower block."""
        return np.broadcast_to(self.traction * self._t, x.shape)

    def slip(self, x: np.ndarray) -> np.ndarray:
        """The slide of the upper block."""
        return np.broadcast_to(self.slide * self._t, x.shape)


Terms = tuple[tuple[float, Pressed], ...]


@dataclass(frozen=True, kw_only=True)
class Sheared(ElasticSolution):
    """A contact of two half-planes that a tangential force shears: Cattaneo's problem.

    `shear` has Q/(μP) in each step. Its last value is that of the fields; `states` has all.
    """

    name: ClassVar[str] = "sheared"
    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    quantities: ClassVar[frozenset[str]] = (
        ElasticSolution.quantities | FRICTION | {"stick_area", "dissipation", "half_width"}
    )

    contact: Pressed = parameter("the contact under P alone", source="solution")
    friction: float = parameter("μ", source="friction", positive=True)
    shear: tuple[float, ...] = parameter("Q/(μP) in each step, between -1 and 1")
    dim: int = parameter("2", source="extruded", default=2)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require("must be 2 (plane strain)", dim=self.dim == 2)
        self.require("must be a contact of half-planes", contact=isinstance(self.contact, Pressed))
        self.require("must be between -1 and 1", shear=all(abs(q) < 1 for q in self.shear))
        steps = np.abs(np.diff(_turns(self.shear)))
        steps[:1] *= 2
        falls = len(self.shear) > 0 and bool((np.diff(steps) <= 1e-12).all())
        self.require("must not turn back by more than it came", shear=falls)
        soft = [(1 - 2 * m.poisson) * (1 + m.poisson) / m.young for m in self.materials]
        alike = abs(soft[0] - soft[1]) <= _SAME * max(soft)
        self.require("must have bodies with equal (1 − 2ν)/μ", contact=alike)

    @property
    def materials(self) -> tuple[Material, ...]:
        """Those of the contact."""
        return self.contact.materials

    @property
    def states(self) -> tuple["Sheared", ...]:
        """The solution of each step."""
        return tuple(replace(self, shear=self.shear[: i + 1]) for i in range(len(self.shear)))

    @property
    def half_width(self) -> float:
        """Of the contact."""
        return self.contact.half_width

    @property
    def stick_area(self) -> float:
        """Of what has stuck since the last turn."""
        *_, before, now = 0.0, *_turns(self.shear)
        part = abs(now - before) if len(_turns(self.shear)) <= 2 else abs(now - before) / 2
        return 2 * under(self.contact, 1 - part).half_width

    @property
    def dissipation(self) -> tuple[float, ...]:
        """In each step, ∫ μp |w| of the slip w in the step."""
        theta = np.pi * ((np.arange(_POINTS) + 0.5) / _POINTS - 0.5)
        a = self.half_width
        x = np.zeros((_POINTS, self.dim))
        x[:, 0] = a * np.sin(theta)
        weight = np.pi / _POINTS * a * np.cos(theta) * self.friction
        pressure = self.contact.contact_pressure(x)
        return tuple(
            float(weight @ (pressure * np.abs(state.slip(x)[:, 0]))) for state in self.states
        )

    def level(self, x: np.ndarray) -> np.ndarray:
        """As of the contact."""
        return self.contact.level(x)

    def regular(self, x: np.ndarray) -> np.ndarray:
        """As of the contact."""
        return self.contact.regular(x)

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """As of the contact."""
        found = self.contact.measured(x, force, centre, mean)
        return {name: value for name, value in found.items() if name == "half_width"}

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """As without friction."""
        return self.contact.contact_pressure(x)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """As without friction."""
        return self.contact.gap(x)

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """−q along x on the lower body (n, dim)."""
        found = np.zeros(x.shape)
        for factor, contact in self._terms:
            found[:, 0] -= factor * contact.contact_pressure(x)
        return found

    def slip(self, x: np.ndarray) -> np.ndarray:
        """Of the upper body along x in the last step (n, dim), beyond the contact as well."""
        found = np.zeros(x.shape)
        before = replace(self, shear=self.shear[:-1])._terms if self.shear[:-1] else ()
        for sign, terms in ((1.0, self._terms), (-1.0, before)):
            for factor, contact in terms:
                found[:, 0] += sign * factor * contact.functions(x[:, 0] + 0j)[0].imag
        return found * 2 / self.contact.modulus

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """That of the contact, and of each term."""
        part = self.part_of(x, part)
        found = self.contact.displacement(x, part)
        for factor, contact in self._terms:
            side, height, (whole, stress, _), (shear, poisson) = contact.at(x, part)
            u = side * (2 * (1 - poisson) * whole.imag + height * stress.real)
            v = -(1 - 2 * poisson) * whole.real - height * stress.imag
            found[:, 0] += factor * u / (2 * shear)
            found[:, -1] += factor * v / (2 * shear)
        return found

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """By differentiation."""
        part = self.part_of(x, part)
        found = np.array(self.contact.gradient(x, part))
        for factor, contact in self._terms:
            side, _, (_, stress, rest), (shear, poisson) = contact.at(x, part)
            amount = factor / (2 * shear)
            found[:, 0, 0] += amount * side * (2 * (1 - poisson) * stress.imag + rest.real)
            found[:, 0, -1] += amount * ((3 - 2 * poisson) * stress.real - rest.imag)
            found[:, -1, 0] += amount * (-(1 - 2 * poisson) * stress.real - rest.imag)
            found[:, -1, -1] -= amount * side * (2 * poisson * stress.imag + rest.real)
        return found

    @property
    def _terms(self) -> Terms:
        """Factors and contacts whose sum is Z_q."""
        terms: list[tuple[float, Pressed]] = []
        turns = _turns(self.shear)
        for i, (before, now) in enumerate(pairwise(turns)):
            times = self.friction * np.sign(now - before) * (1 if i == 0 else 2)
            share = abs(now - before) / (1 if i == 0 else 2)
            if share:
                terms += [(times, self.contact), (-times, under(self.contact, 1 - share))]
        return tuple(terms)


def _turns(shear: tuple[float, ...]) -> list[float]:
    """0, the values where a path turns, and the last.

    >>> _turns((0.0, 0.3, 0.7, -0.2))
    [0.0, 0.7, -0.2]
    """
    found = [0.0]
    for value in shear:
        if value == found[-1]:
            continue
        if len(found) > 1 and (value - found[-1]) * (found[-1] - found[-2]) > 0:
            found.pop()
        found.append(float(value))
    return found


def under(contact: Pressed, share: float) -> Pressed:
    """The contact under a share of its force."""
    if isinstance(contact, PartialWaves):
        return replace(contact, mean_pressure=share * contact.mean_pressure)
    whole = contact.force  # type: ignore[attr-defined]

    def missing(end: float) -> float:
        return float(replace(contact, end=end).force - share * whole)  # type: ignore[call-arg, attr-defined]

    low, high = getattr(contact, "flat", 0.0), contact.half_width
    end = brentq(missing, low + 1e-9 * (high - low), high, xtol=1e-15 * high, rtol=1e-15)
    return replace(contact, end=end)  # type: ignore[call-arg]
