"""Contact status by a primal–dual active set (semi-smooth Newton).

ḡ ≥ 0, p ≥ 0, p ḡ = 0 for each macro-element. One iteration solves with the present set of closed
macro-elements as equality constraints; a macro-element is closed in the next one where
p − c ḡ > 0, with c a stiffness over a length so that no unit matters. Source: Hüeber, Wohlmuth,
A primal–dual active set strategy for non-linear multibody contact problems, CMAME 194 (2005).
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver.system.errors import SolveError

_LOG = logging.getLogger(__name__)

# solve(closed) gives pressure (m,) (zero where open), average gap (m,), and the rest it found
Solve = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

# Pressures and gaps below these shares of their scales are round-off and change no status.
PRESSURE_NOISE = 1e-10
GAP_NOISE = 1e-12
_MAX_ITERATIONS = 60


@dataclass(frozen=True)
class StatusResult:
    """Final `closed` (m,), how many solves it took, and how many statuses changed in each."""

    closed: np.ndarray
    iterations: int
    changes: list[int]


def find_status(
    solve: Solve,
    start: np.ndarray,
    eligible: np.ndarray,
    pressure_scale: float,
    length: float,
    confirm: bool = False,
) -> StatusResult:
    """Iterate from `start` (m,) until no status changes; only `eligible` (m,) may close.

    `pressure_scale` and `length` are the sizes below whose noise nothing changes. A set seen before
    (a cycle) is broken by changing only the worst offender from then on. `confirm`: the set that is
    found is solved once more. Raises SolveError when there is no end within the allowed iterations.
    """
    closed, seen = start & eligible, set()
    changes: list[int] = []
    single = False
    for iteration in range(1, _MAX_ITERATIONS + 1):
        pressure, gap = solve(closed)
        scale = max(pressure_scale, float(np.abs(pressure).max(initial=0.0)))
        offence = np.where(closed, -pressure / scale, -gap / length)
        noise = np.where(closed, PRESSURE_NOISE, GAP_NOISE)
        wrong = eligible & (offence > noise)
        told = iteration, int(closed.sum()), len(closed), int(wrong.sum())
        _LOG.info("contact status: iteration %d, %d of %d closed, %d wrong", *told)
        if not wrong.any():
            if confirm:
                confirm = False
                continue
            return StatusResult(closed, iteration, changes)
        seen.add(closed.tobytes())
        following = closed ^ wrong
        single = single or following.tobytes() in seen
        if single:
            following = closed.copy()
            worst = int(np.where(wrong, offence, -np.inf).argmax())
            following[worst] = ~following[worst]
        changes.append(int((following ^ closed).sum()))
        closed = following
    raise SolveError(
        f"the contact status did not settle within {_MAX_ITERATIONS} iterations "
        f"({changes[-1]} macro-elements still change)"
    )


def likely_closed(
    gap: np.ndarray, area: np.ndarray, eligible: np.ndarray, push: float, dim: int
) -> np.ndarray:
    """Which macro-elements (m,) a force is likely to close, judged by their initial gaps (m,).

    Bodies that touch on an area A under a force F approach each other there by about F/(E* √A), in
    the plane by F/E*; `push` is F/E*, F per thickness in the plane. Macro-elements close in the
    order of their gaps up to that approach, from where bodies that are apart first touch. A first
    guess that is too small grows in one iteration; one that is too large shrinks step by step.
    """
    if not eligible.any():
        return eligible
    order = np.argsort(np.where(eligible, gap, np.inf), kind="stable")
    touching = np.cumsum(area[order])
    approach = push / touching ** ((dim - 2) / (dim - 1))
    above = gap[order] - max(gap[order[0]], 0.0)
    closed = np.zeros(len(gap), dtype=bool)
    closed[order[above <= approach]] = True
    return closed & eligible
