"""Contact along the normals of the master: for planes and smooth obstacles.

A slave of linear cells is faceted where it is bent, and its own normals jump from face to face. The
normal of the obstacle does not: gaps are then distances from it, and forces are along its normal.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .cells.catalogue import CellType
from .cells.faces import nodal_normals
from .cells.shape import shape_functions
from .facets import FLAT, Facets, project_along

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
    normals = nodal_normals(points, [(block.type.name, block.nodes) for block in masters])
    nodes = np.unique(np.concatenate([block.nodes.ravel() for block in slaves]))
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
    from scipy.spatial import cKDTree  # a quarter of the time that the package takes to load

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
