"""Plane regions bounded by parabolic arcs, clipped by lines and parabolas, many at once.

The edges of quadratic faces are parabolas p(t) = (1 − t) a + t b + 4 t (1 − t) h, and so are their
images under a parallel projection. A region is a closed chain of such arcs, counter-clockwise. One
line or parabola at a time clips it (Sutherland, Hodgman, CACM 17 (1974) 32–42), and arcs are cut
exactly where they cross; nothing is dropped for being small.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb
from typing import Self

import numpy as np

from .cells.faces import FLAT

# Halvings after which an interval within [0, 1] is as short as rounding allows.
_HALVINGS = 54


@dataclass(frozen=True, kw_only=True)
class Regions:
    """n regions: arc k runs from `start` k (n, v, 2) to start k + 1, of `count` (n,) arcs in use.

    `bulge` (n, v, 2): the offset h of its middle from the middle of its chord.
    """

    start: np.ndarray
    bulge: np.ndarray
    count: np.ndarray

    def of(self, chosen: np.ndarray) -> Self:
        """Some of the regions."""
        return type(self)(
            start=self.start[chosen], bulge=self.bulge[chosen], count=self.count[chosen]
        )

    @property
    def used(self) -> np.ndarray:
        """Which arcs (n, v) are in use."""
        return np.arange(self.start.shape[1]) < self.count[:, None]

    @property
    def end(self) -> np.ndarray:
        """Where the arcs (n, v, 2) end."""
        following = np.arange(1, self.start.shape[1] + 1)
        following = np.where(following < self.count[:, None], following, 0)
        return np.take_along_axis(self.start, following[..., None], axis=1)


@dataclass(frozen=True, kw_only=True)
class Curves:
    """One curve for each of n regions, and the side of it to keep.

    A line through `origin` along `along` (n, 2), whose inside is its left; with a `bulge` (n, 2),
    the parabola through origin and origin + along, whose inside is the convex one. `inside`:
    whether that side is kept. Where `idle` (n,), nothing is clipped.
    """

    origin: np.ndarray
    along: np.ndarray
    idle: np.ndarray
    bulge: np.ndarray | None = None
    inside: bool = True

    def side(self, arcs: np.ndarray) -> np.ndarray:
        """How far inside arcs (n, v, 3, 2) are: polynomials (n, v, degree + 1) along them."""
        arcs = arcs.copy()
        arcs[:, :, 0] -= self.origin[:, None]
        if self.bulge is None:
            return _cross(self.along[:, None, None], arcs)
        place, height = self._frame(arcs)
        side = np.zeros((*place.shape[:2], 5))
        side[..., :3] = 4 * place - height
        for k in range(3):
            side[..., k : k + 3] -= 4 * place[..., k : k + 1] * place
        return side

    def joint(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """The bulge (m, 2) of the part of the curve between points (m, 2) on it."""
        if self.bulge is None:
            return np.zeros_like(start)
        places = np.stack([start, end], axis=1) - self.origin[:, None]
        place = self._frame(places)[0]
        return self.bulge * np.diff(place, axis=1) ** 2

    def _frame(self, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates t, w of offsets t · along + w · bulge from the origin."""
        assert self.bulge is not None
        shape = (-1, *[1] * (offset.ndim - 2), 2)
        along, bulge = self.along.reshape(shape), self.bulge.reshape(shape)
        area = _cross(along, bulge)
        return _cross(offset, bulge) / area, _cross(along, offset) / area

    def of(self, chosen: np.ndarray) -> Self:
        """The curves of some of the regions."""
        values = {k: v[chosen] if isinstance(v, np.ndarray) else v for k, v in vars(self).items()}
        return type(self)(**values)

    def reversed(self) -> Self:
        """The same curves, with the other sides kept."""
        return replace(self, inside=not self.inside)


