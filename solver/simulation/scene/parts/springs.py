"""Springs to the ground and elastic foundations, made where the mesh was given."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from ....case.acting import Scalar
from ....mechanics.fem.displacement import Displacement
from ....mechanics.fem.loads import Field, at_nodes, foundation
from ....system.errors import InputError
from ..groups import ALL
from .part import ModelPart, Term

if TYPE_CHECKING:
    from ..attributes import Attributes


class _SpringTerm(Term):
    def __init__(self, force: np.ndarray):
        self.force = self.ground = force


class Springs(ModelPart):
    """Springs of a stiffness (n_dofs, n_dofs), drawn by `drawn` (n, dim) beside displacements.

    A stiff spring stretches by a tiny difference between two displacements: it needs all digits.
    """

    holder = "springs"

    def __init__(self, stiffness: sparse.csr_matrix, drawn: np.ndarray):
        self.stiffness, self._drawn = stiffness, drawn
        self.diagonal = stiffness.diagonal()
        self._held = np.diff(stiffness.indptr) > 0
        self.resisting = _rows(stiffness)

    def term(self, displacement: Displacement, inner: None) -> Term:  # noqa: ARG002
        """Their forces."""
        drawn = displacement.extended(self._held) + self._drawn.ravel()
        force = (self.stiffness @ drawn).astype(float)
        return _SpringTerm(force.reshape(self._drawn.shape))


def springs_of(groups: Attributes) -> Springs:
    """The springs and foundations of a case; InputError where one has no positive stiffness."""
    kept = groups.at_rest.kept
    if Springs.holder not in kept:
        kept[Springs.holder] = _whole(groups.at_rest)
    return Springs(kept[Springs.holder], groups.motion)


def _whole(groups: Attributes) -> sparse.csr_matrix:
    """The stiffness (n_dofs, n_dofs) of all of them."""
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
        for name, nodes in groups.faces_with_area(group, key)
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


def _rows(springs: sparse.csr_matrix) -> sparse.csr_matrix:
    """The rows (k, n_dofs) of a stiffness of springs, the largest entry of each one.

    They resist the same motions, soft springs beside stiff ones too.
    """
    largest = abs(springs).max(axis=1).toarray().ravel()
    return (sparse.diags_array(1 / np.where(largest > 0, largest, 1.0)) @ springs).tocsr()
