"""Nodal forces of pressures, tractions and body forces; springs and elastic foundations."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from ...lac.cells.faces import circumference, surface_vectors
from ...lac.cells.quadrature import face_rule
from ...lac.cells.shape import invert, shape_functions
from ...lac.errors import SolveError
from .block import volume_rule
from .stress import traction

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
