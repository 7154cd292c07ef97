"""Contact status by a primal–dual active set (semi-smooth Newton), with guaranteed termination.

ḡ ≥ 0, p ≥ 0, p ḡ = 0 for each macro-element. One iteration solves with the present closed
macro-elements as equality constraints; a closed one then opens where p < 0, an open one closes
where ḡ < 0, by more than round-off of its own size. Source: Hüeber, Wohlmuth, A primal–dual active
set strategy for non-linear multibody contact problems, CMAME 194 (2005).

From few closed macro-elements, more would close at once than are in contact in the end, and these
open ring by ring: an iteration closes no more than are closed already.

The search goes on while it makes progress: fewer wrong statuses than ever before, or fewer or more
closed macro-elements. Contact that peels off opens row by row and makes progress in each step. None
of the three can go on for ever. The search may also open so much that a body moves freely. Then it
is repeated from another start, if there is one. Where that fails too, the linear complementarity
problem |T| p = W ḡ + q of all macro-elements is formed on the factor that has them all closed, and
solved by a method that ends after finitely many steps. A solve with the set found yields accurate p
and ḡ, from which q is corrected until no status is wrong.

Linear complementarity: x ≥ 0, W x + q ≥ 0, xᵀ (W x + q) = 0, W positive semidefinite.

These are the conditions of the least of ½ xᵀ W x + qᵀ x over x ≥ 0. With Cholesky's factor L of W
it is the least of |Lᵀ x + L⁻¹ q|², which SciPy's active set finds: it ends, as no set comes twice
(Lawson, Hanson, Solving Least Squares Problems, §23.3).
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .errors import SolveError

# Added to the scaled diagonal of one: motions that nothing resists stay finite. The next ones serve
# where W as given is not semidefinite.
_SHIFTS = 1e-13, 1e-11, 1e-9
_INDEFINITE = "the stiffness that the gaps see is not positive semidefinite"


def complementary(matrix: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The unknowns x (k,) for W = `matrix` (k, k), symmetric, and q = `force` (k,).

    Raises SolveError where W is not positive semidefinite. With x = (1, 0), W x + q = (0, 1) here:

    >>> complementary(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-2.0, 0.0])).round(9)
    array([1., 0.])
    """
    from scipy.linalg import solve_triangular
    from scipy.optimize import nnls

    diagonal = np.diag(matrix)
    if not (diagonal > 0).all():
        raise SolveError(_INDEFINITE)
    scale = 1 / np.sqrt(diagonal)
    matrix = (matrix + matrix.T) / 2 * np.outer(scale, scale)
    for shift in _SHIFTS:
        try:
            root = np.linalg.cholesky(matrix + shift * np.eye(len(force)))
            goal = solve_triangular(root, -force * scale, lower=True)
            found: np.ndarray = nnls(root.T, goal, maxiter=10 * len(force) + 10)[0]
        except (np.linalg.LinAlgError, RuntimeError):  # of nnls: too many steps
            continue
        return scale * found
    raise SolveError(_INDEFINITE)


_LOG = logging.getLogger(__name__)

# Between information and warnings: what a user wants to see.
_OUTCOME = 25
# Stop the active-set search when this many solves make no progress.
_PATIENCE = 8
# At most this many may close in one iteration when few are closed, or hold a body that is free.
_FEW = 50
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

    def violation(self, closed: np.ndarray) -> np.ndarray:
        """Violation of each multiplier's sign condition, as a multiple of the round-off limit.

        That is p ≥ 0 where `closed` (k,), else ḡ ≥ 0.
        """
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
    guess: Callable[[], np.ndarray] | None = None,
) -> StatusResult:
    """Iterate from `start` (k,) until no status changes; only `eligible` (k,) may close.

    `guess()` (k,) is asked for another start where the search from the first one fails. `area` (k,)
    turns pressures into forces. `stiffness()` is asked for where both fail: the forces (e, e) that
    average gaps of the eligible multipliers bring up, each imposed with all others closed. It may
    raise SolveError where no pressure makes equilibrium. `confirm`: the set that is found is solved
    once more. Raises SolveError where no status fulfils the conditions.

    Two macro-elements, of which the second one would be pulled:

    >>> tiny, both = np.full(2, 1e-9), np.array([True, True])
    >>> def solve(closed):
    ...     pressure, gap = np.where(closed, [1.0, -1.0], 0.0), np.where(closed, 0.0, 0.5)
    ...     return Trial(pressure=pressure, gap=gap, pressure_limit=tiny, gap_limit=tiny)
    >>> result = find_status(solve, both, both, np.ones(2), lambda: np.eye(2))
    >>> result.closed.tolist(), result.iterations
    ([True, False], 2)
    """
    changes: list[int] = []
    failure: SolveError | None = None
    for number, begin in enumerate((lambda: start, guess)):
        if begin is None:
            break
        changes += [0] * number
        closed, confirmed = begin() & eligible, not confirm
        search = _Search(len(closed))
        try:
            while not search.ended:
                violation = np.where(eligible, solve(closed).violation(closed), 0.0)
                wrong = violation > 1
                _log(len(changes) + 1, closed, wrong)
                if not wrong.any():
                    if confirmed:
                        return StatusResult(closed, len(changes) + 1 + confirm, changes)
                    confirmed = True
                    continue
                following = search.following(closed, wrong, violation)
                if not search.ended:
                    changes.append(int((following ^ closed).sum()))
                    closed = following
        except SolveError as error:
            if not changes and guess is None:
                raise
            failure = error
    return _solve_complementarity(solve, eligible, area, stiffness, changes, failure)


