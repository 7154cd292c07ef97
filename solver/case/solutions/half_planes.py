"""Two elastic half-planes in contact without friction: fields from one analytic function.

The upper body fills y > 0, the lower one mirrors it. With z = x + i|y|, Westergaard's function Z,
its integral Ẑ and derivative Z′, in plane strain and with v pointing away from the interface,

    σ_x = Re Z − |y| Im Z′,    σ_y = Re Z + |y| Im Z′,    τ = −|y| Re Z′
    2 μ u = (1 − 2ν) Re Ẑ − |y| Im Z,    2 μ v = 2 (1 − ν) Im Ẑ − |y| Re Z

hold in each body with its own μ, ν. In 3D the last axis is y, and nothing changes along the one
between. There is no shear at the interface, and the pressure −Re Z is the same from both sides.
With 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂ and the initial gap g₀, the gap is g₀ + (2/E*) Im Ẑ; Ẑ is
zero in the middle of the contact. With these fields as displacement and traction on the outside of
two blocks, their contact is an exact problem of linear elasticity. Sources: H. M. Westergaard,
J. Appl. Mech. 6 (1939) A49–A53; K. L. Johnson, Contact Mechanics (1985), §2.7, §5.2, §13.2; the
punch: M. Ciavarella, D. A. Hills, G. Monno, Proc. IMechE C 212 (1998) 319–328.
"""

from dataclasses import dataclass
from math import isfinite
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ElasticSolution, Part, lame_of, parameter

# Ẑ, Z and Z′ (n,).
Functions = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class HalfPlanes(ElasticSolution):
    """The common part: the fields, and what follows from the pressure's second moment."""

    parts: ClassVar[tuple[str, ...]] = ("bottom", "top")
    dim: int = parameter("2 or 3", source="extruded", default=2)

    bottom: Material = parameter("of the lower body", source="material")
    top: Material = parameter("of the upper body", source="material")

    def __post_init__(self) -> None:
        super().__post_init__()
        finite = {name: isfinite(getattr(self, name).young) for name in self.parts}
        self.require("must not be rigid", **finite)

    @property
    def modulus(self) -> float:
        """E*."""
        return 1 / sum((1 - m.poisson**2) / m.young for m in self.materials)

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
        _, stress, _ = self.functions(x[:, 0] + 0j)
        return np.where(self.closed(x[:, 0]), np.maximum(-stress.real, 0.0), 0.0)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """g₀ + (2/E*) Im Ẑ where they do not."""
        opened = 2 / self.modulus * self.functions(x[:, 0] + 0j)[0].imag
        found = self.initial_gap(x[:, 0]) + opened
        return np.where(self.closed(x[:, 0]), 0.0, np.maximum(found, 0.0))

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
        whole, stress, slope = self.functions(x[:, 0] + 1j * height)
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
