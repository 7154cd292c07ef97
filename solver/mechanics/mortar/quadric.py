"""Rigid surfaces without a mesh: planes, spheres, cylinders and parabolas as masters.

All of them are quadrics F(x) = level + slope·d + ½ d·curvature·d with d = x − point. The body is
where F < 0, and ∇F points out of it. The gap is the distance along the slave's normal, a root of a
quadratic equation, so that neither pairs nor segments are needed.
"""

from dataclasses import dataclass

import numpy as np

from ...lac.cells.catalogue import BY_NAME
from ...lac.facets import Facets
from ...lac.partners import Samples
from ...lac.segments import Segments, Side


@dataclass(frozen=True, kw_only=True)
class Quadric:
    """A surface F = 0: `point` (dim,), `level` a length, `slope` (dim,), `curvature` (dim, dim)."""

    point: np.ndarray
    level: float
    slope: np.ndarray
    curvature: np.ndarray

    def gradient(self, places: np.ndarray) -> np.ndarray:
        """∇F (…, dim) at places (…, dim).

        >>> ball(np.zeros(2), 2.0).gradient(np.array([0.0, -3.0])).tolist()
        [0.0, -1.5]
        """
        return self.slope + (places - self.point) @ self.curvature

    def moved(self, turn: np.ndarray, shift: np.ndarray) -> "Quadric":
        """The surface after a rotation `turn` (dim, dim) about the origin, then a `shift` (dim,).

        A plane with the normal x, turned by a quarter:

        >>> quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
        >>> plane(np.zeros(2), np.array([1.0, 0.0])).moved(quarter, np.ones(2)).slope.tolist()
        [0.0, 1.0]
        """
        return Quadric(
            point=turn @ self.point + shift,
            level=self.level,
            slope=turn @ self.slope,
            curvature=turn @ self.curvature @ turn.T,
        )

    def distance(self, places: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance (…,) from places (…, dim) along unit normals to the surface, and where it is.

        There is one where the normal meets the body from outside; negative within the body, where
        the way out is back along the normal. Zero elsewhere.

        Up to a circle of radius 2 about the origin; the line up from (2.5, −3) misses it:

        >>> up = np.array([0.0, 1.0])
        >>> gap, there = ball(np.zeros(2), 2.0).distance(np.array([[0.0, -3.0], [2.5, -3.0]]), up)
        >>> gap.tolist(), there.tolist()
        ([1.0, 0.0], [True, False])
        """
        d = places - self.point
        bent = d @ self.curvature
        value = self.level + d @ self.slope + np.einsum("...d,...d->...", bent, d) / 2
        fall = np.einsum("...d,...d->...", self.slope + bent, normal)
        turn = np.einsum("...d,...d->...", normal @ self.curvature, normal)
        square = fall**2 - 2 * turn * value
        steep = np.sqrt(np.maximum(square, 0.0)) - fall
        there = (square >= 0) & (steep > 0) & ((fall < 0) | (value >= 0))
        return np.where(there, 2 * value / np.where(there, steep, 1.0), 0.0), there


def plane(point: np.ndarray, normal: np.ndarray) -> Quadric:
    """The plane, or line, through a point, with its `normal` (dim,) out of the body.

    >>> plane(np.zeros(2), np.array([0.0, 2.0])).slope.tolist()
    [0.0, 1.0]
    """
    dim = len(point)
    return Quadric(point=point, level=0.0, slope=_unit(normal), curvature=np.zeros((dim, dim)))


def ball(centre: np.ndarray, radius: float, hollow: bool = False) -> Quadric:
    """The sphere, or circle; the body is in it, or around it if `hollow`.

    >>> ball(np.zeros(2), 2.0, hollow=True).gradient(np.array([0.0, -2.0])).tolist()
    [0.0, 1.0]
    """
    return _round(centre, np.eye(len(centre)), radius, hollow)


def cylinder(point: np.ndarray, axis: np.ndarray, radius: float, hollow: bool = False) -> Quadric:
    """The cylinder about an axis (3,) through a point; the body is in it, or around it.

    >>> x = np.array([1.0, 0.0, 0.0])
    >>> cylinder(np.zeros(3), x, 2.0).gradient(np.array([5.0, 0.0, 2.0])).tolist()
    [0.0, 0.0, 1.0]
    """
    return _round(point, _across(_unit(axis)), radius, hollow)


def parabola(apex: np.ndarray, normal: np.ndarray, radius: float, hollow: bool = False) -> Quadric:
    """The parabola, or paraboloid of revolution, with a radius of curvature at its apex.

    `normal` (dim,) is out of the body at the apex. Height s²/2R:

    >>> down = np.array([0.0, -1.0])
    >>> parabola(np.zeros(2), down, 2.0).distance(np.array([1.0, -1.0]), -down)[0].tolist()
    1.25
    """
    out = _unit(normal)
    bend = _across(out) / (-radius if hollow else radius)
    return Quadric(point=apex, level=0.0, slope=out, curvature=bend)


def _round(point: np.ndarray, across: np.ndarray, radius: float, hollow: bool) -> Quadric:
    sign = -1.0 if hollow else 1.0
    return Quadric(
        point=point,
        level=-sign * radius / 2,
        slope=np.zeros(len(point)),
        curvature=sign / radius * across,
    )


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _across(unit: np.ndarray) -> np.ndarray:
    """The projection (dim, dim) to what is across a unit vector."""
    return np.eye(len(unit)) - np.outer(unit, unit)


def frame(points: np.ndarray, nodes: np.ndarray) -> Facets:
    """The simplex of `nodes` (dim + 1,) that a rigid surface moves with, as a master without end.

    A rigid motion is linear: its value at any place follows from those at the nodes.

    >>> corners = np.array([[0.0, 1.0], [1.0, 1.0], [0.0, 2.0]])
    >>> frame(corners, np.array([2, 0, 1])).nodes.tolist()
    [[2, 0, 1]]
    """
    dim, one = points.shape[1], np.ones(1, dtype=bool)
    corner = points[nodes][None]
    return Facets(
        type=BY_NAME["TRIA3" if dim == 2 else "TETRA4"],
        nodes=nodes[None],
        number=np.full(1, -1),
        corner=corner,
        centre=corner.mean(axis=1),
        radius=np.full(1, np.inf),
        normal=np.eye(dim)[-1:],
        tangents=np.eye(dim)[None, :-1],
        flat=one,
        straight=one,
        affine=one,
        turn=np.zeros(1),
    )


def meet_quadric(
    surface: Quadric,
    slaves: list[Facets],
    samples: list[Samples],
    masters: list[Facets],
    _: float = np.inf,
) -> list[Segments]:
    """The points of whole slave faces with their gaps to a quadric, one segment for each face.

    `masters`: the one `frame` that it moves with. Points that do not see the surface have no
    weight.

    A slave edge of length 2 that is 1/2 away from the body above it:

    >>> above = plane(np.array([0.0, 0.5]), np.array([0.0, -1.0]))
    >>> body = frame(np.array([[0.0, 1.0], [1.0, 1.0], [0.0, 2.0]]), np.array([0, 1, 2]))
    >>> (segments,) = meet_quadric(above, [slave], face_samples([slave]), [body])
    >>> segments.area.round(15).tolist(), np.unique(segments.gap).tolist()
    ([2.0], [0.5])
    """
    (body,) = masters
    found = []
    for index, (slave, sample) in enumerate(zip(slaves, samples, strict=True)):
        places = np.einsum("qa,fad->fqd", sample.values, slave.corner)
        gap, there = surface.distance(places, sample.normal)
        seen = np.flatnonzero(there.any(axis=1))
        if not len(seen):
            continue
        opposite = (places + gap[..., None] * sample.normal)[seen]
        values = np.broadcast_to(sample.values, (len(seen), *sample.values.shape))
        found.append(
            Segments(
                slave=Side(faces=slave, index=index, face=seen, values=values),
                master=Side(
                    faces=body,
                    index=0,
                    face=np.zeros(len(seen), dtype=int),
                    values=_in_simplex(body.corner[0], opposite),
                ),
                weight=np.where(there, sample.weight, 0.0)[seen],
                normal=sample.normal[seen],
                gap=gap[seen],
            )
        )
    return found


def _in_simplex(corner: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The linear functions (…, dim + 1) of a simplex (dim + 1, dim) at places (…, dim)."""
    sides = (corner[1:] - corner[0]).T
    share = (places - corner[0]) @ np.linalg.inv(sides).T
    return np.concatenate([1 - share.sum(axis=-1, keepdims=True), share], axis=-1)
