"""Coulomb's law of friction on each macro-element, and the step of its iteration.

q is the traction on the master, w the slip of the master relative to the slave since the last step
in equilibrium. A closed macro-element sticks, w = 0 and |q| ≤ μp, or slips, q = −μp w/|w|. One
iteration solves with the slips' bounds b = μp and directions d = w/|w| of the iteration before: the
problem of Tresca, whose matrix is symmetric. In 3D it takes Newton's term of b|w| along, a spring
b/|w| across d. Source: Hüeber, Stadler, Wohlmuth, A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction, SIAM J. Sci. Comput. 30 (2008) 572–596.

The slip operator has the jump of displacement along the tangents of macro-elements. The slip of
macro-element i along its tangent t is w = (row i · u) / covered area, master relative to slave. A
traction q on the master does the work q · w per area: its nodal forces are rowᵀ q. Rows are
integrated at the points of the gap operator. Where a segment is flat they are its closed integrals
∫ N times t, so that a uniform shear acts on both sides as on whole faces.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .facets import tangents_of
from .multipliers import MASTER, SLAVE, Integrals
from .segments import Segments

# Normals that differ by less within a segment are one normal.
_FLAT = 1e-12


def levers(given: Sequence[tuple[Segments, np.ndarray]], normal: np.ndarray, k: int) -> np.ndarray:
    """The couples (dim − 1, m, k, 3) ∫ ψ g n × t dS of tractions ψ, by tangent.

    Tractions act on both surfaces where these are meshed, a gap g apart. `given` are segments with
    functions ψ (s, q, ≤ k) at their points; the couples of further ones are zero.

    The edges are 1/2 apart over a length of 2, n × t is the axis across the plane:

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> one = np.ones((*segments.weight.shape, 1))
    >>> levers([(segments, one)], np.array([[0.0, 1.0]]), 1)[0].round(15).tolist()
    [[[0.0, 0.0, 1.0]]]
    """
    m, dim = normal.shape
    couples = np.zeros((dim - 1, m, k, 3))
    for by_macro, tangent in zip(couples, tangents(normal), strict=True):
        for segments, psi in given:
            pair = segments.normal, along_faces(segments, tangent)
            n, t = (np.pad(v, [(0, 0), (0, 0), (0, 3 - dim)]) for v in pair)
            weight = segments.weight * segments.gap
            couple = np.einsum("sq,sqk,sqd->skd", weight, psi, np.cross(n, t))
            np.add.at(by_macro[:, : psi.shape[-1]], segments.macro, couple)
    return couples


class Tangent(NamedTuple):
    """One tangent of each macro-element: `normal` (m, dim), its mean one, and `along` (m, dim)."""

    normal: np.ndarray
    along: np.ndarray


def tangents(normal: np.ndarray) -> list[Tangent]:
    """The dim − 1 tangents of macro-elements with mean normals (m, dim).

    >>> [tangent.along.tolist() for tangent in tangents(np.array([[0.0, 1.0]]))]
    [[[-1.0, 0.0]]]
    """
    return [Tangent(normal, along) for along in np.swapaxes(tangents_of(normal), 0, 1)]


def along_faces(segments: Segments, tangent: Tangent) -> np.ndarray:
    """Unit tangents (s, q, dim) in the face at the points of segments.

    The smallest rotation from the mean normal a of the macro-element to the normal n at the point
    turns its tangent t to t − (t · n) (a + n)/(1 + a · n). This is linear in t, so that results do
    not depend on the frame of the macro-element, nor on the axes.

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> tilted = Tangent(np.array([[-0.8, 0.6]]), np.array([[0.6, 0.8]]))
    >>> along_faces(segments, tilted)[0, 0].round(15).tolist()
    [1.0, 0.0]
    """
    n = segments.normal
    a, t = (vectors[segments.macro][:, None] for vectors in tangent)
    out, level = ((vectors * n).sum(axis=-1, keepdims=True) for vectors in (t, a))
    return np.asarray(t - out / (1 + level) * (a + n))


def turned_along(part: Integrals, tangent: Tangent) -> Integrals:
    """The integrals of a part with ∫ N t in place of ∫ N n.

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> data = InterfaceData(slaves=[slave], samples=[], found=[segments], n_macro=1)
    >>> part = integrals(constants(data), segments)
    >>> tangent = Tangent(np.array([[0.0, 1.0]]), np.array([[1.0, 0.0]]))
    >>> turned_along(part, tangent).vectors[MASTER][..., 0].round(15).tolist()
    [[[0.5, 0.5]], [[0.5, 0.5]]]
    """
    slave, master = (_along(part, side, tangent)[:, None] for side in (SLAVE, MASTER))
    return replace(part, vectors=(slave, master))


def _along(part: Integrals, side: int, tangent: Tangent) -> np.ndarray:
    """∫ N t (s, n_nodes, dim) over segments; t is the tangent in the face at each point."""
    segments = part.segments
    normal, t = segments.normal, along_faces(segments, tangent)
    flat = np.abs(normal - normal[:, :1]).max(axis=(1, 2), initial=0.0) <= _FLAT
    scalar = np.einsum("sad,sd->sa", part.vectors[side][:, 0], normal[:, 0])
    exact = scalar[..., None] * t[:, :1]
    values = segments.sides[side].values
    return np.where(
        flat[:, None, None], exact, np.einsum("sqa,sq,sqd->sad", values, segments.weight, t)
    )


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


def _moves(found: Response) -> np.ndarray:
    """Where the slip is more than round-off (m,)."""
    return np.asarray(np.linalg.norm(found.slip, axis=1) > found.slip_limit)


def _positive(values: np.ndarray) -> np.ndarray:
    return np.maximum(values, np.finfo(float).tiny)
