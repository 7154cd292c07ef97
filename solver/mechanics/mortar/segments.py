"""Mortar segments: the pieces of the slave surface that lie over one master face each.

Straight slave faces are cut in their own plane, seen along their normal; bent ones in their
reference face, into which the master's outline is projected. Every quadrature point of a segment
knows its place on both faces, found along the slave's normal at that point (that of the face, or
one interpolated between the mean normals at its nodes), so that both sides of an integral share one
normal and one surface measure. Source: Puso, Laursen, A mortar
segment-to-segment contact method, CMAME 193 (2004) 601–629, for segments; Abbas et al. (2018), §4.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from solver.mechanics.fem import mortar_degree, shape_functions, simplex_rule
from solver.mechanics.fem.small_matrices import invert
from solver.mechanics.mortar.clipping import clip, overlap, placed, triangles
from solver.mechanics.mortar.facets import Facets, locate, shift
from solver.mechanics.mortar.pairing import candidate_pairs
from solver.mesh.catalogue import CellType

# A master face may meet a slave face only where their normals oppose at least this much.
_FACING = 0.2
# Extra degrees where a face is not the affine image of its reference face: its functions are then
# no polynomials in the plane.
_BENT_DEGREES = 6
# More than what rounding makes of a distance, as a share of it.
_ROUNDING = 1e-9
# Pairs cut at once: few enough for their polygons to stay in the processor's cache.
_PAIRS_AT_ONCE = 4096
# The straight edges around a bent face are moved outward by twice what its mid-nodes ask for, since
# an edge may reach beyond its mid-node, and by this share of their distance from the centre.
_MARGIN = 0.05


@dataclass(frozen=True)
class Segments:
    """Segments between slave faces of one type and master faces of one type.

    `slave`, `master` (s,) index the two Facets; at each of q points: `slave_values`,
    `master_values` (s, q, n_nodes) shape functions, `weight` (s, q) surface measure × quadrature
    weight, `normal` (s, q, dim) the slave's and `gap` (s, q) the distance along it, positive when
    open. `whole` (s,): parts of slave faces that lie within the master face and were not clipped.
    """

    slave: np.ndarray
    master: np.ndarray
    slave_values: np.ndarray
    master_values: np.ndarray
    weight: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    whole: np.ndarray


def intersect(
    slave: Facets, master: Facets, reach: float, more: int = 0, clip_all: bool = False
) -> list[Segments]:
    """All segments between two blocks of faces, looked for within `reach` (a length).

    Their quadrature is exact for shape functions of affine faces times polynomials of degree
    `more`. `clip_all`: faces that lie within others are clipped as well.
    """
    i, j = facing_pairs(slave, master, reach)
    straight = slave.straight[i]
    in_plane = partial(_in_plane, clip_all=clip_all)
    charts = (
        (np.flatnonzero(straight & _above_each_other(slave, master, i, j)), in_plane),
        (np.flatnonzero(~straight), _in_reference),
    )
    parts = []
    for pairs, chart in charts:
        for start in range(0, len(pairs), _PAIRS_AT_ONCE):
            some = pairs[start : start + _PAIRS_AT_ONCE]
            parts.append(chart(slave, master, (i[some], j[some]), reach, more))
    return [part for part in parts if len(part.slave)]


def facing_pairs(slave: Facets, master: Facets, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (slave number, master number) of faces within `reach` that look at each other."""
    i, j = candidate_pairs(slave.centre, slave.radius, master.centre, master.radius, reach)
    facing = np.einsum("pd,pd->p", slave.normal[i], master.normal[j]) < -_FACING
    return i[facing], j[facing]


