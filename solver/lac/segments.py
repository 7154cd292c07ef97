"""Mortar segments: the pieces of the slave surface that lie over one master face each.

Both faces are seen along the normal at the slave's centre. Where their edges look straight,
polygons are clipped; where they look bent they are parabolas, and so are the edges of the segments:
areas in that plane are exact to round-off either way. The pieces of slave faces that are not flat
are integrated in their reference face, where shape functions are polynomials; in 2D bent faces are
cut there. Of two master faces behind each other the nearer one counts. Every quadrature point
knows its place on both faces, found along the slave's normal at that point (the face's own, or one
interpolated between the mean normals at its nodes), so that both sides of an integral share one
normal and one surface measure.
Sources: Puso, Laursen, A mortar segment-to-segment contact method, CMAME 193 (2004) 601–629, for
segments; Abbas et al. (2018), §4.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Self

import numpy as np

from .cells.faces import circumference
from .cells.shape import invert, shape_functions, simplex_rule
from .clipping import Image, Pieces, clip, overlap, quadrature
from .facets import Facets, project_along
from .pairing import (
    Outlines,
    Pairs,
    face_pairs,
    hidden_pairs,
    seen_along,
)
from .regions import (
    Parts,
    Regions,
    clip_to_face,
    edge_bends,
    joined,
    without_face,
)
from .threads import prefetch

# Extra degrees where a face is not the affine image of its reference face: its functions are then
# no polynomials in the plane.
_BENT_DEGREES = 6
# Pairs cut at once: few enough for their polygons to stay in the processor's cache.
_PAIRS_AT_ONCE = 4096
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

    At each of q points: `weight` (s, q) surface measure (of axisymmetric faces that of rings) ×
    quadrature weight, `normal` (s, q, dim) the slave's unit normal and `gap` (s, q) the distance
    along it, positive when open.
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
    part = partial(_segments, pairs, hidden_pairs(pairs), reach, more)
    return list(chain.from_iterable(prefetch(part, range(0, len(pairs.i), _PAIRS_AT_ONCE))))


# Pieces of slave faces: pair numbers (s,), places (s, q, dim − 1), weights (s, q)

Behind = tuple[np.ndarray, np.ndarray]


def _segments(pairs: Pairs, hidden: Behind, reach: float, more: int, start: int) -> list[Segments]:
    """The segments of some pairs, from `start` on; `hidden` by number, and the nearer pair."""
    low, high = np.searchsorted(hidden[0], [start, start + _PAIRS_AT_ONCE])
    behind = hidden[0][low:high] - start, pairs.j[hidden[1][low:high]]
    pairs = pairs.of(slice(start, start + _PAIRS_AT_ONCE))
    degree, found = _degree(pairs) + more, list[Segments]()
    slave = pairs.slave
    plane, cut = (
        (slave.straight, _intervals) if slave.centre.shape[1] == 2 else (slave.flat, _areas)
    )
    plane = plane[pairs.i]
    for chosen, curved in ((np.flatnonzero(plane), False), (np.flatnonzero(~plane), True)):
        if len(chosen):
            some = pairs.of(chosen)
            for pieces in cut(some, _among(behind, chosen, len(plane)), degree, curved):
                found += _with_master(some, pieces, reach, curved)
    return found


def _among(behind: Behind, chosen: np.ndarray, count: int) -> Behind:
    """The same couples, with their pairs numbered among the chosen ones."""
    number = np.full(count, -1)
    number[chosen] = np.arange(len(chosen))
    kept = number[behind[0]] >= 0
    return number[behind[0][kept]], behind[1][kept]


def _degree(pairs: Pairs) -> int:
    kinds = [pairs.slave.type, *(block.type for block in pairs.masters)]
    degree = max(kind.degree for kind in kinds)
    affine = pairs.slave.affine[pairs.i].all() and pairs.outline.affine[pairs.j].all()
    plain = affine and pairs.slave.directions is None
    # The radius of a ring is one more degree.
    degree += pairs.slave.axisymmetric
    return degree if plain else degree + _BENT_DEGREES


def _areas(pairs: Pairs, behind: Behind, degree: int, curved: bool) -> list[Pieces]:
    """Pieces of what faces have in common: in the slave's plane, or where `curved` in reference."""
    window, bend = pairs.seen(pairs.own, pairs.i)
    subject, bulge = pairs.seen(pairs.outline, pairs.j)
    bends = np.hstack([edge_bends(window, bend), edge_bends(subject, bulge)])
    special = np.asarray(bends.any(axis=1))
    special[behind[0]] = True
    which = np.flatnonzero(~special)
    corner, count = clip(subject[which], np.full(len(which), subject.shape[1]), window[which])
    parts = [(which, Regions(start=corner, bulge=np.zeros_like(corner), count=count))]
    if special.any():
        which = np.flatnonzero(special)
        slave = Regions(
            start=window[which], bulge=bend[which], count=np.full(len(which), window.shape[1])
        )
        faces = subject[which], bulge[which]
        cut = _bent(pairs.of(which), slave, faces, _among(behind, which, len(special)))
        parts += [(which[k], regions) for k, regions in cut]
    return [
        (which[number], points, weight)
        for which, regions in parts
        for number, points, weight in quadrature(
            regions, degree, _into_reference(pairs.of(which)) if curved else None
        )
    ]


