"""Rigid bodies: what they hold, and how they move."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from ....case.model import Case
from ....mechanics.fem.supports import SAME, Fixed, FreeMotion, released
from ....system.errors import InputError
from ..cut_groups import CutGroups
from .frame import Frame
from .holding import Holding
from .rigid_surfaces import MIDDLE, face_nodes


class RigidBodies(Holding):
    """The rigid bodies of a case: all of their nodes are held, and move as the case says."""

    def __init__(self, groups: CutGroups):
        self._groups, self._bodies = groups, groups.case.rigid
        self.frames = {name: _frame(groups, name) for name in sorted(self._bodies)}
        nodes = [self.frames[name].nodes for name, body in self._bodies.items() if body.moves]
        if nodes:
            self.moving = np.zeros(len(groups.points), dtype=bool)
            self.moving[np.concatenate(nodes)] = True

    def fixed(self, before: Mapping[str, Fixed], name: str | None = None) -> dict[str, Fixed]:
        """All of their nodes, moved as the case imposes it; InputError where supports move them."""
        given = {key: fixed for key, fixed in before.items() if key != "plane"}
        _refuse_moved(self._groups.case, self.frames, given)
        found = {}
        for body, frame in self.frames.items():
            moved = frame.displacement(self._bodies[body].move)
            moved *= name in (None, self._bodies[body].name)
            for i, axis in enumerate(np.eye(moved.shape[1])):
                directions = np.tile(axis, (len(moved), 1))
                found[f"bodies.{body}.{'xyz'[i]}"] = Fixed(
                    frame.nodes, directions, moved[:, i], body
                )
        return found

    def link(self, free: FreeMotion) -> FreeMotion:
        """The motions that are left to those pulled by forces."""
        dim, found = self._groups.points.shape[1], []
        for name, frame in self.frames.items():
            if components := self._bodies[name].force:
                dofs = dim * frame.nodes[:, None] + np.arange(dim)
                found.append((dofs.ravel(), frame.columns(components)))
        return released(free, found)

    def force(self, name: str | None = None) -> np.ndarray:
        """Nodal forces (n, dim) of the forces and moments on them."""
        total = np.zeros_like(self._groups.points)
        for group, frame in self.frames.items():
            body = self._bodies[group]
            if body.force and name in (None, body.name):
                total[frame.nodes] += frame.forces(body.force)
        return total


def _frame(groups: CutGroups, name: str) -> Frame:
    body, nodes = groups.case.rigid[name], groups.nodes(name, f"bodies.{name}")
    places, faces = groups.points[nodes], face_nodes(groups.mesh, name)
    if body.reference is not None:
        point = groups.carried(name, np.array(body.reference) - groups.origin)
    elif body.surface:
        given = np.array(body.values[MIDDLE[body.surface]])
        point = groups.carried(name, given - groups.origin)
    else:
        own = groups.points[faces] if len(faces) else places
        point = (own.min(axis=0) + own.max(axis=0)) / 2
    arm, dim = places - point, places.shape[1]
    motions = {
        axis: np.tile(e, (len(nodes), 1)) for axis, e in zip("xyz", np.eye(dim), strict=False)
    }
    if dim == 3:
        motions |= {f"r{axis}": np.cross(e, arm) for axis, e in zip("xyz", np.eye(3), strict=True)}
    elif not groups.axisymmetric:
        motions["rz"] = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    return Frame(nodes, point, motions, without_cells=len(faces) > 0)


def _refuse_moved(case: Case, frames: Mapping[str, Frame], fixed: Mapping[str, Fixed]) -> None:
    """Refuse displacements given to rigid bodies, and supports of those that move."""
    largest = max((float(np.abs(f.values).max(initial=0)) for f in fixed.values()), default=0.0)
    for (name, frame), (key, support) in product(frames.items(), fixed.items()):
        given = support.values[np.isin(support.nodes, frame.nodes)]
        if len(given) and case.rigid[name].moves:
            allowed = f"{len(given)} of its nodes belong to the rigid body {name}, which moves by "
            allowed += f"`move` and `force` of bodies.{name} alone"
            raise InputError(case.path, key, None, allowed)
        if (np.abs(given) > SAME * largest).any():
            allowed = (
                f"given to {len(given)} nodes of the rigid body {name}, which is fixed; "
                f"allowed there: 0 (move the other body instead, or this one by bodies.{name}.move)"
            )
            value = float(given[np.abs(given).argmax()])
            raise InputError(case.path, key, value, allowed)
