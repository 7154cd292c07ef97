"""A rigid body as it moves."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Frame:
    """A rigid body as it moves: its `nodes` (n,), and the unit motions (n, dim) there by component.

    Components are x, y, z and the turns rx, ry, rz by one radian about the reference `point`
    (dim,). `without_cells`: it is a surface, and its cells only carry its motion.
    """

    nodes: np.ndarray
    point: np.ndarray
    motions: dict[str, np.ndarray]
    without_cells: bool

    def columns(self, keys: Iterable[str]) -> np.ndarray:
        """The motions (n · dim, k) of k components."""
        return np.stack([self.motions[key].ravel() for key in keys], axis=1)

    @property
    def _scaled(self) -> tuple[np.ndarray, np.ndarray]:
        columns = self.columns(self.motions)
        size = np.linalg.norm(columns, axis=0)
        return columns / size, size

    def displacement(self, amount: Mapping[str, float]) -> np.ndarray:
        """The displacement (n, dim) of a motion by component."""
        parts = (value * self.motions[key] for key, value in amount.items())
        return sum(parts, np.zeros_like(self.motions["x"]))

    def amount(self, displacement: np.ndarray) -> dict[str, float]:
        """The motion by component that nodes have with a displacement (n, dim)."""
        columns, size = self._scaled
        found = np.linalg.lstsq(columns, displacement.ravel())[0] / size
        return dict(zip(self.motions, found.tolist(), strict=True))

    def forces(self, resultant: Mapping[str, float]) -> np.ndarray:
        """The smallest forces (n, dim) at the nodes with a force and moment by component."""
        columns, size = self._scaled
        wanted = np.array([resultant.get(key, 0.0) for key in self.motions]) / size
        return np.linalg.lstsq(columns.T, wanted)[0].reshape(len(self.nodes), -1)

    def resultant(self, forces: np.ndarray) -> dict[str, float]:
        """Force and moment by component of forces (n, dim) at the nodes."""
        found = self.columns(self.motions).T @ forces.ravel()
        return dict(zip(self.motions, found.tolist(), strict=True))