def clip_by(regions: Regions, curves: Curves) -> Regions:
    """The parts of the regions on one side of their curves.

    The unit square is bisected by the diagonal from (0, 0) to (1, 1); what is left of it stays:

    >>> square = Regions(start=np.array([[[0, 0], [1, 0], [1, 1], [0, 1]]]) * 1.0,
    ...                  bulge=np.zeros((1, 4, 2)), count=np.array([4]))
    >>> diagonal = Curves(origin=np.zeros((1, 2)), along=np.ones((1, 2)),
    ...                   idle=np.array([False]))
    >>> (_, _, weights), = quadrature(clip_by(square, diagonal), 1)
    >>> round(float(weights.sum()), 15)
    0.5
    """
    first, last = regions.start, regions.end
    arcs = np.stack([first, last - first + 4 * regions.bulge, -4 * regions.bulge], axis=2)
    side = curves.side(arcs)
    side[~regions.used] = 0.0
    # Cut the arcs where they cross the curve.
    n, v, _ = first.shape
    cuts = np.concatenate([np.zeros((n, v, 1)), _crossings(side), np.ones((n, v, 1))], axis=2)
    low, high = cuts[..., :-1], cuts[..., 1:]
    inside = _horner(side[:, :, None], (low + high) / 2) >= 0
    keep = (inside == curves.inside) | curves.idle[:, None, None]
    real = (high > low) & regions.used[..., None]
    start = _horner_at(arcs, low, first, last)
    stop = _horner_at(arcs, high, first, last)
    bulge = regions.bulge[:, :, None] * ((high - low) ** 2)[..., None]
    (start, stop, bulge, keep), count = _packed(real, start, stop, bulge, keep)
    # Join the end of each arc that is kept to the start of the next one, along the curve.
    width = keep.shape[1]
    following = np.where(np.arange(1, width + 1) < count[:, None], np.arange(1, width + 1), 0)
    keep = keep.astype(bool) & (np.arange(width) < count[:, None])
    leaves = keep & ~np.take_along_axis(keep, following, axis=1)
    emitted = np.stack([keep, leaves], axis=2)
    points = np.stack([start, stop], axis=2)
    bulges = np.stack([bulge, np.zeros_like(bulge)], axis=2)
    joints = np.stack([np.zeros_like(leaves), leaves], axis=2)
    (start, bulge, joints), count = _packed(emitted, points, bulges, joints)
    clipped = Regions(start=start, bulge=bulge, count=count)
    row, where = np.nonzero(joints)
    if len(row) and curves.bulge is not None:
        ends = clipped.end[row, where]
        clipped.bulge[row, where] = curves.of(row).joint(start[row, where], ends)
    return clipped


Parts = list[tuple[np.ndarray, Regions]]


def clip_to_face(regions: Regions, corner: np.ndarray, bulge: np.ndarray) -> Parts:
    """What of n regions lies within faces with `corner` and edges of `bulge` (n, v, 2).

    Returns parts without common area: which regions (m,) they are of, and themselves. The corners
    of a face must form a convex polygon, counter-clockwise.

    >>> low = Regions(start=np.array([[[0, 0], [1, 0], [1, 0.5], [0, 0.5]]]),
    ...               bulge=np.zeros((1, 4, 2)), count=np.array([4]))
    >>> left = np.array([[[0, 0], [0.5, 0], [0.5, 1], [0, 1]]])
    >>> (which, part), = clip_to_face(low, left, np.zeros((1, 4, 2)))
    >>> [round(float(weight.sum()), 15) for _, _, weight in quadrature(part, 1)]
    [0.25]
    """
    inner, caps = _boundary(corner, bulge)
    which, part = _filled(np.arange(len(regions.count)), regions)
    parts = []
    for rows, cap in [(which, inner), *caps]:
        mine, inside = rows, part.of(rows)
        for curve in cap:
            mine, inside = _filled(mine, clip_by(inside, curve.of(mine)))
        parts.append((mine, inside))
    return parts


def without_face(regions: Regions, corner: np.ndarray, bulge: np.ndarray) -> Parts:
    """What of n regions lies outside faces, as `clip_to_face` has them.

    >>> low = Regions(start=np.array([[[0, 0], [1, 0], [1, 0.5], [0, 0.5]]]),
    ...               bulge=np.zeros((1, 4, 2)), count=np.array([4]))
    >>> left = np.array([[[0, 0], [0.4, 0], [0.4, 1], [0, 1]]])
    >>> parts = [part for _, part in without_face(low, left, np.zeros((1, 4, 2)))]
    >>> round(sum(float(w.sum()) for part in parts for _, _, w in quadrature(part, 1)), 15)
    0.3
    """
    inner, caps = _boundary(corner, bulge)
    parts = _outside(np.arange(len(regions.count)), regions, inner)
    for rows, cap in caps:
        capped = np.isin(np.arange(len(regions.count)), rows)
        cut: Parts = []
        for which, part in parts:
            has = capped[which]
            cut.append((which[~has], part.of(~has)))
            cut += _outside(which[has], part.of(has), cap)
        parts = cut
    return parts


def _outside(which: np.ndarray, regions: Regions, curves: Sequence[Curves]) -> Parts:
    """The parts of regions outside what all of the curves keep, without common area."""
    parts = []
    for curve in curves:
        mine = curve.of(which)
        cuts = ~mine.idle
        parts.append(_filled(which[cuts], clip_by(regions.of(cuts), mine.of(cuts).reversed())))
        which, regions = _filled(which, clip_by(regions, mine))
    return parts


def _filled(which: np.ndarray, regions: Regions) -> tuple[np.ndarray, Regions]:
    some = regions.count > 0
    return which[some], regions.of(some)


def edge_bends(corner: np.ndarray, bulge: np.ndarray) -> np.ndarray:
    """Which edges (n, v) of faces are bent: 1 inward, −1 outward, 0 straight (see `FLAT`).

    >>> square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    >>> edge_bends(square, np.array([[[0.0, 0.1], [0.1, 0.0], [0.1, 0.0], [0.0, 0.0]]])).tolist()
    [[1.0, -1.0, 0.0, 0.0]]
    """
    chord = np.roll(corner, -1, axis=1) - corner
    sideways = _cross(chord, bulge)
    return np.where(np.abs(sideways) > FLAT * (chord**2).sum(axis=2), np.sign(sideways), 0.0)


