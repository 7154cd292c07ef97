"""Faces of cells: who owns them, their outward normals, and quadrature points on them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from .catalogue import CellType, cell_type
from .gauss import gauss_rule
from .shape import shape_functions

# Points each way on a face: enough for pressures that end with a vertical tangent.
FACE_POINTS = 8
# A block of faces of one type: its name, nodes (f, n_nodes), macro-elements (f,).
SlaveFaces = tuple[str, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class FaceBlock:
    """Faces of one type whose owners are of one type.

    `nodes` (n, n_nodes) turned outward; `number` (n,) their places in the group; `owner` (n,) the
    owner's index in the mesh's block of type `owner_type`; `local` (n,) which of its faces it is.
    """

    type: CellType
    nodes: np.ndarray
    number: np.ndarray
    owner_type: CellType
    owner: np.ndarray
    local: np.ndarray

    def of(self, chosen: np.ndarray) -> Self:
        """The chosen faces, by mask or numbers."""
        parts = {
            name: getattr(self, name)[chosen] for name in ("nodes", "number", "owner", "local")
        }
        return replace(self, **parts)

    def common(self, other: "FaceBlock") -> tuple[np.ndarray, np.ndarray]:
        """The numbers in both blocks (k,) of the faces that both have."""
        if self.owner_type is not other.owner_type or self.type is not other.type:
            return np.empty(0, dtype=int), np.empty(0, dtype=int)
        keys = (10 * block.owner + block.local for block in (self, other))
        _, mine, theirs = np.intersect1d(*keys, return_indices=True)
        return mine, theirs


def area_vectors(points: np.ndarray, nodes: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """Outward normal × surface measure (n, q, dim) of faces, from shape gradients at q points.

    `tangents` (q, n_nodes, dim − 1) are the face type's reference gradients.
    """
    corner = points[nodes]
    slope = np.einsum("fad,qat->fqtd", corner - corner[:, :1], tangents, optimize=True)
    if points.shape[1] == 2:
        tangent = slope[:, :, 0]
        return np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1)
    return np.cross(slope[:, :, 0], slope[:, :, 1])


def circumference(places: np.ndarray) -> np.ndarray:
    """2πr (…,) at places (…, 2) of a meridian plane, whose first coordinate is the radius r.

    >>> circumference(np.array([[0.5, 7.0]])) == np.pi
    array([ True])
    """
    return 2 * np.pi * places[..., 0]


def surface_vectors(
    points: np.ndarray,
    nodes: np.ndarray,
    face_type: str,
    reference: np.ndarray,
    axisymmetric: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions (q, n_nodes) at reference points, and outward n dS (n, q, dim) there.

    `axisymmetric`: dS is the area of a whole ring, 2πr times the length in the meridian plane.
    """
    values, tangents = shape_functions(face_type).both(reference)
    vectors = area_vectors(points, nodes, tangents)
    if axisymmetric:
        vectors = vectors * circumference(values @ points[nodes])[..., None]
    return values, vectors


def nodal_normals(points: np.ndarray, faces: list[tuple[str, np.ndarray]]) -> np.ndarray:
    """Unit normals (n_points, dim) of a surface of faces (type, nodes) at its nodes.

    The mean of the normals there of the faces around a node, weighted by area; zero away from the
    surface. Components of round-off size are zero, so that a plane along the axes has normals along
    the axes.
    """
    total = np.zeros_like(points)
    for name, nodes in faces:
        kind = cell_type(name)
        np.add.at(
            total, nodes, area_vectors(points, nodes, shape_functions(name).gradients(kind.nodes))
        )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    total /= np.where(length > 0, length, 1.0)
    total[np.abs(total) < 16 * np.finfo(float).eps] = 0.0
    return total


@dataclass(frozen=True)
class SurfacePoints:
    """Quadrature points on faces: `place` (k, dim), `weight` (k,), `macro` (k,) of the face."""

    place: np.ndarray
    weight: np.ndarray
    macro: np.ndarray

    def means(self, values: np.ndarray) -> np.ndarray:
        """The mean of values (k,) over each macro-element."""
        return np.bincount(self.macro, self.weight * values) / np.bincount(self.macro, self.weight)


def surface_points(
    points: np.ndarray, faces: Sequence[SlaveFaces], axisymmetric: bool = False
) -> SurfacePoints:
    """Points all over a slave surface."""
    place, weight, macro = [], [], []
    for name, nodes, owner in faces:
        kind = cell_type(name)
        reference, weights = gauss_rule(kind.name, FACE_POINTS)
        values, slopes = shape_functions(kind.name).both(reference)
        # Straight lines and flat triangles: one point serves for all.
        slopes = slopes[:1] if (slopes == slopes[:1]).all() else slopes
        measure = np.linalg.norm(area_vectors(points, nodes, slopes), axis=2) * weights
        where = np.einsum("qa,fad->fqd", values, points[nodes], optimize=True)
        if axisymmetric:
            measure *= circumference(where)
        place.append(where.reshape(-1, points.shape[1]))
        weight.append(measure.ravel())
        macro.append(np.repeat(owner, len(weights)))
    return SurfacePoints(np.concatenate(place), np.concatenate(weight), np.concatenate(macro))