class _Search:
    """A search among `count` multipliers: statuses seen, fewest and most closed, least wrong.

    >>> search = _Search(100)
    >>> def note(wrong, closed):
    ...     one, other = np.arange(100) < closed, np.arange(100) < wrong
    ...     search.following(one, other, np.arange(100.0))
    >>> for closed in range(90, 50, -1):
    ...     note(16, closed)
    >>> search.ended
    False
    >>> for _ in range(8):
    ...     note(16, 60)
    >>> search.ended
    True
    """

    def __init__(self, count: int):
        self._wrong, self._fewest, self._most = count + 1, count + 1, -1
        self._without, self._single = 0, False
        self._seen: set[bytes] = set()

    @property
    def ended(self) -> bool:
        """Whether too many solves set no record."""
        return self._without >= _PATIENCE

    def following(self, closed: np.ndarray, wrong: np.ndarray, violation: np.ndarray) -> np.ndarray:
        """Note a solve with `wrong` (k,) statuses; the status (k,) after it, see the module."""
        few, many = int(wrong.sum()), int(closed.sum())
        record = few < self._wrong or many < self._fewest or many > self._most
        self._without = 0 if record else self._without + 1
        self._wrong = min(self._wrong, few)
        self._fewest, self._most = min(self._fewest, many), max(self._most, many)
        self._seen.add(closed.tobytes())
        found = closed ^ _first_changes(closed, wrong, violation)
        # A cycle is broken by changing the worst offender alone from then on.
        self._single = self._single or found.tobytes() in self._seen
        if self._single:
            found = closed.copy()
            found[violation.argmax()] ^= True
        return found


def _first_changes(closed: np.ndarray, wrong: np.ndarray, violation: np.ndarray) -> np.ndarray:
    """Those of the `wrong` (k,) that change now: all that open, and the worst of many that close.

    From one closed macro-element, `_FEW` more close at once:

    >>> closed, wrong = np.arange(100) == 0, np.arange(100) > 0
    >>> np.flatnonzero(_first_changes(closed, wrong, np.arange(100.0)))[[0, -1]].tolist()
    [50, 99]
    """
    closing = np.flatnonzero(wrong & ~closed)
    most = max(int(closed.sum()), _FEW)
    now = wrong & closed
    now[closing[np.argsort(violation[closing], kind="stable")[-most:]]] = True
    return now


def _solve_complementarity(
    solve: Solve,
    eligible: np.ndarray,
    area: np.ndarray,
    stiffness: Callable[[], np.ndarray],
    changes: list[int],
    failure: SolveError | None,
) -> StatusResult:
    """The status from the complementarity problem of all multipliers; see the module.

    Raises `failure`, why the quick search ended, where this one ends without a status too.
    """
    text = "contact status: complementarity problem, one solve for each of %d macro-elements"
    _LOG.log(_OUTCOME, text, eligible.sum())
    latest, closed, gap = eligible, eligible, np.zeros(len(eligible))
    try:
        matrix = stiffness()
    except SolveError as error:
        raise failure or error from None
    for _ in range(_MAX_CORRECTIONS):
        try:
            trial, closed = _touching(solve, closed, gap)
        except SolveError as error:
            raise failure or error from None
        wrong = eligible & (trial.violation(closed) > 1)
        changes.append(int((closed ^ latest).sum()))
        _log(len(changes) + 1, closed, wrong)
        if not wrong.any():
            return StatusResult(closed, len(changes) + 1, changes)
        opened = np.where(closed, 0.0, trial.gap)
        force = (area * trial.pressure)[eligible] - matrix @ opened[eligible]
        gap[eligible] = complementary(matrix, force)
        latest, closed = closed, eligible & (gap == 0)
    raise failure or SolveError(
        f"the contact status did not settle ({int(wrong.sum())} macro-elements still change)"
    )


def _touching(solve: Solve, closed: np.ndarray, gap: np.ndarray) -> tuple[Trial, np.ndarray]:
    """A solve, and what it has closed (k,): the nearest gaps (k,) too, until no body is free.

    Loads are in balance here: a body that nothing presses may be anywhere among its neighbours.
    """
    apart = np.argsort(gap, kind="stable")[np.count_nonzero(gap <= 0) :]
    for nearest in apart[:_FEW]:
        try:
            return solve(closed), closed
        except SolveError:
            closed = closed.copy()
            closed[nearest] = True
    return solve(closed), closed


def _log(iteration: int, closed: np.ndarray, wrong: np.ndarray) -> None:
    text = "contact status: iteration %d, %d of %d closed, %d wrong"
    _LOG.info(text, iteration, int(closed.sum()), len(closed), int(wrong.sum()))
