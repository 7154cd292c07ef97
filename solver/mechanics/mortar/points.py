"""Points of the slave surface projected to the master, and standard mortar's multipliers.

A point belongs to the one master face that the slave's normal through it meets: no intersections.
With Gauss points this is segment-free (element-based) integration of the mortar integrals: Fischer,
Wriggers, Frictionless 2D contact formulations for finite deformations based on the mortar method,
Comput. Mech. 36 (2005) 226–244; Farah, Popp, Wall, Segment-based vs. element-based integration for
mortar methods, Comput. Mech. 55 (2015) 209–228. With the slave nodes, each weighted with its
tributary area, it is the node-to-segment method: Hughes, Taylor, Sackman, Curnier, Kanoknukulchai,
A finite element method for a class of contact-impact problems, CMAME 8 (1976) 249–276; Wriggers,
Computational Contact Mechanics, 2006, §9.

Standard mortar has multipliers at the slave vertices, standard or dual, on exact segments. On
quadratic faces the pressure is linear between the vertices. Multipliers of the faces' own
quadratic functions are no use for contact: their integrals, which weight the gap, are zero at the
vertices of TRIA6 and negative at those of QUAD8, so that a sign says nothing about contact; and the
linear ones are stable. Sources: Puso, Laursen, A mortar segment-to-segment contact method for large
deformation solid mechanics, CMAME 193 (2004) 601–629; Puso, Laursen, Solberg, A segment-to-segment
mortar contact method for quadratic elements and large deformations, CMAME 197 (2008) 555–566.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ...lac.cells.catalogue import CellType
from ...lac.cells.faces import nodal_normals, surface_nodes
from ...lac.cells.shape import gauss_rule, shape_functions
from ...lac.facets import Facets, project_along
from ...lac.multipliers import InterfaceData, Multipliers
from ...lac.pairing import facing_pairs, line_pairs
from ...lac.partners import Samples, face_samples, sampled
from ...lac.segments import Segments, Side, area_vectors_at

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


# Of a face covered by less than this share, dual functions are those of the whole face: those of
# so small a part would be lost in round-off.
_FEW = 0.01


def linear(data: InterfaceData) -> Multipliers:
    """A multiplier at each slave vertex, its function the linear hat.

    >>> space = linear(InterfaceData(slaves=[slave], samples=[], found=[], n_macro=1))
    >>> space.nodes.tolist(), space.number[0].tolist(), space.shapes[0].tolist()
    ([0, 1], [[1, 0]], [[1.0, 0.0], [0.0, 1.0]])
    """
    vertices = [block.nodes[:, : block.type.n_vertices] for block in data.slaves]
    hats = [shape_functions(b.type.skeleton).values(b.type.nodes) for b in data.slaves]
    return of_nodes(vertices, hats)


def dual(data: InterfaceData) -> Multipliers:
    """A multiplier at each node of linear faces, its function orthogonal to all other hats.

    φᵢ = Σⱼ Aᵢⱼ Nⱼ on each face with A = D M⁻¹, M = ∫ N Nᵀ, D = diag ∫ N, integrals over the part of
    the face that the master covers. Sources: Wohlmuth, A mortar finite element method using dual
    spaces for the Lagrange multiplier, SIAM J. Numer. Anal. 38 (2000) 989–1012; on the covered
    part: Cichosz, Bischoff, Consistent treatment of boundaries with mortar contact formulations
    using dual Lagrange multipliers, CMAME 200 (2011) 1317–1332.

    The functions of an edge are 2 N₁ − N₂ and 2 N₂ − N₁:

    >>> data = InterfaceData(slaves=[slave], samples=face_samples([slave]), found=[], n_macro=1)
    >>> dual(data).coefficients[0].round(12).tolist()
    [[[2.0, -1.0], [-1.0, 2.0]]]
    """
    plain = linear(data)
    coefficients = []
    for a, (block, sample) in enumerate(zip(data.slaves, data.samples, strict=True)):
        whole = np.einsum("fq,qi,qj->fij", sample.weight, sample.values, sample.values)
        mass = np.zeros_like(whole)
        for segments in data.found:
            side = segments.slave
            if side.index == a:
                part = np.einsum("sq,sqi,sqj->sij", segments.weight, side.values, side.values)
                np.add.at(mass, side.face, part)
        few = mass.sum(axis=(1, 2)) < _FEW * whole.sum(axis=(1, 2))
        # A rigid surface may be seen from one point alone.
        few |= np.linalg.matrix_rank(mass, hermitian=True) < block.type.n_nodes
        mass[few] = whole[few]
        # Rows of M sum to ∫ N, since the functions sum to one.
        diagonal = np.eye(block.type.n_nodes) * mass.sum(axis=2)[:, None]
        coefficients.append(np.linalg.solve(mass, diagonal))
    return replace(plain, coefficients=coefficients, dual=True)


def of_nodes(nodes: Sequence[np.ndarray], shapes: Sequence[np.ndarray]) -> Multipliers:
    """One multiplier for each of the `nodes` (n, k) of faces, with functions `shapes`, by block.

    >>> space = of_nodes([np.array([[7, 3]])], [np.eye(2)])
    >>> space.nodes.tolist(), space.number[0].tolist()
    ([3, 7], [[1, 0]])
    """
    known = np.unique(np.concatenate([block.ravel() for block in nodes]))
    return Multipliers(
        count=len(known),
        number=[np.searchsorted(known, block) for block in nodes],
        coefficients=[shape[None] for shape in shapes],
        shapes=list(shapes),
        nodes=known,
    )


Among = Sequence[np.ndarray] | None


def gauss(slaves: list[Facets], n: int) -> list[Samples]:
    """Gauss points, n each way on each face, collapsed ones on triangles: degree 2 n − 1.

    >>> gauss([slave], 1)[0].weight.tolist()
    [[2.0]]
    """
    return [sampled(block, gauss_rule(block.type.name, n)) for block in slaves]


def at_nodes(slaves: list[Facets]) -> list[Samples]:
    """The nodes, weighted with ∫ N over each face, their normals the mean around them.

    >>> at_nodes([master])[0].weight.round(15).tolist()
    [[0.5, 0.5], [0.5, 0.5]]
    """
    nodes = surface_nodes(slaves)
    places = np.empty((len(nodes), slaves[0].centre.shape[1]))
    numbers = [np.searchsorted(nodes, block.nodes) for block in slaves]
    for block, number in zip(slaves, numbers, strict=True):
        places[number] = block.corner
    faces = [(block.type.name, number) for block, number in zip(slaves, numbers, strict=True)]
    normal = nodal_normals(places, faces)
    return [
        Samples(
            values=np.eye(block.type.n_nodes),
            weight=whole.weight @ whole.values,
            normal=normal[number],
        )
        for block, number, whole in zip(slaves, numbers, face_samples(slaves), strict=True)
    ]


def one_each(data: InterfaceData) -> Multipliers:
    """A multiplier at each slave node: its pressure is the node's force over tributary area.

    >>> one_each(InterfaceData(slaves=[master], samples=[], found=[], n_macro=2)).number[0].tolist()
    [[0, 1], [1, 2]]
    """
    shapes = [np.eye(block.type.n_nodes) for block in data.slaves]
    return of_nodes([block.nodes for block in data.slaves], shapes)


def meet_at_points(
    slaves: list[Facets],
    samples: list[Samples],
    masters: list[Facets],
    reach: float,
    among: Among = None,
    beyond: float = EDGE,
) -> list[Segments]:
    """Each point with its master face, as segments of one point.

    A point that no face holds goes to one that it misses by at most `beyond`, in parts of the
    face's reference face: slave nodes at the end of a bent surface look past the master's end.

    One Gauss point at x = 1, where it meets the first of two edges that end there:

    >>> (segments,) = meet_at_points([slave], gauss([slave], 1), [master], 1.0)
    >>> segments.weight.tolist(), segments.gap.tolist(), segments.master.values.tolist()
    ([[2.0]], [[0.5]], [[[0.0, 1.0]]])
    """
    found = []
    for a, (slave, sample) in enumerate(zip(slaves, samples, strict=True)):
        some = None if among is None else among[a]
        hits = [
            meet(slave, sample, master, reach, beyond, facing_pairs(slave, master, reach, some))
            for master in masters
        ]
        block = np.repeat(np.arange(len(masters)), [len(hit.point) for hit in hits])
        chosen = _nearest(hits)
        for b, (master, hit) in enumerate(zip(masters, hits, strict=True)):
            mine = hit.of(chosen[block == b])
            if len(mine.point):
                found.append(_segments((slave, a), (master, b), sample, mine))
    return found


def _nearest(hits: list[Hits]) -> np.ndarray:
    """Which of all hits are the first choice of their points, as a mask.

    A hit inside a face goes before one beyond its edge, then a near one before a far one.
    """
    point, gap, outside = (
        np.concatenate([getattr(hit, key) for hit in hits]) for key in ("point", "gap", "outside")
    )
    order = np.lexsort((np.abs(gap), np.maximum(outside, EDGE), point))
    first = order[np.flatnonzero(np.diff(point[order], prepend=-1))]
    chosen = np.zeros(len(point), dtype=bool)
    chosen[first] = True
    return chosen


def _segments(
    slave: tuple[Facets, int], master: tuple[Facets, int], sample: Samples, hit: Hits
) -> Segments:
    face, q = np.divmod(hit.point, len(sample.values))
    on_master = shape_functions(master[0].type.name).values(hit.place)[:, None]
    return Segments(
        slave=Side(faces=slave[0], index=slave[1], face=face, values=sample.values[q][:, None]),
        master=Side(faces=master[0], index=master[1], face=hit.face, values=on_master),
        weight=sample.weight[face, q][:, None],
        normal=sample.normal[face, q][:, None],
        gap=hit.gap[:, None],
    )
