"""Whether a contact pressure is resolved by its mesh, found without a reference.

A smooth pressure differs from the trend of its neighbours by little, and neighbours differ by the
same sign. Where the faces do not resolve it, they differ by opposite signs: it oscillates from face
to face, or is broken into patches that are one or two faces wide. Open faces count, with a pressure
of zero. The trend at a macro-element is the linear least squares fit to its neighbours.

With e the difference from the trend, and m the mean over the neighbours of their e of the opposite
sign, the scatter is √(∫ |e m| / ∫ p²) where e m < 0. A chequered pressure of 1 ± a has a scatter of
about 2 a, the edge of a well resolved contact one of a few percent (docs/slave-and-master.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np

from ..lac.cells.catalogue import cell_type
from ..lac.cells.neighbours import SAME_SIDE, vertex_neighbours
from ..lac.facets import tangents_of
from ..simulation.equilibrium.rest import AT_REST, FAINT, LITTLE, stress_of_motion
from ..simulation.judgement.validity import allowed_of_pressure
from ..simulation.results.solution import Solution, ZoneResult

if TYPE_CHECKING:
    from ..case.file import Zone

LIMIT = 0.2
"""A pressure that scatters by more is unreliable.

The largest value of a batch case is 0.15, a rigid punch with its singular edges. Broken pressures
have 0.22 and more: press fits and loaded rings and spheres of linear faces with ratios from 5:7 to
24:35.
"""
# Neighbours are nearer than this many sizes of the macro-element along its axes.
_REACH = 1.3
# A fit is determined where the squares of its matrix are above the first share of their number, and
# is no extrapolation where the mean place of the neighbours is nearer than the second.
_RANK, _CENTRED = 0.03, 0.3
# Neighbours in a line have no part across it, up to rounding.
_IN_LINE = 1e-9
# A macro-element that is covered by less than this has a mean of another place.
_COVERED = 0.99


def unresolved(solution: Solution) -> str:
    """Why the pressure is unreliable: its scatter, and what to do; empty where it is resolved.

    A case may allow larger errors of the pressure by its tolerances. What is left of a zone's
    pressures of other steps is not judged.
    """
    case, moved = solution.case, solution.displacement
    limit = allowed_of_pressure(case, LIMIT)
    caused = stress_of_motion(case, solution.scalars.length, moved)
    rounding = max(AT_REST * caused, FAINT * solution.largest_pressure)
    for given, zone in zip(case.zones, solution.zones, strict=True):
        peak, most = zone.multiplier[zone.closed].max(initial=0.0), solution.largest_in(zone.name)
        if zone.nodal is not None or not peak > max(rounding, LITTLE * most):
            continue
        found = scatter(solution.mesh.points, zone)
        if found > limit:
            return (
                f"the pressure of zone {zone.name} scatters by {found:.0%} of itself from face to "
                f"face, open faces counted: {_remedies(solution, given, zone)}"
            )
    return ""


def _remedies(solution: Solution, zone: Zone, result: ZoneResult) -> str:
    """What the case admits of: a rigid side is always master, friction has no stabilised form."""
    lac, cells = zone.treatment == "lac", {c for b in solution.bodies for c in b.cells}
    admitted = {
        "exchange slave and master": solution.deformable[result.surfaces.master_nodes].any(),
        "set `stabilised: true`": lac and not zone.friction and not zone.gives_way,
        "cut with `hexahedra: hexahedra`": lac
        and zone.hexahedra != "hexahedra"
        and bool(cells & ({"HEXA8", "HEXA20"} if result.flat else {"HEXA8"})),  # bent: refused
        "refine the surfaces": True,
    }
    *others, last = [words for words, possible in admitted.items() if possible]
    return f"{', '.join(others)} or {last}" if others else last


def scatter(points: np.ndarray, zone: ZoneResult) -> float:
    """The scatter of a zone's pressure, with the mesh's `points` (n, dim); 0 if all is open.

    Places beside a macro-element that the master covers in part count for nothing: their means
    belong to other places.
    """
    pressure = np.where(zone.closed, zone.multiplier, 0.0)
    scale = float(pressure.max(initial=0.0))
    if not scale > 0:
        return 0.0
    near, whole = _near(points, zone), zone.coverage > _COVERED
    off, known = near.off_trend(pressure / scale)
    known &= ~near.any(~whole)
    against = np.maximum(-off * near.opposite(off, known), 0.0)[known]
    return float(np.sqrt(zone.area[known] @ against / (zone.area @ (pressure / scale) ** 2)))


@dataclass(frozen=True)
class _Near:
    """Pairs (p,) of macro-elements `i` and their neighbours `j`, and where these are.

    `place` (p, dim − 1): along the axes of the macro-element, in parts of the distance looked at.
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

    def opposite(self, values: np.ndarray, known: np.ndarray) -> np.ndarray:
        """The mean (m,) over the known neighbours of values (m,) of the opposite sign.

        Values of the same sign as the own one count as zero, so that rows of either sign are seen.
        """
        kept = known[self.j]
        i, j = self.i[kept], self.j[kept]
        count = np.bincount(i, minlength=self.count)
        against = np.where(values[i] * values[j] < 0, values[j], 0.0)
        return np.asarray(np.bincount(i, against, minlength=self.count) / np.maximum(count, 1))

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


def _near(points: np.ndarray, zone: ZoneResult) -> _Near:
    """Neighbours of macro-elements: linked by a vertex, on the same side of kinks, and near.

    Near is what is within so many sizes along either axis of the macro-element.
    """
    count, tangents = len(zone.area), tangents_of(zone.normal)
    square = _squares(points, zone)
    in_plane = np.einsum("mtd,mde,mse->mts", tangents, square, tangents)
    size, turn = np.linalg.eigh(in_plane)
    axes = np.einsum("mts,mtd->msd", turn, tangents)
    size = np.sqrt(np.maximum(size, np.finfo(float).tiny))
    faces = [(number, nodes[:, : cell_type(name).n_vertices]) for name, nodes, number in zone.faces]
    i, j = vertex_neighbours(faces, count).tocoo().coords
    level = np.einsum("pd,pd->p", zone.normal[i], zone.normal[j]) > SAME_SIDE
    i, j = i[level & (i != j)], j[level & (i != j)]
    away = np.einsum("psd,pd->ps", axes[i], zone.centre[j] - zone.centre[i])
    place = away / (_REACH * size[i])
    close = np.linalg.norm(place, axis=1) <= 1
    return _Near(i[close], j[close], place[close], count)


def _squares(points: np.ndarray, zone: ZoneResult) -> np.ndarray:
    """12 times the mean (m, d, d) over macro-elements of (x − centre)(x − centre)ᵀ.

    Of a rectangle, the squares of its sides along them. Faces are seen as the polygons of their
    vertices.
    """
    dim, count = points.shape[1], len(zone.area)
    area, first, parts = np.zeros(count), np.zeros((count, dim)), []
    for name, nodes, number in zone.faces:
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
    return np.asarray(square / area[:, None, None])


def _measures(corner: np.ndarray) -> np.ndarray:
    """Lengths or areas (f,) of lines and triangles (f, v, d)."""
    sides = corner[:, 1:] - corner[:, :1]
    if sides.shape[1] == 1:
        return np.linalg.norm(sides[:, 0], axis=1)
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
