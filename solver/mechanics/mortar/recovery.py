"""Recovery of a pressure of second or third order from one constant per macro-element.

The mean pressures p (m,) of macro-elements T determine a discontinuous polynomial

    p*(x) = pᵢ + Σₖ cᵢₖ ψᵢₖ(x) on Tᵢ,    c = R p,    ψᵢₖ of mean zero over the covered part of Tᵢ,

by least squares over neighbours, each fitted in the mean. p* has the means p whatever c is, and a
uniform pressure gives c = 0. The loads F with Fᵢₖ = ∫ ψᵢₖ (N_master − N_slave) n dS give the bodies
what the constants withhold from them.

Sources: Barth, Frederickson, AIAA 90-0013 (1990), for the reconstruction; Stetter, Numer. Math. 29
(1978) 425–443, for the deferred correction that applies it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy import sparse

# A macro-element covered by less than this share of its area is no neighbour: its mean is of
# little use to others.
MIN_SHARE = 0.25
# Neighbours' normals differ by less than 30°: across a kink the pressure may jump.
_SAME_SIDE = np.cos(np.radians(30))
# The singular values of a fit may differ by this factor.
_RANK = 1 / 30
_RINGS = 3
_AT_ONCE = 4096


@dataclass(frozen=True, kw_only=True)
class Moments:
    """Moments of the covered parts of m macro-elements, d dimensions.

    `measure` (m,) of the covered part; `share` (m,) of the whole; `centre` (m, d), its centroid;
    `spread` (m, d, d), the mean of (x − centre)(x − centre)ᵀ; `normal` (m, d); `tangents`
    (m, d − 1, d), one orthonormal frame for each macro-element.
    """

    measure: np.ndarray
    share: np.ndarray
    centre: np.ndarray
    spread: np.ndarray
    normal: np.ndarray
    tangents: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """The length (m,) that coordinates on a macro-element are relative to."""
        return self.measure ** (1 / self.tangents.shape[1])

    def along(self, vectors: np.ndarray, macro: np.ndarray) -> np.ndarray:
        """Vectors (n, …, d) in the frames of macro-elements (n,), relative to their size.

        Returns (n, …, d − 1).
        """
        frame = self.tangents[macro] / self.size[macro, None, None]
        return np.einsum("n...d,ntd->n...t", vectors, frame)

    def second(self, matrices: np.ndarray, macro: np.ndarray) -> np.ndarray:
        """Matrices (n, …, d, d) in the frames of macro-elements (n,): (n, …, d − 1, d − 1)."""
        frame = self.tangents[macro] / self.size[macro, None, None]
        return np.einsum("nsd,n...de,nte->n...st", frame, matrices, frame)


def moments(
    macro: Sequence[np.ndarray],
    places: Sequence[np.ndarray],
    weights: Sequence[np.ndarray],
    area: np.ndarray,
    centre: np.ndarray,
    normal: np.ndarray,
) -> Moments:
    """Moments of macro-elements from quadrature points on their covered parts.

    By block of segments: `macro` (s,) the macro-element, `places` (s, q, d), `weights` (s, q).
    `area`, `centre`, `normal` (m,), (m, d), (m, d): whole macro-elements. One that is not covered
    keeps its centre and has no spread.

    Two points that integrate cubics on a macro-element from −1 to 1:

    >>> at = np.array([[[-1 / 3**0.5, 0.0], [1 / 3**0.5, 0.0]]])
    >>> found = moments([np.array([0])], [at], [np.ones((1, 2))], np.array([2.0]),
    ...                 np.zeros((1, 2)), np.array([[0.0, 1.0]]))
    >>> found.measure, found.spread[0, 0, 0].round(12)
    (array([2.]), np.float64(0.333333333333))
    """
    m, dim = centre.shape
    measure, first, second = np.zeros(m), np.zeros((m, dim)), np.zeros((m, dim, dim))
    for owner, x, w in zip(macro, places, weights, strict=True):
        away = x - centre[owner][:, None]
        np.add.at(measure, owner, w.sum(axis=1))
        np.add.at(first, owner, np.einsum("sq,sqd->sd", w, away))
        np.add.at(second, owner, np.einsum("sq,sqd,sqe->sde", w, away, away))
    covered = np.where(measure > 0, measure, 1.0)
    shift = first / covered[:, None]
    spread = second / covered[:, None, None] - shift[:, :, None] * shift[:, None]
    return Moments(
        measure=np.where(measure > 0, measure, area),
        share=measure / area,
        centre=centre + shift,
        spread=spread,
        normal=normal,
        tangents=_frames(normal),
    )


def _frames(normal: np.ndarray) -> np.ndarray:
    if normal.shape[1] == 2:
        return np.stack([-normal[:, 1], normal[:, 0]], axis=1)[:, None]
    axis = np.zeros_like(normal)
    axis[np.arange(len(normal)), np.abs(normal).argmin(axis=1)] = 1.0
    first = np.cross(axis, normal)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normal, first)], axis=1)


def n_shapes(dim: int, degree: int) -> int:
    """The number of functions ψ on a macro-element in `dim` dimensions: 1 or 2 in 2D, 2 or 5."""
    return dim - 1 if degree == 1 else (dim - 1) * (dim + 2) // 2


def shapes(at: Moments, macro: np.ndarray, places: np.ndarray, degree: int) -> np.ndarray:
    """ψ (s, q, k) of macro-elements (s,) at points (s, q, d): linear, for degree 2 squares too.

    >>> one = Moments(measure=np.array([2.0]), share=np.ones(1), centre=np.zeros((1, 2)),
    ...               spread=np.diag([1 / 3, 0.0])[None], normal=np.array([[0.0, 1.0]]),
    ...               tangents=np.array([[[1.0, 0.0]]]))
    >>> shapes(one, np.array([0]), np.array([[[1.0, 0.0]]]), 2).round(6).tolist()
    [[[0.5, 0.166667]]]

    At its end y = 1/2, and y² less the mean of y² is 1/4 − 1/12.
    """
    y = at.along(places - at.centre[macro][:, None], macro)
    return _powers(y, y[..., :, None] * y[..., None, :] - _own_spread(at, macro), degree)


def _own_spread(at: Moments, macro: np.ndarray) -> np.ndarray:
    return at.second(at.spread[macro], macro)[:, None]


def _powers(linear: np.ndarray, squares: np.ndarray, degree: int) -> np.ndarray:
    if degree == 1:
        return linear
    pairs = combinations_with_replacement(range(linear.shape[-1]), 2)
    return np.concatenate([linear, *(squares[..., a, b][..., None] for a, b in pairs)], axis=-1)


@dataclass(frozen=True, kw_only=True)
class Reconstruction:
    """c = `matrix` · p, with `matrix` (m · k, m); `degree` (m,) of the polynomial on each.

    A degree is 0 where a macro-element has too few neighbours for any fit.
    """

    matrix: sparse.csr_matrix
    degree: np.ndarray


def vertex_neighbours(faces: Sequence[tuple[np.ndarray, np.ndarray]], m: int) -> sparse.csr_matrix:
    """Which of m macro-elements share a vertex (m, m), each with itself too.

    `faces`, by block: macro-element (n,) and vertices (n, v).

    >>> vertex_neighbours([(np.arange(3), np.array([[0, 1], [1, 2], [2, 3]]))], 3).toarray()
    array([[ True,  True, False],
           [ True,  True,  True],
           [False,  True,  True]])
    """
    owner = np.concatenate([np.repeat(n, v.shape[1]) for n, v in faces])
    vertex = np.concatenate([v.ravel() for _, v in faces])
    ones = np.ones(len(owner))
    touches = sparse.csr_matrix((ones, (owner, vertex)), shape=(m, int(vertex.max()) + 1))
    return (touches @ touches.T).astype(bool).tocsr()


def reconstruct(
    at: Moments, near: sparse.csr_matrix, closed: np.ndarray, degree: int
) -> Reconstruction:
    """The reconstruction of degree 1 or 2 among closed macro-elements (m,).

    `near` (m, m): which macro-elements share a vertex. Where no ring of neighbours determines a
    quadratic, a linear is fitted; where none determines that, c = 0.

    A linear pressure on a row of three intervals of length 1; its mean falls by 2 per interval:

    >>> x = np.array([[0.5, 0.0], [1.5, 0.0], [2.5, 0.0]])
    >>> row = Moments(measure=np.ones(3), share=np.ones(3), centre=x,
    ...               spread=np.tile(np.diag([1 / 12, 0.0]), (3, 1, 1)),
    ...               normal=np.tile([0.0, 1.0], (3, 1)), tangents=np.tile([[1.0, 0.0]], (3, 1, 1)))
    >>> near = vertex_neighbours([(np.arange(3), np.array([[0, 1], [1, 2], [2, 3]]))], 3)
    >>> (reconstruct(row, near, np.ones(3, dtype=bool), 1).matrix @ [9.0, 7.0, 5.0]).round(12)
    array([-2., -2., -2.])
    """
    m, dim = at.centre.shape
    k = n_shapes(dim, degree)
    useful = _useful(at, near, closed)
    rows, columns, values = [], [], []
    found = np.zeros(m, dtype=int)
    for d in range(degree, 0, -1):
        ring = useful
        for number in range(1, _RINGS + 1):
            if number > 1:
                ring = (ring @ useful + ring).astype(bool).tocsr()
            # Within one ring of triangles a quadratic is determined badly.
            if d == 2 and dim == 3 and number == 1:
                continue
            open_ones = np.flatnonzero(closed & (found == 0))
            for start in range(0, len(open_ones), _AT_ONCE):
                chosen = open_ones[start : start + _AT_ONCE]
                solved, entries = _fit(at, ring[chosen], chosen, d)
                found[chosen[solved]] = d
                for store, part in zip((rows, columns, values), entries, strict=True):
                    store.append(part)
    macro, shape = (np.concatenate(rows).T if rows else np.empty((2, 0))).astype(int)
    entries = (np.concatenate(values or [[]]), (macro * k + shape, np.concatenate(columns or [[]])))
    matrix = sparse.coo_matrix(entries, shape=(m * k, m)).tocsr()
    return Reconstruction(matrix=matrix, degree=found)


def _useful(at: Moments, near: sparse.csr_matrix, closed: np.ndarray) -> sparse.csr_matrix:
    """Neighbours (m, m) that may serve: closed, well covered, not around a kink, another one."""
    pairs = near.tocoo()
    i, j = pairs.row, pairs.col
    level = np.einsum("pd,pd->p", at.normal[i], at.normal[j]) > _SAME_SIDE
    kept = (i != j) & closed[i] & closed[j] & (at.share[j] >= MIN_SHARE) & level
    ones = np.ones(int(kept.sum()), dtype=bool)
    return sparse.csr_matrix((ones, (i[kept], j[kept])), shape=near.shape)


def _fit(
    at: Moments, ring: sparse.csr_matrix, chosen: np.ndarray, degree: int
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Fits of the macro-elements `chosen` (n,) to their rings (n, m): which are determined.

    With them the entries of R: (macro-element, shape) (e, 2), column (e,), value (e,).
    """
    count = np.diff(ring.indptr)
    width = int(count.max(initial=0))
    slot = np.arange(len(ring.indices)) - np.repeat(ring.indptr[:-1], count)
    row = np.repeat(np.arange(len(chosen)), count)
    other = np.repeat(chosen[:, None], max(width, 1), axis=1)
    used = np.zeros(other.shape, dtype=bool)
    other[row, slot], used[row, slot] = ring.indices, True
    used &= other != chosen[:, None]
    y = at.along(at.centre[other] - at.centre[chosen][:, None], chosen)
    spread = at.second(at.spread[other] - at.spread[chosen][:, None], chosen)
    b = _powers(y, y[..., :, None] * y[..., None, :] + spread, degree)
    distance = np.linalg.norm(y, axis=-1)
    weight = np.where(used & (distance > 0), 1 / np.where(distance > 0, distance, 1.0), 0.0)
    left, sizes, right = np.linalg.svd(weight[..., None] * b, full_matrices=False)
    k = b.shape[-1]
    enough = (weight > 0).sum(axis=1) >= k
    solved = enough & (sizes.shape[1] == k) & (sizes[:, -1] > _RANK * sizes[:, 0])
    u, s, v = left[solved], sizes[solved], right[solved]
    inverse = np.einsum("nki,nk,njk->nij", v, 1 / s, u) * weight[solved][:, None]
    macro = chosen[solved]
    shape = np.broadcast_to(np.arange(k), (len(macro), k))
    place = np.stack([np.broadcast_to(macro[:, None], shape.shape), shape], axis=-1)
    place = np.broadcast_to(place[:, :, None], (*inverse.shape, 2)).reshape(-1, 2)
    column = np.broadcast_to(other[solved][:, None], inverse.shape).ravel()
    own = np.stack([np.broadcast_to(macro[:, None], shape.shape), shape], axis=-1).reshape(-1, 2)
    entries = (
        np.concatenate([place, own]),
        np.concatenate([column, own[:, 0]]),
        np.concatenate([inverse.ravel(), -inverse.sum(axis=2).ravel()]),
    )
    return solved, entries
