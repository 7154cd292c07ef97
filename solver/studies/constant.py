"""The numerical inf-sup test: is the multiplier controlled by the displacement under refinement?

β_h² is the smallest eigenvalue of B (K + M/L²)⁻¹ Bᵀ q = β² D q, with B the gap operator, K and M
stiffness (E = 1) and mass (ρ = 1), L the length of the model and D = diag(h_T |T|) over the
macro-elements T. It must level off above zero as the mesh is refined; the patch test cannot see it.
Sources: Chapelle, Bathe, The inf-sup test, Comput. Struct. 47 (1993) 537–545; El-Abbasi, Bathe,
Comput. Struct. 79 (2001) 1473–1486.
"""

import numpy as np
from scipy import sparse

from ..lac.cells.shape import shape_functions
from ..mechanics.fem.assembly import CellSum
from ..mechanics.fem.block import Block
from ..mechanics.fem.elasticity import physical_gradients, stiffness
from ..mechanics.linear.direct import factorise
from ..simulation.scene.scene import Scene


def inf_sup_constant(scene: Scene) -> float:
    """β_h of a scene whose material has a Young's modulus of one, over all its zones.

    Raises SolveError where the system is singular.
    """
    basis = scene.free.basis
    energy = stiffness(scene.points, scene.blocks) + scene.mean.stiffness()
    energy = energy + mass(scene.points, scene.blocks) / scene.length**2
    gaps = sparse.vstack([zone.operator.matrix for zone in scene.zones]) @ basis
    area = np.concatenate([zone.operator.area for zone in scene.zones])
    size = area if scene.points.shape[1] == 2 else np.sqrt(area)
    weight = 1 / np.sqrt(size * area)
    scaled = (sparse.diags(weight) @ gaps).tocsr()
    # For as many right-hand sides as macro-elements double precision is quicker.
    with factorise(scene.free.reduced(energy.tocsr())) as factor:
        response = factor.solve(scaled.T.toarray())
    # Round-off may put an eigenvalue of zero below it.
    return float(np.sqrt(max(np.linalg.eigvalsh(scaled @ response)[0], 0.0)))


def mass(points: np.ndarray, blocks: list[Block]) -> sparse.bsr_matrix:
    """The consistent mass matrix (n_dofs, n_dofs) of unit density."""
    n, dim = points.shape
    total = CellSum([block.cells for block in blocks], n, dim)
    for block in blocks:
        reference, weights = block.rule
        values = shape_functions(block.type.name).values(reference)
        _, determinant = physical_gradients(points, block.cells, block.type, reference)
        scalar = np.einsum("cq,q,qa,qb->cab", determinant, weights, values, values, optimize=True)
        local = np.einsum("cab,ij->caibj", scalar, np.eye(dim))
        total.add(block.cells, local.__getitem__)
    return total.matrix
