"""Nodes that move as those of another side do, turned or shifted: sectors and periods."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ....mechanics.fem.supports import Copies, FreeMotion, copied
from ....mesh.transforms import rotation
from ....system.errors import InputError
from ..cut_groups import CutGroups
from .holding import Holding

# Nodes are copies where they are nearer to the image than this share of the model's extent.
_NEAR = 1e-6


class CyclicSides(Holding):
    """The sides of a case that are copies."""

    holder = "cyclic"

    def __init__(self, groups: CutGroups):
        copies = copies_of(groups)
        self.keys, self._copies = list(copies), list(copies.values())

    def link(self, free: FreeMotion) -> FreeMotion:
        """Copies move as their originals do."""
        return copied(free, self._copies)


def copies_of(groups: CutGroups) -> dict[str, Copies]:
    """Nodes that move as another side's nodes do, by key of the case file."""
    found: dict[str, Copies] = {}
    points, dim = groups.points + groups.origin, groups.points.shape[1]
    extent = float(np.ptp(points, axis=0).max())
    for i, support in enumerate(groups.case.supports):
        if (given := support.cyclic) is None:
            continue
        key = f"supports[{i}].cyclic"
        of, copy = groups.nodes(given.of, f"{key}.of"), groups.nodes(support.group, key)
        turn = rotation(dim, given.angle or 0.0, given.axis)
        image = points[of] @ turn.T + (given.shift or np.zeros(dim))
        # Both surfaces of an interface are at the same place: bodies are apart by a further axis.
        apart = [np.c_[x, extent * groups.body[n]] for x, n in ((image, of), (points[copy], copy))]
        distance, nearest = cKDTree(apart[1]).query(apart[0])
        lost = np.flatnonzero(distance > _NEAR * extent)
        if len(lost) or len(of) != len(copy):
            at = ", ".join(f"{x:.6g}" for x in image[lost[0]]) if len(lost) else ""
            allowed = f"{len(of)} nodes have {len(copy)} copies"
            allowed += f"; no copy is at ({at}), of the same body" if at else ""
            raise InputError(groups.case.path, key, support.group, allowed)
        found[key] = Copies(of, copy[nearest], turn)
    return found