def _bent(
    pairs: Pairs, slave: Regions, master: tuple[np.ndarray, np.ndarray], behind: Behind
) -> Parts:
    """What faces have in common where edges are bent, or where others hide some of it."""
    parts = clip_to_face(slave, *master)
    for face, rows in _layers(behind, len(pairs.i)):
        cut = []
        for which, regions in parts:
            deep = rows[which] >= 0
            cut.append((which[~deep], regions.of(~deep)))
            chosen = which[deep]
            outline = pairs.of(chosen).seen(pairs.outline, face[rows[chosen]])
            cut += [(chosen[k], part) for k, part in without_face(regions.of(deep), *outline)]
        parts = cut
    return [(np.concatenate([which for which, _ in parts]), joined([part for _, part in parts]))]


def _into_reference(pairs: Pairs) -> Image:
    """The map of places in the slaves' planes into their reference faces, of slopes as well."""

    def image(
        which: np.ndarray, points: np.ndarray, slopes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        slave, some = pairs.slave, pairs.of(which)
        tangents, corner = slave.tangents[some.i], some.corner
        direction = slave.normal[some.i][:, None]
        targets = np.einsum("sqt,std->sqd", points, tangents)
        place, _ = project_along(slave.type, corner, targets, direction)
        gradients = shape_functions(slave.type.name).gradients(place)
        across = seen_along(corner, tangents)
        _, inverse = invert(np.einsum("sat,sqar->sqtr", across, gradients))
        return place, np.einsum("sqrt,sqt->sqr", inverse, slopes)

    return image


def _layers(behind: Behind, count: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Nearer faces, at most one for each pair at a time: their numbers, and which is whose."""
    hidden, nearer = behind
    layer = np.arange(len(hidden)) - np.searchsorted(hidden, hidden)
    for k in range(int(layer.max(initial=-1)) + 1):
        rows = np.full(count, -1)
        rows[hidden[layer == k]] = np.flatnonzero(layer == k)
        yield nearer, rows


def _intervals(pairs: Pairs, behind: Behind, degree: int, curved: bool) -> list[Pieces]:
    """Intervals of what edges have in common: on straight slaves along them, else in reference."""
    reference, weights = simplex_rule(1, degree)
    window = _ends(pairs, pairs.own, pairs.i, curved)
    ends, _ = overlap(window, _ends(pairs, pairs.outline, pairs.j, curved))
    which = np.arange(len(pairs.i))
    for face, rows in _layers(behind, len(pairs.i)):
        deep = np.flatnonzero(rows[which] >= 0)
        hiding = _ends(pairs.of(which[deep]), pairs.outline, face[rows[which[deep]]], curved)
        beyond = np.stack([np.maximum(ends[deep, 0], hiding[:, 1]), ends[deep, 1]], axis=1)
        ends[deep, 1] = np.minimum(ends[deep, 1], hiding[:, 0])
        ends, which = np.concatenate([ends, beyond]), np.concatenate([which, which[deep]])
    length = ends[:, 1] - ends[:, 0]
    real = length > 0
    points = ends[real, :1] + length[real, None] * reference[:, 0]
    return [(which[real], points[..., None], length[real, None] * weights)]


def _ends(pairs: Pairs, outline: Outlines, j: np.ndarray, curved: bool) -> np.ndarray:
    """The ends (p, 2) of edges `j`, ascending, in the coordinate that the slave is cut in."""
    ends, _ = pairs.seen(outline, j)
    if curved:
        corner = pairs.corner
        own = seen_along(corner, pairs.slave.tangents[pairs.i])
        low, high = own.min(axis=1), own.max(axis=1)
        margin = _MARGIN * (high - low)
        # Far from a bent face, points have no place in its reference face, or a wrong one.
        ends = np.clip(ends, (low - margin)[:, None], (high + margin)[:, None])
        points = np.einsum("sat,std->sad", ends, pairs.slave.tangents[pairs.i])
        direction = pairs.slave.normal[pairs.i][:, None]
        ends, _ = project_along(pairs.slave.type, corner, points, direction, outline=True)
    return np.sort(ends[..., 0], axis=1)


# Points on both faces


def _with_master(pairs: Pairs, pieces: Pieces, reach: float, curved: bool) -> Iterator[Segments]:
    """The segments of pieces; those with points beyond the reach are left out."""
    which, points, weight = pieces
    pairs = pairs.of(which)
    slave, i = pairs.slave, pairs.i
    kind, corner = slave.type, pairs.corner
    if curved:
        place = points
        values, slopes = shape_functions(kind.name).both(place)
        points = np.einsum("sqa,sad->sqd", values, corner)
        vectors = area_vectors_at(corner, slopes)
        stretch = np.linalg.norm(vectors, axis=-1)
        normal, weight = vectors / stretch[..., None], weight * stretch
    else:
        normal = slave.normal[i][:, None]
        points = np.einsum("sqt,std->sqd", points, slave.tangents[i])
        place, height = project_along(
            kind, corner, points, normal, affine=bool(slave.affine[i].all())
        )
        points = points + height[..., None] * normal
        values = shape_functions(kind.name).values(place)
    if slave.axisymmetric:
        weight = weight * circumference(points + slave.centre[i][:, None])
    if slave.directions is not None:
        between = np.einsum("sqa,sad->sqd", values, slave.directions[i])
        normal = between / np.linalg.norm(between, axis=-1, keepdims=True)
    for index, master in enumerate(pairs.masters):
        mine = np.flatnonzero(pairs.outline.block[pairs.j] == index)
        face = pairs.outline.face[pairs.j[mine]]
        corner = master.corner[face] - slave.centre[i[mine]][:, None]
        affine = bool(master.affine[face].all())
        partner, gap = project_along(master.type, corner, points[mine], normal[mine], affine=affine)
        near = np.abs(gap).max(axis=1, initial=0.0) <= reach
        mine = mine[near]
        if len(mine):
            on_master = shape_functions(master.type.name).values(partner[near])
            yield Segments(
                slave=Side(faces=slave, index=pairs.index, face=i[mine], values=values[mine]),
                master=Side(faces=master, index=index, face=face[near], values=on_master),
                weight=weight[mine],
                normal=np.broadcast_to(normal[mine], points[mine].shape),
                gap=gap[near],
            )


def area_vectors_at(corner: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Normal × surface measure (s, q, dim) of faces (s, n_nodes, dim) at points of their own.

    `slopes` (s, q, n_nodes, dim − 1): the gradients of their shape functions there.

    >>> area_vectors_at(slave.corner, np.array([[[[-1.0], [1.0]]]])).tolist()
    [[[0.0, 2.0]]]
    """
    tangent = np.einsum("sad,sqat->sqtd", corner, slopes)
    if corner.shape[2] == 2:
        return np.stack([tangent[:, :, 0, 1], -tangent[:, :, 0, 0]], axis=-1)
    return np.cross(tangent[:, :, 0], tangent[:, :, 1])
