"""Rigid surfaces that the case gives, not the mesh, and the cells that carry their motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import meshio
import numpy as np

from ....case.model import Case
from ....lac.cells.catalogue import BY_MESHIO, BY_NAME
from ....lac.cells.faces import surface_normals
from ....mechanics.fem.faces import FaceError, boundary_faces
from ....mechanics.fem.layer import layer, turned
from ....mechanics.mortar.quadric import Quadric, ball, cylinder, parabola, plane
from ....system.errors import InputError
from ..groups import members_of

_SHAPES: dict[str, Callable[..., Quadric]] = {
    "plane": plane,
    "sphere": ball,
    "cylinder": cylinder,
    "parabola": parabola,
}
MIDDLE = {"plane": "point", "sphere": "centre", "cylinder": "point", "parabola": "point"}
"""Its reference point, if the case gives none."""


def quadric_of(case: Case, name: str, origin: np.ndarray) -> Quadric | None:
    """The surface of a rigid body without cells, in coordinates from `origin` (dim,)."""
    body = case.rigid.get(name)
    if body is None or not body.surface:
        return None
    given = {
        key: np.array(value) if isinstance(value, tuple) else value
        for key, value in body.values.items()
    }
    place = given.pop(MIDDLE[body.surface]) - origin
    return _SHAPES[body.surface](place, **given)


def with_rigid_surfaces(case: Case, mesh: meshio.Mesh, attached: np.ndarray) -> meshio.Mesh:
    """The mesh with cells for each rigid body without cells.

    They carry its motion. A body whose surface the case gives has one simplex, and one face of it,
    on the surface, behind it, opposite to the middle of the slave, and as large. A group of faces
    without cells behind them gets a thin layer. `attached` (n,): nodes of volume cells.
    """
    for name, body in case.rigid.items():
        if body.surface:
            mesh = _with_simplex(case, mesh, name)
        elif not attached.all():
            mesh = _with_layer(case, mesh, name, attached)
    return mesh


def _with_layer(case: Case, mesh: meshio.Mesh, name: str, attached: np.ndarray) -> meshio.Mesh:
    """The mesh with a layer of cells behind the faces of a group that have none."""
    dim, faces = mesh.points.shape[1], {}
    for block, part in zip(mesh.cells, members_of(mesh.cell_sets.get(name, [])), strict=False):
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
    sets = {
        g: dict(zip(cells, members_of(parts), strict=True)) for g, parts in mesh.cell_sets.items()
    }
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
    nodes = np.concatenate([face_nodes(mesh, group) for group in sorted(slaves)])
    return nodes if len(nodes) else np.arange(len(mesh.points))


def face_nodes(mesh: meshio.Mesh, group: str) -> np.ndarray:
    """The nodes (k,) of the faces of a group."""
    found = [np.empty(0, dtype=int)]
    for block, part in zip(mesh.cells, members_of(mesh.cell_sets.get(group, [])), strict=False):
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
