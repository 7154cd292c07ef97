"""The coverage that is expected of macro-elements under pressure."""

from typing import Any

import numpy as np

from ..case.expressions import evaluate
from ..lac.cells.catalogue import cell_type
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from .norms import macro_neighbours

# Ends of warped faces, and of faces with two of them, move by up to this multiple.
_WARPED = 2.0


def expected_coverage(solution: Solution, zone: ZoneResult, reference: Any) -> np.ndarray:
    """The coverage (m,) of every macro-element: the reference's; else in full under pressure.

    Any is right that the facets of curved surfaces at a distance explain.
    """
    given: Any = solution.case.reference.values.get("coverage")
    if given is not None:
        return evaluate(given, zone.centre)
    full = np.where(1 - zone.coverage <= _passed_by(solution, zone), zone.coverage, 1.0)
    if isinstance(reference, ExactValues):
        return np.where(reference.pressure(zone) > 0, full, zone.coverage)
    return full


def _passed_by(solution: Solution, zone: ZoneResult) -> np.ndarray:
    """The largest share (m,) of macro-elements whose normals may pass the end of the master.

    Where both surfaces end on the same plane, the normal of a facet leans against the plane by
    half the angle θ to the next facet. Over a distance g it moves there by g tan(θ/2).
    """
    tangent = np.zeros(len(zone.area))
    if zone.surfaces.meshed_gap is None or zone.flat:
        return tangent
    pairs, rim = macro_neighbours(zone)
    one, other = pairs.T
    lean = np.linalg.norm(zone.normal[one] - zone.normal[other], axis=1)
    lean /= np.linalg.norm(zone.normal[one] + zone.normal[other], axis=1)
    np.maximum.at(tangent, one, lean)
    np.maximum.at(tangent, other, lean)
    moved = _WARPED * tangent * rim * np.abs(zone.surfaces.meshed_gap)
    return moved / _shortest_side(solution.mesh.points, zone)


def _shortest_side(points: np.ndarray, zone: ZoneResult) -> np.ndarray:
    """The shortest side (m,) of the sub-faces of each macro-element; in 2D the length."""
    shortest = np.full(len(zone.area), np.inf)
    for name, nodes, macro in zone.faces:
        corner = points[nodes[:, : cell_type(name).n_vertices]]
        side = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)
        np.minimum.at(shortest, macro, side.min(axis=1))
    return shortest
