"""Quadrature on plane regions bounded by parabolic arcs, and on their images under smooth maps."""

from collections.abc import Callable

import numpy as np

from .cells.quadrature import gauss_rule, simplex_rule
from .clipping import triangles
from .regions import Regions

# Numbers (s,), places (s, q, 2) and weights (s, q).
Pieces = tuple[np.ndarray, np.ndarray, np.ndarray]
# Of numbers (a,), places (a, q, 2) and slopes (a, q, 2) of curves through them: both in the image.
Image = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

# Additional points along arcs whose images are not polynomials.
_MORE = 2
# Images of arcs that are off their chord by less than this are straight.
_STRAIGHT = 1e-12


def quadrature(regions: Regions, degree: int, image: Image | None = None) -> list[Pieces]:
    """Points on fans of triangles that make up the regions, for polynomials of a degree.

    Region numbers (s,), points (s, q, 2) and weights (s, q); of triangles, where the rule is exact,
    and of those with a bent side, where it is exact for degree 2 and has no fewer points.
    The region under the parabola 4 t (1 − t) has the area 2/3:

    >>> cap = Regions(start=np.array([[[1.0, 0.0], [0.0, 0.0]]]), count=np.array([2]),
    ...               bulge=np.array([[[0.0, 1.0], [0.0, 0.0]]]))
    >>> round(sum(float(weight.sum()) for _, _, weight in quadrature(cap, 1)), 15)
    0.666666666666667

    With an `image`, a smooth map of the plane, they are in the images of the regions. Arcs follow
    the map at each point, so that the sum does not depend on where curves are cut:

    >>> image = lambda _, place, slope: (place * [2.0, 3.0], slope * [2.0, 3.0])
    >>> round(sum(float(weight.sum()) for _, _, weight in quadrature(cap, 1, image)), 14)
    4.0
    """
    if image is not None:
        return _fans(regions, degree, image)
    bent = (regions.bulge.any(axis=2) & regions.used).any(axis=1)
    which = np.flatnonzero(~bent)
    polygon, corner, area = triangles(regions.start[which], regions.count[which])
    reference, weights = simplex_rule(2, degree)
    barycentric = np.column_stack([1 - reference.sum(axis=1), reference])
    points = np.einsum("qk,skt->sqt", barycentric, corner)
    pieces = [(which[polygon], points, 2 * area[:, None] * weights)]
    which = np.flatnonzero(bent)
    if len(which):
        fans = _fans(regions.of(which), degree, None)
        pieces += [(which[arc], points, weights) for arc, points, weights in fans]
    return pieces


def _fans(regions: Regions, degree: int, image: Image | None) -> list[Pieces]:
    """The same of regions with bent arcs, around a corner, between straight arcs if there is one.

    Signs are kept: the fans of regions that are not convex then still sum to them.
    """
    which, arc = np.nonzero(regions.used)
    if not len(which):
        return []
    n = degree // 2 + 2
    radius, outward = gauss_rule("SEG2", n)
    t, along = gauss_rule("SEG2", n if image is None else n + _MORE)
    rim, slope = _rims(regions, np.append(t, 0.0))
    if image is not None:
        rim, slope = image(which, rim, slope)
    first, rim, slope = rim[:, -1], rim[:, :-1], slope[:, :-1]
    begin = np.cumsum(regions.count) - regions.count
    following = np.where(arc + 1 < regions.count[which], np.arange(1, len(arc) + 1), begin[which])
    last = first[following]
    if image is None:
        bent = np.asarray(regions.bulge[which, arc].any(axis=1))
    else:
        chord = last - first
        sideways = np.abs(_cross(chord[:, None], rim - first[:, None])).max(axis=1)
        bent = sideways > _STRAIGHT * np.linalg.norm(chord, axis=1)
    # The straight arcs beside a corner span no triangle with it.
    neighbours = np.full(regions.used.shape, 3)
    neighbours[which[following], arc[following]] = bent.astype(int) + bent[following]
    middle = first[(begin + neighbours.argmin(axis=1))[which]]
    first, last, rim = first - middle, last - middle, rim - middle[:, None]
    straight = ~bent & (_cross(first, last) != 0)
    reference, weights = simplex_rule(2, degree)
    corner = np.stack([first[straight], last[straight]], axis=1)
    points = middle[straight, None] + np.einsum("qk,skd->sqd", reference, corner)
    pieces = [(which[straight], points, _cross(first, last)[straight, None] * weights)]
    if bent.any():
        points = middle[bent, None, None] + radius * rim[bent, :, None]
        measure = (_cross(rim, slope)[bent] * along)[..., None] * (radius[:, 0] * outward)
        count = len(points)
        pieces.append((which[bent], points.reshape(count, -1, 2), measure.reshape(count, -1)))
    return pieces


def _rims(regions: Regions, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and slopes (a, q, 2) of the arcs in use at t (q,)."""
    arcs = [a[regions.used] for a in (regions.start, regions.end, regions.bulge)]
    shapes = np.stack([1 - t, t, 4 * t * (1 - t)])
    slopes = np.stack([-np.ones_like(t), np.ones_like(t), 4 - 8 * t])
    nodes = np.stack(arcs, axis=1)
    return np.einsum("kq,akd->aqd", shapes, nodes), np.einsum("kq,akd->aqd", slopes, nodes)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
