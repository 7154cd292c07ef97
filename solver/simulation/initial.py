"""The initial strains of a case's loads: given, or a change of temperature times an expansion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..case.expressions import evaluate
from ..case.model import Case, Load, Step
from ..lac.cells.shape import shape_functions
from ..mechanics.fem.block import Block
from ..mechanics.fem.initial import StrainLoads, strain_loads
from ..mechanics.fem.mixed import MeanStress
from ..mechanics.fem.stress import COMPONENTS
from .groups import ALL

if TYPE_CHECKING:
    from .attributes import Attributes


def strain_factors(case: Case, step: Step) -> np.ndarray:
    """The factors (k,) of the initial strains of a case in a step."""
    return np.array([load.factor(step) for load in case.loads if load.strains])


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


def strain_loads_of(groups: Attributes, blocks: Sequence[Block], mean: MeanStress) -> StrainLoads:
    """What the initial strains of a case do in its cells; arrays of length 0 where it has none."""
    loads = [load for load in groups.case.loads if load.strains]
    masks = [groups.cell_mask(load.group) if load.group != ALL else None for load in loads]

    def strains(block: Block) -> np.ndarray:
        values = shape_functions(block.type.name).values(block.rule[0])
        place = values @ groups.points[block.cells] + groups.origin
        found = np.zeros((len(loads), *place.shape[:2], 6))
        for one, load, mask in zip(found, loads, masks, strict=True):
            assert block.rows is not None
            here = slice(None) if mask is None else mask[block.type.name][block.rows]
            flat = place[here].reshape(-1, place.shape[2])
            one[here] = strain_at(groups.case, load, flat).reshape(-1, place.shape[1], 6)
        return found

    return strain_loads(groups.points, blocks, mean, strains, len(loads))
