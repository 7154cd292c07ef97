"""Faces as the mortar module sees them: frames, sizes, shape, and points found along a line.

Contact may follow the normals of the master, of planes and smooth obstacles. A slave of linear
cells is faceted where it is bent, and its own normals jump from face to face. The normal of the
obstacle does not: gaps are then distances from it, and forces are along its normal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .cells.catalogue import CellType
from .cells.faces import FLAT, area_vectors, surface_nodes, surface_normals, surface_vectors
from .cells.shape import invert, shape_functions
from .errors import SolveError

# Below this share of a face's size, the skew of its map is round-off.
_AFFINE = 1e-12
# Newton's method stops at steps below the first (in parts of a face) and accepts the second.
_CONVERGED, _ACCEPTED = 1e-13, 1e-8
_NEWTON_STEPS = 30
# Points that it loses are approached from the middle of the face in as many stages.
_STAGES = 32


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Faces of one type with what the pairing and the intersections need, per face.

    `nodes` (n, n_nodes); `number` (n,) the caller's number; `corner` (n, n_nodes, dim) coordinates;
    `centre` (n, dim); `radius` (n,); `normal` (n, dim) outward at the centre; `tangents`
    (n, dim − 1, dim) completing it to a right-handed frame; `flat` (n,): planar; `straight` (n,):
    planar with straight edges; `affine` (n,): straight, and the image of the reference face under
    an affine map; `turn` (n,): the largest angle between `normal` and the normal at a vertex;
    `directions` (n, n_nodes, dim): the unit normals along which a slave face meets its master, at
    its nodes. None: those of the face itself. `axisymmetric`: they are sections of
    rings about the axis x = 0, and integrals over them are those over the rings.
    """

    type: CellType
    nodes: np.ndarray
    number: np.ndarray
    corner: np.ndarray
    centre: np.ndarray
    radius: np.ndarray
    normal: np.ndarray
    tangents: np.ndarray
    flat: np.ndarray
    straight: np.ndarray
    affine: np.ndarray
    turn: np.ndarray
    directions: np.ndarray | None = None
    axisymmetric: bool = False


def with_nodal_normals(blocks: list[Facets], points: np.ndarray) -> list[Facets]:
    """The faces of one surface, with the mean normals at its nodes as their directions.

    On a plane these are the face's own, and the faces stay as they are. Source: Yang, Laursen,
    Meng, Two dimensional mortar contact methods for large deformation frictional sliding, Int. J.
    Numer. Meth. Engng 62 (2005) 1183–1225, §3.

    On a plane nothing changes:

    >>> with_nodal_normals([master], points)[0].directions is None
    True
    """
    normals = surface_normals(points, blocks)
    differ = max(np.abs(normals[b.nodes] - b.normal[:, None]).max(initial=0.0) for b in blocks)
    if differ <= FLAT:
        return blocks
    return [replace(block, directions=normals[block.nodes]) for block in blocks]


def facets(
    points: np.ndarray,
    kind: CellType,
    nodes: np.ndarray,
    number: np.ndarray,
    axisymmetric: bool = False,
) -> Facets:
    """Faces of one type from points (n_points, dim) and node numbers (n, n_nodes).

    Raises SolveError for faces of no size, as beside a node that lies beyond all measure.

    >>> ends = np.array([[4.0, 0.0], [1.0, 0.0]])
    >>> edge = facets(ends, BY_NAME["SEG2"], np.array([[0, 1]]), np.array([0]))
    >>> edge.centre.tolist(), edge.radius.tolist(), edge.normal.tolist()
    ([[2.5, 0.0]], [1.5], [[0.0, 1.0]])
    """
    corner = points[nodes]
    centre = corner[:, : kind.n_vertices].mean(axis=1)
    radius = np.linalg.norm(corner - centre[:, None], axis=2).max(axis=1)
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    slope = shape_functions(kind.name).gradients(middle[None])
    normal = area_vectors(points, nodes, slope)[:, 0]
    size = np.linalg.norm(normal, axis=1)
    if not (size > 0).all():
        lost = int((~(size > 0)).sum())
        raise SolveError(f"{lost} {kind.name} faces have no size left in the precision of the mesh")
    normal /= size[:, None]
    flat, straight, affine = _shape(kind, corner - centre[:, None], radius, normal)
    return Facets(
        type=kind,
        nodes=nodes,
        number=number,
        corner=corner,
        centre=centre,
        radius=radius,
        normal=normal,
        tangents=tangents_of(normal),
        flat=flat,
        straight=straight,
        affine=affine,
        turn=np.where(straight, 0.0, _turn(kind, points, nodes, normal)),
        axisymmetric=axisymmetric,
    )


