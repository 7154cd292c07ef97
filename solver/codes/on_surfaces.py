"""Which slave surfaces, and which of their faces, the places of a foreign result are on."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from ..lac.cells.faces import surface_points
from ..mechanics.fem.locate import locate
from ..simulation.results.solution import ZoneResult
from .model import Model
from .placing import NEAR, Placed
from .surface_cells import SurfaceCells

# How far from the faces of the case, over their size, a curved surface of another mesh may be.
_SAGITTA = 0.02


def faces_at(model: Model, zone: ZoneResult, places: np.ndarray) -> np.ndarray | None:
    """The slave face (m,) that each place is the middle of; None where they are not these."""
    for middle in model.middles(zone):
        far, face = cKDTree(middle).query(places)
        each = len(np.unique(face)) == len(face) == len(middle)
        if each and (far < NEAR * model.length).all():
            return np.asarray(face)
    return None


def where_zones_meet(model: Model, number: int, places: np.ndarray) -> np.ndarray:
    """Which places (k,) of a zone are on another one too: a reference has one value there."""
    found = np.zeros(len(places), dtype=bool)
    for zone in (zone for i, zone in enumerate(model.solution.zones) if i != number):
        here = np.flatnonzero(_is_on(model, zone, places))
        if len(here):
            at = locate(model.points, zone.faces_of("slave"), places[here]).nearest
            found[here] |= at.distance < NEAR * model.length
    return found


def on_zones(model: Model, placed: Placed, sides: SurfaceCells | None) -> np.ndarray:
    """Which slave surfaces each place is on (zones, k): the nearest, and all of a common node."""
    zones = model.solution.zones
    away = np.full((len(zones), len(placed.places)), np.inf)
    for number, zone in enumerate(zones):
        nodes = zone.surfaces.slave_nodes
        mine = (placed.body < 0) | np.isin(placed.body, model.body[nodes])
        apart = _apart(model, zone, placed.places)
        if sides is not None:
            on = sides.on(partial(_is_on, model, zone))
            away[number] = np.where(mine & on, apart, np.inf)
            continue
        # Without numbers a place may be at a node of the other side by chance.
        named, here = placed.node >= 0 if placed.numbered else False, np.isin(placed.node, nodes)
        if not placed.numbered:
            beside, _ = cKDTree(model.points[nodes]).query(placed.places)
            here |= beside < NEAR * model.length
        known = np.where(here, 0.0, np.where(named, np.inf, apart))
        away[number] = np.where(mine | ~np.asarray(placed.numbered), known, np.inf)
    return np.isfinite(away) & (away <= away.min(axis=0, initial=np.inf))


def _is_on(model: Model, zone: ZoneResult, places: np.ndarray) -> np.ndarray:
    """Which places (k,) are on a slave surface."""
    return np.isfinite(_apart(model, zone, places))


def _apart(model: Model, zone: ZoneResult, places: np.ndarray) -> np.ndarray:
    """How far (k,) places on a slave surface are from points of its faces; infinite elsewhere."""
    at = surface_points(model.points, zone.faces)
    apart, near = cKDTree(at.place).query(places)
    face = at.macro[near]
    size = model.face_size(zone)[face]
    across = np.abs(np.einsum("kd,kd->k", places - at.place[near], zone.normal[face]))
    middles = np.concatenate(model.middles(zone))
    middle = cKDTree(middles).query(places)[0] < NEAR * model.length
    on = middle | ((across < _SAGITTA * size) & (apart < size))
    return np.where(on, np.where(middle, 0.0, apart), np.inf)
