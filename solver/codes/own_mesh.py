"""A result on a mesh of its own as a solution there: for error norms and contact forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import meshio
import numpy as np

from ..lac.cells.catalogue import cell_type
from ..lac.cells.faces import FACE_POINTS, right_side_out, surface_points, surface_vectors
from ..lac.cells.quadrature import gauss_rule
from ..mechanics.fem.faces import outer_faces
from ..simulation.results.exact import computed_pressure
from ..simulation.results.solution import NodalContact, Solution, ZoneResult
from .contact import SurfaceValues
from .model import Model
from .placing import Placed


def own_solution(
    model: Model,
    mesh: meshio.Mesh,
    body: np.ndarray,
    placed: Mapping[str, Placed],
    pressures: list[SurfaceValues],
) -> Solution | None:
    """The solution on the result's own cells; None where these do not fill the dimension.

    Values that are not given at all nodes are NaN, zones without a pressure at nodes are left out.
    """
    dim = model.dim
    blocks = [(b.type, b.data) for b in mesh.cells if cell_type(b.type).dim == dim]
    if not blocks or model.rigid.any() or (body < 0).any():
        return None
    points = mesh.points[:, :dim]
    turned = [(name, right_side_out(points, data, cell_type(name))[0]) for name, data in blocks]
    cells = meshio.Mesh(points, turned)
    frame, n = model.solution, len(points)
    faces = list(outer_faces(cells))
    zones = [zone for s in pressures if (zone := _zone(points, faces, s, model)) is not None]
    fields = {"displacement": np.full((n, dim), np.nan), "stress": np.full((n, 6), np.nan)}
    for name, values in fields.items():
        if name in placed and placed[name].own is not None:
            values[placed[name].own] = placed[name].values
    return replace(frame, mesh=cells, body=body, zones=zones, **fields)  # type: ignore[arg-type]


def _zone(
    points: np.ndarray,
    faces: list[tuple[str, np.ndarray]],
    surface: SurfaceValues,
    model: Model,
) -> ZoneResult | None:
    """The zone on the outer faces all of whose vertices have a pressure; None without one."""
    own = surface.placed.own
    if own is None:
        return None
    value = np.full(len(points), np.nan)
    value[own] = surface.placed.values
    found, first = [], 0
    for kind, nodes in faces:
        corners = nodes[:, : cell_type(kind).n_vertices]
        mine = nodes[np.isfinite(value[corners]).all(axis=1)]
        if len(mine):
            found.append((kind, mine, np.arange(first, first := first + len(mine))))
    if not first:
        return None
    known = np.flatnonzero(np.isfinite(value))
    pressure = value[known]
    at = surface_points(points, found, model.case.axisymmetric)
    nodes = np.unique(np.concatenate([f[1].ravel() for f in found]))
    none = np.zeros(first)
    nodal = NodalContact(known, pressure, np.zeros(len(known)), pressure > 0)
    zone = replace(
        surface.zone,
        faces=found,
        centre=np.stack([at.means(x) for x in at.place.T], axis=1),
        normal=np.concatenate([_normals(points, *face[:2]) for face in found]),
        area=np.bincount(at.macro, at.weight),
        gap=none,
        closed=none > 0,
        coverage=np.ones(first),
        slave_nodes=nodes,
        stress_slave=np.full(len(nodes), np.nan),
        nodal=nodal,
    )
    return replace(zone, multiplier=at.means(computed_pressure(points, zone)))


def _normals(points: np.ndarray, kind: str, nodes: np.ndarray) -> np.ndarray:
    """Unit normals (n, dim) of faces."""
    reference, weights = gauss_rule(kind, FACE_POINTS)
    vectors = surface_vectors(points, nodes, kind, reference)[1]
    total = (vectors * weights[:, None]).sum(axis=1)
    return total / np.linalg.norm(total, axis=1, keepdims=True)
