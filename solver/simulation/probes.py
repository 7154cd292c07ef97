"""Results at the points and nodes that a case names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..case.model import Probe
from ..mechanics.fem.locate import Located, locate
from ..system.errors import InputError
from .exact import pressure_on
from .forces import ProbeResult
from .scene import Scene
from .solution import ZoneResult

# A point is in a body, and in two of them, to this share of the model's length; and on a contact
# surface, which its faces only approximate, to the second.
_NEAR, _ON_SURFACE = 1e-6, 1e-2


def probed(
    scene: Scene, zones: Sequence[ZoneResult], displacement: np.ndarray, stress: np.ndarray
) -> dict[str, ProbeResult]:
    """The values at each probe of the case; InputError where a point is in no body, or in two."""
    found = {}
    for probe in scene.case.probes:
        if probe.zone:
            zone = next(zone for zone in zones if zone.name == probe.zone)
            found[probe.name] = _on_surface(scene, probe, zone)
            continue
        if probe.group:
            nodes = scene.probed[probe.name]
            places, moved, tensor = scene.points[nodes], displacement[nodes], stress[nodes]
        else:
            cell = _in_body(scene, probe)
            places = _at(scene, probe)
            moved, tensor = (cell.weights @ f[cell.nodes][None] for f in (displacement, stress))
        none = np.full(len(places), np.nan)
        found[probe.name] = ProbeResult(places + scene.origin, moved, tensor, none)
    return found


def _at(scene: Scene, probe: Probe) -> np.ndarray:
    """The places (k, dim) of a probe in local coordinates."""
    if probe.group:
        return scene.points[scene.probed[probe.name]]
    return np.array([probe.at]) - scene.origin


def _in_body(scene: Scene, probe: Probe) -> Located:
    """The cell that holds the point of a probe."""
    blocks = list(scene.mesh.cells.items())
    if probe.within:
        given = scene.given.groups[probe.within]
        blocks = [(name, cells[scene.mesh.members(name, given)]) for name, cells in blocks]
    found = locate(scene.points, blocks, _at(scene, probe)[0])
    inside = [one for one in found if one.distance <= _NEAR * scene.length]
    if not inside:
        allowed = f"no cell is there; the nearest is {found[0].distance:.3g} away"
        raise InputError(scene.case.path, f"probes.{probe.name}.at", list(probe.at), allowed)
    if len({scene.body[one.nodes[0]] for one in inside}) > 1:
        allowed = "bodies meet there; name the cells of one of them (within)"
        raise InputError(scene.case.path, f"probes.{probe.name}.at", list(probe.at), allowed)
    return inside[0]


def _on_surface(scene: Scene, probe: Probe, zone: ZoneResult) -> ProbeResult:
    """The contact pressure at the nearest places of the slave surface of a zone."""
    blocks = [(name, nodes) for name, nodes, _ in zone.faces]
    places = _at(scene, probe)
    pressure = np.empty(len(places))
    for i, place in enumerate(places):
        face = locate(scene.points, blocks, place)[0]
        if face.distance > _ON_SURFACE * scene.length:
            key = f"probes.{probe.name}.{'group' if probe.group else 'at'}"
            allowed = f"is {face.distance:.3g} from the slave surface of {zone.name}"
            raise InputError(scene.case.path, key, probe.group or list(probe.at), allowed)
        owner = zone.faces[face.block][2][face.number]
        at = face.nodes[None], np.array([owner]), face.reference[None]
        pressure[i] = pressure_on(scene.points + scene.origin, zone, face.type.name, *at)[0, 0]
    none = np.full((len(places), 6), np.nan)
    return ProbeResult(places + scene.origin, none[:, : places.shape[1]], none, pressure)
