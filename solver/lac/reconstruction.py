"""Reconstruction of a pressure from one constant per macro-element.

The mean pressures p (m,) of macro-elements T determine a discontinuous polynomial

    p*(x) = pᵢ + Σₖ cᵢₖ ψᵢₖ(x) on Tᵢ,    c = R p,    ψᵢₖ of mean zero over the covered part of Tᵢ,

by least squares over neighbours, each fitted in the mean. p* has the means p whatever c is, and a
uniform pressure gives c = 0. Where all neighbours lie on one side, the slopes of a linear p* are
those of a quadratic: a linear fit has them half a macro-element away.

The means of cells scatter about the exact ones: on triangles of TETRA4 by more than they vary from
one macro-element to the next, on TETRA10 by ten times the error of the reconstruction. The forms
`smooth` and `none` therefore fit the own mean too, as one of the data: ψ has a constant as well,
and the means of p* are not p.

Source: Barth, Frederickson, AIAA 90-0013 (1990).
"""

from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np
from scipy import sparse

from .cells.neighbours import SAME_SIDE

# A macro-element covered by less than a quarter of its area is no neighbour: its mean is of little
# use to others. Meshes have exact quarters: rounding does not decide.
MIN_SHARE = 0.25 - 1e-9
# Neighbours lie on one side where their mean direction is longer than this; unit vectors to the
# five neighbours of a square at a border have a mean of 0.48.
_ONE_SIDE = 0.4
# The singular values of a fit may differ by this factor.
_RANK = 1 / 30
# Functions below this share of the largest one are round-off, as across neighbours in a line.
_NOTHING = 1e-10
# So many rings of neighbours are tried.
_TRIED = 3
_AT_ONCE = 4096


@dataclass(frozen=True)
class Form:
    """A kind of reconstruction: its degree, whether it keeps the means, whether it is applied.

    The form `none` estimates the error of the constants, and is not. `rings`: the fewest rings of
    neighbours in 2D and in 3D.
    `reach`: neighbours at a distance r have the weight exp(−(r / (reach · farthest))²) where the
    means are not kept, else 1 / r. `fitted`: the degree that is fitted, where it is a lower one.
    """

    name: str
    degree: int
    keeps_means: bool
    applied: bool = True
    rings: tuple[int, int] = (1, 1)
    reach: float = 1.0
    fitted: int = 2

    def count(self, dim: int) -> int:
        """The number of functions ψ on a macro-element in `dim` dimensions.

        >>> [FORMS[name].count(3) for name in ("linear", "quadratic", "smooth")]
        [2, 5, 6]
        """
        of_degree = dim - 1 if self.degree == 1 else (dim - 1) * (dim + 2) // 2
        return of_degree + (not self.keeps_means)


# One ring of triangles determines a quadratic badly, and smooths little.
FORMS = {
    form.name: form
    for form in (
        Form("none", degree=1, keeps_means=False, applied=False),
        Form("linear", degree=1, keeps_means=True),
        Form("quadratic", degree=2, keeps_means=True, rings=(1, 2)),
        Form("smooth", degree=2, keeps_means=False, rings=(2, 2), reach=0.7),
    )
}
# The means of linear cells, by the vertices of their faces: on lines and triangles they scatter
# more than those of quadratic cells. On quadrilaterals they are too large where the pressure is
# highest, and a linear fit, which lowers them there, is the better one.
_WIDE = replace(FORMS["smooth"], rings=(3, 3), reach=1.0)
_NEAR = replace(FORMS["smooth"], rings=(1, 1), reach=1.25, fitted=1)
_ON_LINEAR_CELLS = {2: _WIDE, 3: _WIDE, 4: _NEAR}


