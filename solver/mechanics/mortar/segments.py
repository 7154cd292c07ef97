"""Mortar segments: the pieces of the slave surface that lie over one master face each.

Both faces are seen along the normal at the slave's centre. Where their edges look straight,
polygons are clipped; where they look bent they are parabolas, and so are the edges of the segments:
areas in that plane are exact to round-off either way. In 2D, bent slave faces are cut in their
reference face. Of two master faces behind each other the nearer one counts. Every quadrature point
knows its place on both faces, found along the slave's normal at that point (the face's own, or one
interpolated between the mean normals at its nodes), so that both sides of an integral share one
normal and one surface measure.
Sources: Puso, Laursen, A mortar segment-to-segment contact method, CMAME 193 (2004) 601–629, for
segments; Abbas et al. (2018), §4.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from solver.mechanics.fem import mortar_degree, shape_functions, simplex_rule
from solver.mechanics.mortar.clipping import clip, overlap, triangles
from solver.mechanics.mortar.facets import Facets, project_along
from solver.mechanics.mortar.pairing import (
    Outlines,
    Pairs,
    face_pairs,
    hidden_pairs,
    outlines,
    seen_along,
)
from solver.mechanics.mortar.regions import (
    Pieces,
    Regions,
    clip_to_face,
    joined,
    quadrature,
    without_face,
)

# Extra degrees where a face is not the affine image of its reference face: its functions are then
# no polynomials in the plane.
_BENT_DEGREES = 6
# Pairs cut at once: few enough for their polygons to stay in the processor's cache.
_PAIRS_AT_ONCE = 4096
# Edges whose middle is off the chord by less than this share of it look straight.
_STRAIGHT = 1e-12
# The ends of a line are looked for this far beyond a bent face, in parts of its length.
_MARGIN = 0.05


@dataclass(frozen=True, kw_only=True)
class Side:
    """Where s segments lie on the faces of one block.

    `faces`: the block; `index`: its number among the surface's; `face` (s,): which of its faces;
    `values` (s, q, n_nodes): shape functions at the q points of each segment.
    """

    faces: Facets
    index: int
    face: np.ndarray
    values: np.ndarray

    @property
    def nodes(self) -> np.ndarray:
        """Nodes (s, n_nodes) of the faces."""
        return self.faces.nodes[self.face]

    def of(self, chosen: np.ndarray) -> Self:
        """Some of the segments."""
        return replace(self, face=self.face[chosen], values=self.values[chosen])


@dataclass(frozen=True, kw_only=True)
class Segments:
    """Segments between the slave faces of one block and the master faces of one block.

    At each of q points: `weight` (s, q) surface measure × quadrature weight, `normal` (s, q, dim)
    the slave's unit normal and `gap` (s, q) the distance along it, positive when open.
    """

    slave: Side
    master: Side
    weight: np.ndarray
    normal: np.ndarray
    gap: np.ndarray

    @property
    def sides(self) -> tuple[Side, Side]:
        """Slave and master."""
        return self.slave, self.master

    @property
    def area(self) -> np.ndarray:
        """Area (s,) of the segments on the slave surface."""
        return self.weight.sum(axis=1)

    @property
    def points(self) -> np.ndarray:
        """The quadrature points (s, q, dim) on the slave surface."""
        corner = self.slave.faces.corner[self.slave.face]
        return np.einsum("sqa,sad->sqd", self.slave.values, corner)

    @property
    def macro(self) -> np.ndarray:
        """The macro-elements (s,) that they belong to."""
        return self.slave.faces.number[self.slave.face]

    def of(self, chosen: np.ndarray) -> Self:
        """Some of the segments."""
        return type(self)(
            slave=self.slave.of(chosen),
            master=self.master.of(chosen),
            weight=self.weight[chosen],
            normal=self.normal[chosen],
            gap=self.gap[chosen],
        )


def intersect(
    slaves: Sequence[Facets],
    index: int,
    masters: Sequence[Facets],
    reach: float,
    more: int = 0,
    among: np.ndarray | None = None,
) -> list[Segments]:
    """All segments of the slave block `index` over master blocks, looked for within `reach`.

    Their quadrature is exact for shape functions of affine faces times polynomials of degree
    `more`. `reach` is a length. `among`: the slave faces that are looked at, all by default.
    Raises SolveError for points that have no place on a face.

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> segments.master.face.tolist(), segments.area.tolist(), segments.gap[:, 0].tolist()
    ([0, 1], [1.0, 1.0], [0.5, 0.5])
    """
    pairs = face_pairs(slaves, index, masters, reach, among)
    hidden, nearer = hidden_pairs(pairs)
    found: list[Segments] = []
    for start in range(0, len(pairs.i), _PAIRS_AT_ONCE):
        end = start + _PAIRS_AT_ONCE
        low, high = np.searchsorted(hidden, [start, end])
        behind = hidden[low:high] - start, pairs.j[nearer[low:high]]
        found += _segments(pairs.of(slice(start, end)), behind, reach, more)
    return found


# Pieces of slave faces: pair numbers (s,), places (s, q, dim − 1), weights (s, q)

Behind = tuple[np.ndarray, np.ndarray]


def _segments(pairs: Pairs, behind: Behind, reach: float, more: int) -> Iterator[Segments]:
    degree = _degree(pairs) + more
    if pairs.slave.centre.shape[1] == 2:
        straight = pairs.slave.straight[pairs.i]
        for chosen in (np.flatnonzero(straight), np.flatnonzero(~straight)):
            if len(chosen):
                some = pairs.of(chosen)
                pieces = _intervals(some, _among(behind, chosen, len(straight)), degree)
                yield from _with_master(some, pieces, reach)
        return
    window, bend = pairs.seen(outlines([pairs.slave]), pairs.i)
    subject, bulge = pairs.seen(pairs.outline, pairs.j)
    special = ~(_looks_straight(window, bend) & _looks_straight(subject, bulge))
    special[behind[0]] = True
    chosen = np.flatnonzero(~special)
    pieces = _polygons(window[chosen], subject[chosen], degree)
    yield from _with_master(pairs.of(chosen), pieces, reach)
    chosen = np.flatnonzero(special)
    if len(chosen):
        some = pairs.of(chosen)
        for pieces in _bent(some, _among(behind, chosen, len(special)), degree):
            yield from _with_master(some, pieces, reach)


def _among(behind: Behind, chosen: np.ndarray, count: int) -> Behind:
    """The same couples, with their pairs numbered among the chosen ones."""
    number = np.full(count, -1)
    number[chosen] = np.arange(len(chosen))
    kept = number[behind[0]] >= 0
    return number[behind[0][kept]], behind[1][kept]


def _looks_straight(corner: np.ndarray, bulge: np.ndarray) -> np.ndarray:
    """Which outlines (p,) have straight edges only."""
    chord = np.roll(corner, -1, axis=1) - corner
    sideways = chord[..., 0] * bulge[..., 1] - chord[..., 1] * bulge[..., 0]
    return (np.abs(sideways) <= _STRAIGHT * (chord**2).sum(axis=2)).all(axis=1)


def _degree(pairs: Pairs) -> int:
    kinds = [pairs.slave.type, *(block.type for block in pairs.masters)]
    degree = max(mortar_degree(kind.name) for kind in kinds)
    affine = pairs.slave.affine[pairs.i].all() and pairs.outline.affine[pairs.j].all()
    plain = affine and pairs.slave.directions is None
    return degree if plain else degree + _BENT_DEGREES


def _polygons(window: np.ndarray, subject: np.ndarray, degree: int) -> Pieces:
    """Triangles of what straight slave and master faces (p, v, 2) have in common."""
    reference, weights = simplex_rule(2, degree)
    which, corner, area = triangles(*clip(subject, np.full(len(subject), subject.shape[1]), window))
    barycentric = np.column_stack([1 - reference.sum(axis=1), reference])
    return which, np.einsum("qk,skt->sqt", barycentric, corner), 2 * area[:, None] * weights


def _bent(pairs: Pairs, behind: Behind, degree: int) -> list[Pieces]:
    """Fans of what faces have in common where edges are bent, or where others hide some of it."""
    corner, bulge = pairs.seen(outlines([pairs.slave]), pairs.i)
    slave = Regions(start=corner, bulge=bulge, count=np.full(len(corner), corner.shape[1]))
    parts = clip_to_face(slave, *pairs.seen(pairs.outline, pairs.j))
    for face, rows in _layers(behind, len(pairs.i)):
        cut = []
        for which, regions in parts:
            deep = rows[which] >= 0
            cut.append((which[~deep], regions.of(~deep)))
            chosen = which[deep]
            outline = pairs.of(chosen).seen(pairs.outline, face[rows[chosen]])
            cut += [(chosen[k], part) for k, part in without_face(regions.of(deep), *outline)]
        parts = cut
    which = np.concatenate([which for which, _ in parts])
    pieces = quadrature(joined([regions for _, regions in parts]), degree)
    return [(which[number], points, weight) for number, points, weight in pieces]


def _layers(behind: Behind, count: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Nearer faces, at most one for each pair at a time: their numbers, and which is whose."""
    hidden, nearer = behind
    layer = np.arange(len(hidden)) - np.searchsorted(hidden, hidden)
    for k in range(int(layer.max(initial=-1)) + 1):
        rows = np.full(count, -1)
        rows[hidden[layer == k]] = np.flatnonzero(layer == k)
        yield nearer, rows


