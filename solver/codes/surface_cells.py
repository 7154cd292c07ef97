"""The surface cells of a foreign mesh: where they lie on the slave faces of a case, and how large.

Values of cells are means. Those of the parts of a slave face, as of a face that was cut, make its
mean.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import meshio
import numpy as np

from ..lac.cells.catalogue import BY_MESHIO, CellType
from ..lac.cells.faces import surface_points

# The parts of a face fill it up to this share of its area.
_FILLED = 0.02


def corners_of(points: np.ndarray, kind: CellType, nodes: np.ndarray) -> np.ndarray:
    """The corners (n, 4, dim) of faces, the last one repeated."""
    return points[nodes[:, [min(i, kind.n_vertices - 1) for i in range(4)]]]


def holding(places: np.ndarray, corners: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """The face (k,) that holds each place (k, dim), or is nearest, of the candidates (k, c).

    `corners` (m, 4, dim) of all faces.

    >>> square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    >>> two = np.array([square, square + [1.0, 0.0, 0.0]])
    >>> holding(np.array([[0.9, 0.1, 0.0], [1.1, 0.1, 0.0]]), two, np.array([[0, 1], [0, 1]]))
    array([0, 1])
    """
    start = corners[candidates]
    if places.shape[1] == 2:
        start = start[:, :, :2]
        outward = start - start[:, :, ::-1]
    else:
        diagonals = start[:, :, 2] - start[:, :, 0], start[:, :, 3] - start[:, :, 1]
        edge = np.roll(start, -1, axis=2) - start
        outward = np.cross(edge, np.cross(*diagonals)[:, :, None])
    size = np.linalg.norm(outward, axis=-1)
    beyond = np.einsum("kcvd,kcvd->kcv", places[:, None, None] - start, outward)
    beyond = np.divide(beyond, size, out=np.full(size.shape, -np.inf), where=size > 0)
    return candidates[np.arange(len(places)), beyond.max(axis=2).argmin(axis=1)]


@dataclass(frozen=True)
class SurfaceCells:
    """The cells that values (k,) belong to: `corners` (k, 4, dim), the last repeated; `area` (k,).

    NaN for cells that are no faces in the dimension of the case.
    """

    corners: np.ndarray
    area: np.ndarray

    @classmethod
    def of(
        cls, mesh: meshio.Mesh, points: np.ndarray, cells: np.ndarray, axisymmetric: bool
    ) -> SurfaceCells:
        """Those of numbers (k,) in a mesh on `points` (n, dim)."""
        dim = points.shape[1]
        corners, area = [], []
        for block in mesh.cells:
            kind, count = BY_MESHIO[block.type], len(block.data)
            corners.append(np.full((count, 4, dim), np.nan))
            area.append(np.full(count, np.nan))
            if kind.dim == dim - 1:
                corners[-1] = corners_of(points, kind, block.data)
                faces = [(kind.name, block.data, np.arange(count))]
                at = surface_points(points, faces, axisymmetric)
                area[-1] = np.bincount(at.macro, at.weight, minlength=count)
        return cls(np.concatenate(corners)[cells], np.concatenate(area)[cells])

    def at(self, chosen: np.ndarray) -> SurfaceCells:
        """The chosen ones, by mask or number."""
        return SurfaceCells(self.corners[chosen], self.area[chosen])

    def on(self, is_on: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Which of them (k,) have all of their corners on a surface: `is_on` by place."""
        found = np.isfinite(self.area)
        corners = self.corners[found]
        places = corners.reshape(-1, corners.shape[2])
        found[found] = is_on(places).reshape(corners.shape[:2]).all(axis=1)
        return found

    def means(self, values: np.ndarray, face: np.ndarray, area: np.ndarray) -> np.ndarray | None:
        """The means (m,) of values (k,) over faces of an `area` (m,); None where cells leave a gap.

        `face` (k,): the face that each cell is part of.
        """
        filled = np.bincount(face, self.area, minlength=len(area))
        if (np.abs(filled - area) > _FILLED * area).any():
            return None
        return np.bincount(face, self.area * values, minlength=len(area)) / filled