def _above_each_other(slave: Facets, master: Facets, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Which pairs (p,) may overlap, seen along the slave's normal: their balls do."""
    between = master.centre[j] - slave.centre[i]
    beside = np.einsum("pd,ptd->pt", between, slave.tangents[i])
    return np.linalg.norm(beside, axis=1) <= (1 + _ROUNDING) * (slave.radius[i] + master.radius[j])


def _in_plane(
    slave: Facets,
    master: Facets,
    pair: tuple[np.ndarray, np.ndarray],
    reach: float,
    more: int,
    clip_all: bool,
) -> Segments:
    """Segments of straight slave faces, cut in the plane of the slave face."""
    i, j = pair
    tangents = slave.tangents[i]
    outline = _outline(slave.type, bent=False)
    window = _plane(shift(slave, i, slave.centre[i])[:, outline], tangents)
    outline = _outline(master.type, bent=not master.straight[j].all())
    subject = _plane(shift(master, j, slave.centre[i])[:, outline[::-1]], tangents)
    degree = _degree(slave, master, i, j) + more
    whole = np.zeros(len(i), dtype=bool)
    if window.shape[2] == 2 and not clip_all:
        meeting, whole = _meeting(window, subject, i, bool(master.straight[j].all()))
        i, j, window, subject = (x[meeting] for x in (i, j, window, subject))
    count = np.full(len(i), subject.shape[1])
    which, places, weight = _cut_pieces(window, subject, count, degree, whole)
    i, j, whole = i[which], j[which], whole[which]
    points = np.einsum("sqt,std->sqd", places, slave.tangents[i])
    normal = np.broadcast_to(slave.normal[i][:, None], points.shape)
    place, height = locate(slave.type, shift(slave, i, slave.centre[i]), points, normal)
    points = points + height[..., None] * normal
    normal = _directions(slave, i, place, normal)
    return _with_master(slave, master, (i, j), place, points, weight, normal, reach, whole)


def _meeting(
    window: np.ndarray, subject: np.ndarray, slave: np.ndarray, convex: bool
) -> tuple[np.ndarray, np.ndarray]:
    """The pairs (k,) with a common area, and which of them (k,) are slave faces within the master.

    Polygons (n, v, 2) of pairs, of the slave faces numbered `slave` (n,).
    """
    within, apart, nearly = placed(window, subject, convex)
    held = np.zeros(slave.max(initial=-1) + 1, dtype=bool)
    held[slave[within]] = True
    # A face that counts as a whole has no sliver on the next master face.
    meeting = np.flatnonzero(within | ~np.where(held[slave], nearly, apart))
    return meeting, within[meeting]


def _in_reference(
    slave: Facets, master: Facets, pair: tuple[np.ndarray, np.ndarray], reach: float, more: int
) -> Segments:
    """Segments of bent slave faces, cut in the reference face of the slave."""
    i, j = pair
    kind = slave.type
    corner = shift(slave, i, slave.centre[i])
    outline = _outline(master.type, bent=True)
    rim = _plane(shift(master, j, slave.centre[i])[:, outline[::-1]], slave.tangents[i])
    rim, count = _near(_plane(corner, slave.tangents[i]), kind.n_vertices, rim)
    used = np.arange(rim.shape[1]) < count[:, None]
    rim = np.where(used[..., None], rim, rim[:, :1])
    some = count > 0
    i, j, corner, rim, count = i[some], j[some], corner[some], rim[some], count[some]
    rim = np.einsum("sat,std->sad", rim, slave.tangents[i])
    direction = np.broadcast_to(slave.normal[i][:, None], rim.shape)
    subject, _ = locate(kind, corner, rim, direction, outline=True)
    window = kind.nodes[_outline(kind, bent=False)]
    window = np.broadcast_to(window, (len(i), *window.shape))
    degree = _degree(slave, master, i, j) + more
    none = np.zeros(len(i), dtype=bool)
    which, place, weight = _cut_pieces(window, subject, count, degree, none)
    i, j = i[which], j[which]
    values, slopes = shape_functions(kind.name).both(place)
    corner = shift(slave, i, slave.centre[i])
    points = np.einsum("sqa,sad->sqd", values, corner)
    vectors = _area_vectors_at(corner, slopes)
    stretch = np.linalg.norm(vectors, axis=-1)
    normal = _directions(slave, i, place, vectors / stretch[..., None])
    weight, none = weight * stretch, none[which]
    return _with_master(slave, master, (i, j), place, points, weight, normal, reach, none)


def _directions(slave: Facets, i: np.ndarray, place: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Unit vectors (s, q, dim) towards the master: the given normals, or those between nodes."""
    if slave.directions is None:
        return normal
    values = shape_functions(slave.type.name).values(place)
    between = np.einsum("sqa,sad->sqd", values, slave.directions[i])
    return between / np.linalg.norm(between, axis=-1, keepdims=True)


def _area_vectors_at(corner: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Normal × surface measure (s, q, dim) where every face has its own points."""
    s, q, n_nodes, _ = slopes.shape
    points = np.repeat(corner, q, axis=0).reshape(s * q * n_nodes, -1)
    nodes = np.arange(len(points)).reshape(s * q, n_nodes)
    tangent = np.einsum("fad,fat->ftd", points[nodes], slopes.reshape(s * q, n_nodes, -1))
    if points.shape[1] == 2:
        vectors = np.stack([tangent[:, 0, 1], -tangent[:, 0, 0]], axis=-1)
    else:
        vectors = np.cross(tangent[:, 0], tangent[:, 1])
    return vectors.reshape(s, q, -1)


def _with_master(
    slave: Facets,
    master: Facets,
    pair: tuple[np.ndarray, np.ndarray],
    place: np.ndarray,
    points: np.ndarray,
    weight: np.ndarray,
    normal: np.ndarray,
    reach: float,
    whole: np.ndarray,
) -> Segments:
    """Find each point's partner on the master face; leave out segments beyond the reach."""
    i, j = pair
    partner, gap = locate(master.type, shift(master, j, slave.centre[i]), points, normal)
    near = np.abs(gap).max(axis=1, initial=0.0) <= reach
    return Segments(
        i[near],
        j[near],
        shape_functions(slave.type.name).values(place[near]),
        shape_functions(master.type.name).values(partner[near]),
        weight[near],
        normal[near],
        gap[near],
        whole[near],
    )


def _outline(kind: CellType, bent: bool) -> list[int]:
    """The face's rim as a closed polygon: vertices, with mid-nodes where edges may be bent."""
    if kind.dim == 1:
        return [0, 1]
    return list(kind.boundary) if bent else list(range(kind.n_vertices))


def _plane(corner: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    return np.einsum("fad,ftd->fat", corner, tangents)


def _degree(slave: Facets, master: Facets, i: np.ndarray, j: np.ndarray) -> int:
    degree = max(mortar_degree(slave.type.name), mortar_degree(master.type.name))
    affine = slave.affine[i].all() and master.affine[j].all() and slave.directions is None
    return degree if affine else degree + _BENT_DEGREES


def _near(face: np.ndarray, n_vertices: int, rim: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of each rim (n, v, d) around its face (n, a, d), both seen in a plane, and counts.

    Far from a bent face, points have no place in its reference face, or a wrong one.
    """
    if face.shape[2] == 1:
        low, high = face.min(axis=1), face.max(axis=1)
        margin = _MARGIN * (high - low)
        ends, length = overlap(np.hstack([low - margin, high + margin]), np.sort(rim[..., 0], 1))
        return ends[..., None], np.where(length > 0, 2, 0)
    vertices = face[:, :n_vertices]
    centre = vertices.mean(axis=1, keepdims=True)
    side = np.roll(vertices, -1, axis=1) - vertices
    outward = np.stack([side[..., 1], -side[..., 0]], axis=-1)
    inner = np.einsum("fed,fed->fe", outward, vertices - centre)
    reach = np.einsum("fed,fad->fea", outward, face - centre).max(axis=2)
    offset = (1 + _MARGIN) * inner + 2 * (reach - inner)
    # A corner of the window is where two neighbouring edges, moved outward, meet.
    lines = np.stack([np.roll(outward, 1, axis=1), outward], axis=2)
    values = np.stack([np.roll(offset, 1, axis=1), offset], axis=2)
    window = centre + np.einsum("feij,fej->fei", invert(lines)[1], values)
    return clip(rim, np.full(len(rim), rim.shape[1]), window)


def _cut_pieces(
    window: np.ndarray, subject: np.ndarray, count: np.ndarray, degree: int, whole: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pieces of the subjects within the windows: pair (s,), points (s, q, d), weights (s, q).

    Polygons (n, v, 2) of `count` (n,) vertices in 3D; intervals (n, 2, 1) in 2D. `whole` (n,)
    windows are known to lie within their subjects.
    """
    dim = window.shape[2]
    reference, weights = simplex_rule(dim, degree)
    if dim == 1:
        ends, length = overlap(np.sort(window[..., 0], axis=1), np.sort(subject[..., 0], axis=1))
        pair = np.flatnonzero(length > 0)
        points = ends[pair, :1] + length[pair, None] * reference[:, 0]
        return pair, points[..., None], length[pair, None] * weights
    part, full = np.flatnonzero(~whole), np.flatnonzero(whole)
    clipped = triangles(*clip(subject[part], count[part], window[part]))
    kept = triangles(window[full], np.full(len(full), window.shape[1]))
    pair = np.concatenate([part[clipped[0]], full[kept[0]]])
    corner, area = (np.concatenate(both) for both in zip(clipped[1:], kept[1:], strict=True))
    barycentric = np.column_stack([1 - reference.sum(axis=1), reference])
    points = np.einsum("qk,skt->sqt", barycentric, corner)
    return pair, points, 2 * area[:, None] * weights
