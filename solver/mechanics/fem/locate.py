"""Places in cells or on faces: the cells at or near them, and their reference coordinates there.

The map x(ξ) = Σ N(ξ) X of a cell is inverted by Newton's method; on a face, where the Jacobian is
not square, by the method of Gauss and Newton, which finds the nearest point of the face.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import cKDTree

from ...lac.cells.catalogue import CellType, cell_type
from ...lac.cells.shape import shape_functions
from ...lac.pairing import candidate_pairs

_STEPS = 30
# The gradients of a pyramid's shape functions have no value at its apex.
_APEX = 1 - 1e-9
# Cells whose box is farther from a place than this share of their diagonal do not hold it.
_NEAR = 0.25
# So many places at once bound the memory.
_PART = 4096


@dataclass(frozen=True, kw_only=True)
class Located:
    """Pairs (k,) of a place and a cell (or face) near it: those of a place from the nearest on.

    `place` and the `number` of the cell in its `block` are indices; `reference` (k, dim) is the
    point of the cell that is nearest to the place, `distance` how far that is.
    """

    place: np.ndarray
    block: np.ndarray
    number: np.ndarray
    reference: np.ndarray
    distance: np.ndarray

    def __getitem__(self, rows: np.ndarray | slice) -> "Located":
        return Located(**{one.name: getattr(self, one.name)[rows] for one in fields(self)})

    @property
    def nearest(self) -> "Located":
        """The first pair of each place."""
        return self[np.unique(self.place, return_index=True)[1]]


def locate(
    points: np.ndarray, blocks: Sequence[tuple[str, np.ndarray]], places: np.ndarray
) -> Located:
    """The cells at or near places (m, dim); each place has one at least.

    `blocks` are cells or faces: (type, (n, n_nodes)) on `points` (n_points, dim). Reference
    coordinates are kept within the cell.

    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> found = locate(square, [("QUAD4", np.arange(4)[None])], np.array([[0.5, 1.0]]))
    >>> found.reference.tolist(), found.distance.tolist()
    ([[0.25, 0.5]], [0.0])
    """
    found = [
        part
        for block, (name, nodes) in enumerate(blocks)
        if len(nodes)
        for part in _in_block(cell_type(name), points[nodes], block, places)
    ]
    whole = Located(
        **{k.name: np.concatenate([getattr(p, k.name) for p in found]) for k in fields(Located)}
    )
    return whole[np.lexsort((whole.distance, whole.place))]


def _in_block(
    kind: CellType, corner: np.ndarray, block: int, places: np.ndarray
) -> Iterator[Located]:
    """The cells of one type, of nodes (n, n_nodes, dim), near places; parts of these in turn."""
    low, high = corner.min(axis=1), corner.max(axis=1)
    across = np.linalg.norm(high - low, axis=1)
    middle = (low + high) / 2
    tree = cKDTree(middle)
    for start in range(0, len(places), _PART):
        part = places[start : start + _PART]
        # The box whose middle is nearest is no farther than that; a middle is half across away.
        limit, _ = tree.query(part)
        place, cell = candidate_pairs(part, limit, middle, (0.5 + _NEAR) * across, 0.0)
        beyond = np.maximum(low[cell] - part[place], part[place] - high[cell])
        apart = np.linalg.norm(np.maximum(beyond, 0), axis=1)
        least = np.minimum.reduceat(apart, np.flatnonzero(np.diff(place, prepend=-1)))
        near = apart <= least[place] + _NEAR * across[cell]
        place, cell = place[near], cell[near]
        reference = _inverted(kind, corner[cell], part[place])
        values = shape_functions(kind.name).values(reference)
        missing = np.einsum("na,nad->nd", values, corner[cell]) - part[place]
        yield Located(
            place=start + place,
            block=np.full(len(cell), block),
            number=cell,
            reference=reference,
            distance=np.linalg.norm(missing, axis=1),
        )


def _inverted(kind: CellType, corner: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Reference coordinates (n, dim) within cells of nodes (n, n_nodes, dim), for places (n, dim).

    Each pair goes on until it stays: no place depends on the others.
    """
    shape = shape_functions(kind.name)
    middle = kind.nodes[: kind.n_vertices].mean(axis=0)
    reference, moving = np.tile(middle, (len(corner), 1)), np.arange(len(corner))
    for _ in range(_STEPS):
        if not len(moving):
            break
        before = reference[moving]
        values, slopes = shape.both(before)
        missing = places[moving] - np.einsum("na,nad->nd", values, corner[moving])
        jacobian = np.einsum("nad,nat->ndt", corner[moving], slopes)
        step = np.einsum("ntd,nd->nt", np.linalg.pinv(jacobian), missing)
        reference[moving] = _within(kind, before + step)
        moving = moving[np.abs(reference[moving] - before).max(axis=1) >= 1e-15]
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
