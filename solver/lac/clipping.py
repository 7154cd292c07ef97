"""Intersections of convex polygons, many at once, and their triangles.

Polygons are padded arrays (n, v, 2) with vertex counts (n,), counter-clockwise. Nothing is dropped
for being small: a lost sliver would be a lost piece of force.
"""

import numpy as np


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
