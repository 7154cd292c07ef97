"""Rigid bodies that move, and those whose surface is given by the case and not by the mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import meshio
import numpy as np

from ..case.model import Case
from ..mechanics.fem.supports import SAME, Fixed
from ..mechanics.mortar.quadric import Quadric, ball, cylinder, parabola, plane
from ..mesh.catalogue import BY_MESHIO
from ..system.errors import InputError

if TYPE_CHECKING:
    from .attributes import Attributes

_SHAPES: dict[str, Callable[..., Quadric]] = {
    "plane": plane,
    "sphere": ball,
    "cylinder": cylinder,
    "parabola": parabola,
}
# Its reference point, if the case gives none.
_MIDDLE = {"plane": "point", "sphere": "centre", "cylinder": "point", "parabola": "point"}


def quadric_of(case: Case, name: str, origin: np.ndarray) -> Quadric | None:
    """The surface of a rigid body without cells, in coordinates from `origin` (dim,)."""
    body = case.rigid.get(name)
    if body is None or not body.surface:
        return None
    given = {
        key: np.array(value) if isinstance(value, tuple) else value
        for key, value in body.values.items()
    }
    place = given.pop(_MIDDLE[body.surface]) - origin
    return _SHAPES[body.surface](place, **given)


def with_rigid_surfaces(case: Case, mesh: meshio.Mesh) -> meshio.Mesh:
    """The mesh with one simplex, and one face of it, for each rigid body without cells.

    They carry the motion of the body; the contact is that of its surface. The simplex is on the
    surface, behind it, opposite to the middle of the slave, and as large.
    """
    for name, body in case.rigid.items():
        if body.surface:
            mesh = _with_simplex(case, mesh, name)
    return mesh


def _with_simplex(case: Case, mesh: meshio.Mesh, name: str) -> meshio.Mesh:
    if name in {*mesh.cell_sets, *mesh.point_sets}:
        allowed = "the mesh has a group of this name; give the body another one"
        raise InputError(case.path, f"bodies.{name}", None, allowed)
    first, dim = len(mesh.points), mesh.points.shape[1]
    corners = _simplex(case, name, mesh.points[_opposite(case, mesh, name)])
    nodes = first + np.arange(dim + 1)
    added = {("triangle", "tetra")[dim - 2]: nodes, ("line", "triangle")[dim - 2]: nodes[:dim]}
    cells = {block.type: block.data for block in mesh.cells}
    sets = {group: dict(zip(cells, parts, strict=True)) for group, parts in mesh.cell_sets.items()}
    sets[name] = {}
    for kind, cell in added.items():
        data = cells.get(kind, np.empty((0, len(cell)), dtype=int))
        sets[name][kind] = np.array([len(data)])
        cells[kind] = np.vstack([data, cell])
    none = np.empty(0, dtype=int)
    return meshio.Mesh(
        np.vstack([mesh.points, corners]),
        list(cells.items()),
        point_sets=mesh.point_sets,
        cell_sets={group: [of.get(kind, none) for kind in cells] for group, of in sets.items()},
    )


def _opposite(case: Case, mesh: meshio.Mesh, name: str) -> np.ndarray:
    """The nodes of the faces that meet the body; all if there are none."""
    slaves = {s for z in case.zones if name in (z.slave, z.master) for s in (z.slave, z.master)}
    found = [np.empty(0, dtype=int)]
    for group in slaves & mesh.cell_sets.keys():
        for block, members in zip(mesh.cells, mesh.cell_sets[group], strict=True):
            if BY_MESHIO[block.type].dim == mesh.points.shape[1] - 1:
                found.append(block.data[np.asarray(members, dtype=int)].ravel())
    nodes = np.unique(np.concatenate(found))
    return nodes if len(nodes) else np.arange(len(mesh.points))


def _simplex(case: Case, name: str, slave: np.ndarray) -> np.ndarray:
    """Corners (dim + 1, dim) of a simplex on the surface, opposite to slave nodes (n, dim)."""
    dim, middle = slave.shape[1], slave.mean(axis=0)
    size = float(np.ptp(slave, axis=0).max())
    surface = quadric_of(case, name, np.zeros(dim))
    assert surface is not None
    out = surface.gradient(middle)
    if case.axisymmetric:  # no corner beyond the axis
        out = np.array([0.0, out[1]])
    length = float(np.linalg.norm(out))
    out = out / length if length > 0 else np.eye(dim)[-1]
    gap, _ = surface.distance(middle, -out)
    sides = np.linalg.svd(out[None])[2][1:]
    sides *= np.where(sides.sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    corners = middle - gap * out + size * np.vstack([np.zeros(dim), sides, -out])
    if np.linalg.det(corners[1:] - corners[0]) < 0:
        corners[:2] = corners[1::-1]
    return corners


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


def frames_of(groups: Attributes) -> dict[str, Frame]:
    """The rigid bodies of a case by name."""
    return {name: _frame(groups, name) for name in sorted(groups.case.rigid)}


def _frame(groups: Attributes, name: str) -> Frame:
    body, nodes = groups.case.rigid[name], groups.nodes(name, f"bodies.{name}")
    places = groups.points[nodes]
    if body.reference is not None:
        point = np.array(body.reference) - groups.origin
    elif body.surface:
        point = np.array(body.values[_MIDDLE[body.surface]]) - groups.origin
    else:
        point = (places.min(axis=0) + places.max(axis=0)) / 2
    arm, dim = places - point, places.shape[1]
    motions = {
        axis: np.tile(e, (len(nodes), 1)) for axis, e in zip("xyz", np.eye(dim), strict=False)
    }
    if dim == 3:
        motions |= {f"r{axis}": np.cross(e, arm) for axis, e in zip("xyz", np.eye(3), strict=True)}
    elif not groups.axisymmetric:
        motions["rz"] = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    return Frame(nodes, point, motions)


def held(groups: Attributes) -> dict[str, Fixed]:
    """What rigid bodies hold, by key: all of their nodes, moved as the case imposes it."""
    found = {}
    for name, frame in groups.frames.items():
        moved = frame.displacement(groups.case.rigid[name].move)
        for i, axis in enumerate(np.eye(moved.shape[1])):
            directions = np.tile(axis, (len(moved), 1))
            found[f"bodies.{name}.{'xyz'[i]}"] = Fixed(frame.nodes, directions, moved[:, i])
    return found


def refuse_moved(groups: Attributes, fixed: Mapping[str, Fixed]) -> None:
    """Refuse displacements given to rigid bodies, and supports of those that move."""
    largest = max((float(np.abs(f.values).max(initial=0)) for f in fixed.values()), default=0.0)
    for (name, frame), (key, support) in product(groups.frames.items(), fixed.items()):
        given = support.values[np.isin(support.nodes, frame.nodes)]
        if len(given) and groups.case.rigid[name].moves:
            allowed = f"{len(given)} of its nodes belong to the rigid body {name}, which moves by "
            allowed += f"`move` and `force` of bodies.{name} alone"
            raise InputError(groups.case.path, key, None, allowed)
        if (np.abs(given) > SAME * largest).any():
            allowed = (
                f"given to {len(given)} nodes of the rigid body {name}, which is fixed; "
                f"allowed there: 0 (move the other body instead, or this one by bodies.{name}.move)"
            )
            value = float(given[np.abs(given).argmax()])
            raise InputError(groups.case.path, key, value, allowed)


def free_motions(groups: Attributes) -> list[tuple[np.ndarray, np.ndarray]]:
    """The motions that rigid bodies are free in: degrees of freedom (m,), columns (m, k)."""
    dim, found = groups.points.shape[1], []
    for name, frame in groups.frames.items():
        if free := groups.case.rigid[name].force:
            dofs = dim * frame.nodes[:, None] + np.arange(dim)
            found.append((dofs.ravel(), frame.columns(free)))
    return found


def forces(groups: Attributes, name: str | None = None) -> np.ndarray:
    """Nodal forces (n, dim) of the forces and moments on rigid bodies, or of those of a `name`."""
    total = np.zeros_like(groups.points)
    for group, frame in groups.frames.items():
        body = groups.case.rigid[group]
        if body.force and name in (None, body.name):
            total[frame.nodes] += frame.forces(body.force)
    return total


def moving_nodes(groups: Attributes) -> np.ndarray:
    """Which nodes (n,) belong to rigid bodies that move."""
    found = np.zeros(len(groups.points), dtype=bool)
    for name, frame in groups.frames.items():
        if groups.case.rigid[name].moves:
            found[frame.nodes] = True
    return found
