"""Initial strain ε₀, such as thermal strain: σ = C (ε(u) − ε₀), so that C ε₀ acts as a load.

The forces ∫ Bᵀ C ε₀ are integrated at the points of the stiffness: where a displacement has the
strain ε₀ at these points, no stress is left. In mixed form (see `mixed`) the blocks have λ = 0, and
the rest of C ε₀ is in ∫ q (div u − tr ε₀ − s/λ) = 0.

Source: Zienkiewicz, Taylor, Zhu, The Finite Element Method: Its Basis and Fundamentals, §2.2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .block import Block
from .elasticity import chunks, shapes_in
from .mixed import MeanStress
from .stress import extrapolation

# Strains (k, n, q, 6) of the cells of a block at its quadrature points, as COMPONENTS.
Strains = Callable[[Block], np.ndarray]
# The places in a tensor of the components xx, yy, zz, xy, yz, xz.
_TENSOR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])


@dataclass(frozen=True, kw_only=True)
class StrainLoads:
    """What k initial strains do, each by itself; all but the energy are linear in them.

    `force` (k, n, dim) at nodes; `swelling` (k, size), the integrals of q tr ε₀; `stress`
    (k, n, 6), C ε₀ at nodes as `nodal_stress` averages it; `energy` (k, k), ∫ ε₀:C:ε₀.
    """

    force: np.ndarray
    swelling: np.ndarray
    stress: np.ndarray
    energy: np.ndarray


def strain_loads(
    points: np.ndarray, blocks: Sequence[Block], mean: MeanStress, strains: Strains, count: int
) -> StrainLoads:
    """The loads of `count` initial strains in blocks, those in mixed form with λ = 0.

    Raises SolveError where cells are inverted or degenerate.
    """
    n, dim = points.shape
    force, stress = np.zeros((count, n, dim)), np.zeros((count, n, 6))
    energy, around = np.zeros((count, count)), np.zeros(n)
    for block in blocks if count else ():
        reference, weights = block.rule
        fit = extrapolation(block.type, reference)
        for part in chunks(block, dim):
            some = block.of(part)
            strain = strains(some)
            if not strain.any():
                continue
            shapes = shapes_in(points, block, some.cells, reference)
            inner = _stress(some, strain)
            weighted = inner * (weights * shapes.measure)[..., None]
            tensor = weighted[..., _TENSOR[:dim, :dim]]
            nodal = np.einsum("cqai,kcqij->kcaj", shapes.gradient, tensor, optimize=True)
            if shapes.hoop is not None:
                nodal[..., 0] += np.einsum("cqa,kcq->kca", shapes.hoop, weighted[..., 2])
            at_nodes = np.einsum("aq,kcqs->kcas", fit, inner, optimize=True)
            for i in range(count):
                np.add.at(force[i], some.cells, nodal[i])
                np.add.at(stress[i], some.cells, at_nodes[i])
            # Each component across the axes is twice in the tensor.
            weighted[..., 3:] *= 2
            energy += np.einsum("kcqs,lcqs->kl", weighted, strain, optimize=True)
        around += np.bincount(block.cells.ravel(), minlength=n)
    stress /= np.maximum(around, 1)[:, None]
    swelling = mean.integrals(points, lambda block: strains(block)[..., :3].sum(axis=-1), count)
    return StrainLoads(force=force, swelling=swelling, stress=stress, energy=energy)


def _stress(block: Block, strain: np.ndarray) -> np.ndarray:
    """C ε₀ (k, n, q, 6) of strains (k, n, q, 6) in a block's cells."""
    stress = 2 * block.shear[:, None, None] * strain
    stress[..., :3] += block.lame[:, None, None] * strain[..., :3].sum(axis=-1, keepdims=True)
    return stress
