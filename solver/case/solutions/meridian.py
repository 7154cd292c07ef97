"""A solution of three dimensions, symmetric about an axis, seen in one meridian plane.

Points are (r, z): the radius and the place along the axis, which is the last axis of the solution
in three dimensions, seen at (r, 0, z). Tensors have the axes r, z and θ, in this order.
"""

from __future__ import annotations

import numpy as np

from ..material import Material
from .base import ElasticSolution, ExactSolution, Part

# The axes r, z, θ of a meridian plane as axes x, z, y of three dimensions at y = 0.
_AXES = [0, 2, 1]


class Meridian(ElasticSolution):
    """The fields of a `whole` solution of three dimensions; its parameters and its quantities."""

    dim = 2

    def __init__(self, whole: ExactSolution):
        self.whole = whole
        self.name, self.parts = whole.name, whole.parts  # type: ignore[misc]
        self.quantities = whole.quantities  # type: ignore[misc]

    @property
    def materials(self) -> tuple[Material, ...]:
        """The materials of the parts."""
        assert isinstance(self.whole, ElasticSolution)
        return self.whole.materials

    def contact_pressure(self, x: np.ndarray) -> np.ndarray:
        """The contact pressure (n,) of the whole at points (n, 2)."""
        return self.whole.contact_pressure(_around(x))

    def gap(self, x: np.ndarray) -> np.ndarray:
        """The gap (n,) of the whole at points (n, 2)."""
        return self.whole.gap(_around(x))

    def friction_traction(self, x: np.ndarray) -> np.ndarray:
        """Traction of friction (n, 2) along r and z at points (n, 2)."""
        return self.whole.friction_traction(_around(x))[:, _AXES[:2]]

    def slip(self, x: np.ndarray) -> np.ndarray:
        """Slip (n, 2) along r and z at points (n, 2)."""
        return self.whole.slip(_around(x))[:, _AXES[:2]]

    def displacement(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Displacement (n, 2) along r and z at points (n, 2)."""
        return self.whole.displacement(_around(x), part)[:, _AXES[:2]]

    def gradient(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Displacement gradients (n, 3, 3) at points (n, 2), the hoop strain last."""
        return self.whole.gradient(_around(x), part)[:, _AXES][:, :, _AXES]

    def body_force(self, x: np.ndarray, part: Part = None) -> np.ndarray:
        """Force per volume (n, 2) along r and z at points (n, 2)."""
        return self.whole.body_force(_around(x), part)[:, _AXES[:2]]

    def regular(self, x: np.ndarray) -> np.ndarray:
        """As the whole says."""
        return self.whole.regular(_around(x))

    def level(self, x: np.ndarray) -> np.ndarray:
        """As the whole says."""
        return self.whole.level(_around(x))

    def body_part(self, nodes: np.ndarray) -> int:
        """As the whole says."""
        return self.whole.body_part(_around(nodes))

    @property
    def half_width(self) -> float:
        """The radius of the contact, a length."""
        return self.whole.half_width

    @property
    def peak(self) -> float:
        """The largest pressure, a stress."""
        return self.whole.peak

    def measured(
        self, x: np.ndarray, force: np.ndarray, centre: np.ndarray, mean: np.ndarray
    ) -> dict[str, float]:
        """Radius and peak, from forces (n,) on rings through points x (n, 2)."""
        return self.whole.measured(_around(x), force, _around(centre), mean)


def _around(x: np.ndarray) -> np.ndarray:
    """Points (n, 2) of the meridian plane in three dimensions (n, 3)."""
    return np.column_stack([x[:, 0], np.zeros(len(x)), x[:, 1]])
