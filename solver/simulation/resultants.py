"""Resultants of contact in a zone: edge, area, force and moment."""

import numpy as np

from ..lac.cells.faces import surface_points
from ..lac.reconstruction import vertex_neighbours
from ..mechanics.mortar.edge import Edges, contact_edges
from .balance import moment
from .equilibrium import Equilibrium
from .forces import Resultants
from .recovery import RecoveredZone
from .scene import Scene, ZoneScene


def resultants(
    scene: Scene,
    zone: ZoneScene,
    state: Equilibrium,
    closed: np.ndarray,
    field: RecoveredZone | None,
) -> Resultants:
    """Area and edges of the `closed` macro-elements (m,), and the forces on the slave."""
    mean = zone.by_macro_element(state.pressure)
    edges, area = _extent(scene, zone, mean, closed)
    forces = zone.forces(state.pressure)
    if field is not None:
        forces = forces + field.force
    nodes = np.unique(np.concatenate([f.nodes.ravel() for f in zone.sub_faces]))
    force = forces.reshape(scene.points.shape)[nodes]
    return Resultants(
        area=area,
        force=force.sum(axis=0),
        moment=moment(scene, nodes, force),
        edges=edges,
        pressure=np.array([mean.min(), mean.max()]),
        **_friction(scene, zone, state, mean, nodes),
    )


def _friction(
    scene: Scene, zone: ZoneScene, state: Equilibrium, mean: np.ndarray, nodes: np.ndarray
) -> dict[str, np.ndarray]:
    """The force of friction on the slave, and the area that sticks; nothing without friction.

    What the traction leaves of the bound, μp − |q|, ends where slip begins, as a pressure ends
    where contact does: the edge of the sticking area is found in the same way.
    """
    if not zone.slips or state.friction is None:
        return {}
    forces = zone.tangential_forces(state.pressure).reshape(scene.points.shape)
    traction = np.linalg.norm([state.pressure[rows] for rows in zone.slips], axis=0)
    sticks = state.status.closed[zone.numbers] & ~state.friction.slipping[zone.numbers]
    rest = np.where(sticks, zone.zone.friction * mean - traction, 0.0)
    _, area = _extent(scene, zone, rest, sticks)
    return {"friction": forces[nodes].sum(axis=0), "stick": area}


def _extent(
    scene: Scene, zone: ZoneScene, mean: np.ndarray, closed: np.ndarray
) -> tuple[Edges | None, np.ndarray]:
    """The edges of contact in 2D, and the area of contact with its bounds (3,)."""
    surface = zone.operator.surface
    faces = [(b.number, b.nodes[:, : b.type.n_vertices]) for b in zone.slave_faces]
    if scene.points.shape[1] == 2:
        ends = np.empty((len(closed), 2), dtype=int)
        for number, nodes in faces:
            ends[number] = nodes
        # Where multipliers belong to nodes, means of macro-elements are no resultants of theirs.
        whole = surface.covered / surface.area * (zone.operator.nodes is None)
        points = scene.points + scene.origin
        around = scene.case.axisymmetric
        at = surface_points(points, [(b.type.name, b.nodes, b.number) for b in zone.slave_faces])
        length = np.bincount(at.macro, at.weight)
        edges = contact_edges(points, ends, length, whole, mean, closed, around)
        return edges, surface.covered[closed].sum() + edges.lengths.sum(axis=0)
    if closed.all() or not closed.any():
        return None, np.full(3, surface.covered[closed].sum())
    near = vertex_neighbours(faces, len(closed)).astype(int)
    inside, around = closed & (near @ ~closed == 0), closed | (near @ closed > 0)
    return None, np.array([surface.covered[chosen].sum() for chosen in (closed, inside, around)])