def _boundary(
    corner: np.ndarray, bulge: np.ndarray
) -> tuple[list[Curves], list[tuple[np.ndarray, list[Curves]]]]:
    """Curves that bound faces (n, v, 2): of the polygon of corners less its dents, and of caps.

    A cap lies between an edge bent outward and its chord; which faces (m,) have it comes with it.
    """
    chord, bends = np.roll(corner, -1, axis=1) - corner, edge_bends(corner, bulge)
    bent = bends != 0
    lines, dents, caps = [], [], []
    for k in range(corner.shape[1]):
        line = Curves(origin=corner[:, k], along=chord[:, k], idle=~chord[:, k].any(axis=1))
        # Where nothing is bent any bulge serves, since the parabola is idle.
        across = np.stack([-chord[:, k, 1], chord[:, k, 0]], axis=1)
        across[line.idle] = [0.0, 1.0]
        parabola = Curves(
            origin=corner[:, k],
            along=np.where(line.idle[:, None], [1.0, 0.0], chord[:, k]),
            bulge=np.where(bent[:, k, None], bulge[:, k], across),
            idle=~bent[:, k],
        )
        lines.append(line)
        inward = bends[:, k] > 0
        if inward.any():
            dents.append(replace(parabola, inside=False, idle=~inward))
        rows = np.flatnonzero(bent[:, k] & ~inward)
        if len(rows):
            caps.append((rows, [line.reversed(), parabola]))
    return [*lines, *dents], caps


def joined(parts: Sequence[Regions]) -> Regions:
    """All regions in one batch.

    >>> one = Regions(start=np.zeros((1, 3, 2)), bulge=np.zeros((1, 3, 2)), count=np.array([3]))
    >>> two = Regions(start=np.zeros((2, 4, 2)), bulge=np.zeros((2, 4, 2)), count=np.array([4, 4]))
    >>> joined([one, two]).count.tolist()
    [3, 4, 4]
    """
    width = max(part.start.shape[1] for part in parts)
    start, bulge = (
        np.concatenate([np.pad(a, ((0, 0), (0, width - a.shape[1]), (0, 0))) for a in arrays])
        for arrays in ([p.start for p in parts], [p.bulge for p in parts])
    )
    return Regions(start=start, bulge=bulge, count=np.concatenate([p.count for p in parts]))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _horner(coefficients: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Polynomials with coefficients (..., degree + 1), ascending, at t (...)."""
    value = np.zeros_like(t)
    for k in range(coefficients.shape[-1] - 1, -1, -1):
        value = value * t + coefficients[..., k]
    return value


def _horner_at(arcs: np.ndarray, t: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Points (n, v, k, 2) of arcs at t (n, v, k), the ends to the bit."""
    point = _horner(np.moveaxis(arcs, 2, -1)[:, :, None], t[..., None] + np.zeros(2))
    point = np.where((t == 0)[..., None], first[:, :, None], point)
    return np.where((t == 1)[..., None], last[:, :, None], point)


def _crossings(polynomial: np.ndarray) -> np.ndarray:
    """Where polynomials (..., degree + 1) change sign in (0, 1): (..., degree), filled up with 1.

    Between the extremes of a polynomial, found in the same way, there is one root at most.
    """
    degree = polynomial.shape[-1] - 1
    found = np.ones((*polynomial.shape[:-1], degree))
    bernstein = np.zeros_like(polynomial)
    for i in range(degree + 1):
        for k in range(i + 1):
            bernstein[..., i] += comb(i, k) / comb(degree, k) * polynomial[..., k]
    some = np.nonzero((bernstein.min(axis=-1) < 0) & (bernstein.max(axis=-1) > 0))
    p = polynomial[some]
    if not len(p):
        return found
    ends = np.zeros((len(p), 1))
    if degree > 1:
        ends = np.hstack([ends, _crossings(p[:, 1:] * np.arange(1, degree + 1))])
    ends = np.hstack([ends, np.ones((len(p), 1))])
    value = _horner(p[:, None], ends)
    row, part = np.nonzero(value[:, :-1] * value[:, 1:] < 0)
    low, high, p = ends[row, part], ends[row, part + 1], p[row]
    rising = value[row, part] < 0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        below = (_horner(p, middle) < 0) == rising
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    roots = np.ones((len(ends), degree))
    roots[row, part] = (low + high) / 2
    found[some] = np.sort(roots, axis=1)
    return found


def _packed(wanted: np.ndarray, *arrays: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """The wanted entries (n, …) of arrays (n, …, 2) or (n, …) moved to the front, and counts."""
    n, entries, axes = len(wanted), int(np.prod(wanted.shape[1:])), wanted.ndim
    wanted = wanted.reshape(n, entries)
    count = wanted.sum(axis=1)
    row, where = np.nonzero(wanted)
    place = (np.cumsum(wanted, axis=1) - 1)[row, where]
    packed = []
    for array in arrays:
        flat = array.reshape(n, entries, *array.shape[axes:])
        out = np.zeros((n, max(int(count.max(initial=0)), 1), *flat.shape[2:]), dtype=flat.dtype)
        out[row, place] = flat[row, where]
        packed.append(out)
    return packed, count
