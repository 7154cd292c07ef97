"""A contact surface in space, laid flat: where its points are on a plan, and along a profile.

Surfaces that hardly bend are seen along their mean normal. Cylinders are unrolled, over the arc and
along the axis. Spheres are seen from their pole, each point as far from it as the arc is long.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..simulation.results.solution import ZoneResult

# Cosine of the angle to the mean normal, over what is pressed, up to which a surface is flat.
_FLAT = np.cos(np.radians(10))
# Normals leave the plane around an axis by no more, and radii differ by no more (shares).
_ROUND = 0.05
Place = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class LaidFlat:
    """Places (n, 2) of points (n, 3) on a plan, with the names of both, and along a profile.

    `around`: the length after which the first place comes back to the same point; infinite where it
    never does.
    """

    plan: Place
    names: tuple[str, str]
    profile: Place
    profile_name: str
    around: float = np.inf
    profile_is_angle: bool = False

    def whole(self, places: np.ndarray) -> np.ndarray:
        """Which faces (f,), by the places (f, nodes, 2) of their nodes, do not run over the cut."""
        return np.asarray(np.ptp(places[..., 0], axis=1) < self.around / 2)


def laid_flat(zone: ZoneResult) -> LaidFlat:
    """How a zone in space is laid flat."""
    pressed = zone.multiplier > 0
    chosen = pressed if pressed.any() else np.ones(len(pressed), dtype=bool)
    normal, centre = zone.normal[chosen], zone.centre[chosen]
    mean = normal.mean(axis=0)
    size = float(np.linalg.norm(mean))
    if size > 0 and (normal @ mean).min() > _FLAT * size:
        return _seen_along(zone.normal.mean(axis=0))
    middle = _middle(normal, centre)
    if middle is None:
        return _seen_along(zone.normal.mean(axis=0))
    _, sizes, axes = np.linalg.svd(np.concatenate([normal, np.zeros((3, 3))]), full_matrices=False)
    if sizes[2] <= _ROUND * sizes[0]:
        return _unrolled(axes[2], *middle, centre.mean(axis=0))
    return _from_pole(*middle, centre.mean(axis=0))


def plan_axes(normal: np.ndarray) -> tuple[np.ndarray, tuple[str, str]]:
    """Two unit vectors (2, 3) across a normal (3,), along coordinate axes if it can be; names."""
    drop = int(np.argmax(np.abs(normal))) if np.abs(normal).max() > 1e-6 else 2
    first, second = (i for i in range(3) if i != drop)
    normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
    u = np.eye(3)[first] - normal[first] * normal
    u /= np.linalg.norm(u)
    v = np.eye(3)[second] - normal[second] * normal
    v -= (v @ u) * u
    return np.stack([u, v / np.linalg.norm(v)]), ("xyz"[first], "xyz"[second])


def _seen_along(normal: np.ndarray) -> LaidFlat:
    axes, names = plan_axes(normal)
    return LaidFlat(lambda p: p @ axes.T, names, lambda p: p @ axes[0], names[0])


def _middle(normal: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, float] | None:
    """The point (3,) that the normals at the centres (m, 3) come from, and the radius, if any."""
    across = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    right = np.einsum("mij,mj->i", across, centre)
    point = np.linalg.lstsq(across.sum(axis=0), right, rcond=1e-6)[0]
    radii = np.abs(((centre - point) * normal).sum(axis=1))
    radius = float(radii.mean())
    return (point, radius) if np.abs(radii - radius).max() <= _ROUND * radius else None


def _unrolled(axis: np.ndarray, point: np.ndarray, radius: float, pressed: np.ndarray) -> LaidFlat:
    """Around an axis through a point, from the middle (3,) of what is pressed on."""
    axis = np.where(np.abs(axis) < 1e-3, 0.0, axis)
    axis = axis / np.linalg.norm(axis) * np.sign(axis[np.abs(axis).argmax()])
    first = pressed - point
    first = first - axis * (first @ axis)
    if np.linalg.norm(first) < _ROUND * radius:  # pressed all around
        first = np.eye(3)[int(np.abs(axis).argmin())]
        first = first - axis * (first @ axis)
    first /= np.linalg.norm(first)
    second, name = np.cross(axis, first), _named(axis)

    def angle(points: np.ndarray) -> np.ndarray:
        return np.asarray(np.arctan2((points - point) @ second, (points - point) @ first))

    return LaidFlat(
        lambda p: np.stack([radius * angle(p), p @ axis], axis=-1),
        (f"arc around {name}", name),
        lambda p: np.degrees(angle(p)),
        f"angle around {name} from the middle of the contact, degrees",
        2 * np.pi * radius,
        profile_is_angle=True,
    )


def _from_pole(point: np.ndarray, radius: float, pressed: np.ndarray) -> LaidFlat:
    """Around a point, from the middle (3,) of what is pressed, or z, along arcs to all sides."""
    pole = pressed - point
    pole = pole if np.linalg.norm(pole) > _ROUND * radius else np.eye(3)[2]
    pole = pole / np.linalg.norm(pole)
    axes, names = plan_axes(pole)

    def angle(points: np.ndarray) -> np.ndarray:
        away = points - point
        cosine = away @ pole / np.maximum(np.linalg.norm(away, axis=-1), 1e-300)
        return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def plan(points: np.ndarray) -> np.ndarray:
        side = (points - point) @ axes.T
        length = np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), 1e-300)
        return np.asarray(radius * angle(points)[..., None] * side / length)

    return LaidFlat(
        plan,
        (f"arc towards {names[0]}", names[1]),
        lambda p: np.degrees(angle(p)),
        "angle from the middle of the contact, degrees",
        2 * np.pi * radius,
        profile_is_angle=True,
    )


def _named(axis: np.ndarray) -> str:
    """A coordinate axis by its letter, another one by its direction."""
    if np.abs(axis).max() > 1 - 1e-6:
        return "xyz"[int(np.abs(axis).argmax())]
    return "(" + ", ".join(f"{x:.2g}" for x in axis) + ")"
