"""Intersections of convex polygons, many at once, and quadrature on them.

Polygons are padded arrays (n, v, 2) with vertex counts (n,), counter-clockwise. Nothing is dropped
for being small: a lost sliver would be a lost piece of force.

Quadrature is on triangles, or on plane regions bounded by parabolic arcs, and on their images under
smooth maps.
"""

from collections.abc import Callable

import numpy as np

from .cells.shape import gauss_rule, simplex_rule
from .regions import Regions


def clip(
    subject: np.ndarray, count: np.ndarray, window: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Intersect subject polygons (n, v, 2), of `count` (n,) vertices, with windows (n, w, 2).

    Windows are convex with all w vertices in use. Source: Sutherland, Hodgman, Reentrant polygon
    clipping, CACM 17 (1974) 32–42.

    >>> square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    >>> part, count = clip(square + 0.5, np.array([4]), square)
    >>> part[0, : count[0]].tolist()
    [[0.5, 0.5], [1.0, 0.5], [1.0, 1.0], [0.5, 1.0]]
    """
    for k in range(window.shape[1]):
        start, end = window[:, k], window[:, (k + 1) % window.shape[1]]
        subject, count = _clip_by_line(subject, count, start, end - start)
    return subject, count


def _clip_by_line(
    polygon: np.ndarray, count: np.ndarray, origin: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Keep what lies to the left of the line through `origin` along `direction` (n, 2)."""
    n, v, _ = polygon.shape
    offset = polygon - origin[:, None]
    side = direction[:, None, 0] * offset[..., 1] - direction[:, None, 1] * offset[..., 0]
    used = np.arange(v) < count[:, None]
    following = np.where(np.arange(1, v + 1) < count[:, None], np.arange(1, v + 1), 0)
    row = np.arange(n)[:, None]
    next_side = side[row, following]
    keep = used & (side >= 0)
    cross = used & ((side > 0) & (next_side < 0) | (side < 0) & (next_side > 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(cross, side / (side - next_side), 0.0)
    crossing = polygon + share[..., None] * (polygon[row, following] - polygon)
    # Each vertex gives itself, where kept, and then the crossing on the edge that it begins.
    emitted = np.stack([keep, cross], axis=2).reshape(n, 2 * v)
    points = np.stack([polygon, crossing], axis=2).reshape(n, 2 * v, 2)
    new_count = emitted.sum(axis=1)
    clipped = np.zeros((n, max(int(new_count.max(initial=0)), 1), 2))
    place = np.cumsum(emitted, axis=1) - 1
    which, where = np.nonzero(emitted)
    clipped[which, place[which, where]] = points[which, where]
    return clipped, new_count


def triangles(polygon: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fans of triangles: polygon number (t,), corners (t, 3, 2), signed areas (t,).

    Signs are kept: the fan of a polygon that is not convex then still sums to the polygon.

    >>> square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    >>> which, corner, area = triangles(square, np.array([4]))
    >>> which.tolist(), area.tolist()
    ([0, 0], [0.5, 0.5])
    """
    v = polygon.shape[1]
    fan = np.arange(1, max(v - 1, 1))
    which, first = np.nonzero((fan[None, :] + 1) < count[:, None])
    second = fan[first]
    corner = np.stack(
        [polygon[which, 0], polygon[which, second], polygon[which, (second + 1) % v]], axis=1
    )
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    real = area != 0
    return which[real], corner[real], area[real]


def overlap(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Common part (n, 2) of intervals (n, 2) with ascending ends, and its length (n,).

    >>> ends, length = overlap(np.array([[0.0, 2.0]]), np.array([[1.5, 3.0]]))
    >>> ends.tolist(), length.tolist()
    ([[1.5, 2.0]], [0.5])
    """
    low = np.maximum(first[:, 0], second[:, 0])
    high = np.minimum(first[:, 1], second[:, 1])
    return np.stack([low, high], axis=1), high - low


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
