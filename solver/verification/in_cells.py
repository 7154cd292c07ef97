"""Displacement, its gradient and the mean stress of a result at points in its cells."""

from __future__ import annotations

from dataclasses import dataclass

import meshio
import numpy as np

from ..lac.cells.catalogue import cell_type
from ..lac.cells.shape import shape_functions
from ..mechanics.fem.elasticity import Shapes, shapes_in
from ..simulation.results.solution import Solution

# Numbers of gradients handled at once: small enough to stay in the processor's cache.
_CHUNK = 1 << 17


def deformable_parts(
    solution: Solution, block: meshio.CellBlock, n_points: int
) -> list[np.ndarray]:
    """The cells of a block, but for those of rigid bodies, in parts for `n_points` in each cell."""
    kind = cell_type(block.type)
    chosen = np.flatnonzero(solution.deformable[block.data].all(axis=1))
    step = max(1, _CHUNK // (n_points * kind.n_nodes * kind.dim))
    return [chosen[start : start + step] for start in range(0, len(chosen), step)]


@dataclass(frozen=True)
class InCells:
    """A result at q points of n cells.

    `place` and `displacement` (n, q, dim); its gradient `slope` (n, q, dim, dim), (n, q, 3, 3) in
    axisymmetric cells. `mean` (n, q) is the stress that stands for λ div u in cells in mixed form,
    NaN in others; None where the result has none of this type.
    """

    shapes: Shapes
    place: np.ndarray
    displacement: np.ndarray
    slope: np.ndarray
    mean: np.ndarray | None


def in_cells(
    solution: Solution, block: meshio.CellBlock, chosen: np.ndarray, reference: np.ndarray
) -> InCells:
    """A result at reference points (q, dim) of the `chosen` cells (n,) of a block."""
    points, kind, cells = solution.mesh.points, cell_type(block.type), block.data[chosen]
    values, nodal = shape_functions(kind.name).values(reference), solution.displacement[cells]
    shapes = shapes_in(points, kind, cells, reference, solution.case.axisymmetric)
    mixed = solution.fields.by_cell.get(kind.name)
    return InCells(
        shapes=shapes,
        place=values @ points[cells],
        displacement=values @ nodal,
        slope=shapes.slopes(nodal - nodal[:, :1], nodal[..., 0]),
        mean=None if mixed is None else mixed[chosen] @ values.T,
    )
