"""Nearly incompressible cells: their mean stress is an unknown (`mechanics.fem.mixed`)."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ....case.acting import Step
from ....case.material import MIXED_ABOVE
from ....mechanics.fem.block import Block
from ....mechanics.fem.displacement import Displacement
from ....mechanics.fem.faces import volume_cells
from ....mechanics.fem.mixed import MeanStress, split
from .part import ModelPart, Nodal, Term

if TYPE_CHECKING:
    from ..attributes import Attributes
    from .strain import StrainFields

# The mean stress (size,), and ∫ q tr ε₀ (size,) of initial strains, which stays.
_Inner = tuple[np.ndarray, np.ndarray]


class _MixedTerm(Term):
    def __init__(self, mean: MeanStress, displacement: Displacement, inner: _Inner):
        self._mean, self._displacement = mean, displacement
        self._stress, self._swelling = inner
        self.force = mean.force(self._stress)

    @cached_property
    def _defect(self) -> np.ndarray:
        """By how much the mean stress differs from λ (div u − tr ε₀)."""
        deformation = self._displacement.deformation.reshape(2, *np.shape(self.force))
        return self._mean.defect(deformation, self._stress) + self._swelling

    @property
    def condensed(self) -> np.ndarray:  # type: ignore[override]
        return self._mean.condensed_force(self._defect)

    @cached_property
    def rounded(self) -> tuple[Nodal, float]:  # type: ignore[override]
        return self._mean.cancellation(self._stress)

    @property
    def energy(self) -> np.ndarray:
        return self._mean.on_nodes(-self._stress * self._swelling / 2)

    def advanced(self, change: np.ndarray) -> _Inner:
        return self._stress + self._mean.change(change, self._defect), self._swelling

    def stress(self, blocks: list[Block]) -> np.ndarray:
        return self._mean.nodal_stress(self._stress, blocks)

    def by_cell(self, cells: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return self._mean.by_cell(self._stress, cells)


class MixedForm(ModelPart):
    """The mean stress of all cells in mixed form, beside their blocks with λ = 0."""

    factored = "nearly incompressible cells: multigrid does not converge"

    def __init__(self, points: np.ndarray, mean: MeanStress, strains: StrainFields | None):
        self.mean, self._strains, self.stiffness = mean, strains, mean.stiffness()
        self._swelling = np.zeros((0, mean.size))
        if strains is not None:
            opened = lambda block: strains(block)[..., :3].sum(axis=-1)  # noqa: E731
            self._swelling = mean.integrals(points, opened, strains.count)

    @property
    def note(self) -> tuple[str, str]:  # type: ignore[override]
        """How many cells there are."""
        why = f"nearly incompressible (Poisson's ratio above {MIXED_ABOVE:g}), or as chosen"
        return f"mixed form in {self.mean.n_cells} cells", why

    def start(self, step: Step) -> _Inner:
        """No mean stress, and the swelling by initial strains in a step."""
        factors = np.zeros(0) if self._strains is None else self._strains.factors(step)
        return np.zeros(self.mean.size), factors @ self._swelling

    def term(self, displacement: Displacement, inner: _Inner) -> Term:
        """The forces of the mean stress."""
        return _MixedTerm(self.mean, displacement, inner)


def split_off(
    groups: Attributes, blocks: list[Block], strains: StrainFields | None
) -> tuple[list[Block], MixedForm]:
    """The blocks, with λ = 0 where the material is in mixed form, and the mean stress there."""
    mixed = groups.by_material(lambda material: float(material.mixed), 0.0)
    meshed, number = {}, 0
    for name, cells in volume_cells(groups.mesh).items():
        meshed[name] = number + np.arange(len(cells))
        number += len(cells)
    chosen, of = [], []
    for block in blocks:
        name, rows = block.type.name, block.rows
        chosen.append(mixed[name][rows] > 0)
        of.append(groups.cut.members(name, meshed)[rows])
    blocks, mean = split(groups.points, blocks, chosen, of)
    return blocks, MixedForm(groups.points, mean, strains)
