"""Rigid bodies that move, and those whose surface is given by the case and not by the mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import product

import meshio
import numpy as np

from ...case.model import Case
from ...lac.cells.catalogue import BY_MESHIO, BY_NAME
from ...lac.cells.faces import surface_normals
from ...mechanics.fem.faces import FaceError, boundary_faces
from ...mechanics.fem.layer import layer, turned
from ...mechanics.fem.supports import SAME, Fixed
from ...mechanics.mortar.quadric import Quadric, ball, cylinder, parabola, plane
from ...system.errors import InputError
from .cut_groups import CutGroups
from .groups import nodes_of_volumes

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
    """The mesh with cells for each rigid body without cells.

    They carry its motion. A body whose surface the case gives has one simplex, and one face of it,
    on the surface, behind it, opposite to the middle of the slave, and as large. A group of faces
    without cells behind them gets a thin layer. All other faces without cells are left out.
    """
    attached = nodes_of_volumes(mesh)
    for name, body in case.rigid.items():
        if body.surface:
            mesh = _with_simplex(case, mesh, name)
        elif not attached.all():
            mesh = _with_layer(case, mesh, name, attached)
    return mesh if attached.all() else _without_loose(mesh)


def _without_loose(mesh: meshio.Mesh) -> meshio.Mesh:
    """The mesh without the nodes of no volume cell, and the faces and edges on them."""
    attached = nodes_of_volumes(mesh)
    new = np.cumsum(attached) - 1
    kept = [attached[block.data].all(axis=1) for block in mesh.cells]
    place = [np.cumsum(k) - 1 for k in kept]
    sets = {
        name: [at[i[k[i]]] for i, k, at in zip(_whole(parts), kept, place, strict=True)]
        for name, parts in mesh.cell_sets.items()
    }
    return meshio.Mesh(
        mesh.points[attached],
        [(block.type, new[block.data[k]]) for block, k in zip(mesh.cells, kept, strict=True)],
        point_sets={name: new[i[attached[i]]] for name, i in mesh.point_sets.items()},
        cell_sets=sets,
    )


def _whole(parts: Iterable[np.ndarray]) -> list[np.ndarray]:
    return [np.asarray(part, dtype=int) for part in parts]


def _with_layer(case: Case, mesh: meshio.Mesh, name: str, attached: np.ndarray) -> meshio.Mesh:
    """The mesh with a layer of cells behind the faces of a group that have none."""
    dim, faces = mesh.points.shape[1], {}
    for block, part in zip(mesh.cells, _whole(mesh.cell_sets.get(name, [])), strict=False):
        kind = BY_MESHIO[block.type]
        if kind.dim == dim - 1 and len(part) and not attached[block.data[part]].any():
            faces[kind.name] = block.data[part]
    if not faces:
        return mesh
    key = f"bodies.{name}"
    if name not in {side for zone in case.zones for side in (zone.slave, zone.master)}:
        allowed = "has no cells and is the master of no contact zone"
        raise InputError(case.path, key, name, allowed)
    outward = turned(mesh.points, faces, _slave_normals(case, mesh, name))
    if outward is None:
        raise InputError(case.path, key, name, "its surface has one side only")
    more, cells = layer(mesh.points, outward)
    if case.axisymmetric:
        more[:, 0] = np.abs(more[:, 0])
    points = np.vstack([mesh.points, more])
    return _with_cells(mesh, points, name, {BY_NAME[k].meshio: c for k, c in cells.items()})


def _slave_normals(case: Case, mesh: meshio.Mesh, name: str) -> np.ndarray:
    """The nodes (k, dim) of the faces that meet a body, each with its normal (k, dim)."""
    found = [np.hstack([mesh.points.mean(axis=0), np.zeros(mesh.points.shape[1])])[None]]
    for zone in case.zones:
        other = {zone.slave: zone.master, zone.master: zone.slave}.get(name, "")
        if other not in mesh.cell_sets:
            continue
        try:
            faces = boundary_faces(mesh, other)
        except FaceError as error:
            raise InputError(case.path, "contact", other, str(error)) from None
        normals = surface_normals(mesh.points, faces)
        used = np.flatnonzero(normals.any(axis=1))
        found.append(np.hstack([mesh.points[used], normals[used]]))
    return np.concatenate(found[1:] or found)


def _with_simplex(case: Case, mesh: meshio.Mesh, name: str) -> meshio.Mesh:
    if name in {*mesh.cell_sets, *mesh.point_sets}:
        allowed = "the mesh has a group of this name; give the body another one"
        raise InputError(case.path, f"bodies.{name}", None, allowed)
    first, dim = len(mesh.points), mesh.points.shape[1]
    corners = _simplex(case, name, mesh.points[_opposite(case, mesh, name)])
    nodes = first + np.arange(dim + 1)
    volume, face = ("triangle", "tetra")[dim - 2], ("line", "triangle")[dim - 2]
    points = np.vstack([mesh.points, corners])
    return _with_cells(mesh, points, name, {volume: nodes[None], face: nodes[None, :dim]})


def _with_cells(
    mesh: meshio.Mesh, points: np.ndarray, name: str, added: Mapping[str, np.ndarray]
) -> meshio.Mesh:
    """The mesh with cells by type added, in the group of that name too."""
    none = np.empty(0, dtype=int)
    cells = {block.type: block.data for block in mesh.cells}
    sets = {g: dict(zip(cells, _whole(parts), strict=True)) for g, parts in mesh.cell_sets.items()}
    mine = sets.setdefault(name, {})
    for kind, new in added.items():
        data = cells.get(kind, np.empty((0, new.shape[1]), dtype=int))
        mine[kind] = np.r_[mine.get(kind, none), len(data) + np.arange(len(new))]
        cells[kind] = np.vstack([data, new])
    return meshio.Mesh(
        points,
        list(cells.items()),
        point_sets=mesh.point_sets,
        cell_sets={group: [of.get(kind, none) for kind in cells] for group, of in sets.items()},
    )


def _opposite(case: Case, mesh: meshio.Mesh, name: str) -> np.ndarray:
    """The nodes of the faces that meet the body; all nodes if no face does."""
    slaves = {s for z in case.zones if name in (z.slave, z.master) for s in (z.slave, z.master)}
    nodes = np.concatenate([_face_nodes(mesh, group) for group in sorted(slaves)])
    return nodes if len(nodes) else np.arange(len(mesh.points))


def _face_nodes(mesh: meshio.Mesh, group: str) -> np.ndarray:
    """The nodes (k,) of the faces of a group."""
    found = [np.empty(0, dtype=int)]
    for block, part in zip(mesh.cells, _whole(mesh.cell_sets.get(group, [])), strict=False):
        if BY_MESHIO[block.type].dim == mesh.points.shape[1] - 1:
            found.append(block.data[part].ravel())
    return np.unique(np.concatenate(found))


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
    base = np.vstack([np.zeros(dim), sides])
    if not case.axisymmetric:
        base -= base.mean(axis=0)
    corners = middle - gap * out + size * np.vstack([base, -out])
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


def frames_of(groups: CutGroups) -> dict[str, Frame]:
    """The rigid bodies of a case by name."""
    return {name: _frame(groups, name) for name in sorted(groups.case.rigid)}


def _frame(groups: CutGroups, name: str) -> Frame:
    body, nodes = groups.case.rigid[name], groups.nodes(name, f"bodies.{name}")
    places = groups.points[nodes]
    if body.reference is not None:
        point = np.array(body.reference) - groups.origin
    elif body.surface:
        point = np.array(body.values[_MIDDLE[body.surface]]) - groups.origin
    else:
        faces = _face_nodes(groups.mesh, name)
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


def held(case: Case, frames: Mapping[str, Frame]) -> dict[str, Fixed]:
    """What rigid bodies hold, by key: all of their nodes, moved as the case imposes it."""
    found = {}
    for name, frame in frames.items():
        moved = frame.displacement(case.rigid[name].move)
        for i, axis in enumerate(np.eye(moved.shape[1])):
            directions = np.tile(axis, (len(moved), 1))
            found[f"bodies.{name}.{'xyz'[i]}"] = Fixed(frame.nodes, directions, moved[:, i])
    return found


def refuse_moved(case: Case, frames: Mapping[str, Frame], fixed: Mapping[str, Fixed]) -> None:
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


def free_motions(
    groups: CutGroups, frames: Mapping[str, Frame]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """The motions that rigid bodies are free in: degrees of freedom (m,), columns (m, k)."""
    dim, found = groups.points.shape[1], []
    for name, frame in frames.items():
        if free := groups.case.rigid[name].force:
            dofs = dim * frame.nodes[:, None] + np.arange(dim)
            found.append((dofs.ravel(), frame.columns(free)))
    return found


def forces(groups: CutGroups, frames: Mapping[str, Frame], name: str | None = None) -> np.ndarray:
    """Nodal forces (n, dim) of the forces and moments on rigid bodies, or of the named ones."""
    total = np.zeros_like(groups.points)
    for group, frame in frames.items():
        body = groups.case.rigid[group]
        if body.force and name in (None, body.name):
            total[frame.nodes] += frame.forces(body.force)
    return total


def moving_nodes(groups: CutGroups, frames: Mapping[str, Frame]) -> np.ndarray:
    """Which nodes (n,) belong to rigid bodies that move."""
    found = np.zeros(len(groups.points), dtype=bool)
    for name, frame in frames.items():
        if groups.case.rigid[name].moves:
            found[frame.nodes] = True
    return found
