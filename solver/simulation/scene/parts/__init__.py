"""What a model has beside its elastic cells: a part for each key of the case that asks for one.

A part is made only where the case has its key, and no part knows another one's file: the
equilibrium sums over those that are there. Each adds a term to the equations of an iterate
(`part`). A new part is a new file here and a line in `parts_of`.

    springs      springs to the ground, elastic foundations
    mixed        nearly incompressible cells, whose mean stress is an unknown
    strain       initial strain, also by temperature

Source of the design: the items of a step in FElupe (Dutzler, https://github.com/adtzlr/felupe).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....mechanics.fem.block import Block
from ...options import Safeguards
from .part import ModelPart

if TYPE_CHECKING:
    from ..attributes import Attributes


def parts_of(
    groups: Attributes, blocks: list[Block], safeguards: Safeguards
) -> tuple[list[Block], tuple[ModelPart, ...]]:
    """The elastic blocks of cells that are left, and the parts that the case asks for."""
    case, parts, strain = groups.case, list[ModelPart](), None
    if any(support.spring for support in case.supports):
        from .springs import springs_of

        parts.append(springs_of(groups))
    if any(load.strains for load in case.loads):
        from .strain import StrainFields

        strain = StrainFields(groups)
    if safeguards.mixed and any(material.mixed for material in case.materials.values()):
        from .mixed import split_off

        blocks, part = split_off(groups, blocks, strain)
        if part.mean.size:
            parts.append(part)
    if strain is not None:
        from .strain import InitialStrain

        parts.append(InitialStrain(groups, blocks, strain))
    return blocks, tuple(parts)
