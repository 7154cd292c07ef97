"""Nodes that move as one along an axis."""

from __future__ import annotations

import numpy as np

from ....mechanics.fem.supports import FreeMotion, tied
from ....system.errors import InputError
from ..cut_groups import CutGroups
from .holding import Holding


class Together(Holding):
    """The ties of a case."""

    holder = "together"

    def __init__(self, groups: CutGroups):
        ties = ties_of(groups)
        self.keys, self._ties = list(ties), list(ties.values())

    def link(self, free: FreeMotion) -> FreeMotion:
        """The nodes of each have one displacement."""
        return tied(free, self._ties)


def ties_of(groups: CutGroups) -> dict[str, np.ndarray]:
    """The degrees of freedom (n,) of nodes that move as one, by key of the case file."""
    found: dict[str, np.ndarray] = {}
    dim = groups.points.shape[1]
    for i, support in enumerate(groups.case.supports):
        if not support.together:
            continue
        key = f"supports[{i}].group"
        nodes = groups.nodes(support.group, key)
        if np.ptp(groups.body[nodes]):
            allowed = "its nodes belong to several bodies; only one body is tied"
            raise InputError(groups.case.path, key, support.group, allowed)
        for direction in support.together:
            found[f"supports[{i}].together.{direction}"] = dim * nodes + "xyz".index(direction)
    return found
