"""Contact status by a primal–dual active set (semi-smooth Newton), with a search that must end.

ḡ ≥ 0, p ≥ 0, p ḡ = 0 for each macro-element. One iteration solves with the present closed
macro-elements as equality constraints; a closed one then opens where p < 0, an open one closes
where ḡ < 0, by more than round-off of its own size. Source: Hüeber, Wohlmuth, A primal–dual active
set strategy for non-linear multibody contact problems, CMAME 194 (2005).

This search may cycle, make no progress or open so much that a body moves freely. Then the linear
complementarity problem |T| p = W ḡ + q of all macro-elements is formed on the factor that has them
all closed, and solved by a method that ends after finitely many steps (`complementarity`). A solve
with the set found yields accurate p and ḡ, from which q is corrected until no status is wrong.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count

import numpy as np

from ...system.errors import SolveError
from ..linear.complementarity import complementary

_LOG = logging.getLogger(__name__)

# The quick search ends after so many solves without fewer wrong statuses than ever before.
_PATIENCE = 10
_MAX_CORRECTIONS = 6


@dataclass(frozen=True, kw_only=True)
class Trial:
    """The result of a solve with given closed multipliers, and its round-off; all (k,).

    `pressure` is zero where open. Pressures above −`pressure_limit` and gaps above −`gap_limit`
    change no status.
    """

    pressure: np.ndarray
    gap: np.ndarray
    pressure_limit: np.ndarray
    gap_limit: np.ndarray

    def offence(self, closed: np.ndarray) -> np.ndarray:
        """How many times its limit each multiplier (k,) violates p ≥ 0 if closed, else ḡ ≥ 0."""
        value = np.where(closed, -self.pressure, -self.gap)
        limit = np.where(closed, self.pressure_limit, self.gap_limit)
        with np.errstate(over="ignore"):
            return value / np.maximum(limit, np.finfo(float).tiny)


Solve = Callable[[np.ndarray], Trial]


@dataclass(frozen=True)
class StatusResult:
    """Final `closed` (k,), how many solves it took, and how many statuses changed in each."""

    closed: np.ndarray
    iterations: int
    changes: list[int]


def find_status(
    solve: Solve,
    start: np.ndarray,
    eligible: np.ndarray,
    area: np.ndarray,
    stiffness: Callable[[], np.ndarray],
    confirm: bool = False,
) -> StatusResult:
    """Iterate from `start` (k,) until no status changes; only `eligible` (k,) may close.

    `area` (k,) turns pressures into forces. `stiffness()` is asked for where the quick search
    fails: the forces (e, e) that average gaps of the eligible multipliers bring up, each imposed
    with all others closed. It may raise SolveError where no pressure makes equilibrium. `confirm`:
    the set that is found is solved once more. Raises SolveError where no status fulfils the
    conditions.

    Two macro-elements, of which the second one would be pulled:

    >>> tiny, both = np.full(2, 1e-9), np.array([True, True])
    >>> def solve(closed):
    ...     pressure, gap = np.where(closed, [1.0, -1.0], 0.0), np.where(closed, 0.0, 0.5)
    ...     return Trial(pressure=pressure, gap=gap, pressure_limit=tiny, gap_limit=tiny)
    >>> result = find_status(solve, both, both, np.ones(2), lambda: np.eye(2))
    >>> result.closed.tolist(), result.iterations
    ([True, False], 2)
    """
    closed, seen = start & eligible, set()
    changes: list[int] = []
    single = False
    fewest, since = len(closed) + 1, 0
    for iteration in count(1):
        try:
            offence = np.where(eligible, solve(closed).offence(closed), 0.0)
        except SolveError as error:
            if iteration == 1:
                raise
            return _certain(solve, closed, eligible, area, stiffness, changes, error)
        wrong = offence > 1
        _log(iteration, closed, wrong)
        if not wrong.any():
            if confirm:
                confirm = False
                continue
            return StatusResult(closed, iteration, changes)
        since = 0 if wrong.sum() < fewest else since + 1
        fewest = min(fewest, int(wrong.sum()))
        if since == _PATIENCE:
            break
        seen.add(closed.tobytes())
        following = closed ^ wrong
        # A cycle is broken by changing the worst offender alone from then on.
        single = single or following.tobytes() in seen
        if single:
            following = closed.copy()
            following[offence.argmax()] ^= True
        changes.append(int((following ^ closed).sum()))
        closed = following
    return _certain(solve, closed, eligible, area, stiffness, changes, None)


def _certain(
    solve: Solve,
    latest: np.ndarray,
    eligible: np.ndarray,
    area: np.ndarray,
    stiffness: Callable[[], np.ndarray],
    changes: list[int],
    failure: SolveError | None,
) -> StatusResult:
    """The status from the complementarity problem of all multipliers; see the module.

    Raises `failure`, why the quick search ended, where this one ends without a status too.
    """
    _LOG.info("contact status: complementarity problem of %d multipliers", eligible.sum())
    closed = eligible
    try:
        matrix = stiffness()
    except SolveError as error:
        raise failure or error from None
    for _ in range(_MAX_CORRECTIONS):
        try:
            trial = solve(closed)
        except SolveError as error:
            raise failure or error from None
        wrong = eligible & (trial.offence(closed) > 1)
        changes.append(int((closed ^ latest).sum()))
        _log(len(changes) + 1, closed, wrong)
        if not wrong.any():
            return StatusResult(closed, len(changes) + 1, changes)
        opened = np.where(closed, 0.0, trial.gap)
        force = (area * trial.pressure)[eligible] - matrix @ opened[eligible]
        latest, closed = closed, eligible.copy()
        closed[eligible] = complementary(matrix, force) == 0
    raise failure or SolveError(
        f"the contact status did not settle ({int(wrong.sum())} macro-elements still change)"
    )


def _log(iteration: int, closed: np.ndarray, wrong: np.ndarray) -> None:
    known = iteration, int(closed.sum()), len(closed), int(wrong.sum())
    _LOG.info("contact status: iteration %d, %d of %d closed, %d wrong", *known)


def likely_closed(
    gap: np.ndarray, area: np.ndarray, eligible: np.ndarray, push: float, dim: int
) -> np.ndarray:
    """Which macro-elements (m,) a force is likely to close, judged by their initial gaps (m,).

    Bodies that touch on an area A under a force F approach each other there by about F/(E* √A), in
    the plane by F/E*; `push` is F/E*, F per thickness in the plane. Macro-elements close in the
    order of their gaps up to that approach, from where bodies that are apart first touch. A first
    guess that is too small grows in one iteration; one that is too large shrinks step by step.

    In the plane, an approach of 2 closes gaps of 0 and 1, but not of 3:

    >>> gap, eligible = np.array([0.0, 1.0, 3.0]), np.ones(3, dtype=bool)
    >>> likely_closed(gap, np.ones(3), eligible, 2.0, 2).tolist()
    [True, True, False]
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
