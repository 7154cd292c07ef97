"""Springs to the ground: the stiffness of elastic foundations, and of springs at nodes."""

import numpy as np
from scipy import sparse

from ...lac.cells.faces import surface_vectors
from ...lac.cells.quadrature import face_rule
from .loads import Field


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
