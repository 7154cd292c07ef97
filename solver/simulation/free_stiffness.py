"""The stiffness of a scene's free unknowns, and what these unknowns are."""

import numpy as np

from ..mechanics.fem.bodies import motion_fields, nodes_of_unknowns
from ..mechanics.fem.elasticity import stiffness
from ..mechanics.fem.vertices import from_vertices, linear_unknowns
from ..mechanics.linear.choice import against_multigrid
from ..mechanics.linear.nodal_matrix import NodalMatrix, Stiffness
from ..mechanics.linear.unknowns import Unknowns
from .scene import Scene


def free_stiffness(scene: Scene, unknowns: Unknowns, single: bool) -> tuple[Stiffness, np.ndarray]:
    """The stiffness of the free unknowns, and the diagonal (n_dofs,) for all degrees of freedom.

    `single`: in single precision where multigrid solves.
    """
    free, mean = scene.free, scene.mean
    # Friction adds springs to the matrix.
    iterative = not (scene.case.frictional or against_multigrid(len(unknowns.node), unknowns))
    plain = free.selection is not None and not scene.springs.nnz
    in_blocks = plain and iterative and not mean.size
    blocks = stiffness(scene.points, scene.blocks, single and in_blocks)
    diagonal = blocks.diagonal().astype(float)
    if in_blocks and free.selection is not None:
        return NodalMatrix(blocks, free.selection), diagonal
    matrix = free.reduced(blocks)
    if scene.springs.nnz:
        matrix = matrix + free.reduced(scene.springs)
        diagonal = diagonal + scene.springs.diagonal()
    if mean.size:
        matrix = matrix + free.reduced(mean.stiffness())
    return matrix, diagonal


def free_unknowns(scene: Scene) -> Unknowns:
    """The meaning of a scene's free unknowns."""
    basis, dim = scene.free.basis, scene.points.shape[1]
    node = nodes_of_unknowns(basis, dim)

    def motions() -> np.ndarray:
        # Those of axisymmetric sections in their plane hardly strain rings far from the axis.
        found = np.empty((len(node), 3 if dim == 2 else 6))
        for number, field in enumerate(motion_fields(scene.points, scene.body)):
            found[:, number] = scene.free.gathered(field.ravel())
        return found

    about, mixed = (dim, node, motions, scene.body[node], scene.points), scene.mean.size > 0
    if dim == 2 or all(block.type.order == 1 for block in scene.blocks):
        return Unknowns(*about, mixed=mixed)
    vertices = from_vertices(scene.points, scene.blocks)
    return Unknowns(*about, *linear_unknowns(basis, dim, *vertices), mixed)
