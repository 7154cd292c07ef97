"""The stiffness of a scene's free unknowns, and what these unknowns are."""

import numpy as np
from scipy import sparse

from ..mechanics.fem.bodies import nodes_of_unknowns, whole_motions
from ..mechanics.fem.elasticity import stiffness
from ..mechanics.fem.vertices import from_vertices, linear_unknowns
from ..mechanics.linear.choice import against_multigrid
from ..mechanics.linear.nodal_matrix import NodalMatrix
from ..mechanics.linear.unknowns import Unknowns
from .scene import Scene


def free_stiffness(
    scene: Scene, unknowns: Unknowns, single: bool
) -> tuple[sparse.csr_matrix | NodalMatrix, np.ndarray]:
    """The stiffness of the free unknowns, and the diagonal (n_dofs,) for all degrees of freedom.

    `single`: in single precision where multigrid solves.
    """
    free, mean = scene.free, scene.mean
    plain = free.selection is not None and not mean.size and not scene.springs.nnz
    in_blocks = plain and not against_multigrid(len(unknowns.node), unknowns)
    blocks = stiffness(scene.points, scene.blocks, single and in_blocks)
    diagonal = blocks.diagonal().astype(float)
    if in_blocks and free.selection is not None:
        return NodalMatrix(blocks, free.selection), diagonal
    matrix = free.reduced(blocks)
    if mean.size:
        matrix = matrix + free.reduced(mean.stiffness())
    if scene.springs.nnz:
        matrix = matrix + free.reduced(scene.springs)
        diagonal = diagonal + scene.springs.diagonal()
    return matrix, diagonal


def free_unknowns(scene: Scene) -> Unknowns:
    """The meaning of a scene's free unknowns."""
    basis, dim = scene.free.basis, scene.points.shape[1]
    node = nodes_of_unknowns(basis, dim)

    def motions() -> np.ndarray:
        # Those of axisymmetric sections in their plane hardly strain rings far from the axis.
        return np.asarray(basis.T @ whole_motions(scene.points, scene.body))

    about = dim, node, motions, scene.body[node], scene.points
    if dim == 2 or all(block.type.order == 1 for block in scene.blocks):
        return Unknowns(*about)
    return Unknowns(
        *about, *linear_unknowns(basis, dim, *from_vertices(len(scene.points), scene.blocks))
    )
