"""Friction in the results of a zone: traction, slip and status, its force, the area that sticks."""

from dataclasses import replace

import numpy as np

from ...lac.cells.faces import surface_nodes
from ...lac.facets import tangents_of
from ..equilibrium.state import Equilibrium
from ..scene.scene import Scene, ZoneScene
from .balance import extent
from .forces import Resultants
from .solution import ZoneFriction


def zone_friction(zone: ZoneScene, state: Equilibrium) -> ZoneFriction:
    """Traction, slip and status of a zone."""
    assert state.friction is not None
    tangents = tangents_of(zone.operator.surface.normal)

    def in_space(values: np.ndarray) -> np.ndarray:
        return np.einsum("mkd,km->md", tangents, np.array([values[rows] for rows in zone.slips]))

    closed, recovered = state.status.closed[zone.numbers], None
    if (field := state.fields.get(zone.zone.name)) and len(field.tractions):
        coefficients = -np.array(field.tractions).reshape(len(zone.slips), len(closed), -1)
        recovered = np.einsum("mtd,tmk->mkd", tangents, coefficients)
    return ZoneFriction(
        friction_traction=in_space(-state.pressure),
        slip=in_space(state.gap),
        slip_total=in_space(state.friction.total),
        status=closed.astype(int) + (closed & state.friction.slipping[zone.numbers]),
        recovered=recovered,
    )


def with_friction(
    found: Resultants, scene: Scene, zone: ZoneScene, state: Equilibrium
) -> Resultants:
    """The resultants of a zone with the force of friction on the slave, and the area that sticks.

    What the traction leaves of the bound, μp − |q|, ends where slip begins, as a pressure ends
    where contact does: the edge of the sticking area is found in the same way.
    """
    assert state.friction is not None
    forces = zone.tangential_forces(state.pressure).reshape(scene.points.shape)
    traction = np.linalg.norm([state.pressure[rows] for rows in zone.slips], axis=0)
    sticks = state.status.closed[zone.numbers] & ~state.friction.slipping[zone.numbers]
    bound = zone.zone.friction * zone.by_macro_element(state.pressure)
    _, area = extent(scene, zone, np.where(sticks, bound - traction, 0.0), sticks)
    force = forces[surface_nodes(zone.sub_faces)].sum(axis=0)
    return replace(found, friction=force, stick=area)
