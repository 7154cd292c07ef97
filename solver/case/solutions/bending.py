"""Two blocks pressed together with a linear pressure: compression and bending, a linear stress.

The lower block stands on rollers at the level `base`, all sides are free, and the top carries
p = p₀ + Σₜ sₜ xₜ, positive where the blocks are. With ζ the height above the base, n the last axis,
t the others,

    σ_nn = −p, all other stresses zero (in plane strain σ_zz = −ν p)
    E′ u_n = −p ζ,    E′ u_t = ν′ (p xₜ − sₜ |x_t|²/2) + sₜ ζ²/2

in the lower block, where E′ = E and ν′ = ν; in plane strain E′ = E/(1 − ν²) and ν′ = ν/(1 − ν).
The interface stays plane and turns. The upper block has the same displacement with its own moduli
and the height above the interface, and moves with the interface as a rigid body. The stress
balances without body force and is compatible because it is linear.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..material import Material
from .base import ElasticSolution, Part, parameter


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
