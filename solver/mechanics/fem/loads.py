"""Nodal forces of pressures, tractions, body forces and initial strain; springs and foundations.

Initial strain ε₀, such as thermal strain, is a load since σ = C (ε(u) − ε₀). Its forces ∫ Bᵀ C ε₀
are integrated at the points of the stiffness: where a displacement has the strain ε₀ at these
points, no stress is left. In mixed form (see `mixed`) the blocks have λ = 0, and the rest of C ε₀
is in ∫ q (div u − tr ε₀ − s/λ) = 0.

Source: Zienkiewicz, Taylor, Zhu, The Finite Element Method: Its Basis and Fundamentals, §2.2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...lac.cells.faces import circumference, surface_vectors
from ...lac.cells.shape import face_rule, invert, shape_functions
from ...lac.errors import SolveError
from .block import Block, volume_rule
from .elasticity import chunks, shapes_in
from .stress import extrapolation, traction

# A value of position: points (n, dim) to values (n,) or (n, dim).
Field = Callable[[np.ndarray], np.ndarray]


def face_forces(
    points: np.ndarray,
    nodes: np.ndarray,
    face_type: str,
    value: Field,
    pressure: bool,
    axisymmetric: bool = False,
) -> np.ndarray:
    """Forces (n_points, dim) on faces (n, n_nodes) turned outward.

    `value` gives a pressure (stress, positive inwards) or, where `pressure` is False, the traction
    vector (stress). `axisymmetric`: the forces are those on whole rings.
    """
    reference, weights = face_rule(face_type)
    values, vectors = surface_vectors(points, nodes, face_type, reference, axisymmetric)
    vectors = vectors * weights[:, None]
    given = _at(points, nodes, values, value)
    if pressure:
        vectors = -vectors * given[..., None]
    else:
        vectors = np.linalg.norm(vectors, axis=2)[..., None] * given
    return _gather(points, nodes, np.einsum("qa,fqd->fad", values, vectors))


def stress_forces(
    points: np.ndarray,
    nodes: np.ndarray,
    face_type: str,
    stress: Field,
    pressure: bool,
    axisymmetric: bool = False,
) -> np.ndarray:
    """Forces (n_points, dim) of a stress field (n, 6) on faces (n, n_nodes) turned outward.

    The traction is σ·n; where `pressure` is True, only its part along n.
    """
    reference, weights = face_rule(face_type)
    values, vectors = surface_vectors(points, nodes, face_type, reference, axisymmetric)
    vectors = vectors * weights[:, None]
    given = _at(points, nodes, values, stress)
    flat = vectors.reshape(-1, vectors.shape[-1])
    force = traction(given.reshape(len(flat), 6), flat)
    if pressure:
        along = np.einsum("nd,nd->n", force, flat) / np.einsum("nd,nd->n", flat, flat)
        force = along[:, None] * flat
    return _gather(points, nodes, np.einsum("qa,fqd->fad", values, force.reshape(vectors.shape)))


def body_forces(
    points: np.ndarray,
    cells: np.ndarray,
    cell_type: str,
    value: Field,
    axisymmetric: bool = False,
) -> np.ndarray:
    """Forces (n_points, dim) of a force per volume, given as a vector field, on cells."""
    reference, weights = volume_rule(cell_type)
    values, slopes = shape_functions(cell_type).both(reference)
    corner = points[cells]
    jacobian = np.einsum("cad,qat->cqdt", corner - corner[:, :1], slopes, optimize=True)
    determinant, _ = invert(jacobian)
    if (determinant <= 0).any():
        raise SolveError(f"{cell_type} cells under a body force are inverted or degenerate")
    if axisymmetric:
        determinant = determinant * circumference(values @ corner)
    force = _at(points, cells, values, value) * (determinant * weights)[..., None]
    return _gather(points, cells, np.einsum("qa,cqd->cad", values, force))


def _at(points: np.ndarray, nodes: np.ndarray, values: np.ndarray, value: Field) -> np.ndarray:
    place = np.einsum("qa,fad->fqd", values, points[nodes])
    given = value(place.reshape(-1, points.shape[1]))
    return given.reshape(*place.shape[:2], *given.shape[1:])


def _gather(points: np.ndarray, nodes: np.ndarray, forces: np.ndarray) -> np.ndarray:
    total = np.zeros_like(points)
    for d in range(points.shape[1]):
        total[:, d] = np.bincount(nodes.ravel(), forces[..., d].ravel(), minlength=len(points))
    return total


def foundation(
    points: np.ndarray,
    nodes: np.ndarray,
    face_type: str,
    stiffness: Field,
    direction: np.ndarray | None,
    axisymmetric: bool = False,
) -> sparse.csr_matrix:
    """∫ k (N d)(N d)ᵀ dS (n_dofs, n_dofs) on faces (n, n_nodes), k a force per volume.

    `direction` (dim,) is the unit vector d; None: the normal at each place (Winkler's foundation).
    """
    reference, weights = face_rule(face_type)
    values, vectors = surface_vectors(points, nodes, face_type, reference, axisymmetric)
    area = np.linalg.norm(vectors, axis=2)
    place = np.einsum("qa,fad->fqd", values, points[nodes])
    given = stiffness(place.reshape(-1, points.shape[1])).reshape(area.shape)
    unit = (
        vectors / area[..., None] if direction is None else np.broadcast_to(direction, place.shape)
    )
    weight = given * area * weights
    entries = np.einsum(
        "fq,qa,qb,fqc,fqd->facbd", weight, values, values, unit, unit, optimize=True
    )
    dim = points.shape[1]
    dofs = (dim * nodes[..., None] + np.arange(dim)).reshape(len(nodes), -1)
    size = dofs.shape[1]
    rows, columns = np.repeat(dofs, size, axis=1).ravel(), np.tile(dofs, (1, size)).ravel()
    shape = (points.size, points.size)
    return sparse.csr_matrix((entries.ravel(), (rows, columns)), shape=shape)


def at_nodes(
    points: np.ndarray, nodes: np.ndarray, stiffness: np.ndarray, axis: int
) -> sparse.csr_matrix:
    """Springs (n_dofs, n_dofs) of stiffness (n,), force per length, at nodes (n,) along an axis."""
    diagonal = np.zeros(points.shape)
    diagonal[nodes, axis] = stiffness
    return sparse.diags_array(diagonal.ravel()).tocsr()


# Strains (k, n, q, 6) of the cells of a block at its quadrature points, as COMPONENTS.
Strains = Callable[[Block], np.ndarray]
# The places in a tensor of the components xx, yy, zz, xy, yz, xz.
_TENSOR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])


@dataclass(frozen=True, kw_only=True)
class StrainLoads:
    """What k initial strains do, each by itself; all but the energy are linear in them.

    `force` (k, n, dim) at nodes; `stress` (k, n, 6), C ε₀ at nodes as `nodal_stress` averages it;
    `energy` (n, k, k), ∫ ε₀:C:ε₀ over each cell, at its first node.
    """

    force: np.ndarray
    stress: np.ndarray
    energy: np.ndarray


def strain_loads(
    points: np.ndarray, blocks: Sequence[Block], strains: Strains, count: int
) -> StrainLoads:
    """The loads of `count` initial strains in blocks, those in mixed form with λ = 0.

    Raises SolveError where cells are inverted or degenerate.
    """
    n, dim = points.shape
    force, stress = np.zeros((count, n, dim)), np.zeros((count, n, 6))
    energy, around = np.zeros((n, count, count)), np.zeros(n)
    for block in blocks:
        reference, weights = block.rule
        fit = extrapolation(block.type, reference)
        for part in chunks(block, dim):
            some = block.of(part)
            strain = strains(some)
            if not strain.any():
                continue
            shapes = shapes_in(points, block.type, some.cells, reference, block.axisymmetric)
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
            by_cell = np.einsum("kcqs,lcqs->ckl", weighted, strain, optimize=True)
            np.add.at(energy, some.cells[:, 0], by_cell)
        around += np.bincount(block.cells.ravel(), minlength=n)
    stress /= np.maximum(around, 1)[:, None]
    return StrainLoads(force=force, stress=stress, energy=energy)


def _stress(block: Block, strain: np.ndarray) -> np.ndarray:
    """C ε₀ (k, n, q, 6) of strains (k, n, q, 6) in a block's cells."""
    stress = 2 * block.shear[:, None, None] * strain
    stress[..., :3] += block.lame[:, None, None] * strain[..., :3].sum(axis=-1, keepdims=True)
    return stress
