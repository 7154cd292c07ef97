"""Where contact ends: the edges of closed regions, in 2D to better than one macro-element.

The pressure of smooth bodies ends like p = C √(a − x), Hertz's among them. With P₁ the resultant
on a macro-element of length g, and P₂ that of all beyond it, a length s up to the edge,

    P₂ = ⅔ C s^{3/2},    P₁ + P₂ = ⅔ C (s + g)^{3/2},    so that s = g / ((1 + P₁/P₂)^{2/3} − 1).

The means of the last closed macro-element and of the one before are off: the pressure of an open
one is missing, a partly open one bears the wrong share. Their sum is right, by equilibrium. P₂ is
therefore the resultant of the last two, and P₁ that of the third; the edge found may be in the last
closed macro-element or in the open one. Measured on Hertz's cylinder wherever the edge is in its
macro-element: within 0.06 of a macro-element on quadratic cells, 0.25 on linear ones.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ...lac.cells.faces import circumference

# Up to round-off a macro-element is covered as a whole.
_WHOLE = 1 - 1e-6
# How far from the edge found the true one is, in lengths of the last closed macro-element.
_WITHIN = 0.25


@dataclass(frozen=True, kw_only=True)
class Edges:
    """The e edges of contact along lines of macro-elements in 2D.

    `position` (e, 2): where contact ends; `lower`, `upper` (e, 2): places on its inner and outer
    side that it is between; `macro` (e,): the last closed macro-element; `better` (e,): whether the
    form of the pressure finds the position. Elsewhere that is the end of the last closed
    macro-element. `lengths` (e, 3): contact beyond that end, up to the three places, of
    axisymmetric bodies as areas.
    """

    position: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    macro: np.ndarray
    better: np.ndarray
    lengths: np.ndarray


def end_of_pressure(before: np.ndarray, last: np.ndarray, length: np.ndarray) -> np.ndarray:
    """How far (e,) a pressure C √(s − x) reaches, given its resultants (e,).

    `before`: that on the `length` (e,) before x = 0; `last`: that from there on. NaN where a
    resultant is not positive.

    √(1/2 − x): its resultants are ⅔ (1.5^{3/2} − 0.5^{3/2}) on [−1, 0] and ⅔ 0.5^{3/2} beyond.

    >>> end_of_pressure(np.array([1.5**1.5 - 0.5**1.5]), np.array([0.5**1.5]), np.ones(1)).round(12)
    array([0.5])
    """
    falls = (before > 0) & (last > 0)
    ratio = np.divide(before, last, out=np.full(len(last), np.nan), where=falls)
    return length / np.expm1(2 / 3 * np.log1p(ratio))


def contact_edges(
    points: np.ndarray,
    ends: np.ndarray,
    length: np.ndarray,
    coverage: np.ndarray,
    mean: np.ndarray,
    closed: np.ndarray,
    axisymmetric: bool = False,
) -> Edges:
    """The edges between closed and open ones of m macro-elements in 2D.

    `points` (n, 2); `ends` (m, 2): the points that macro-elements lie between; `length`,
    `coverage` (intersected over whole), `mean` pressure and `closed`, all (m,).

    Four intervals of length 1, the last one open, and means of √(2.5 − x) on the others:

    >>> x = np.stack([np.arange(5.0), np.zeros(5)], axis=1)
    >>> means = -2 / 3 * np.diff([2.5**1.5, 1.5**1.5, 0.5**1.5, 0.0, 0.0])
    >>> chain = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    >>> found = contact_edges(x, chain, np.ones(4), np.ones(4), means, means > 0)
    >>> found.position.round(12), found.better
    (array([[2.5, 0. ]]), array([ True]))
    """
    m = len(ends)
    if closed.all() or not closed.any():
        nowhere = np.empty((0, 2))
        return Edges(
            position=nowhere,
            lower=nowhere,
            upper=nowhere,
            macro=np.empty(0, dtype=int),
            better=np.empty(0, dtype=bool),
            lengths=np.empty((0, 3)),
        )
    around = (np.ones(2 * m), (np.repeat(np.arange(m), 2), ends.ravel()))
    touch = sparse.csr_matrix(around, shape=(m, len(points)))
    pairs = (touch @ touch.T).tocoo()
    here = closed[pairs.row] & ~closed[pairs.col]
    last, opened = pairs.row[here], pairs.col[here]
    shared = (ends[last][:, :, None] == ends[opened][:, None]).any(axis=2)
    outer = np.where(shared[:, 0], ends[last, 0], ends[last, 1])
    inner, far = ends[last].sum(axis=1) - outer, ends[opened].sum(axis=1) - outer
    whole = closed & (coverage > _WHOLE)
    second, middle = _next(ends, whole, last, inner)
    third, _ = _next(ends, whole, second, middle)
    known = whole[last] & (third >= 0) & (coverage[opened] > 0)
    force = length * mean
    beyond = end_of_pressure(force[third], force[last] + force[second], length[third])
    beyond -= length[second] + length[last]
    better = known & (beyond > -length[last]) & (beyond < length[opened])
    at = np.where(better, beyond, 0.0)
    free = np.where(coverage[opened] > 0, length[opened], 0.0)
    off = np.where(better, _WITHIN, 1.0) * length[last]
    low, high = np.maximum(at - off, -length[last]), np.where(better, at + off, free)
    lengths = np.stack([at, low, np.minimum(high, free)], axis=1)
    backwards = (points[outer] - points[inner]) / length[last][:, None]
    forwards = (points[far] - points[outer]) / length[opened][:, None]
    along = np.where(lengths[..., None] < 0, backwards[:, None], forwards[:, None])
    places = points[outer][:, None] + lengths[..., None] * along
    if axisymmetric:
        lengths = lengths * circumference((points[outer][:, None] + places) / 2)
    position, lower, upper = places.swapaxes(0, 1)
    return Edges(
        position=position, lower=lower, upper=upper, macro=last, better=better, lengths=lengths
    )


def _next(
    ends: np.ndarray, whole: np.ndarray, macro: np.ndarray, end: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The other whole macro-element (e,) at an end (e,) of each, and its other end; −1: none."""
    number, n = np.flatnonzero(whole), int(ends.max(initial=0)) + 1
    around = ends[number].ravel()
    count = np.bincount(around, minlength=n)[end]
    both = np.bincount(around, np.repeat(number, 2), minlength=n)[end].astype(int)
    found = np.where((macro >= 0) & (end >= 0) & (count == 2), both - macro, -1)
    return found, np.where(found >= 0, ends[found].sum(axis=1) - end, -1)
