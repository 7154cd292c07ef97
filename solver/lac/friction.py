"""Coulomb's law of friction on each macro-element, and the step of its iteration.

q is the traction on the master, w the slip of the master relative to the slave since the last step
in equilibrium. A closed macro-element sticks, w = 0 and |q| ≤ μp, or slips, q = −μp w/|w|. One
iteration solves with the slips' bounds b = μp and directions d = w/|w| of the iteration before: the
problem of Tresca, whose matrix is symmetric. In 3D it takes Newton's term of b|w| along, a spring
b/|w| across d. Source: Hüeber, Stadler, Wohlmuth, A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction, SIAM J. Sci. Comput. 30 (2008) 572–596.
"""

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Slip:
    """Which of m macro-elements slip, with bounds and directions from the iteration before.

    `slips` (m,); `bound` b (m,) a traction; `direction` d (m, k) of k = dim − 1 components along
    the tangents, zero where it is not known yet; `distance` |w| (m,) that belongs to it.
    """

    slips: np.ndarray
    bound: np.ndarray
    direction: np.ndarray
    distance: np.ndarray

    @property
    def traction(self) -> np.ndarray:
        """−b d (m, k), zero where nothing slips."""
        return np.where(self.slips[:, None], -self.bound[:, None] * self.direction, 0.0)

    @property
    def across(self) -> tuple[np.ndarray, np.ndarray]:
        """Directions (m, k) across d, and the traction per slip along them (m,); in 3D."""
        across = np.stack([-self.direction[:, 1], self.direction[:, 0]], axis=1)
        far = np.where(self.distance > 0, self.distance, np.inf)
        return across, np.where(self.slips, self.bound / far, 0.0)


@dataclass(frozen=True, kw_only=True)
class Response:
    """What a solve with given slips finds: all by macro-element (m,), vectors (m, k).

    `closed`; `pressure`; `traction` q and `slip` w; `traction_limit`, `slip_limit`: round-off.
    """

    closed: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray
    slip: np.ndarray
    traction_limit: np.ndarray
    slip_limit: np.ndarray


def sticking(closed: np.ndarray, k: int) -> Slip:
    """Nothing slips.

    >>> sticking(np.array([True]), 1).slips.tolist()
    [False]
    """
    m = len(closed)
    return Slip(
        slips=np.zeros(m, dtype=bool),
        bound=np.zeros(m),
        direction=np.zeros((m, k)),
        distance=np.full(m, np.inf),
    )


def without_friction(closed: np.ndarray, k: int) -> Slip:
    """All that is `closed` (m,) slips, and nothing resists.

    >>> without_friction(np.array([True, False]), 1).slips.tolist()
    [True, False]
    """
    return replace(sticking(closed, k), slips=closed.copy())


def violation(slip: Slip, found: Response, bound: np.ndarray) -> np.ndarray:
    """By how many limits (m,) a response breaks |q| ≤ `bound` where stuck, q · w ≤ 0 elsewhere.

    A stuck macro-element bears twice what friction of 0.5 at a pressure of 2 can:

    >>> one, tiny = np.ones((1, 1)), np.array([0.1])
    >>> response = Response(closed=np.array([True]), pressure=2 * one[0], traction=2 * one,
    ...     slip=0 * one, traction_limit=tiny, slip_limit=tiny)
    >>> violation(sticking(response.closed, 1), response, np.array([1.0])).round(9).tolist()
    [10.0]
    """
    size = np.linalg.norm(found.traction, axis=1)
    over = (size - bound) / _positive(found.traction_limit)
    back = -(found.slip * slip.direction).sum(axis=1) / _positive(found.slip_limit)
    # Without friction so far, and still where it was: it may as well stick.
    rests = (slip.direction == 0).all(axis=1) & ~_moves(found)
    back = np.where(rests, np.inf, back)
    return np.where(found.closed, np.where(slip.slips, back, over), 0.0)


def following(
    slip: Slip, found: Response, fresh: np.ndarray, change: np.ndarray, softness: float
) -> tuple[Slip, float]:
    """The slips of the next iteration with bounds `fresh` (m,), those in `change` turned over.

    Also the largest change of a bound or of b d where slips go on, a traction. `softness`: slip per
    traction, for a first guess of how far a macro-element goes that begins to slip.

    Pulled by 2 along the tangent, it begins to slip the other way where it bears 1 only:

    >>> one, tiny = np.ones((1, 1)), np.array([0.1])
    >>> response = Response(closed=np.array([True]), pressure=2 * one[0], traction=2 * one,
    ...     slip=0 * one, traction_limit=tiny, slip_limit=tiny)
    >>> slip, _ = following(sticking(response.closed, 1), response, one[0], response.closed, 0.5)
    >>> slip.traction.tolist(), slip.direction.tolist(), slip.distance.tolist()
    ([[1.0]], [[-1.0]], [0.5])
    """
    size, far = np.linalg.norm(found.traction, axis=1), np.linalg.norm(found.slip, axis=1)
    slips = found.closed & (slip.slips ^ change)
    begins, goes_on = slips & change, slips & slip.slips
    direction, distance = slip.direction.copy(), slip.distance.copy()
    unit = size[begins][:, None]
    direction[begins] = -found.traction[begins] / np.where(unit > 0, unit, 1.0)
    distance[begins] = softness * np.abs(size - fresh)[begins]
    unknown = (direction == 0).all(axis=1)
    turns = goes_on & _moves(found) & (unknown | (direction.shape[1] > 1))
    direction[turns], distance[turns] = (found.slip / _positive(far)[:, None])[turns], far[turns]
    changed = np.abs((fresh - slip.bound)[goes_on]).max(initial=0.0)
    turned = slip.bound[:, None] * (direction - slip.direction)
    changed = max(changed, np.abs(turned[goes_on]).max(initial=0.0))
    new = Slip(slips=slips, bound=fresh, direction=direction, distance=distance)
    return new, float(changed)


def extrapolated(
    bounds: tuple[np.ndarray, np.ndarray], before: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Bounds (m,) nearer to the fixed point b = μp, from two iterations with the same status.

    Of each, the bounds that it was solved with and those that its pressures yield: the secant
    method for what is between them, Anderson's of depth one. Source: H. Walker, P. Ni, Anderson
    acceleration for fixed-point iterations, SIAM J. Numer. Anal. 49 (2011) 1715–1735.

    b ← 1 + b/2 has the fixed point 2:

    >>> at = lambda b: (np.array([b]), np.array([1 + b / 2]))
    >>> extrapolated(at(1.0), at(0.0)).tolist()
    [2.0]
    """
    now, last = bounds[1] - bounds[0], before[1] - before[0]
    turned = now - last
    share = float(now @ turned / (turned @ turned)) if turned.any() else 0.0
    return np.maximum(bounds[1] - share * (bounds[1] - before[1]), 0.0)


def _moves(found: Response) -> np.ndarray:
    """Where the slip is more than round-off (m,)."""
    return np.asarray(np.linalg.norm(found.slip, axis=1) > found.slip_limit)


def _positive(values: np.ndarray) -> np.ndarray:
    return np.maximum(values, np.finfo(float).tiny)
