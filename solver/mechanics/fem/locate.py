"""Points in cells or on faces: the cell that holds a point, and the point's reference coordinates.

The map x(ξ) = Σ N(ξ) X of a cell is inverted by Newton's method; on a face, where the Jacobian is
not square, by the method of Gauss and Newton, which finds the nearest point of the face.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...lac.cells.catalogue import CellType, cell_type
from ...lac.cells.shape import shape_functions

_STEPS = 30
# The gradients of a pyramid's shape functions have no value at its apex.
_APEX = 1 - 1e-9
# Cells whose box is farther from a point than this share of their diagonal do not hold it.
_NEAR = 0.25


@dataclass(frozen=True, kw_only=True)
class Located:
    """A point on one cell (or face): `reference` (dim,) of the nearest place in it.

    `nodes` (n_nodes,) of the cell, the number of its `block` and its `number` there; `distance`
    from that place.
    """

    type: CellType
    nodes: np.ndarray
    block: int
    number: int
    reference: np.ndarray
    distance: float

    @property
    def weights(self) -> np.ndarray:
        """The shape functions (n_nodes,) there."""
        return shape_functions(self.type.name).values(self.reference[None])[0]


def locate(
    points: np.ndarray, blocks: Sequence[tuple[str, np.ndarray]], place: np.ndarray
) -> list[Located]:
    """The cells at or near a place (dim,), the nearest first.

    `blocks` are cells or faces: (type, (n, n_nodes)) on `points` (n_points, dim). Reference
    coordinates are kept within the cell.

    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> found = locate(square, [("QUAD4", np.arange(4)[None])], np.array([0.5, 1.0]))
    >>> [(one.reference.tolist(), one.distance) for one in found]
    [([0.25, 0.5], 0.0)]
    """
    found = [
        one for number in range(len(blocks)) for one in _in_block(points, blocks, number, place)
    ]
    return sorted(found, key=lambda one: one.distance)


def _in_block(
    points: np.ndarray, blocks: Sequence[tuple[str, np.ndarray]], block: int, place: np.ndarray
) -> Iterator[Located]:
    name, nodes = blocks[block]
    if not len(nodes):
        return
    kind, corner = cell_type(name), points[nodes]
    low, high = corner.min(axis=1), corner.max(axis=1)
    apart = np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0), axis=1)
    near = np.flatnonzero(apart <= apart.min() + _NEAR * np.linalg.norm(high - low, axis=1))
    reference = _inverted(kind, corner[near], place)
    values = shape_functions(kind.name).values(reference)
    distance = np.linalg.norm(np.einsum("na,nad->nd", values, corner[near]) - place, axis=1)
    for i, cell in enumerate(near):
        yield Located(
            type=kind,
            nodes=nodes[cell],
            block=block,
            number=int(cell),
            reference=reference[i],
            distance=float(distance[i]),
        )


def _inverted(kind: CellType, corner: np.ndarray, place: np.ndarray) -> np.ndarray:
    """The reference coordinates (n, dim) within cells of nodes (n, n_nodes, dim), for a place."""
    shape = shape_functions(kind.name)
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    reference = np.tile(middle, (len(corner), 1))
    for _ in range(_STEPS):
        values, slopes = shape.both(reference)
        missing = place - np.einsum("na,nad->nd", values, corner)
        jacobian = np.einsum("nad,nat->ndt", corner, slopes)
        step = np.einsum("ntd,nd->nt", np.linalg.pinv(jacobian), missing)
        before, reference = reference, _within(kind, reference + step)
        if np.abs(reference - before).max() < 1e-15:
            break
    return reference


def _within(kind: CellType, reference: np.ndarray) -> np.ndarray:
    """Reference coordinates (n, dim) moved into the cell."""
    shape, found = kind.shape, reference.copy()
    if shape == "PYRA":
        found[:, 2] = found[:, 2].clip(0, _APEX)
        reach = 1 - found[:, 2:]
        found[:, :2] = found[:, :2].clip(-reach, reach)
        return found
    found = found.clip(0, 1)
    slanted = {"TRIA": 2, "TETRA": 3, "PENTA": 2}.get(shape, 0)
    if slanted:
        total = found[:, :slanted].sum(axis=1, keepdims=True)
        found[:, :slanted] /= np.maximum(total, 1)
    return found
