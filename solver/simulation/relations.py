"""Supports that fix no displacement: springs, nodes that move as one or as others do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..case.model import Scalar
from ..mechanics.fem.loads import Field
from ..mechanics.fem.springs import at_nodes, foundation
from ..mechanics.fem.supports import Copies
from ..system.errors import InputError
from .cut_groups import CutGroups
from .groups import ALL

# Nodes are copies where they are nearer to the image than this share of the model's extent.
_NEAR = 1e-6


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
        turn = np.eye(dim) if given.angle is None else _turn(dim, given.angle, given.axis)
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


def _turn(dim: int, degrees: float, axis: Sequence[float]) -> np.ndarray:
    """The rotation (dim, dim) by an angle, in 3D about an axis (Rodrigues' formula)."""
    angle = np.radians(degrees)
    if dim == 2:
        axis = (0.0, 0.0, 1.0)
    unit = np.asarray(axis) / np.linalg.norm(axis)
    across = np.cross(np.eye(3), unit)
    whole = np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across
    return whole[:dim, :dim]


def springs_of(groups: CutGroups) -> sparse.csr_matrix:
    """The stiffness (n_dofs, n_dofs) of springs and foundations."""
    total = sparse.csr_matrix((groups.points.size, groups.points.size))
    for i, support in enumerate(groups.case.supports):
        for direction, value in support.spring.items():
            total = total + _spring(
                groups, support.group, direction, value, f"supports[{i}].spring.{direction}"
            )
    return total


def _spring(
    groups: CutGroups, group: str, direction: str, value: Scalar, key: str
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


def _stiffness(groups: CutGroups, value: Scalar, key: str) -> Field:
    """A stiffness as a field; refused where it is not positive."""
    field = groups.field(value)

    def stiffness(local: np.ndarray) -> np.ndarray:
        found = field(local)
        if (found <= 0).any():
            allowed = "a stiffness must be positive everywhere on the group"
            raise InputError(groups.case.path, key, float(found.min()), allowed)
        return found

    return stiffness
