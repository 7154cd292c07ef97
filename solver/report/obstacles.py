"""Rigid surfaces that have no cells, drawn as what they are: planes, spheres, cylinders, parabolas.

Each is a profile (height, distance) turned about an axis, or in 2D mirrored at it; a cylinder is a
circle along a line. Drawn is what is opposite to the slave, and some more.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..simulation.rigid import quadric_of
from ..simulation.solution import Solution

# So much more than what is opposite to the slave, in each direction; points along the profile.
_MORE, _POINTS, _AROUND = 1.3, 24, 48
_TINY = 1e-300


@dataclass(frozen=True)
class Obstacle:
    """A rigid surface: `points` (n, dim), `out` of the body (n, dim), `faces` (f, 4) or (f, 2)."""

    points: np.ndarray
    out: np.ndarray
    faces: np.ndarray


def obstacles(solution: Solution) -> dict[int, Obstacle]:
    """The surfaces of bodies without cells, by number of the body."""
    found = ((number, obstacle(solution, body.name)) for number, body in enumerate(solution.bodies))
    return {number: surface for number, surface in found if surface}


def obstacle(solution: Solution, name: str) -> Obstacle | None:
    """The surface of a body; None where it has cells."""
    body = solution.case.rigid.get(name)
    dim = solution.mesh.points.shape[1]
    surface = quadric_of(solution.case, name, np.zeros(dim))
    near = [
        solution.mesh.points[zone.slave_nodes]
        for zone, given in zip(solution.zones, solution.case.zones, strict=True)
        if given.master == name
    ]
    if body is None or surface is None or not near:
        return None
    place, values = np.concatenate(near), body.values
    if solution.case.axisymmetric:
        place = np.concatenate([place, place * [-1.0, 1.0]])
    points, faces = _SHAPES[body.surface](place, **{k: np.array(v) for k, v in values.items()})
    if solution.case.axisymmetric:
        used, faces = np.unique(
            faces[(points[faces, 0] > -1e-9 * np.ptp(points)).all(axis=1)], return_inverse=True
        )
        points, faces = points[used], faces.reshape(-1, 2)
    out = surface.gradient(points)
    size = np.linalg.norm(out, axis=1, keepdims=True)
    return Obstacle(points, out / np.maximum(size, _TINY), faces)


_Drawn = tuple[np.ndarray, np.ndarray]


def _plane(place: np.ndarray, point: np.ndarray, normal: np.ndarray) -> _Drawn:
    normal = _unit(normal)
    middle = (place.min(axis=0) + place.max(axis=0)) / 2
    foot = middle - ((middle - point) @ normal) * normal
    side = _MORE * np.linalg.norm(_across(place - foot, normal), axis=1).max()
    points, faces = _turned(foot, normal, np.array([0.0, side]), np.zeros(2), corners=4)
    return (points, faces) if len(foot) == 2 else (points[-4:], np.arange(4)[None])


def _sphere(
    place: np.ndarray, centre: np.ndarray, radius: np.ndarray, hollow: np.ndarray
) -> _Drawn:
    del hollow  # drawn alike from either side
    axis, most = _reach(place - centre)
    angle = np.linspace(0.0, most, _POINTS)
    return _turned(centre, axis, radius * np.sin(angle), radius * np.cos(angle))


def _parabola(
    place: np.ndarray,
    point: np.ndarray,
    normal: np.ndarray,
    radius: np.ndarray,
    hollow: np.ndarray,
) -> _Drawn:
    normal = _unit(normal)
    far = _MORE * np.linalg.norm(_across(place - point, normal), axis=1).max()
    along = np.linspace(0.0, far, _POINTS)
    return _turned(point, normal, along, (1 if hollow else -1) * along**2 / (2 * radius))


def _cylinder(
    place: np.ndarray,
    point: np.ndarray,
    axis: np.ndarray,
    radius: np.ndarray,
    hollow: np.ndarray,
) -> _Drawn:
    del hollow
    axis = _unit(axis)
    away = _across(place - point, axis)
    middle, most = _reach(away)
    angle = np.linspace(-most, most, 2 * _POINTS)[:, None]
    arc = point + radius * (np.cos(angle) * middle + np.sin(angle) * np.cross(axis, middle))
    along = (place - point) @ axis
    ends = along.mean() + _MORE * (np.array([along.min(), along.max()]) - along.mean())
    return _grid(arc[:, None] + ends[:, None] * axis)


def _reach(away: np.ndarray) -> tuple[np.ndarray, float]:
    """The direction (dim,) of places from a centre (n, dim), and the angle that holds them."""
    directions = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), _TINY)
    middle = directions.mean(axis=0)
    if np.linalg.norm(middle) < 0.1:
        return directions[0], np.pi
    axis = _unit(middle)
    return axis, min(np.pi, _MORE * float(np.arccos(np.clip(directions @ axis, -1, 1)).max()))


def _turned(
    base: np.ndarray,
    axis: np.ndarray,
    away: np.ndarray,
    height: np.ndarray,
    corners: int = _AROUND,
) -> _Drawn:
    """A profile (k,) about an axis through a point: both sides of it in 2D, around it in 3D."""
    if len(base) == 2:
        side = np.array([-axis[1], axis[0]])
        away, height = np.r_[-away[:0:-1], away], np.r_[height[:0:-1], height]
        points = base + height[:, None] * axis + away[:, None] * side
        return points, np.c_[np.arange(len(points) - 1), np.arange(1, len(points))]
    first = _unit(_across(np.eye(3)[[int(np.argmin(np.abs(axis)))]], axis)[0])
    angle = 2 * np.pi * (np.arange(corners + 1) + 0.5) / corners
    around = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * np.cross(axis, first)
    return _grid(base + height[:, None, None] * axis + away[:, None, None] * around)


def _grid(places: np.ndarray) -> _Drawn:
    """Points (n, 3) of a grid (r, c, 3), and its cells (f, 4)."""
    rows, columns = places.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    cells = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    return places.reshape(-1, 3), np.stack([cell.ravel() for cell in cells], axis=1)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _across(vectors: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """The part of vectors (n, dim) across a unit vector."""
    return vectors - (vectors @ unit)[:, None] * unit


_SHAPES: dict[str, Callable[..., _Drawn]] = {
    "plane": _plane,
    "sphere": _sphere,
    "cylinder": _cylinder,
    "parabola": _parabola,
}