def _turn(kind: CellType, points: np.ndarray, nodes: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The largest angle (n,) between the normal at the centre and those at the vertices."""
    slopes = shape_functions(kind.name).gradients(kind.nodes[: kind.n_vertices])
    vectors = area_vectors(points, nodes, slopes)
    size = np.linalg.norm(vectors, axis=2)
    cosine = np.einsum("fqd,fd->fq", vectors, normal) / np.where(size > 0, size, 1.0)
    return np.arccos(np.clip(cosine, -1.0, 1.0)).max(axis=1)


def tangents_of(normal: np.ndarray) -> np.ndarray:
    """Unit tangents (n, dim − 1, dim) that complete unit normals (n, dim) to frames.

    >>> tangents_of(np.array([[0.0, 1.0]])).tolist()
    [[[-1.0, 0.0]]]
    """
    if normal.shape[1] == 2:
        return np.stack([-normal[:, 1], normal[:, 0]], axis=1)[:, None]
    axis = np.zeros_like(normal)
    axis[np.arange(len(normal)), np.abs(normal).argmin(axis=1)] = 1.0
    first = np.cross(axis, normal)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normal, first)], axis=1)


def _shape(
    kind: CellType, corner: np.ndarray, radius: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which faces are flat, which straight-edged as well, and which affine images."""
    bend = np.abs(np.einsum("fad,fd->fa", corner, normal)).max(axis=1)
    flat = bend <= FLAT * radius
    n, edges = kind.n_vertices, np.array(kind.edges)
    if kind.order == 2 and kind.dim == 2:
        ends = corner[:, edges]
        chord = ends[:, :, 1] - ends[:, :, 0]
        offset = corner[:, n : n + len(edges)] - ends.mean(axis=2)
        across = np.einsum("fed,fed->fe", offset, chord) / np.einsum("fed,fed->fe", chord, chord)
        sideways = np.linalg.norm(offset - across[..., None] * chord, axis=2).max(axis=1)
        bend = np.maximum(bend, sideways)
    first = corner[:, :1]
    sides = corner[:, [1, n - 1]] - first if kind.dim == 2 else corner[:, [1]] - first
    image = first + np.einsum("ar,frd->fad", kind.nodes - kind.nodes[0], sides)
    skew = np.linalg.norm(image - corner, axis=2).max(axis=1)
    straight = bend <= FLAT * radius
    return flat, straight, straight & (skew <= _AFFINE * radius)


def measured(block: Facets, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions (q, n_nodes) at reference points, and outward n dS (n, q, dim) there.

    The edge from (2, 0) to (0, 0), in its middle:

    >>> values, vectors = measured(slave, np.array([[0.5]]))
    >>> values.tolist(), vectors.tolist()
    ([[0.5, 0.5]], [[[0.0, 2.0]]])
    """
    n, n_nodes, dim = block.corner.shape
    nodes, points = np.arange(n * n_nodes).reshape(n, n_nodes), block.corner.reshape(-1, dim)
    return surface_vectors(points, nodes, block.type.name, reference, block.axisymmetric)


def project_along(
    kind: CellType,
    corner: np.ndarray,
    target: np.ndarray,
    direction: np.ndarray,
    outline: bool = False,
    affine: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Where lines through points meet faces: reference points (f, q, dim − 1), distances (f, q).

    One face `corner` (f, n_nodes, dim) for each row of `target` (f, q, dim) and unit `direction`
    (f, q or 1, dim); the meeting point is target + distance · direction. Newton from the affine
    face through the vertices, whose tangents serve where all faces are `affine`. Raises SolveError
    where it does not converge; points of an `outline` around the face then keep their place on the
    affine face (they lie outside the face, and all that matters is that neighbours agree on them).

    Up from (3/4, 0) to the edge from (0, 1/2) to (1, 1/2):

    >>> up = np.array([[[0.0, 1.0]]])
    >>> place, distance = project_along(
    ...     master.type, master.corner[:1], np.array([[[0.75, 0.0]]]), up
    ... )
    >>> place.tolist(), distance.tolist()
    ([[[0.75]]], [[0.5]])
    """
    start, distance, inverse = _on_affine_face(kind, corner, target, direction)
    if affine:
        values = shape_functions(kind.name).values(start)
        error = _error(values, corner, target, direction, distance)
        step = np.einsum("fqij,fqj->fqi", inverse, error)
        place, distance = start - step[..., :-1], distance - step[..., -1]
        size = np.abs(step[..., :-1]).max(axis=-1, initial=0.0)
    else:
        direction = np.broadcast_to(direction, target.shape)
        place, distance, size = _newton(kind, corner, target, direction, start, distance)
    lost = ~(size <= _ACCEPTED)
    if outline:
        return np.where(lost[..., None], start, place), distance
    if lost.any():
        face, q = np.nonzero(lost)
        direction = np.broadcast_to(direction, target.shape)
        again, height, size = _from_the_middle(
            kind, corner[face], target[face, q][:, None], direction[face, q][:, None]
        )
        place[lost], distance[lost] = again[:, 0], height[:, 0]
        lost[lost] = ~(size[:, 0] <= _ACCEPTED)
    if lost.any():
        raise SolveError(f"{int(lost.sum())} points could not be projected onto {kind.name} faces")
    return place, distance


def _newton(
    kind: CellType,
    corner: np.ndarray,
    target: np.ndarray,
    direction: np.ndarray,
    place: np.ndarray,
    distance: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, distances, and the sizes (f, q) of the last steps; done faces are left alone."""
    size = np.full(distance.shape, np.inf)
    place, distance = np.array(place), np.array(distance)
    for _ in range(_NEWTON_STEPS):
        rows = np.flatnonzero(~(size <= _CONVERGED).all(axis=1))
        if not len(rows):
            break
        step = _newton_step(
            kind, corner[rows], target[rows], direction[rows], place[rows], distance[rows]
        )
        place[rows] -= step[..., :-1]
        distance[rows] -= step[..., -1]
        size[rows] = np.abs(step[..., :-1]).max(axis=-1, initial=0.0)
    return place, distance, size


def _from_the_middle(
    kind: CellType, corner: np.ndarray, target: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same, going from the middle of the face to the point: for faces bent up to folding."""
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    values = shape_functions(kind.name).values(middle)
    centre = np.einsum("a,fad->fd", values, corner)[:, None]
    place = np.broadcast_to(middle, (*target.shape[:2], kind.dim))
    distance = np.zeros(target.shape[:2])
    for share in np.arange(1, _STAGES + 1) / _STAGES:
        between = centre + share * (target - centre)
        place, distance, size = _newton(kind, corner, between, direction, place, distance)
    return place, distance, size


def _on_affine_face(
    kind: CellType, corner: np.ndarray, target: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same for the affine faces through the first vertices, and their inverse tangents."""
    n = kind.n_vertices
    sides = corner[:, [1, n - 1]] if kind.dim == 2 else corner[:, [1]]
    sides = np.swapaxes(sides - corner[:, :1], 1, 2)[:, None]
    sides = np.broadcast_to(sides, (*direction.shape[:2], *sides.shape[2:]))
    _, inverse = invert(np.concatenate([sides, -direction[..., None]], axis=-1))
    found = np.einsum("fqij,fqj->fqi", inverse, target - corner[:, :1])
    return found[..., :-1], found[..., -1], inverse


def _newton_step(
    kind: CellType,
    corner: np.ndarray,
    target: np.ndarray,
    direction: np.ndarray,
    place: np.ndarray,
    distance: np.ndarray,
) -> np.ndarray:
    """Step (f, q, dim) of place and distance, at most one face length at a time."""
    values, slopes = shape_functions(kind.name).both(place)
    error = _error(values, corner, target, direction, distance)
    tangent = np.einsum("fad,fqat->fqdt", corner, slopes, optimize=True)
    _, inverse = invert(np.concatenate([tangent, -direction[..., None]], axis=-1))
    step = np.einsum("fqij,fqj->fqi", inverse, error)
    # Far outside a bent face the full step may overshoot.
    length = np.abs(step[..., :-1]).max(axis=-1, initial=0.0)
    with np.errstate(invalid="ignore"):  # a face seen edge-on: no place on it is found
        return step / np.maximum(length, 1.0)[..., None]


def _error(
    values: np.ndarray,
    corner: np.ndarray,
    target: np.ndarray,
    direction: np.ndarray,
    distance: np.ndarray,
) -> np.ndarray:
    """How far (f, q, dim) the places with these shape functions are from those on the lines."""
    return np.einsum("fqa,fad->fqd", values, corner) - target - distance[..., None] * direction


# Points of the master are equally near if their distances differ by less than this share of the
# size of its faces.
_EQUALLY = 1e-9


def with_master_normals(
    slaves: list[Facets], masters: Sequence[Facets], points: np.ndarray
) -> list[Facets]:
    """The slave's faces with the master's normals as their directions, from nearest points.

    The normals are the means at the master's nodes, interpolated. A slave in a plane opposite to a
    plane master stays as it is:

    >>> with_master_normals([slave], [master], points)[0].directions is None
    True
    """
    normals = surface_normals(points, masters)
    nodes = surface_nodes(slaves)
    directions = np.zeros_like(points)
    directions[nodes] = -_nearest_normals(points[nodes], masters, normals)
    return with_directions(slaves, directions)


def with_directions(slaves: list[Facets], vectors: np.ndarray) -> list[Facets]:
    """The faces with directions along vectors (n_points, dim), or as they are if along their own.

    >>> [leaning] = with_directions([slave], np.array([[0.0, 2.0], [0.6, 0.8]]))
    >>> leaning.directions.tolist()
    [[[0.6, 0.8], [0.0, 1.0]]]
    """
    found = [vectors[block.nodes] for block in slaves]
    found = [along / np.linalg.norm(along, axis=2, keepdims=True) for along in found]
    differ = max(
        np.abs(along - b.normal[:, None]).max() for along, b in zip(found, slaves, strict=True)
    )
    if differ <= FLAT:
        return slaves
    return [replace(b, directions=along) for along, b in zip(found, slaves, strict=True)]


def _nearest_normals(
    places: np.ndarray, masters: Sequence[Facets], normals: np.ndarray
) -> np.ndarray:
    """The interpolated unit normals (n, dim) of the master at the points nearest to `places`.

    Where several points are equally near, the mean of their normals: it does not depend on the
    order of the faces.
    """
    from scipy.spatial import cKDTree

    corners = np.concatenate([block.corner.reshape(-1, places.shape[1]) for block in masters])
    limit, _ = cKDTree(corners).query(places)
    owner, distances, found = [], [], []
    for block in masters:
        tree = cKDTree(block.centre)
        reach = (limit + block.radius.max()) * (1 + _EQUALLY)
        near = tree.query_ball_point(places, reach)
        i = np.repeat(np.arange(len(places)), [len(faces) for faces in near])
        j = np.concatenate([np.asarray(faces, dtype=int) for faces in near])
        target, direction = places[i][:, None], block.normal[j][:, None]
        place, _ = project_along(block.type, block.corner[j], target, direction, outline=True)
        values = shape_functions(block.type.name).values(_inside(block.type, place))
        point = np.einsum("pqa,pad->pd", values, block.corner[j])
        normal = np.einsum("pqa,pad->pd", values, normals[block.nodes[j]])
        owner.append(i)
        distances.append(np.linalg.norm(point - places[i], axis=1))
        found.append(normal / np.linalg.norm(normal, axis=1)[:, None])
    i, distance, normal = (np.concatenate(part) for part in (owner, distances, found))
    nearest = np.full(len(places), np.inf)
    np.minimum.at(nearest, i, distance)
    size = limit + max(block.radius.max() for block in masters)
    equal = distance <= nearest[i] + _EQUALLY * size[i]
    total = np.zeros_like(places)
    np.add.at(total, i[equal], normal[equal])
    return total / np.linalg.norm(total, axis=1)[:, None]


def _inside(kind: CellType, place: np.ndarray) -> np.ndarray:
    """Reference points (…, dim) moved to the nearest ones on the reference face, roughly."""
    place = np.clip(place, kind.nodes.min(), kind.nodes.max())
    if kind.n_vertices == 3:
        place = place / np.maximum(place.sum(axis=-1, keepdims=True), 1.0)
    return place
