"""Initial strain, also by temperature: a load, and a stress that is taken off.

In a cell in mixed form, whose block has λ = 0, the rest of C ε₀ is in the equation of its mean
stress.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ....case.acting import Load, Step
from ....case.expressions import evaluate
from ....case.model import Case
from ....lac.cells.shape import shape_functions
from ....mechanics.fem.block import Block
from ....mechanics.fem.displacement import Displacement
from ....mechanics.fem.loads import StrainLoads, strain_loads
from ....mechanics.fem.stress import COMPONENTS
from ..groups import ALL
from .part import ModelPart, Nodal, Term

if TYPE_CHECKING:
    from ..attributes import Attributes


class StrainFields:
    """The k initial strains of a case as fields, and their factors in a step."""

    def __init__(self, groups: Attributes):
        self._groups = groups
        self._loads = [load for load in groups.case.loads if load.strains]
        self._masks = [
            groups.cell_mask(load.group) if load.group != ALL else None for load in self._loads
        ]

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self._loads)

    def factors(self, step: Step) -> np.ndarray:
        """The factors (k,) in a step."""
        return np.array([load.factor(step) for load in self._loads])

    def __call__(self, block: Block) -> np.ndarray:
        """Each of them (k, n, q, 6) at the quadrature points of a block's cells."""
        groups = self._groups
        values = shape_functions(block.type.name).values(block.rule[0])
        place = values @ groups.points[block.cells] + groups.origin
        found = np.zeros((self.count, *place.shape[:2], 6))
        for one, load, mask in zip(found, self._loads, self._masks, strict=True):
            assert block.rows is not None
            here = slice(None) if mask is None else mask[block.type.name][block.rows]
            flat = place[here].reshape(-1, place.shape[2])
            one[here] = strain_at(groups.case, load, flat).reshape(-1, place.shape[1], 6)
        return found


def strain_at(case: Case, load: Load, place: np.ndarray) -> np.ndarray:
    """The initial strain (n, 6) of a load at points (n, dim).

    In plane stress the strain across the plane is free and counts for nothing.
    """
    assert isinstance(load.value, dict)
    found = np.zeros((len(place), 6))
    if load.kind == "temperature":
        parts = [evaluate(value, place) for value in load.value.values()]
        found[:, :3] = np.prod(parts, axis=0)[:, None]
    else:
        for name, value in load.value.items():
            found[:, COMPONENTS.index(name)] = evaluate(value, place)
    if case.thin:
        found[:, 2] = 0.0
    return found


def strain_in(
    case: Case, sets: Mapping[str, np.ndarray], cells: np.ndarray, place: np.ndarray
) -> np.ndarray:
    """The initial strain (k, 6) in the last step at points (k, dim), k/n in each of `cells` (n,).

    `sets` has the cells of groups, by name.
    """
    found = np.zeros((len(place), 6))
    for load in (load for load in case.loads if load.strains):
        mine = load.group == ALL or np.isin(cells, sets[load.group])
        here = np.repeat(np.broadcast_to(mine, len(cells)), len(place) // len(cells))
        found[here] += load.factor(case.steps[-1]) * strain_at(case, load, place[here])
    return found


class _StrainTerm(Term):
    def __init__(self, loads: StrainLoads, factors: np.ndarray, displacement: Displacement):
        self._loads, self._factors, self._displacement = loads, factors, displacement

    @cached_property
    def rounded(self) -> tuple[Nodal, float]:  # type: ignore[override]
        stress = np.tensordot(np.abs(self._factors), np.abs(self._loads.stress), axes=1)
        return 0.0, float(stress.max())

    def advanced(self, change: np.ndarray) -> np.ndarray:  # noqa: ARG002
        return self._factors

    def stress(self, blocks: list[Block]) -> Nodal:  # noqa: ARG002
        return -np.tensordot(self._factors, self._loads.stress, axes=1)

    @property
    def energy(self) -> np.ndarray:
        """½ ∫ ε₀:C:ε₀ − ∫ ε₀:C:ε."""
        moved = self._displacement.deformation.sum(axis=0)
        force = np.tensordot(self._factors, self._loads.force, axes=1)
        own = np.einsum("k,nkl,l->n", self._factors, self._loads.energy, self._factors)
        return np.asarray(own / 2 - (moved.reshape(force.shape) * force).sum(axis=1))


class InitialStrain(ModelPart):
    """The initial strains of a case in its blocks of cells."""

    def __init__(self, groups: Attributes, blocks: list[Block], strains: StrainFields):
        self._strains = strains
        self._loads = strain_loads(groups.points, blocks, strains, strains.count)
        # Where all of a body is held, its initial strain is stress.
        self.loaded = np.flatnonzero(self._loads.stress.any(axis=(0, 2)))

    def load(self, step: Step) -> np.ndarray:
        """Their forces in a step."""
        return np.tensordot(self._strains.factors(step), self._loads.force, axes=1)

    def start(self, step: Step) -> np.ndarray:
        """The factors (k,) in a step, which stay."""
        return self._strains.factors(step)

    def term(self, displacement: Displacement, inner: np.ndarray) -> Term:
        """The stress that is taken off, and its energy."""
        return _StrainTerm(self._loads, inner, displacement)
