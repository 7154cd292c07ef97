"""Displacements that supports impose, and the axis of axisymmetric bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from ....case.expressions import Exact
from ....lac.cells.faces import nodal_normals
from ....mechanics.fem.supports import Fixed
from ..cut_groups import CutGroups
from .holding import Holding


class RingAxis(Holding):
    """The circles of points on the axis have no radius, and keep it."""

    def __init__(self, groups: CutGroups):
        self._points = groups.points

    def fixed(
        self,
        before: Mapping[str, Fixed],  # noqa: ARG002
        name: str | None = None,  # noqa: ARG002
    ) -> dict[str, Fixed]:
        """No displacement along the radius."""
        nodes = np.flatnonzero(self._points[:, 0] == 0)
        along = np.tile(np.eye(self._points.shape[1])[0], (len(nodes), 1))
        return {"plane": Fixed(nodes, along, np.zeros(len(nodes)), "axis")}


class Imposed(Holding):
    """The displacements that supports impose."""

    def __init__(self, groups: CutGroups):
        self._groups = groups

    def fixed(
        self,
        before: Mapping[str, Fixed],  # noqa: ARG002
        name: str | None = None,
    ) -> dict[str, Fixed]:
        """One for each component of each support."""
        found = {}
        for key, support, fixed in self._each:
            mine = name is None or support == name
            found[key] = fixed if mine else replace(fixed, values=0 * fixed.values)
        return found

    @cached_property
    def _each(self) -> list[tuple[str, str, Fixed]]:
        """Key, name of the support in steps, and what is fixed."""
        groups, points = self._groups, self._groups.points
        found = []
        for i, support in enumerate(groups.case.supports):
            nodes = groups.nodes(support.group, f"supports[{i}].group")
            for direction, value in support.fix.items():
                key = f"supports[{i}].fix.{direction}"
                if direction == "normal":
                    directions = nodal_normals(points, groups.faces(support.group, key))[nodes]
                else:
                    axis = np.eye(points.shape[1])["xyz".index(direction)]
                    directions = np.tile(axis, (len(nodes), 1))
                if isinstance(value, Exact):
                    whole = groups.exact_displacement(nodes)
                    values = np.einsum("nd,nd->n", whole, directions)
                else:
                    values = groups.field(value)(points[nodes])
                fixed = Fixed(nodes, directions, values, support.group)
                found.append((key, support.name, fixed))
        return found