def form_of(name: str, order: int, vertices: int) -> Form:
    """The form of a `name` on cells of an `order`, their faces with so many vertices.

    `automatic` is the one that is best by measurement.

    >>> [form_of("automatic", *faces).name for faces in ((2, 2), (2, 3), (1, 2))]
    ['quadratic', 'smooth', 'smooth']
    """
    if name == "automatic":
        name = "quadratic" if order == 2 and vertices == 2 else "smooth"
    return _ON_LINEAR_CELLS[vertices] if name == "smooth" and order == 1 else FORMS[name]


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

    A degree is 0 where a macro-element has too few neighbours for any fit; `alone` (m,) are those
    of them that are closed.
    """

    form: Form
    matrix: sparse.csr_matrix
    degree: np.ndarray
    alone: np.ndarray


def reconstruct(
    at: Moments, near: sparse.csr_matrix, closed: np.ndarray, form: Form
) -> Reconstruction:
    """The reconstruction among closed macro-elements (m,).

    `near` (m, m): which macro-elements share a vertex. Where no ring of neighbours determines a
    quadratic, a linear is fitted; where none determines that, c = 0.

    A linear pressure on a row of three intervals of length 1; its mean falls by 2 per interval:

    >>> x = np.array([[0.5, 0.0], [1.5, 0.0], [2.5, 0.0]])
    >>> local = Local(centre=x, axes=np.tile([[1.0, 0.0]], (3, 1, 1)),
    ...               spread=np.full((3, 1, 1), 1 / 12))
    >>> row = Moments(share=np.ones(3), spread=np.tile(np.diag([1 / 12, 0.0]), (3, 1, 1)),
    ...               normal=np.tile([0.0, 1.0], (3, 1)), local=local)
    >>> near = sparse.csr_matrix([[1, 1, 0], [1, 1, 1], [0, 1, 1]], dtype=bool)
    >>> found = reconstruct(row, near, np.ones(3, dtype=bool), FORMS["linear"])
    >>> (found.matrix @ [9.0, 7.0, 5.0]).round(12)
    array([-2., -2., -2.])
    """
    m, dim = at.local.centre.shape
    useful = _useful(at, near, closed)
    degree, parts, rings = np.zeros(m, dtype=int), [], [useful]
    highest = min(form.degree, form.fitted)
    attempts = [(replace(form, degree=lower), closed) for lower in range(highest, 0, -1)]
    if form.degree == 1 and form.keeps_means:
        attempts.insert(0, (FORMS["quadratic"], closed & _one_sided(at, useful)))
    for tried, wanted in attempts:
        first = tried.rings[dim - 2]
        for number in range(first, first + _TRIED):
            left = np.flatnonzero(wanted & (degree == 0))
            while len(left) and len(rings) < number:
                rings.append((rings[-1] @ useful + rings[-1]).astype(bool).tocsr())
            for start in range(0, len(left), _AT_ONCE):
                some = left[start : start + _AT_ONCE]
                solved, entries = _fit(at, rings[number - 1][some], some, tried, form)
                degree[some[solved]] = min(tried.degree, form.degree)
                parts.append(entries)
    row, column, value = (
        np.concatenate([part[i] for part in parts] or [np.empty(0)]) for i in range(3)
    )
    places = (row.astype(int), column.astype(int))
    matrix = sparse.coo_matrix((value, places), shape=(m * form.count(dim), m)).tocsr()
    return Reconstruction(form=form, matrix=matrix, degree=degree, alone=closed & (degree == 0))


def _useful(at: Moments, near: sparse.csr_matrix, closed: np.ndarray) -> sparse.csr_matrix:
    """Neighbours (m, m) that may serve: closed, well covered, not around a kink, another one."""
    pairs = near.tocoo()
    i, j = pairs.row, pairs.col
    level = np.einsum("pd,pd->p", at.normal[i], at.normal[j]) > SAME_SIDE
    kept = (i != j) & closed[i] & closed[j] & (at.share[j] >= MIN_SHARE) & level
    ones = np.ones(int(kept.sum()), dtype=bool)
    return sparse.csr_matrix((ones, (i[kept], j[kept])), shape=near.shape)


def _one_sided(at: Moments, useful: sparse.csr_matrix) -> np.ndarray:
    """Whether macro-elements (m,) have their neighbours on one side."""
    i, j = useful.tocoo().coords
    away = at.local.along(at.local.centre[j] - at.local.centre[i], i)
    total, count = np.zeros((len(at.share), away.shape[1])), np.bincount(i, minlength=len(at.share))
    np.add.at(total, i, away / np.linalg.norm(away, axis=1)[:, None])
    return np.linalg.norm(total, axis=1) > _ONE_SIDE * count


Entries = tuple[np.ndarray, np.ndarray, np.ndarray]


def _fit(
    at: Moments, ring: sparse.csr_matrix, chosen: np.ndarray, form: Form, written: Form
) -> tuple[np.ndarray, Entries]:
    """Fits of macro-elements `chosen` (n,) to their rings (n, m): which (n,) are determined.

    With them the entries of R in the functions of the form `written`, those of them that `form`
    has: row, column and value (e,) each.
    """
    other, counts = _neighbours(ring, chosen)
    b, weight = _means(at, chosen, other, counts, form)
    system = weight[..., None] * b
    if not form.keeps_means:
        own = np.zeros((len(chosen), 1, b.shape[-1]))
        own[..., -1] = 1.0
        system = np.concatenate([system, own], axis=1)
    if form.degree == 1 and at.local.centre.shape[1] == 3:
        system = np.concatenate([system, _across(system)], axis=1)
    scale = _scale(system, at.local.axes.shape[1], form)
    system = system @ scale
    squares, vectors = np.linalg.eigh(system.swapaxes(1, 2) @ system)
    solved = squares[:, 0] > _RANK**2 * squares[:, -1]
    v, scaled = vectors[solved], system[solved, : other.shape[1]]
    inverse = scale[solved] @ (v / squares[solved][:, None]) @ v.swapaxes(1, 2)
    by_neighbour = inverse @ scaled.swapaxes(1, 2) * weight[solved][:, None]
    values = np.concatenate([by_neighbour, -by_neighbour.sum(axis=2, keepdims=True)], axis=2)
    columns = np.concatenate([other[solved], chosen[solved][:, None]], axis=1)
    shape, k = np.arange(b.shape[-1]), written.count(at.local.centre.shape[1])
    if not form.keeps_means:
        shape[-1] = k - 1
    rows = chosen[solved][:, None] * k + shape[shape < k]
    row, column, value = np.broadcast_arrays(
        rows[:, :, None], columns[:, None], values[:, shape < k]
    )
    return solved, (row.ravel(), column.ravel(), value.ravel())


def _scale(system: np.ndarray, d: int, form: Form) -> np.ndarray:
    """The functions (n, k, k), as sums of those of systems (n, w, k), that fits are judged in.

    In d coordinates in which neighbours lie alike in all directions; all squares have one scale.
    Whether a fit is determined then depends on no direction of the axes.
    """
    squares, vectors = np.linalg.eigh(system[..., :d].swapaxes(1, 2) @ system[..., :d])
    some = squares > _NOTHING * squares.max(axis=1, keepdims=True)
    root = np.where(some, 1 / np.sqrt(np.where(some, squares, 1.0)), 0.0)
    turn = (vectors * root[:, None]) @ vectors.swapaxes(1, 2)
    found = np.tile(np.eye(system.shape[2]), (len(system), 1, 1))
    found[:, :d, :d] = turn
    pairs = list(combinations_with_replacement(range(d), 2)) if form.degree == 2 else []
    for i, (a, b) in enumerate(pairs, start=d):
        for j, (c, e) in enumerate(pairs, start=d):
            both = turn[:, a, c] * turn[:, b, e] + (a != b) * turn[:, b, c] * turn[:, a, e]
            found[:, i, j] = both if c == e else np.sqrt(2) * both
    for part in (slice(d, d + len(pairs)), slice(d + len(pairs), None)):
        size = np.linalg.norm(system @ found[..., part], axis=(1, 2))
        found[..., part] /= np.where(size > 0, size, 1.0)[:, None, None]
    return found


def _across(system: np.ndarray) -> np.ndarray:
    """Rows (n, 1, k) by which a linear fit does not vary across neighbours that lie in a line."""
    slopes = system[..., :2]
    squares, vectors = np.linalg.eigh(slopes.swapaxes(1, 2) @ slopes)
    in_line = (squares[:, 0] < _NOTHING * squares[:, 1]) & (squares[:, 1] > 0)
    rows = np.zeros((len(system), 1, system.shape[2]))
    rows[:, 0, :2] = np.where(in_line[:, None], np.sqrt(squares[:, 1:]) * vectors[:, :, 0], 0.0)
    return rows


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
    known = np.where(distance > 0, distance, 1.0)
    farthest = form.reach * np.where(counts > 0, known, 0.1).max(axis=1, keepdims=True)
    weight = counts * (1 / known if form.keeps_means else np.exp(-((known / farthest) ** 2)))
    return _powers(y, y[..., :, None] * y[..., None, :] + spread, form), weight
