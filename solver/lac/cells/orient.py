"""Orientation: every cell right side out."""

import numpy as np

from ..threads import prefetch
from .catalogue import CellType

# Below this share of the product of the edges that span it, a corner counts as flat.
_FLAT = 1e-12
# Cells that are looked at together.
_AT_ONCE = 1 << 12


def vertex_jacobians(points: np.ndarray, cells: np.ndarray, cell: CellType) -> np.ndarray:
    """Jacobian at the vertices, as a share of the product of the edge tangents that span it.

    points (n, dim), cells (n_cells, n_nodes) of a type of the same dimension; returns
    (n_cells, n_corners), positive for a cell in the catalogue's orientation. The tangents are
    those of the cell's own interpolation, mid-edge nodes included. The apex of a pyramid, where
    the Jacobian has no value, is left out.
    """
    at = np.ascontiguousarray(points[cells].transpose(1, 2, 0))
    columns = []
    for vertex in range(cell.n_vertices):
        ends = [
            (sum(edge) - vertex, cell.n_vertices + i)
            for i, edge in enumerate(cell.edges)
            if vertex in edge
        ]
        if len(ends) != cell.dim:
            continue
        sign = np.sign(np.linalg.det([cell.nodes[end] - cell.nodes[vertex] for end, _ in ends]))
        tangents = [_tangent(at, cell, vertex, *end) for end in ends]
        size = np.prod([np.sqrt(np.einsum("dn,dn->n", t, t)) for t in tangents], axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            columns.append(sign * np.nan_to_num(_determinant(*tangents) / size))
    return np.stack(columns, axis=1)


def _tangent(at: np.ndarray, cell: CellType, vertex: int, end: int, middle: int) -> np.ndarray:
    """The tangent (dim, n) at a vertex of an edge, of cells with nodes `at` (n_nodes, dim, n)."""
    chord = at[end] - at[vertex]
    return chord if cell.order == 1 else 4 * (at[middle] - at[vertex]) - chord


def _determinant(a: np.ndarray, b: np.ndarray, c: np.ndarray | None = None) -> np.ndarray:
    """The determinants (n,) of two or three vectors (dim, n)."""
    if c is None:
        return a[0] * b[1] - a[1] * b[0]
    cross = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    return a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]


def right_side_out(
    points: np.ndarray, cells: np.ndarray, cell: CellType
) -> tuple[np.ndarray, np.ndarray]:
    """Cells, mirrored ones renumbered in a copy, and a mask (n_cells,) of invalid cells.

    The latter have a Jacobian that is zero at a vertex or changes its sign from one to another.
    """

    def judged(first: int) -> list[np.ndarray]:
        jacobian = vertex_jacobians(points, cells[first : first + _AT_ONCE], cell)
        mirrored = (jacobian < 0).all(axis=1)
        flat = (np.abs(jacobian) <= _FLAT).any(axis=1)
        return [mirrored, flat | ((jacobian < 0).any(axis=1) & ~mirrored)]

    parts = list(prefetch(judged, range(0, max(1, len(cells)), _AT_ONCE)))
    mirrored, bad = (np.concatenate(masks) for masks in zip(*parts, strict=True))
    if not mirrored.any():
        return cells, bad
    turned = cells.copy()
    turned[mirrored] = cells[mirrored][:, list(cell.mirror)]
    return turned, bad
