"""Lines from points of the slave, along its normals, and the master faces that they meet."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...lac.cells.catalogue import CellType
from ...lac.cells.shape import shape_functions
from ...lac.facets import Facets, project_along
from ...lac.pairing import line_pairs
from ...lac.segments import area_vectors_at
from ...lac.surface_points import Samples

# A point this far outside a face, in parts of its reference face, is on its edge.
EDGE = 1e-9
# A line is looked at where it passes a face's centre within this many radii.
_MARGIN = 1.1
# The normals of a face that is curved turn by less than this, seen from its middle.
_STEEPEST = 1.5
# Pairs of a point and a master face that are looked at together.
_CHUNK = 1 << 20


def all_hits(
    slave: Facets,
    sample: Samples,
    masters: Sequence[Facets],
    reach: float,
    among: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Points of slave faces `among` (a,) that see a master face, and its distance, both (h,).

    Points are counted face by face. Each looks both ways along its normal, and sees the first
    master face there if that one looks back at it. No face is left out for how it lies as a whole.

    >>> sample = sampled(slave, (np.array([[0.5]]), np.array([1.0])))
    >>> point, gap = all_hits(slave, sample, [master], 1.0, np.array([0]))
    >>> point.tolist(), gap.tolist()
    ([0], [0.5])
    """
    normals = sample.normal.reshape(-1, sample.normal.shape[2])
    points, gaps, looks = [], [], []
    for master in masters:
        i, j = line_pairs(slave, master, reach, among)
        seen = _on_the_way(slave, master, i, j)
        hit = meet(slave, sample, master, reach, EDGE, (i[seen], j[seen]))
        slopes = shape_functions(master.type.name).gradients(hit.place)
        across = area_vectors_at(master.corner[hit.face], slopes[:, None])[:, 0]
        points.append(hit.point)
        gaps.append(hit.gap)
        looks.append(np.einsum("hd,hd->h", across, normals[hit.point]) < 0)
    point, gap, look = (np.concatenate(part) for part in (points, gaps, looks))
    order = np.lexsort((~look, np.abs(gap), gap < 0, point))
    side = 2 * point[order] + (gap[order] < 0)
    first = order[np.flatnonzero(np.diff(side, prepend=-1))]
    first = first[look[first]]
    return point[first], gap[first]


def _on_the_way(slave: Facets, master: Facets, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Which pairs (p,) a line along a normal of the slave face, which may turn, may join."""
    between = master.centre[j] - slave.centre[i]
    along = np.abs(np.einsum("pd,pd->p", between, slave.normal[i]))
    beside = np.linalg.norm(np.einsum("pd,ptd->pt", between, slave.tangents[i]), axis=1)
    spread = (along + slave.radius[i]) * np.tan(np.minimum(slave.turn[i], _STEEPEST))
    return beside <= _MARGIN * (slave.radius[i] + master.radius[j]) + spread


@dataclass(frozen=True)
class Hits:
    """Points on faces of one master block: `point` counts them face by face.

    `face` (h,) the master's, `place` (h, dim − 1) in it, `gap` (h,) along the normal, `outside`
    (h,) how far beyond its edges.
    """

    point: np.ndarray
    face: np.ndarray
    place: np.ndarray
    gap: np.ndarray
    outside: np.ndarray

    def of(self, chosen: np.ndarray) -> Self:
        """The chosen hits, by mask or numbers."""
        return type(self)(*(values[chosen] for values in vars(self).values()))


def meet(
    slave: Facets,
    sample: Samples,
    master: Facets,
    reach: float,
    beyond: float,
    pairs: tuple[np.ndarray, np.ndarray],
) -> Hits:
    """Every meeting of a point's normal with a face of the `pairs`, slave and master faces (p,).

    Within `reach`, and `beyond` the edges of the face.

    >>> sample = sampled(slave, (np.array([[0.25]]), np.array([1.0])))
    >>> hit = meet(slave, sample, master, 1.0, EDGE, (np.array([0, 0]), np.array([0, 1])))
    >>> hit.face.tolist(), hit.gap.tolist()
    ([1], [0.5])
    """
    places = np.einsum("qa,fad->fqd", sample.values, slave.corner)
    count = places.shape[1]
    step = max(1, _CHUNK // count)
    i, j = pairs
    parts = []
    for start in range(0, len(i), step):
        pair = slice(start, start + step)
        which, q = _near_line(places[i[pair]], sample.normal[i[pair]], master, j[pair], reach)
        face, partner = i[pair][which], j[pair][which]
        target, normal = places[face, q][:, None], sample.normal[face, q][:, None]
        # Seen from the point itself, where no digits are lost.
        corner = master.corner[partner] - target
        place, gap = project_along(master.type, corner, 0 * target, normal, outline=True)
        outside = _outside(master.type, place[:, 0])
        near = (outside <= beyond) & (np.abs(gap[:, 0]) <= reach)
        hit = Hits(face * count + q, partner, place[:, 0], gap[:, 0], outside)
        parts.append(hit.of(near))
    if not parts:
        none = np.empty(0, dtype=int)
        return Hits(none, none, np.empty((0, master.type.dim)), np.empty(0), np.empty(0))
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    return Hits(*map(np.concatenate, columns))


def _near_line(
    places: np.ndarray, normal: np.ndarray, master: Facets, j: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Which lines (p, q) through places along normals (p, q, dim) pass by the master faces j."""
    offset = master.centre[j][:, None] - places
    along = np.einsum("pqd,pqd->pq", offset, normal)
    across = np.einsum("pqd,pqd->pq", offset, offset) - along**2
    radius = master.radius[j][:, None] * _MARGIN
    pair, place = np.nonzero((across <= radius**2) & (np.abs(along) <= reach + radius))
    return pair, place


def _outside(kind: CellType, place: np.ndarray) -> np.ndarray:
    """How far (h,) places in the reference face lie beyond its edges, at most: < 0 inside."""
    beyond = [-place.min(axis=1)]
    beyond.append(place.sum(axis=1) - 1 if kind.n_vertices == 3 else place.max(axis=1) - 1)
    return np.maximum(*beyond)
