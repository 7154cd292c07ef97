"""Recovery of a pressure of second or third order from one constant per macro-element.

The mean pressures p (m,) of macro-elements T determine a discontinuous polynomial

    p*(x) = pᵢ + Σₖ cᵢₖ ψᵢₖ(x) on Tᵢ,    c = R p,    ψᵢₖ of mean zero over the covered part of Tᵢ,

by least squares over neighbours, each fitted in the mean. p* has the means p whatever c is, and a
uniform pressure gives c = 0. The loads F with Fᵢₖ = ∫ ψᵢₖ (N_master − N_slave) n dS give the bodies
what the constants withhold from them.

On linear cells the means themselves scatter about the exact ones, on triangles of TETRA4 by more
than they vary from one macro-element to the next. The form `smooth` therefore applies the loads of
a linear reconstruction, and then fits the own mean too, as one of the data: ψ has a constant as
well, and the means of p* are not p.

Sources: Barth, Frederickson, AIAA 90-0013 (1990), for the reconstruction; Stetter, Numer. Math. 29
(1978) 425–443, for the deferred correction that applies it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np
from scipy import sparse

from ..fem.faces import circumference
from .facets import tangents_of
from .segments import Segments
from .surface_points import Surface

# A macro-element covered by less than this share of its area is no neighbour: its mean is of
# little use to others.
MIN_SHARE = 0.25
# Neighbours' normals differ by less than 30°: across a kink the pressure may jump.
_SAME_SIDE = np.cos(np.radians(30))
# The singular values of a fit may differ by this factor.
_RANK = 1 / 30
_RINGS = 3
_AT_ONCE = 4096


@dataclass(frozen=True)
class Form:
    """A kind of reconstruction: its degree, whether it keeps the means, how often it is applied.

    `sweeps`: solves with the loads that it adds. The form `none` estimates the error of the
    constants and recovers nothing.
    """

    name: str
    degree: int
    keeps_means: bool
    sweeps: int

    def count(self, dim: int) -> int:
        """The number of functions ψ on a macro-element in `dim` dimensions.

        >>> [FORMS[name].count(3) for name in ("linear", "quadratic", "smooth")]
        [2, 5, 3]
        """
        of_degree = dim - 1 if self.degree == 1 else (dim - 1) * (dim + 2) // 2
        return of_degree + (not self.keeps_means)


FORMS = {
    form.name: form
    for form in (
        Form("none", degree=1, keeps_means=True, sweeps=0),
        Form("linear", degree=1, keeps_means=True, sweeps=2),
        Form("quadratic", degree=2, keeps_means=True, sweeps=3),
        Form("smooth", degree=1, keeps_means=False, sweeps=2),
    )
}


def automatic(quadratic: bool) -> str:
    """The form that measurement shows to be best, by the degree of the slave's cells.

    >>> automatic(True), automatic(False)
    ('quadratic', 'smooth')
    """
    return "quadratic" if quadratic else "smooth"


@dataclass(frozen=True)
class Asked:
    """The form of a recovery, and which of the m macro-elements share a vertex, `near` (m, m)."""

    form: Form
    near: sparse.csr_matrix


@dataclass(frozen=True, kw_only=True)
class Local:
    """Local coordinates y = axes · (x − centre) on m macro-elements in d dimensions.

    `centre` (m, d); `axes` (m, d − 1, d), unit tangents over the size of the macro-element;
    `spread` (m, d − 1, d − 1), the mean of y yᵀ over its covered part.
    """

    centre: np.ndarray
    axes: np.ndarray
    spread: np.ndarray

    def along(self, vectors: np.ndarray, macro: np.ndarray) -> np.ndarray:
        """Vectors (n, …, d) in the axes of macro-elements (n,): (n, …, d − 1)."""
        return np.einsum("n...d,ntd->n...t", vectors, self.axes[macro])

    def shapes(self, macro: np.ndarray, places: np.ndarray, form: Form) -> np.ndarray:
        """ψ (s, q, k) of macro-elements (s,) at points (s, q, d): linear, squares, a constant.

        >>> one = Local(centre=np.zeros((1, 2)), axes=np.array([[[0.5, 0.0]]]),
        ...             spread=np.array([[[1 / 12]]]))
        >>> one.shapes(np.array([0]), np.array([[[1.0, 0.0]]]), FORMS["quadratic"]).round(6)
        array([[[0.5     , 0.166667]]])

        On an interval from −1 to 1, y = 1/2 at its end, and y² less its mean is 1/4 − 1/12.
        """
        y = self.along(places - self.centre[macro][:, None], macro)
        return _powers(y, y[..., :, None] * y[..., None, :] - self.spread[macro][:, None], form)


@dataclass(frozen=True, kw_only=True)
class Moments:
    """Moments of the covered parts of m macro-elements, d dimensions.

    `share` (m,) of the area; `spread` (m, d, d), the mean of (x − centre)(x − centre)ᵀ; `normal`
    (m, d); `local` coordinates, their origin at the centroid.
    """

    share: np.ndarray
    spread: np.ndarray
    normal: np.ndarray
    local: Local


def moments(found: Sequence[Segments], surface: Surface) -> Moments:
    """Moments of macro-elements (m,) from the segments that cover them.

    One that is not covered keeps its centre and has no spread.

    A slave edge from 0 to 2: the mean of (x − 1)² is 1/3, whatever the master edges over it.

    >>> found = meet_in_segments([slave], [], [master], 1.0, degree=1)
    >>> at = Surface(area=np.array([2.0]), covered=np.array([2.0]), centre=np.array([[1.0, 0.0]]),
    ...              normal=np.array([[0.0, 1.0]]))
    >>> moments(found, at).spread[0, 0, 0].round(12)
    np.float64(0.333333333333)
    """
    m, dim = surface.centre.shape
    measure, first, second = np.zeros(m), np.zeros((m, dim)), np.zeros((m, dim, dim))
    for segments in found:
        owner, w = segments.macro, segments.weight
        away = segments.points - surface.centre[owner][:, None]
        np.add.at(measure, owner, segments.area)
        np.add.at(first, owner, np.einsum("sq,sqd->sd", w, away))
        np.add.at(second, owner, np.einsum("sq,sqd,sqe->sde", w, away, away))
    covered = np.where(measure > 0, measure, 1.0)
    shift = first / covered[:, None]
    spread = second / covered[:, None, None] - shift[:, :, None] * shift[:, None]
    size = np.where(measure > 0, measure, surface.area)
    if found and found[0].slave.faces.axisymmetric:
        size = size / circumference(surface.centre + shift)
    size = size ** (1 / (dim - 1))
    axes = tangents_of(surface.normal) / size[:, None, None]
    own = np.einsum("nsd,nde,nte->nst", axes, spread, axes)
    local = Local(centre=surface.centre + shift, axes=axes, spread=own)
    return Moments(share=measure / surface.area, spread=spread, normal=surface.normal, local=local)


@dataclass(frozen=True, kw_only=True)
class Recovery:
    """What recovers the pressure on m macro-elements by functions ψ, k on each.

    `near` (m, m): which of them share a vertex; `loads` (m · k, n_dofs): ∫ ψ (N_master − N_slave) n
    dS; `products` (m, k, k): ∫ ψ ψᵀ dS.
    """

    form: Form
    moments: Moments
    near: sparse.csr_matrix
    loads: sparse.csr_matrix
    products: np.ndarray

    def reconstruction(self, closed: np.ndarray, applied: bool = False) -> "Reconstruction":
        """The reconstruction among closed macro-elements (m,): as read, or as `applied` as loads.

        Loads keep the means, in every form.
        """
        fitted = replace(self.form, keeps_means=self.form.keeps_means or applied)
        return reconstruct(self.moments, self.near, closed, fitted, self.form)

    def error(self, coefficients: np.ndarray) -> np.ndarray:
        """η (m,), the L2 norm of p* − p on each, for `coefficients` (m · k,)."""
        c = coefficients.reshape(len(self.products), -1)
        scale = np.abs(c).max(initial=0.0) or 1.0  # squares of the largest numbers overflow
        square = np.einsum("mk,mkl,ml->m", c / scale, self.products, c / scale)
        return scale * np.sqrt(np.maximum(square, 0.0))


def recovery(asked: Asked, found: Sequence[Segments], surface: Surface, n_nodes: int) -> Recovery:
    """What recovers the pressure of macro-elements from the segments that cover them.

    A slave edge from 0 to 2 under two master edges, with ψ = (1 − x) / 2: ∫ ψ N is ±1/6 at the two
    slave nodes, 1/6, 0, −1/6 at the three master nodes, and ∫ ψ² is 1/6.

    >>> found = meet_in_segments([slave], [], [master], 1.0, degree=1)
    >>> at = Surface(area=np.array([2.0]), covered=np.array([2.0]), centre=np.array([[1.0, 0.0]]),
    ...              normal=np.array([[0.0, 1.0]]))
    >>> alone = Asked(FORMS["linear"], sparse.identity(1, dtype=bool, format="csr"))
    >>> one = recovery(alone, found, at, len(points))
    >>> one.loads.toarray().reshape(5, 2)[:, 1].round(4).tolist(), one.products.round(4).tolist()
    ([-0.1667, 0.1667, 0.1667, 0.0, -0.1667], [[[0.1667]]])
    """
    form = asked.form
    at, (m, dim) = moments(found, surface), surface.centre.shape
    k = form.count(dim)
    products = np.zeros((m, k, k))
    rows, columns, values = [], [], []
    for segments in found:
        psi = at.local.shapes(segments.macro, segments.points, form)
        weighted = segments.weight[..., None] * psi
        np.add.at(products, segments.macro, np.einsum("sqk,sql->skl", weighted, psi))
        if not form.sweeps:
            continue
        for sign, side in zip((-1.0, 1.0), segments.sides, strict=True):
            part = np.einsum("sqk,sqa,sqd->skad", sign * weighted, side.values, segments.normal)
            row = segments.macro[:, None] * k + np.arange(k)
            column = dim * side.nodes[:, :, None] + np.arange(dim)
            rows.append(np.broadcast_to(row[:, :, None, None], part.shape).ravel())
            columns.append(np.broadcast_to(column[:, None], part.shape).ravel())
            values.append(part.ravel())
    entries = [np.concatenate(part or [np.empty(0, int)]) for part in (values, rows, columns)]
    loads = sparse.coo_matrix((entries[0], (entries[1], entries[2])), shape=(m * k, dim * n_nodes))
    return Recovery(form=form, moments=at, near=asked.near, loads=loads.tocsr(), products=products)


def _powers(linear: np.ndarray, squares: np.ndarray, form: Form) -> np.ndarray:
    parts = [linear]
    if form.degree == 2:
        pairs = combinations_with_replacement(range(linear.shape[-1]), 2)
        parts += [squares[..., a, b][..., None] for a, b in pairs]
    if not form.keeps_means:
        parts.append(np.ones((*linear.shape[:-1], 1)))
    return np.concatenate(parts, axis=-1)


@dataclass(frozen=True, kw_only=True)
class Reconstruction:
    """c = `matrix` · p, with `matrix` (m · k, m); `degree` (m,) of the polynomial on each.

    A degree is 0 where a macro-element has too few neighbours for any fit.
    """

    form: Form
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
    at: Moments,
    near: sparse.csr_matrix,
    closed: np.ndarray,
    form: Form,
    written: Form | None = None,
) -> Reconstruction:
    """The reconstruction among closed macro-elements (m,), in the functions of the form `written`.

    `near` (m, m): which macro-elements share a vertex. Where no ring of neighbours determines a
    quadratic, a linear is fitted; where none determines that, c = 0.

    A linear pressure on a row of three intervals of length 1; its mean falls by 2 per interval:

    >>> x = np.array([[0.5, 0.0], [1.5, 0.0], [2.5, 0.0]])
    >>> local = Local(centre=x, axes=np.tile([[1.0, 0.0]], (3, 1, 1)),
    ...               spread=np.full((3, 1, 1), 1 / 12))
    >>> row = Moments(share=np.ones(3), spread=np.tile(np.diag([1 / 12, 0.0]), (3, 1, 1)),
    ...               normal=np.tile([0.0, 1.0], (3, 1)), local=local)
    >>> near = vertex_neighbours([(np.arange(3), np.array([[0, 1], [1, 2], [2, 3]]))], 3)
    >>> found = reconstruct(row, near, np.ones(3, dtype=bool), FORMS["linear"])
    >>> (found.matrix @ [9.0, 7.0, 5.0]).round(12)
    array([-2., -2., -2.])
    """
    m, dim = at.local.centre.shape
    useful = _useful(at, near, closed)
    degree, parts = np.zeros(m, dtype=int), []
    for lower in range(form.degree, 0, -1):
        ring, tried = useful, replace(form, degree=lower)
        for number in range(1, _RINGS + 1):
            if number > 1:
                ring = (ring @ useful + ring).astype(bool).tocsr()
            # One ring of triangles determines a quadratic badly, and smooths little.
            if dim == 3 and number == 1 and (lower == 2 or not form.keeps_means):
                continue
            left = np.flatnonzero(closed & (degree == 0))
            for start in range(0, len(left), _AT_ONCE):
                some = left[start : start + _AT_ONCE]
                solved, entries = _fit(at, ring[some], some, tried)
                degree[some[solved]] = lower
                parts.append(entries)
    macro, shape, column, value = (
        np.concatenate([part[i] for part in parts] or [np.empty(0)]) for i in range(4)
    )
    k = (written or form).count(dim)
    row = macro.astype(int) * k + shape.astype(int)
    matrix = sparse.coo_matrix((value, (row, column.astype(int))), shape=(m * k, m)).tocsr()
    return Reconstruction(form=form, matrix=matrix, degree=degree)


def _useful(at: Moments, near: sparse.csr_matrix, closed: np.ndarray) -> sparse.csr_matrix:
    """Neighbours (m, m) that may serve: closed, well covered, not around a kink, another one."""
    pairs = near.tocoo()
    i, j = pairs.row, pairs.col
    level = np.einsum("pd,pd->p", at.normal[i], at.normal[j]) > _SAME_SIDE
    kept = (i != j) & closed[i] & closed[j] & (at.share[j] >= MIN_SHARE) & level
    ones = np.ones(int(kept.sum()), dtype=bool)
    return sparse.csr_matrix((ones, (i[kept], j[kept])), shape=near.shape)


Entries = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _fit(
    at: Moments, ring: sparse.csr_matrix, chosen: np.ndarray, form: Form
) -> tuple[np.ndarray, Entries]:
    """Fits of macro-elements `chosen` (n,) to their rings (n, m): which (n,) are determined.

    With them the entries of R: macro-element, shape, column and value (e,) each.
    """
    other, weight = _neighbours(ring, chosen)
    b, weight = _means(at, chosen, other, weight, form)
    system = weight[..., None] * b
    if not form.keeps_means:
        own = np.zeros((len(chosen), 1, b.shape[-1]))
        own[..., -1] = 1.0
        system = np.concatenate([system, own], axis=1)
    left, sizes, right = np.linalg.svd(system, full_matrices=False)
    k = b.shape[-1]
    solved = ((weight > 0).sum(axis=1) + (not form.keeps_means) >= k) & (sizes.shape[1] == k)
    solved &= sizes[:, -1] > _RANK * sizes[:, 0]
    u, s, v = left[solved, : other.shape[1]], sizes[solved], right[solved]
    by_neighbour = np.einsum("nki,nk,njk->nij", v, 1 / s, u) * weight[solved][:, None]
    values = np.concatenate([by_neighbour, -by_neighbour.sum(axis=2, keepdims=True)], axis=2)
    columns = np.concatenate([other[solved], chosen[solved][:, None]], axis=1)
    entries = np.broadcast_arrays(
        chosen[solved][:, None, None], np.arange(k)[:, None], columns[:, None], values
    )
    macro, shape, column, value = (x.ravel() for x in entries)
    return solved, (macro, shape, column, value)


def _neighbours(ring: sparse.csr_matrix, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Neighbours (n, w) of the chosen and whether each counts, as 0 or 1; the rest is padding."""
    count = np.diff(ring.indptr)
    width = max(int(count.max(initial=0)), 1)
    slot = np.arange(len(ring.indices)) - np.repeat(ring.indptr[:-1], count)
    row = np.repeat(np.arange(len(chosen)), count)
    other, counts = np.repeat(chosen[:, None], width, axis=1), np.zeros((len(chosen), width))
    other[row, slot] = ring.indices
    counts[row, slot] = ring.indices != chosen[row]
    return other, counts


def _means(
    at: Moments, chosen: np.ndarray, other: np.ndarray, counts: np.ndarray, form: Form
) -> tuple[np.ndarray, np.ndarray]:
    """Means of the chosen ones' ψ (n, w, k) over their neighbours, and the weights of these."""
    local, centre = at.local, at.local.centre
    y = local.along(centre[other] - centre[chosen][:, None], chosen)
    more, axes = at.spread[other] - at.spread[chosen][:, None], local.axes[chosen]
    spread = np.einsum("nsd,nwde,nte->nwst", axes, more, axes)
    distance = np.linalg.norm(y, axis=-1)
    weight = np.where(distance > 0, counts / np.where(distance > 0, distance, 1.0), 0.0)
    return _powers(y, y[..., :, None] * y[..., None, :] + spread, form), weight
