"""Supports that fix no displacement: springs to the ground, and nodes that move as one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from ..case.model import Scalar
from ..mechanics.fem.bodies import body_numbers
from ..mechanics.fem.loads import Field
from ..mechanics.fem.springs import at_nodes, foundation
from ..system.errors import InputError
from .groups import ALL

if TYPE_CHECKING:
    from .attributes import Attributes


def ties_of(groups: Attributes) -> dict[str, np.ndarray]:
    """The degrees of freedom (n,) of nodes that move as one, by key of the case file."""
    found: dict[str, np.ndarray] = {}
    dim = groups.points.shape[1]
    for i, support in enumerate(groups.case.supports):
        if not support.together:
            continue
        key = f"supports[{i}].group"
        nodes = groups.nodes(support.group, key)
        if np.ptp(body_numbers(len(groups.points), groups.cut.cells)[nodes]):
            allowed = "its nodes belong to several bodies; only one body is tied"
            raise InputError(groups.case.path, key, support.group, allowed)
        for direction in support.together:
            found[f"supports[{i}].together.{direction}"] = dim * nodes + "xyz".index(direction)
    return found


def springs_of(groups: Attributes) -> sparse.csr_matrix:
    """The stiffness (n_dofs, n_dofs) of springs and foundations."""
    total = sparse.csr_matrix((groups.points.size, groups.points.size))
    for i, support in enumerate(groups.case.supports):
        for direction, value in support.spring.items():
            total = total + _spring(
                groups, support.group, direction, value, f"supports[{i}].spring.{direction}"
            )
    return total


def _spring(
    groups: Attributes, group: str, direction: str, value: Scalar, key: str
) -> sparse.csr_matrix:
    points, axis, stiffness = groups.points, "xyz".find(direction), _stiffness(groups, value, key)
    if group == ALL or group in groups.mesh.point_sets:
        nodes = groups.nodes(group, key)
        return at_nodes(points, nodes, stiffness(points[nodes]), axis)
    along = None if axis < 0 else np.eye(points.shape[1])[axis]
    return sum(
        foundation(points, nodes, name, stiffness, along, groups.axisymmetric)
        for name, nodes in groups.faces(group, key)
    )


def _stiffness(groups: Attributes, value: Scalar, key: str) -> Field:
    """A stiffness as a field; refused where it is not positive."""
    field = groups.field(value)

    def stiffness(local: np.ndarray) -> np.ndarray:
        found = field(local)
        if (found <= 0).any():
            allowed = "a stiffness must be positive everywhere on the group"
            raise InputError(groups.case.path, key, float(found.min()), allowed)
        return found

    return stiffness
