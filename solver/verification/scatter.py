"""Whether a contact pressure oscillates, found without a reference.

A smooth pressure differs from the trend of its neighbours by little, and neighbours differ by the
same sign. Where it oscillates, they differ by opposite signs. The trend at a macro-element is the
linear least squares fit to others within half a master face, because the facets of a master that
is coarser than the slave are the cause of most oscillations (docs/slave-and-master.md). A contact
area that the facets break into spots smaller than themselves is the same fault in an extreme form.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..mechanics.mortar.facets import tangents_of
from ..mesh.catalogue import cell_type
from ..simulation.solution import Solution, ZoneResult
from ..system.threads import ahead

LIMIT = 0.04
"""A pressure that oscillates by more than this share of its peak is unreliable.

The largest value of a batch case whose pressure is smooth is 0.029, at the edge of contact of a
sphere. Pressures that differ from the exact ones by 10 % of the peak or more have 0.043 and more.
"""
# The checks of a pressure along the surface whose tolerance may be wider.
_ALLOWED = ("multiplier", "pressure_l2", "pressure_means", "pressure_max", "pressure_oscillation")
# So many macro-elements have to oscillate: a kink of the exact pressure is at one place.
_PLACES = 3
# Neighbours are nearer than this share of the distance looked at, which is at most so many faces.
_REACH, _FARTHEST = 1.3, 4.0
# Neighbours' normals differ by less than 30°: across a kink the pressure may jump.
_SAME_SIDE = np.cos(np.radians(30))
# A fit is determined where the squares of its matrix are above the first share of their number, and
# is no extrapolation where the mean place of the neighbours is nearer than the second.
_RANK, _CENTRED = 0.03, 0.3
# A macro-element that is covered by less than this has a mean of another place.
_COVERED = 0.99
_AT_ONCE = 1 << 15  # pairs


def oscillating(solution: Solution) -> str:
    """Why the pressure is unreliable: its oscillation, and what to do; empty where it is smooth.

    A case may allow larger errors of the pressure by its tolerances.
    """
    tolerance = solution.case.tolerance
    limit = max([LIMIT, *(tolerance[check] for check in _ALLOWED if check in tolerance)])
    for zone in solution.zones:
        if zone.nodal is not None or not zone.multiplier.any():
            continue
        size, spots = scatter(solution.mesh.points, zone)
        if size > limit:
            what = f"oscillates from face to face by {size:.0%} of its peak"
        elif spots > 1:
            what = f"is broken into {spots} spots smaller than a master face"
        else:
            continue
        return (
            f"the pressure of zone {zone.name} {what}: exchange slave and master, set "
            "`stabilised: true`, or refine the master"
        )
    return ""


def scatter(points: np.ndarray, zone: ZoneResult) -> tuple[float, int]:
    """The oscillation of a zone's pressure over its peak, and the spots of a contact in pieces.

    `points` (n, dim) of the mesh. Zero where too few closed macro-elements are side by side.
    """
    size = _sizes(points, zone.faces, len(zone.area))
    facet = _facets(points, zone)
    reach = _REACH * np.clip(facet / 2, size, _FARTHEST * size)
    near = _near(zone, reach)
    inside = zone.closed & (zone.coverage > _COVERED)
    inside &= ~near.any(~inside)
    off, known = near.off_trend(zone.multiplier)
    known &= inside
    mean, count = near.mean(off, known)
    swings = known & ~near.any(~inside) & (count > 1) & (off * mean < 0)
    found = np.sort(np.sqrt(np.abs(off * mean)) * swings)
    largest = found[-_PLACES] if len(found) >= _PLACES else 0.0
    spots = _spots(zone, _near(zone, _REACH * size), facet)
    return float(largest / zone.multiplier.max()), spots


@dataclass(frozen=True)
class _Near:
    """Pairs (p,) of macro-elements `i` and their neighbours `j`; `place` (p, dim − 1) of these.

    Places are counted from the macro-element, in its tangents, in parts of the distance looked at.
    """

    i: np.ndarray
    j: np.ndarray
    place: np.ndarray
    count: int

    def any(self, flag: np.ndarray) -> np.ndarray:
        """Whether a macro-element (m,) or one of its neighbours has the flag (m,)."""
        found = flag.copy()
        np.logical_or.at(found, self.i, flag[self.j])
        return found

    def mean(self, values: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The mean (m,) of values (m,) over the neighbours that are known, and their number."""
        kept = known[self.j]
        i, j = self.i[kept], self.j[kept]
        count = np.bincount(i, minlength=self.count)
        return np.bincount(i, values[j], minlength=self.count) / np.maximum(count, 1), count

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
        known = np.linalg.eigvalsh(squares)[:, 0] > _RANK * number
        known &= np.linalg.norm(squares[:, 0, 1:], axis=1) < _CENTRED * number
        squares[~known] = np.eye(len(terms))
        fit = np.linalg.solve(squares, right[..., None])[:, 0, 0]
        return np.where(known, values - fit, 0.0), known


