"""Supports as codes take them: displacements of nodes along axes, and along other directions."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..case.expressions import evaluate
from ..case.model import Zone
from ..lac.cells.faces import FaceBlock, nodal_normals
from ..mechanics.fem.bodies import body_numbers
from ..mechanics.fem.supports import FreeMotion

# A component of a unit vector below this is round-off.
_ZERO = 1e-12
# A unit vector has a part along an axis from here on.
_ALONG = 0.1
# How deep closed bodies overlap, over the extent of the model, and what gap counts as closed.
_OVERLAP, _CLOSED = 3e-4, 1e-6


@dataclass(frozen=True)
class Oblique:
    """Support of a node across the axes: direction (dim,) · displacement = value.

    The component `axis` of the direction is 1. It is 0 in the node's other supports, so that the
    displacement along this axis follows from the others.
    """

    node: int
    axis: int
    direction: np.ndarray
    value: float

    @property
    def terms(self) -> list[tuple[int, float]]:
        """Axis and coefficient of each component that is not zero, `axis` first."""
        rest = [a for a in np.flatnonzero(self.direction).tolist() if a != self.axis]
        return [(a, float(self.direction[a])) for a in [self.axis, *rest]]


def split(free: FreeMotion, dim: int) -> tuple[np.ndarray, list[Oblique]]:
    """Imposed displacements (n, dim) along axes, NaN in free directions, and all other supports."""
    held, oblique = free.offset.reshape(-1, dim).copy(), []
    basis = free.basis.tocsr()
    entries = np.diff(basis.indptr)
    plain = np.ones(len(entries), dtype=bool)
    single = entries == 1
    plain[single] = np.abs(np.abs(basis.data[basis.indptr[:-1][single]]) - 1) < _ZERO
    plain &= entries <= 1
    held.reshape(-1)[entries > 0] = np.nan
    for node in np.flatnonzero(~plain.reshape(-1, dim).all(axis=1)).tolist():
        block = basis[dim * node : dim * (node + 1)]
        block = block[:, np.unique(block.indices)].toarray()
        across = np.linalg.svd(block)[0][:, block.shape[1] :].T
        values = across @ free.offset[dim * node : dim * (node + 1)]
        held[node] = np.nan
        for row, axis in _reduced(np.column_stack([across, values])):
            if np.count_nonzero(row[:-1]) == 1:
                held[node, axis] = row[-1]
            else:
                oblique.append(Oblique(node, axis, row[:-1], float(row[-1])))
    return held, oblique


def _reduced(rows: np.ndarray) -> Iterable[tuple[np.ndarray, int]]:
    """Rows that say the same, each with the axis whose coefficient is 1 there and 0 elsewhere.

    >>> [(row.tolist(), axis) for row, axis in _reduced(np.array([[0.6, 0.8, 4.0]]))]
    [([0.75, 1.0, 5.0], 1)]
    """
    rows, axes = rows.copy(), []
    for i in range(len(rows)):
        axes.append(int(np.abs(rows[i, :-1]).argmax()))
        rows[i] /= rows[i, axes[i]]
        others = np.arange(len(rows)) != i
        rows[others] -= np.outer(rows[others, axes[i]], rows[i])
    rows[np.abs(rows) < _ZERO] = 0.0
    return zip(rows, axes, strict=True)


def closing(
    points: np.ndarray,
    cells: dict[str, np.ndarray],
    held: np.ndarray,
    oblique: Sequence[Oblique],
    pairs: Sequence[tuple[Zone, list[FaceBlock], list[FaceBlock]]],
) -> np.ndarray:
    """Displacement (n, dim), zero except on bodies that contact alone can hold.

    Such a body, of an open zone, is moved to the other side until they overlap a little. Without
    contact at the start the first matrix of a code is singular.
    """
    start = np.zeros_like(points)
    body = body_numbers(len(points), cells)
    for zone, slave, master in pairs:
        for mine, other in ((slave, master), (master, slave)):
            direction = _mean_normal(points, mine)
            of = body == body[mine[0].nodes[0, 0]]
            along = np.abs(direction) > _ALONG
            tilted = any(abs(o.direction @ direction) > _ALONG for o in oblique if of[o.node])
            if not along.any() or tilted or not np.isnan(held[np.ix_(of, along)]).all():
                continue
            gap = _gaps(points, zone, mine, other)
            extent = float(np.ptp(points, axis=0).max())
            if np.median(gap) > _CLOSED * extent:
                moved = (max(gap.min(), 0.0) + _OVERLAP * extent) * direction
                start[of] = np.where(np.isnan(held[of]), moved, 0.0)
            break
    return start


def _nodes(faces: list[FaceBlock]) -> np.ndarray:
    return np.unique(np.concatenate([block.nodes.ravel() for block in faces]))


def _mean_normal(points: np.ndarray, faces: list[FaceBlock]) -> np.ndarray:
    """The direction of the sum of normals at nodes; zero for a closed surface."""
    normals = nodal_normals(points, [(b.type.name, b.nodes) for b in faces])[_nodes(faces)]
    total = normals.mean(axis=0)
    length = float(np.linalg.norm(total))
    return total / length if length > _ALONG else np.zeros_like(total)


def _gaps(
    points: np.ndarray, zone: Zone, mine: list[FaceBlock], other: list[FaceBlock]
) -> np.ndarray:
    """About the initial gap at the nodes of one side: to the plane at the other's nearest node."""
    from scipy.spatial import cKDTree

    nodes, others = _nodes(mine), _nodes(other)
    if zone.clearance is not None:
        return evaluate(zone.clearance, points[nodes]) - zone.interference
    normals = nodal_normals(points, [(b.type.name, b.nodes) for b in other])[others]
    near = cKDTree(points[others]).query(points[nodes])[1]
    offset = points[nodes] - points[others][near]
    return np.einsum("nd,nd->n", offset, normals[near]) - zone.interference
