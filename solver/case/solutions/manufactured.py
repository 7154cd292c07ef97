"""Manufactured contact: a unit square or cube with ν = 0 pressed onto a rigid paraboloid.

The obstacle is x_n = −κ ρ², with ρ the distance from the middle of the face x_n = 0 (n: the last
axis). Chosen are

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

from ..material import Material
from .base import ElasticSolution, Part, parameter

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
