"""Recovery in the results of a zone: the pressure p* that its constants stand for."""

from dataclasses import replace

import numpy as np

from ...lac.cells.faces import surface_nodes
from ..equilibrium.state import Equilibrium
from ..scene.scene import Scene, ZoneScene
from .solution import RecoveredPressure


def recovered_pressure(
    scene: Scene, zone: ZoneScene, state: Equilibrium
) -> RecoveredPressure | None:
    """The recovered pressure of a zone, and its mean at each node over the faces around."""
    field = state.fields.get(zone.zone.name)
    if field is None or field.form == "none":
        return None
    local, pressure = field.local, state.pressure[zone.numbers]
    nodes = surface_nodes(zone.sub_faces)
    found = RecoveredPressure(
        form=field.form,
        coefficients=field.coefficients.reshape(len(pressure), -1),
        degree=field.degree,
        centre=local.centre + scene.coordinates.origin,
        axes=local.axes,
        spread=local.spread,
        nodes=nodes,
        at_nodes=np.zeros(len(nodes)),
    )
    total, count = np.zeros((2, len(nodes)))
    for faces in zone.sub_faces:
        places = scene.points[faces.nodes] + scene.coordinates.origin
        at = np.searchsorted(nodes, faces.nodes)
        np.add.at(total, at, found.values(pressure, faces.macro, places))
        np.add.at(count, at, 1.0)
    return replace(found, at_nodes=total / count)
