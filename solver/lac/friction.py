"""The rows of slip: jumps of displacement along the tangents of macro-elements.

q is the traction on the master, w the slip of the master relative to the slave since the last step
in equilibrium. A closed macro-element sticks, w = 0 and |q| ≤ μp, or slips, q = −μp w/|w|.

The slip operator has the jump of displacement along the tangents of macro-elements. The slip of
macro-element i along its tangent t is w = (row i · u) / covered area, master relative to slave. A
traction q on the master does the work q · w per area: its nodal forces are rowᵀ q. Rows are
integrated at the points of the gap operator. Where a segment is flat they are its closed integrals
∫ N times t, so that a uniform shear acts on both sides as on whole faces.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from .facets import tangents_of
from .multipliers import MASTER, SLAVE, Integrals
from .segments import Segments

# Normals that differ by less within a segment are one normal.
_FLAT = 1e-12


def levers(given: Sequence[tuple[Segments, np.ndarray]], normal: np.ndarray, k: int) -> np.ndarray:
    """The couples (dim − 1, m, k, 3) ∫ ψ g n × t dS of tractions ψ, by tangent.

    Tractions act on both surfaces where these are meshed, a gap g apart. `given` are segments with
    functions ψ (s, q, ≤ k) at their points; the couples of further ones are zero.

    The edges are 1/2 apart over a length of 2, n × t is the axis across the plane:

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> one = np.ones((*segments.weight.shape, 1))
    >>> levers([(segments, one)], np.array([[0.0, 1.0]]), 1)[0].round(15).tolist()
    [[[0.0, 0.0, 1.0]]]
    """
    m, dim = normal.shape
    couples = np.zeros((dim - 1, m, k, 3))
    for by_macro, tangent in zip(couples, tangents(normal), strict=True):
        for segments, psi in given:
            pair = segments.normal, along_faces(segments, tangent)
            n, t = (np.pad(v, [(0, 0), (0, 0), (0, 3 - dim)]) for v in pair)
            weight = segments.weight * segments.gap
            couple = np.einsum("sq,sqk,sqd->skd", weight, psi, np.cross(n, t))
            np.add.at(by_macro[:, : psi.shape[-1]], segments.macro, couple)
    return couples


class Tangent(NamedTuple):
    """One tangent of each macro-element: `normal` (m, dim), its mean one, and `along` (m, dim)."""

    normal: np.ndarray
    along: np.ndarray


def tangents(normal: np.ndarray) -> list[Tangent]:
    """The dim − 1 tangents of macro-elements with mean normals (m, dim).

    >>> [tangent.along.tolist() for tangent in tangents(np.array([[0.0, 1.0]]))]
    [[[-1.0, 0.0]]]
    """
    return [Tangent(normal, along) for along in np.swapaxes(tangents_of(normal), 0, 1)]


def along_faces(segments: Segments, tangent: Tangent) -> np.ndarray:
    """Unit tangents (s, q, dim) in the face at the points of segments.

    The smallest rotation from the mean normal a of the macro-element to the normal n at the point
    turns its tangent t to t − (t · n) (a + n)/(1 + a · n). This is linear in t, so that results do
    not depend on the frame of the macro-element, nor on the axes.

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> tilted = Tangent(np.array([[-0.8, 0.6]]), np.array([[0.6, 0.8]]))
    >>> along_faces(segments, tilted)[0, 0].round(15).tolist()
    [1.0, 0.0]
    """
    a, t = (vectors[segments.macro][:, None] for vectors in tangent)
    return _turned(t, a, segments.normal)


def _turned(t: np.ndarray, a: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Vectors t across the unit vectors a, by the smallest rotation from these to n."""
    out, level = ((vectors * n).sum(axis=-1, keepdims=True) for vectors in (t, a))
    return np.asarray(t - out / (1 + level) * (a + n))


def of_tractions(matrix: sparse.csr_matrix, normal: np.ndarray) -> sparse.csr_matrix:
    """A reconstruction (m · k, m) for tractions by tangent: (d · m · k, d · m), d = dim − 1.

    The frames of neighbours differ, also by the round-off of their mean normals (m, dim): tangents
    are turned to the plane of the macro-element that the matrix reconstructs on.

    The second of two macro-elements gets what the first one has. By round-off in their normals
    their first tangents are along x and along −y:

    >>> normal = np.array([[1e-17, 0.0, 1.0], [0.0, 1e-17, 1.0]])
    >>> copied = of_tractions(sparse.csr_matrix([[0.0, 0.0], [1.0, 0.0]]), normal)
    >>> (copied.toarray()[[1, 3]].round(12) + 0.0).tolist()
    [[0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
    """
    pairs, along = matrix.tocoo(), tangents_of(normal)
    k, other = matrix.shape[0] // matrix.shape[1], pairs.col
    own = pairs.row // k
    turned = _turned(along[other], normal[other][:, None], normal[own][:, None])
    shares = np.einsum("ptd,psd->tsp", along[own], turned)
    blocks = [
        [sparse.coo_array((share * pairs.data, pairs.coords), matrix.shape) for share in row]
        for row in shares
    ]
    return sparse.csr_matrix(sparse.block_array(blocks))


def turned_along(part: Integrals, tangent: Tangent) -> Integrals:
    """The integrals of a part with ∫ N t in place of ∫ N n.

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> data = InterfaceData(slaves=[slave], samples=[], found=[segments], n_macro=1)
    >>> part = integrals(constants(data), segments)
    >>> tangent = Tangent(np.array([[0.0, 1.0]]), np.array([[1.0, 0.0]]))
    >>> turned_along(part, tangent).vectors[MASTER][..., 0].round(15).tolist()
    [[[0.5, 0.5]], [[0.5, 0.5]]]
    """
    slave, master = (_along(part, side, tangent)[:, None] for side in (SLAVE, MASTER))
    return replace(part, vectors=(slave, master))


def _along(part: Integrals, side: int, tangent: Tangent) -> np.ndarray:
    """∫ N t (s, n_nodes, dim) over segments; t is the tangent in the face at each point."""
    segments = part.segments
    normal, t = segments.normal, along_faces(segments, tangent)
    flat = np.abs(normal - normal[:, :1]).max(axis=(1, 2), initial=0.0) <= _FLAT
    scalar = np.einsum("sad,sd->sa", part.vectors[side][:, 0], normal[:, 0])
    exact = scalar[..., None] * t[:, :1]
    values = segments.sides[side].values
    return np.where(
        flat[:, None, None], exact, np.einsum("sqa,sq,sqd->sad", values, segments.weight, t)
    )
