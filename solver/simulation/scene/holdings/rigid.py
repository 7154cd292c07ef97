"""Rigid bodies: their frames, what they hold, and how they move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from ....case.model import Case
from ....mechanics.fem.supports import SAME, Fixed, FreeMotion, released
from ....system.errors import InputError
from ..cut_groups import CutGroups
from .holding import Holding
from .rigid_surfaces import MIDDLE, face_nodes


@dataclass(frozen=True)
class Frame:
    """A rigid body as it moves: its `nodes` (n,), and the unit motions (n, dim) there by component.

    Components are x, y, z and the turns rx, ry, rz by one radian about the reference `point`
    (dim,).
    """

    nodes: np.ndarray
    point: np.ndarray
    motions: dict[str, np.ndarray]

    def columns(self, keys: Iterable[str]) -> np.ndarray:
        """The motions (n · dim, k) of k components."""
        return np.stack([self.motions[key].ravel() for key in keys], axis=1)

    @property
    def _scaled(self) -> tuple[np.ndarray, np.ndarray]:
        columns = self.columns(self.motions)
        size = np.linalg.norm(columns, axis=0)
        return columns / size, size

    def displacement(self, amount: Mapping[str, float]) -> np.ndarray:
        """The displacement (n, dim) of a motion by component."""
        parts = (value * self.motions[key] for key, value in amount.items())
        return sum(parts, np.zeros_like(self.motions["x"]))

    def amount(self, displacement: np.ndarray) -> dict[str, float]:
        """The motion by component that nodes have with a displacement (n, dim)."""
        columns, size = self._scaled
        found = np.linalg.lstsq(columns, displacement.ravel())[0] / size
        return dict(zip(self.motions, found.tolist(), strict=True))

    def forces(self, resultant: Mapping[str, float]) -> np.ndarray:
        """The smallest forces (n, dim) at the nodes with a force and moment by component."""
        columns, size = self._scaled
        wanted = np.array([resultant.get(key, 0.0) for key in self.motions]) / size
        return np.linalg.lstsq(columns.T, wanted)[0].reshape(len(self.nodes), -1)

    def resultant(self, forces: np.ndarray) -> dict[str, float]:
        """Force and moment by component of forces (n, dim) at the nodes."""
        found = self.columns(self.motions).T @ forces.ravel()
        return dict(zip(self.motions, found.tolist(), strict=True))


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
    places = groups.points[nodes]
    if body.reference is not None:
        point = groups.carried(name, np.array(body.reference) - groups.origin)
    elif body.surface:
        given = np.array(body.values[MIDDLE[body.surface]])
        point = groups.carried(name, given - groups.origin)
    else:
        faces = face_nodes(groups.mesh, name)
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
    return Frame(nodes, point, motions)


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