def _near(zone: ZoneResult, reach: np.ndarray) -> _Near:
    """Neighbours within the reach (m,) of each macro-element, on the same side of kinks."""
    pairs = cKDTree(zone.centre).query_pairs(reach.max(), output_type="ndarray")
    tangents = tangents_of(zone.normal)

    def part(first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        some = pairs[first : first + _AT_ONCE]
        i, j = np.concatenate([some, some[:, ::-1]]).T.astype(np.int32)
        away = zone.centre[j] - zone.centre[i]
        near = np.linalg.norm(away, axis=1) <= reach[i]
        near &= np.einsum("pd,pd->p", zone.normal[i], zone.normal[j]) > _SAME_SIDE
        i, j, away = i[near], j[near], away[near]
        return i, j, np.einsum("ptd,pd->pt", tangents[i], away) / reach[i][:, None]

    parts = ahead(part, range(0, max(len(pairs), 1), _AT_ONCE))
    i, j, place = (np.concatenate(every) for every in zip(*parts, strict=True))
    return _Near(i, j, place, len(reach))


def _spots(zone: ZoneResult, near: _Near, facet: np.ndarray) -> int:
    """How many connected parts of the contact area are smaller than the master's faces there."""
    both = zone.closed[near.i] & zone.closed[near.j]
    pairs = (np.ones(int(both.sum())), (near.i[both], near.j[both]))
    count, part = connected_components(sparse.coo_matrix(pairs, shape=(near.count, near.count)))
    part, dim = part[zone.closed], zone.centre.shape[1]
    area = np.bincount(part, zone.area[zone.closed], minlength=count)
    face = np.bincount(part, facet[zone.closed] ** (dim - 1), minlength=count)
    number = np.bincount(part, minlength=count)
    return int((area * number < face).sum())


def _facets(points: np.ndarray, zone: ZoneResult) -> np.ndarray:
    """The size (m,) of the master face nearest to each macro-element; zero for a rigid master.

    The facets of a rigid master are its shape.
    """
    if not zone.stress_master.any():
        return np.zeros(len(zone.area))
    centres, sizes = [], []
    for name, nodes in zone.master_faces:
        vertices = nodes[:, : cell_type(name).n_vertices]
        centres.append(points[vertices].mean(axis=1))
        sizes.append(_sizes(points, [(name, nodes, np.arange(len(nodes)))], len(nodes)))
    _, nearest = cKDTree(np.concatenate(centres)).query(zone.centre)
    return np.concatenate(sizes)[nearest]


def _sizes(
    points: np.ndarray, faces: Iterable[tuple[str, np.ndarray, np.ndarray]], count: int
) -> np.ndarray:
    """The length or the root of the area (count,) of faces (type, nodes, number), summed."""
    area = np.zeros(count)
    for name, nodes, number in faces:
        n = cell_type(name).n_vertices
        corner = points[nodes[:, :n]]
        if n == 2:
            part = np.linalg.norm(corner[:, 1] - corner[:, 0], axis=1)
        else:
            one, other = corner[:, 2] - corner[:, 0], corner[:, n - 1] - corner[:, 1]
            other = other if n == 4 else corner[:, 1] - corner[:, 0]
            part = np.linalg.norm(np.cross(one, other), axis=1) / 2
        area += np.bincount(number, part, minlength=count)
    return area if points.shape[1] == 2 else np.sqrt(area)
