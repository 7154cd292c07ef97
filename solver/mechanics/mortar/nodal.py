"""Standard mortar: multipliers at the slave vertices, standard or dual, on exact segments.

On quadratic faces the pressure is linear between the vertices. Multipliers of the faces' own
quadratic functions are no use for contact: their integrals, which weight the gap, are zero at the
vertices of TRIA6 and negative at those of QUAD8, so that a sign says nothing about contact; and the
linear ones are stable. Sources: Puso, Laursen, A mortar segment-to-segment contact method for large
deformation solid mechanics, CMAME 193 (2004) 601–629; Puso, Laursen, Solberg, A segment-to-segment
mortar contact method for quadratic elements and large deformations, CMAME 197 (2008) 555–566.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...lac.cells.shape import shape_functions
from ...lac.multipliers import InterfaceData, Multipliers

# Of a face covered by less than this share, dual functions are those of the whole face: those of
# so small a part would be lost in round-off.
_FEW = 0.01


def linear(data: InterfaceData) -> Multipliers:
    """A multiplier at each slave vertex, its function the linear hat.

    >>> space = linear(InterfaceData(slaves=[slave], samples=[], found=[], n_macro=1))
    >>> space.nodes.tolist(), space.number[0].tolist(), space.shapes[0].tolist()
    ([0, 1], [[1, 0]], [[1.0, 0.0], [0.0, 1.0]])
    """
    vertices = [block.nodes[:, : block.type.n_vertices] for block in data.slaves]
    hats = [shape_functions(b.type.skeleton).values(b.type.nodes) for b in data.slaves]
    return of_nodes(vertices, hats)


def dual(data: InterfaceData) -> Multipliers:
    """A multiplier at each node of linear faces, its function orthogonal to all other hats.

    φᵢ = Σⱼ Aᵢⱼ Nⱼ on each face with A = D M⁻¹, M = ∫ N Nᵀ, D = diag ∫ N, integrals over the part of
    the face that the master covers. Sources: Wohlmuth, A mortar finite element method using dual
    spaces for the Lagrange multiplier, SIAM J. Numer. Anal. 38 (2000) 989–1012; on the covered
    part: Cichosz, Bischoff, Consistent treatment of boundaries with mortar contact formulations
    using dual Lagrange multipliers, CMAME 200 (2011) 1317–1332.

    The functions of an edge are 2 N₁ − N₂ and 2 N₂ − N₁:

    >>> data = InterfaceData(slaves=[slave], samples=face_samples([slave]), found=[], n_macro=1)
    >>> dual(data).coefficients[0].round(12).tolist()
    [[[2.0, -1.0], [-1.0, 2.0]]]
    """
    plain = linear(data)
    coefficients = []
    for a, (block, sample) in enumerate(zip(data.slaves, data.samples, strict=True)):
        whole = np.einsum("fq,qi,qj->fij", sample.weight, sample.values, sample.values)
        mass = np.zeros_like(whole)
        for segments in data.found:
            side = segments.slave
            if side.index == a:
                part = np.einsum("sq,sqi,sqj->sij", segments.weight, side.values, side.values)
                np.add.at(mass, side.face, part)
        few = mass.sum(axis=(1, 2)) < _FEW * whole.sum(axis=(1, 2))
        mass[few] = whole[few]
        # Rows of M sum to ∫ N, since the functions sum to one.
        diagonal = np.eye(block.type.n_nodes) * mass.sum(axis=2)[:, None]
        coefficients.append(np.linalg.solve(mass, diagonal))
    return replace(plain, coefficients=coefficients, dual=True)


def of_nodes(nodes: Sequence[np.ndarray], shapes: Sequence[np.ndarray]) -> Multipliers:
    """One multiplier for each of the `nodes` (n, k) of faces, with functions `shapes`, by block.

    >>> space = of_nodes([np.array([[7, 3]])], [np.eye(2)])
    >>> space.nodes.tolist(), space.number[0].tolist()
    ([3, 7], [[1, 0]])
    """
    known = np.unique(np.concatenate([block.ravel() for block in nodes]))
    return Multipliers(
        count=len(known),
        number=[np.searchsorted(known, block) for block in nodes],
        coefficients=[shape[None] for shape in shapes],
        shapes=list(shapes),
        nodes=known,
    )