def _intervals(pairs: Pairs, behind: Behind, degree: int) -> Pieces:
    """Intervals of what edges have in common: on straight slaves along them, else in reference."""
    reference, weights = simplex_rule(1, degree)
    window = _ends(pairs, outlines([pairs.slave]), pairs.i)
    ends, _ = overlap(window, _ends(pairs, pairs.outline, pairs.j))
    which = np.arange(len(pairs.i))
    for face, rows in _layers(behind, len(pairs.i)):
        deep = np.flatnonzero(rows[which] >= 0)
        hiding = _ends(pairs.of(which[deep]), pairs.outline, face[rows[which[deep]]])
        beyond = np.stack([np.maximum(ends[deep, 0], hiding[:, 1]), ends[deep, 1]], axis=1)
        ends[deep, 1] = np.minimum(ends[deep, 1], hiding[:, 0])
        ends, which = np.concatenate([ends, beyond]), np.concatenate([which, which[deep]])
    length = ends[:, 1] - ends[:, 0]
    real = length > 0
    points = ends[real, :1] + length[real, None] * reference[:, 0]
    return which[real], points[..., None], length[real, None] * weights


def _ends(pairs: Pairs, outline: Outlines, j: np.ndarray) -> np.ndarray:
    """The ends (p, 2) of edges `j`, ascending, in the coordinate that the slave is cut in."""
    ends, _ = pairs.seen(outline, j)
    if not pairs.slave.straight[pairs.i].all():
        corner = pairs.corner
        own = seen_along(corner, pairs.slave.tangents[pairs.i])
        low, high = own.min(axis=1), own.max(axis=1)
        margin = _MARGIN * (high - low)
        # Far from a bent face, points have no place in its reference face, or a wrong one.
        ends = np.clip(ends, (low - margin)[:, None], (high + margin)[:, None])
        points = np.einsum("sat,std->sad", ends, pairs.slave.tangents[pairs.i])
        direction = np.broadcast_to(pairs.slave.normal[pairs.i][:, None], points.shape)
        ends, _ = project_along(pairs.slave.type, corner, points, direction, outline=True)
    return np.sort(ends[..., 0], axis=1)


