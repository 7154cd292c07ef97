"""A Winkler bed: faces that are pulled back where they were, along all axes alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from ....mechanics.fem.loads import foundation
from .springs import Springs

if TYPE_CHECKING:
    from ..attributes import Attributes


def bed_of(groups: Attributes) -> Springs:
    """The bed of a case."""
    points, total = groups.points, sparse.csr_matrix((groups.points.size, groups.points.size))
    for i, support in enumerate(groups.case.supports):
        for name, nodes in groups.faces(support.group, f"supports[{i}].bed") if support.bed else ():
            for along in np.eye(points.shape[1]):
                one = foundation(points, nodes, name, _one, along, groups.axisymmetric)
                total = total + support.bed * one
    return Springs(total.tocsr(), np.zeros_like(points))


def _one(places: np.ndarray) -> np.ndarray:
    return np.ones(len(places))
