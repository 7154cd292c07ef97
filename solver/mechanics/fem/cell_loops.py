"""Loops over the solid cells of large meshes, compiled by Numba: stiffness, forces, stress, sizes.

Each thread adds up the rows of its own nodes, from every cell that has one of them, in the order of
the cells. So no list of cell matrices is stored, and the number of threads changes no digit. The
nodes of a thread are a slab of the mesh: few cells have nodes of two threads.
"""

from collections.abc import Callable, Sequence

import numpy as np

from ...lac.cells.shape import shape_functions
from ...lac.errors import SolveError
from ...lac.threads import prefetch, workers
from . import cell_kernels
from .block import Block

# Nodes from which these loops pay for loading Numba: 60,000 unknowns.
_LEAST = 20_000


def serve(n_nodes: int, blocks: Sequence[Block]) -> bool:
    """Whether these loops serve a mesh: a large one of solid cells."""
    return n_nodes >= _LEAST and all(block.type.dim == 3 for block in blocks)


def add_stiffness(
    points: np.ndarray, block: Block, starts: np.ndarray, columns: np.ndarray, out: np.ndarray
) -> None:
    """Add the stiffness of a block's cells to the blocks `out` (nnz, 3, 3) of a sum.

    `starts` (n_nodes + 1,), `columns` (nnz,): its pattern, rows sorted. Raises SolveError where a
    Jacobian is not positive, as do the others.
    """
    _shared(cell_kernels.stiffness_rows, points, block, starts, columns, out)


def add_forces(points: np.ndarray, block: Block, displacement: np.ndarray, out: np.ndarray) -> None:
    """Add the internal forces of a block's cells to `out` (n_nodes, 3).

    `displacement` (parts, n_nodes, 3); see `elasticity.internal_force`.
    """
    _shared(cell_kernels.force_rows, points, block, displacement, out)


def add_nodal_stress(
    points: np.ndarray, block: Block, displacement: np.ndarray, fit: np.ndarray, out: np.ndarray
) -> None:
    """Add the stress at the nodes of a block's cells, seen from each cell, to `out` (n_nodes, 6).

    `fit` (n_nodes of a cell, q): see `nodal_stress.extrapolation`.
    """
    _shared(cell_kernels.stress_rows, points, block, displacement, fit, out)


def add_sizes(
    points: np.ndarray,
    block: Block,
    displacement: np.ndarray,
    force: np.ndarray,
    most: np.ndarray,
) -> tuple[float, float]:
    """Add the sizes of a block's forces to `force` (n_nodes,); the highest and slender stress.

    `most` (n_nodes,): raised to the largest norm of stress around; see `stress.Sizes`.
    """
    highest = np.zeros((workers(), 2))
    _shared(cell_kernels.size_rows, points, block, displacement, force, most, highest, middle=True)
    return float(highest[:, 0].max()), float(highest[:, 1].max())


def _shared(
    loop: Callable[..., None],
    points: np.ndarray,
    block: Block,
    *more: object,
    middle: bool = False,
) -> None:
    """Call a loop for the nodes of each thread; `middle`: for one point in the middle of a cell."""
    reference, weights = block.middle if middle else block.rule
    on_reference, count = shape_functions(block.type.name).gradients(reference), workers()
    owner, bad = np.zeros(len(points), dtype=np.int32), np.zeros(1, dtype=bool)
    if count > 1:
        # Across the longest side. The planes of a regular mesh are oblique to the slabs.
        # No BLAS here: its threads would keep a core busy for a while.
        x, y, z = sorted(points.T, key=np.ptp)
        along = 1e-6 * x + 1e-3 * y + z
        cuts = np.quantile(along[::101], np.arange(1, count) / count)
        owner = np.searchsorted(cuts, along, side="right").astype(np.int32)
    known = points, block.cells, block.lame, block.shear, on_reference, weights
    about = [np.ascontiguousarray(array) for array in known]
    for _ in prefetch(lambda mine: loop(mine, owner, bad, *about, *more), range(count)):
        pass
    if bad[0]:
        raise SolveError(f"{block.type.name} cells are inverted or degenerate")