# Points on both faces


def _with_master(pairs: Pairs, pieces: Pieces, reach: float) -> Iterator[Segments]:
    """The segments of pieces; those with points beyond the reach are left out."""
    which, points, weight = pieces
    pairs = pairs.of(which)
    slave, i = pairs.slave, pairs.i
    kind, corner = slave.type, pairs.corner
    normal = np.broadcast_to(slave.normal[i][:, None], (*points.shape[:2], slave.normal.shape[1]))
    if points.shape[2] == 1 and not slave.straight[i].all():
        place = points
        points = np.einsum("sqa,sad->sqd", shape_functions(kind.name).values(place), corner)
        vectors = _area_vectors(corner, shape_functions(kind.name).gradients(place))
        stretch = np.linalg.norm(vectors, axis=-1)
        normal, weight = vectors / stretch[..., None], weight * stretch
    else:
        points = np.einsum("sqt,std->sqd", points, slave.tangents[i])
        place, height = project_along(kind, corner, points, normal)
        points = points + height[..., None] * normal
        if not slave.flat[i].all():
            vectors = _area_vectors(corner, shape_functions(kind.name).gradients(place))
            stretch = np.linalg.norm(vectors, axis=-1)
            weight = weight * stretch / np.einsum("sqd,sqd->sq", vectors, normal)
            normal = vectors / stretch[..., None]
    values = shape_functions(kind.name).values(place)
    if slave.directions is not None:
        between = np.einsum("sqa,sad->sqd", values, slave.directions[i])
        normal = between / np.linalg.norm(between, axis=-1, keepdims=True)
    for index, master in enumerate(pairs.masters):
        mine = np.flatnonzero(pairs.outline.block[pairs.j] == index)
        face = pairs.outline.face[pairs.j[mine]]
        corner = master.corner[face] - slave.centre[i[mine]][:, None]
        partner, gap = project_along(master.type, corner, points[mine], normal[mine])
        near = np.abs(gap).max(axis=1, initial=0.0) <= reach
        mine = mine[near]
        if len(mine):
            on_master = shape_functions(master.type.name).values(partner[near])
            yield Segments(
                slave=Side(faces=slave, index=pairs.index, face=i[mine], values=values[mine]),
                master=Side(faces=master, index=index, face=face[near], values=on_master),
                weight=weight[mine],
                normal=normal[mine],
                gap=gap[near],
            )


def _area_vectors(corner: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Normal × surface measure (s, q, dim) of faces (s, n_nodes, dim) at points of their own."""
    tangent = np.einsum("sad,sqat->sqtd", corner, slopes)
    if corner.shape[2] == 2:
        return np.stack([tangent[:, :, 0, 1], -tangent[:, :, 0, 0]], axis=-1)
    return np.cross(tangent[:, :, 0], tangent[:, :, 1])
