"""Whether a contact pressure oscillates, found without a reference.

A smooth pressure differs from the trend of its neighbours by little, and neighbours differ by the
same sign. Where it oscillates, they differ by opposite signs. The trend at a macro-element is the
linear least squares fit to others within half a master face, because the facets of a master that
is coarser than the slave are the cause of most oscillations (docs/slave-and-master.md). A contact
area that the facets break into spots smaller than themselves is the same fault in an extreme form.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..lac.cells.catalogue import cell_type
from ..lac.facets import tangents_of
from ..lac.reconstruction import vertex_neighbours
from ..simulation.equilibrium.state import stress_of_motion
from ..simulation.results.solution import Solution, ZoneResult
from .norms import macro_neighbours

LIMIT = 0.04
"""A pressure whose means over master faces oscillate by more than this share of its peak is
unreliable.

The largest value of a batch case whose tolerance is not wider is 0.036, HEXA8 on TETRA4 in bending.
"""
FACE_LIMIT = 0.2
"""The same for the pressures of single faces: what averages out leaves forces and means right."""
# The checks of a pressure along the surface whose tolerance may be wider.
_ALLOWED = ("multiplier", "pressure_l2", "pressure_means", "pressure_max", "pressure_oscillation")
# So many macro-elements have to oscillate, or half of those that could, at least the second number:
# a kink of the exact pressure, or the tip of a wedge, is at one place.
_PLACES, _FEWEST, _ENOUGH = 5, 2, 6
# Neighbours are nearer than this share of the distance looked at, which is at most so many faces.
_REACH, _FARTHEST = 1.3, 4.0
# Neighbours' normals differ by less than 30°: across a kink the pressure may jump.
_SAME_SIDE = np.cos(np.radians(30))
# A fit is determined where the squares of its matrix are above the first share of their number, and
# is no extrapolation where the mean place of the neighbours is nearer than the second.
_RANK, _CENTRED = 0.03, 0.3
# Neighbours in a line have no part across it, up to rounding.
_IN_LINE = 1e-9
# Pressures below this share of the stress that the displacement could cause are rounding.
_ROUNDING = 1e-13
# A macro-element that is covered by less than this has a mean of another place.
_COVERED = 0.99


def oscillating(solution: Solution) -> str:
    """Why the pressure is unreliable: its oscillation, and what to do; empty where it is smooth.

    A case may allow larger errors of the pressure by its tolerances.
    """
    tolerance = solution.case.tolerance
    limit = max([LIMIT, *(tolerance[check] for check in _ALLOWED if check in tolerance)])
    moved = solution.displacement
    rounding = _ROUNDING * stress_of_motion(solution.case, solution.length, moved)
    for zone in solution.zones:
        peak = zone.multiplier[zone.closed].max(initial=0.0)
        if zone.nodal is not None or not peak > rounding:
            continue
        found = scatter(solution.mesh.points, zone)
        if found.averaged > limit:
            what = f"oscillates by {found.averaged:.0%} of its peak, averaged over master faces"
        elif found.size > max(limit, FACE_LIMIT):
            what = f"oscillates from face to face by {found.size:.0%} of its peak"
        elif found.spots > 1 and found.in_spots > LIMIT:
            what = (
                f"is broken into {found.spots} spots smaller than a master face, which bear "
                f"{found.in_spots:.0%} of its force"
            )
        else:
            continue
        return (
            f"the pressure of zone {zone.name} {what}: exchange slave and master, set "
            "`stabilised: true`, or refine the master"
        )
    return ""


class Scatter(NamedTuple):
    """How a pressure scatters: from face to face, and what is left of that in what people read.

    `size` and `averaged`, over master faces, are parts of the peak. `spots`: parts of the contact
    that are smaller than a master face, and `in_spots` the share of the force that they bear.
    """

    size: float
    averaged: float
    spots: int
    in_spots: float


def scatter(points: np.ndarray, zone: ZoneResult) -> Scatter:
    """The oscillation of a zone's pressure, and the spots of a contact in pieces.

    `points` (n, dim) of the mesh. Zero where too few closed macro-elements are side by side.
    """
    shape = _shapes(points, zone)
    near = _near(zone, shape, _REACH * np.clip(shape.facet / 2, shape.size, _FARTHEST * shape.size))
    inside = zone.closed & (zone.coverage > _COVERED)
    inside &= ~near.any(~inside)
    # Along the rim of the slave the pressure may be singular, as at the edge of a punch.
    _, rim = macro_neighbours(zone)
    size, averaged = (
        _oscillation(near, pressure, inside, rim) / float(zone.multiplier.max())
        for pressure in (zone.multiplier, near.averaged(zone.multiplier, shape))
    )
    spots, in_spots = _spots(zone, shape.facet_area)
    return Scatter(size, averaged, spots, in_spots)


def _oscillation(near: _Near, values: np.ndarray, inside: np.ndarray, rim: np.ndarray) -> float:
    """The size of the oscillation of values (m,) at places `inside` (m,) of the contact."""
    off, known = near.off_trend(values)
    known &= inside
    mean, count = near.opposite(off, known)
    candidates = known & ~near.any(~inside) & (count > 1)
    if (candidates & ~rim).sum() >= _ENOUGH:
        candidates &= ~rim
    sizes = np.sort(np.sqrt(np.maximum(-off * mean, 0.0))[candidates])
    places = min(max(_FEWEST, len(sizes) // 2), _PLACES)
    return float(sizes[-places]) if len(sizes) >= places else 0.0


@dataclass(frozen=True)
class _Near:
    """Pairs (p,) of macro-elements `i` and their neighbours `j`, and where these are.

    `away` (p, dim − 1): along the axes of the macro-element, `place` the same in parts of the
    distance looked at.
    """

    i: np.ndarray
    j: np.ndarray
    place: np.ndarray
    away: np.ndarray
    count: int

    def averaged(self, values: np.ndarray, shape: _Shapes) -> np.ndarray:
        """The mean (m,) of values (m,) over a master face in the middle of each macro-element.

        By what it has in common with the neighbours, taken as rectangles of the same size.
        """
        facet = np.maximum(shape.facet, 1e-9 * shape.size)
        least, half = np.minimum(facet, shape.size), (facet + shape.size) / 2
        common = np.clip(half[self.i] - np.abs(self.away), 0.0, least[self.i]).prod(axis=1)
        own = least.prod(axis=1)
        return (own * values + self._sum(common * values[self.j])) / (own + self._sum(common))

    def any(self, flag: np.ndarray) -> np.ndarray:
        """Whether a macro-element (m,) or one of its neighbours has the flag (m,)."""
        found = flag.copy()
        np.logical_or.at(found, self.i, flag[self.j])
        return found

    def opposite(self, values: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The mean (m,) over the known neighbours of values (m,), and the number of these.

        Values of the same sign as the own one count as zero, so that rows of either sign are seen.
        """
        kept = known[self.j]
        i, j = self.i[kept], self.j[kept]
        count = np.bincount(i, minlength=self.count)
        against = np.where(values[i] * values[j] < 0, values[j], 0.0)
        return np.bincount(i, against, minlength=self.count) / np.maximum(count, 1), count

    def _sum(self, values: np.ndarray) -> np.ndarray:
        """The sum (m,) over the neighbours of values (p,)."""
        return np.bincount(self.i, values, minlength=self.count)

    def off_trend(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (m,) less the linear fit to the neighbours' ones, and where that is determined."""
        terms = np.concatenate([np.ones((1, len(self.i))), self.place.T])
        squares = np.empty((self.count, len(terms), len(terms)))
        for (a, one), (b, other) in combinations_with_replacement(enumerate(terms), 2):
            squares[:, a, b] = squares[:, b, a] = self._sum(one * other)
        right = np.stack([self._sum(term * values[self.j]) for term in terms], axis=1)
        number = np.maximum(squares[:, 0, 0], 1)
        # Along rows one macro-element wide, nothing is known across them, nor needed.
        size, across = np.linalg.eigh(squares[:, 1:, 1:])
        in_line = size < _IN_LINE * number[:, None]
        squares[:, 1:, 1:] += number[:, None, None] * (
            np.einsum("mak,mk,mbk->mab", across, in_line, across)
        )
        known = (np.linalg.eigvalsh(squares)[:, 0] > _RANK * number) & ~in_line.all(axis=1)
        known &= np.linalg.norm(squares[:, 0, 1:], axis=1) < _CENTRED * number
        squares[~known] = np.eye(len(terms))
        fit = np.linalg.solve(squares, right[..., None])[:, 0, 0]
        return np.where(known, values - fit, 0.0), known


@dataclass(frozen=True)
class _Shapes:
    """The shapes of m macro-elements: `axes` (m, d − 1, d), `size` (m, d − 1) along them.

    `facet` (m, d − 1): the extent of the nearest master face along the same axes, and `facet_area`
    (m,); zero for a rigid master, whose facets are its shape.
    """

    axes: np.ndarray
    size: np.ndarray
    facet: np.ndarray
    facet_area: np.ndarray


def _shapes(points: np.ndarray, zone: ZoneResult) -> _Shapes:
    count, tangents = len(zone.area), tangents_of(zone.normal)
    _, _, square = _moments(points, zone.faces, count)
    in_plane = np.einsum("mtd,mde,mse->mts", tangents, square, tangents)
    size, turn = np.linalg.eigh(in_plane)
    axes = np.einsum("mts,mtd->msd", turn, tangents)
    size = np.sqrt(np.maximum(size, np.finfo(float).tiny))
    facet, area = np.zeros_like(size), np.zeros(count)
    if zone.stress_master.any():
        faces, first = [], 0
        for name, nodes in zone.master_faces:
            faces.append((name, nodes, first + np.arange(len(nodes))))
            first += len(nodes)
        areas, centre, square = _moments(points, faces, first)
        _, nearest = cKDTree(centre).query(zone.centre)
        along = np.einsum("msd,mde,mse->ms", axes, square[nearest], axes)
        facet, area = np.sqrt(np.maximum(along, 0.0)), areas[nearest]
    return _Shapes(axes, size, facet, area)


def _moments(
    points: np.ndarray, faces: Iterable[tuple[str, np.ndarray, np.ndarray]], count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Area (count,), centre (count, d) and square (count, d, d) of faces (type, nodes, number).

    The square is 12 times the mean of (x − centre)(x − centre)ᵀ: of a rectangle, the squares of its
    sides along them. Faces are seen as the polygons of their vertices.
    """
    dim = points.shape[1]
    area, first = np.zeros(count), np.zeros((count, dim))
    parts = []
    for name, nodes, number in faces:
        n = cell_type(name).n_vertices
        for k in range(1, max(n - 1, 2)):
            corner = points[nodes[:, [0, 1] if n == 2 else [0, k, k + 1]]]
            parts.append((number, corner, _measures(corner)))
    for number, corner, part in parts:
        area += np.bincount(number, part, minlength=count)
        np.add.at(first, number, part[:, None] * corner.mean(axis=1))
    centre, square = first / area[:, None], np.zeros((count, dim, dim))
    for number, corner, part in parts:
        away = corner - centre[number][:, None]
        total, v = away.sum(axis=1), corner.shape[1]
        each = np.einsum("fvd,fve->fde", away, away) + total[:, :, None] * total[:, None]
        np.add.at(square, number, (12 * part / (v * (v + 1)))[:, None, None] * each)
    return area, centre, square / area[:, None, None]


def _measures(corner: np.ndarray) -> np.ndarray:
    """Lengths or areas (f,) of lines and triangles (f, v, d)."""
    sides = corner[:, 1:] - corner[:, :1]
    if sides.shape[1] == 1:
        return np.linalg.norm(sides[:, 0], axis=1)
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2


def _near(zone: ZoneResult, shape: _Shapes, reach: np.ndarray) -> _Near:
    """Neighbours within the reach (m, d − 1) of each macro-element along its axes.

    They are linked by common vertices, each ring of them about one size wide, and lie on the same
    side of kinks.
    """
    count, ring = len(zone.area), _linked(zone)
    linked = ring
    for _ in range(int(np.ceil((reach / shape.size).max(initial=1.0))) - 1):
        linked = (linked @ ring).astype(bool).tocsr()
    i, j = linked.tocoo().coords
    level = np.einsum("pd,pd->p", zone.normal[i], zone.normal[j]) > _SAME_SIDE
    i, j = i[level & (i != j)], j[level & (i != j)]
    away = np.einsum("psd,pd->ps", shape.axes[i], zone.centre[j] - zone.centre[i])
    place = away / reach[i]
    close = np.linalg.norm(place, axis=1) <= 1
    return _Near(i[close], j[close], place[close], away[close], count)


def _linked(zone: ZoneResult) -> sparse.csr_matrix:
    """Pairs (m, m) of macro-elements with a common vertex."""
    faces = [(number, nodes[:, : cell_type(name).n_vertices]) for name, nodes, number in zone.faces]
    return vertex_neighbours(faces, len(zone.area))


def _spots(zone: ZoneResult, facet: np.ndarray) -> tuple[int, float]:
    """How many connected parts of the contact are smaller than the master's faces there.

    With the share of the force that they bear. Macro-elements are connected at common vertices.
    `facet` (m,): areas of master faces.
    """
    i, j = _linked(zone).tocoo().coords
    both = zone.closed[i] & zone.closed[j]
    shape = len(zone.area), len(zone.area)
    graph = sparse.coo_matrix((np.ones(int(both.sum())), (i[both], j[both])), shape=shape)
    count, part = connected_components(graph, directed=False)
    part = part[zone.closed]
    area = np.bincount(part, zone.area[zone.closed], minlength=count)
    face = np.bincount(part, facet[zone.closed], minlength=count)
    number = np.bincount(part, minlength=count)
    small = area * number < face
    force = np.bincount(part, (zone.area * zone.multiplier)[zone.closed], minlength=count)
    return int(small.sum()), float(force[small].sum() / force.sum())
