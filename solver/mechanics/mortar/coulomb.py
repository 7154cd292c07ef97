"""Coulomb's law on the contact alone, found by Newton's method with the whole coupling b = μp.

With z = (gap, slip by tangent), means over macro-elements, S the forces that unit jumps bring up
with everything closed and stuck, λ₀ the forces at z = 0, the forces are λ = λ₀ + S z: pressures and
tractions times areas. For a = λ − c z with any c > 0 the law is

    λ_n = max(0, a_n),    λ_t = a_t, or b a_t / |a_t| where that is shorter, b = μ max(0, a_n).

Its derivative has d b = μ d a_n, which bounds from the iteration before leave out, and across the
slip b/|a_t| (1 − d dᵀ). S is a matrix, or, for a large contact, a product by one back-solve; then
Newton's systems are solved by GMRES.

Source: Alart, Curnier, A mixed formulation for frictional contact problems prone to Newton like
solution methods, CMAME 92 (1991) 353–375.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from itertools import islice
from typing import Self, TypeAlias

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

# Iterations, and the fault of the law by the largest force that ends them: at once, or where it
# falls no more; from so many on a larger one, as of a stiff slave, whose S has lost digits. There
# each step gains little: as long as it gains there may be more iterations.
_MOST, _EXACT, _ENOUGH, _STALLED = 60, 1e-13, 1e-9, 0.3
_LATE, _ROUNDED, _LONGEST = 15, 1e-6, 300
# Forces below this share of those that close everything are as good as none.
_OPEN = 1e-6
# Below this share of the forces at work forces are round-off.
_NOTHING = 1e-12
# Slips that would bring up less than this share of the largest force are rounding.
_STUCK = 1e-10
# Imposed gaps that would bring up so many times the forces lose digits of these.
_WIDE = 1e4
# A coefficient with which all that is closed sticks.
_ROUGH = 1e6
UNIQUE = 1.0
"""Up to this coefficient the first state found is taken for the only one."""
# Jumps that bring up so many times the forces wanted are, up to the rounding of S, the motion of a
# free body. The springs that hold it have a share of the stiffness.
_FREE, _WEAK = 1e6, 1e-8
# A step of the line search is halved down to this.
_SHORTEST = 1e-3
# Of a way between forces, the share that is tried first; of any way, the smallest part, and how
# many are tried: ways that lead to a state took 14 at most.
_FIRST, _SMALLEST, _TRIED = 0.1, 1e-4, 50
# Where S is a product: the fault that Newton's method ends with, the shares of a fault that GMRES
# leaves of a large one and at most, its restart and restarts.
_INEXACT, _SHARE, _LARGEST, _RESTART, _RESTARTS = 1e-6, 0.1, 1e-2, 200, 5


@dataclass(frozen=True)
class _Law:
    """The law at one z: its fault (r,), forces (r,), which are closed (m,) and slip (f,).

    `unit` (k, f): a_t / |a_t|, `share` (f,): b / |a_t|.
    """

    fault: np.ndarray
    forces: np.ndarray
    closed: np.ndarray
    slips: np.ndarray
    unit: np.ndarray
    share: np.ndarray


_Found: TypeAlias = tuple[_Law, np.ndarray, int]
"""The law fulfilled, its z (r,), and the steps."""


class CoulombContact:
    """The contact of m gaps and of f macro-elements with friction, which slip along k tangents.

    `stiffness` S (r, r), symmetric, a matrix or a product: rows of the gaps come first; `diagonal`
    (r,), positive, is about that of S; `friction` μ (f,); `of` (f,): the gap each one has; `rows`
    (k, f): those of its slips, by tangent, in any order.
    """

    def __init__(
        self,
        stiffness: np.ndarray | LinearOperator,
        diagonal: np.ndarray,
        friction: np.ndarray,
        of: np.ndarray,
        rows: np.ndarray,
    ):
        self.stiffness, self.friction, self.of = stiffness, friction, of
        self.m, self.rows = len(diagonal) - rows.size, list(rows)
        self.c = diagonal.copy()
        # One for all tangents of a macro-element, or its traction would not be along its slip.
        for rows in self.rows:
            self.c[rows] = np.mean([diagonal[each] for each in self.rows], axis=0)

    def solve(
        self,
        forces: np.ndarray,
        guess: np.ndarray | float = 0.0,
        last: np.ndarray | None = None,
        scale: float = 0.0,
    ) -> tuple[np.ndarray, np.ndarray, int] | None:
        """Forces λ (r,), jumps z (r,) and the iterations, for λ₀ = `forces` (r,); None where none.

        From z = `guess` (r,) by plain steps; else from where all is closed and slips, as after a
        long way; else from where all that is closed sticks; else with a line search; else by way of
        forces between the `last` ones (r,) and λ₀, or of larger or smaller coefficients. Where μ is
        above 1 there may be several states: then from the first two, and the state in which most of
        the contact stays closed is taken. Forces that are round-off of a `scale` are none.

        Springs without coupling in n and t, pressed by 2 and pulled by 1.5, μ = 1/2: it slips by
        what the bound 1 leaves of the pull.

        >>> one, friction = np.ones(2), np.array([0.5])
        >>> contact = CoulombContact(np.eye(2), one, friction, np.array([0]), np.array([[1]]))
        >>> found, jump, _ = contact.solve(np.array([2.0, 1.5]))
        >>> found.round(12).tolist(), (-jump[1:]).round(12).tolist()
        ([2.0, 1.0], [0.5])
        """
        size = np.abs(forces).max(initial=0.0) or 1.0
        size = scale if size < _NOTHING * scale else size
        start, rest = forces / size, np.zeros(len(forces)) + guess / size
        attempts = self._attempts(rest, start, None if last is None else last / size)
        known = list(filter(None, islice(attempts, 1)))
        # More than all of the contact cannot stay closed.
        if self.friction.max(initial=0.0) > UNIQUE and not any(k[0].closed.all() for k in known):
            known += filter(None, islice(attempts, 1))
        known = known or list(islice(filter(None, attempts), 1))
        if not known:
            return None
        law, z, count = max(known, key=lambda one: int(one[0].closed.sum()))
        return law.forces * size, z * size, count

    def _attempts(
        self, rest: np.ndarray, start: np.ndarray, last: np.ndarray | None
    ) -> Iterator[_Found | None]:
        """What Newton's method finds in the ways that `solve` names, each tried when asked for."""
        yield self._newton(rest, start, False)
        yield self._newton(self._sliding(start), start, False)
        stuck = self._sticking(start)
        if stuck is not None:
            yield self._newton(stuck, start, False)
            yield self._newton(stuck, start, True)
        yield self._newton(rest, start, True)
        if last is not None:
            yield self._along(last, start)
        if stuck is not None:
            yield self._by_friction(stuck, start)
        yield self._from_smooth(start)

    def _with(self, friction: np.ndarray) -> Self:
        """The same contact with other coefficients (f,)."""
        other = copy(self)
        other.friction = friction
        return other

    def _by_friction(self, z: np.ndarray, start: np.ndarray) -> _Found | None:
        """The law fulfilled by way of larger coefficients, from all sticking at `z` (r,) on."""
        end = float(np.log(_ROUGH))

        def found_at(gone: float, z: np.ndarray) -> _Found | None:
            larger = self.friction * np.exp(end - gone)
            return self._with(larger)._newton(z, start, False)

        return _by_way(z, end, 1.0, found_at)

    def _from_smooth(self, start: np.ndarray) -> _Found | None:
        """The law fulfilled by way of smaller coefficients, from none on."""
        smooth = self._with(np.zeros_like(self.friction))
        z = smooth._sliding(start)
        found = smooth._newton(z, start, False) or smooth._newton(z, start, True)

        def found_at(gone: float, z: np.ndarray) -> _Found | None:
            return self._with(gone * self.friction)._newton(z, start, False)

        return None if found is None else _by_way(found[1], 1.0, _FIRST, found_at)

    def _sticking(self, start: np.ndarray) -> np.ndarray | None:
        """The jumps z (r,) where all that is closed sticks, however large its traction."""
        rough = self._with(np.full_like(self.friction, _ROUGH))
        found = rough._newton(np.zeros(len(start)), start, False)
        return None if found is None else found[1]

    def _along(self, last: np.ndarray, start: np.ndarray) -> _Found | None:
        """The law fulfilled by way of forces between the `last` ones and `start` (r,)."""

        def found_at(gone: float, z: np.ndarray) -> _Found | None:
            return self._newton(z, (1 - gone) * last + gone * start, False)

        return _by_way(np.zeros(len(start)), 1.0, _FIRST, found_at)

    def _sliding(self, start: np.ndarray) -> np.ndarray:
        """The jumps z (r,) with all closed and slipping the way that the forces at rest pull."""
        along = np.array([start[rows] for rows in self.rows])
        size, rows = np.linalg.norm(along, axis=0), np.concatenate(self.rows)
        unit = (along / np.where(size > 0, size, 1.0)).ravel()
        bound = np.tile(self.friction, len(self.rows)) * unit
        of = np.tile(self.of, len(self.rows))

        def fault(_: np.ndarray, forces: np.ndarray) -> np.ndarray:
            return forces[rows] - bound[:, None] * forces[of]

        z = np.zeros(len(start))
        z[rows] = self._solved(fault, rows, bound * start[of] - start[rows])
        return z

    def _newton(
        self, z: np.ndarray, start: np.ndarray, searches: bool, at: np.ndarray | float = 0.0
    ) -> _Found | None:
        """The law fulfilled, its z (r,), and the steps from `z` on; `searches`: along each step.

        The forces `start` (r,) are those at the jumps `at` (r,).
        """
        best, exact = np.inf, _EXACT if isinstance(self.stiffness, np.ndarray) else _INEXACT
        for count in range(_LONGEST):
            law = self._law(z, start + self.stiffness @ (z - at))
            fault = float(np.abs(law.fault).max(initial=0.0))
            enough = _ENOUGH if count < _LATE else _ROUNDED
            if fault < exact or (fault < enough and fault > _STALLED * best):
                return law, z, count
            if count >= _MOST and fault >= best:
                return None
            best = min(best, fault)
            if not np.isfinite(step := self._step(law)).all():
                return None
            z = z + (self._length(z, step, law) if searches else 1.0) * step
        return None

    def corrected(
        self, forces: np.ndarray, jump: np.ndarray, scale: float = 0.0
    ) -> tuple[np.ndarray, float]:
        """The jumps (r,) after a Newton step from `forces` and `jump` that need not be those of S.

        Also the fault before it, by the largest force; where nothing presses these are round-off of
        forces of a `scale`.
        """
        size = max(np.abs(forces).max(initial=0.0), _OPEN * scale) or 1.0
        law = self._law(jump / size, forces / size)
        return jump + size * self._step(law), float(np.abs(law.fault).max(initial=0.0))

    def again(self, forces: np.ndarray, jump: np.ndarray) -> np.ndarray | None:
        """The jumps (r,) that fulfil the law, from `forces` (r,) at `jump` (r,); None where none.

        Where bodies are far apart, the forces that close all are so large that the law is lost in
        their rounding: those that act are the measure here.
        """
        size = np.abs(forces).max(initial=0.0) or 1.0
        start, z = forces / size, jump / size
        found = self._newton(z, start, False, z) or self._newton(z, start, True, z)
        return None if found is None else found[1] * size

    def opens_wide(self, forces: np.ndarray, jump: np.ndarray) -> bool:
        """Whether imposed gaps are so wide that their rounding counts beside the forces."""
        unit = (self.c * np.abs(jump))[: self.m].max(initial=0.0)
        return bool(unit > _WIDE * np.abs(forces).max(initial=0.0))

    def kept(self, closed: np.ndarray) -> np.ndarray:
        """The rows (r,) of closed gaps (m,), and of their slips."""
        rows = np.zeros(len(self.c), dtype=bool)
        rows[: self.m] = closed
        for along in self.rows:
            rows[along] = closed[self.of]
        return rows

    def statuses(self, forces: np.ndarray, jump: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which gaps are closed (m,), and which macro-elements slip (f,).

        Of a pair that the law makes complementary the larger one decides, in one unit: closed where
        the force is more than what the gap would bring up, slip where the slip's is more than what
        is spare of the bound. What is at its bound and moves by rounding alone sticks.
        """
        m, unit = self.m, self.c * jump
        none = _STUCK * np.abs(forces).max(initial=0.0)
        closed = forces[:m] > unit[:m]
        along, far = (np.linalg.norm([v[r] for r in self.rows], axis=0) for v in (forces, unit))
        bound = self.friction * np.maximum(forces[:m][self.of], 0.0)
        return closed, closed[self.of] & (far > bound - along + none)

    def _length(self, z: np.ndarray, step: np.ndarray, law: _Law) -> float:
        """The share of a step that lowers the fault; all of it where none does."""
        length, now, along = 1.0, np.linalg.norm(law.fault), self.stiffness @ step
        while length > _SHORTEST:
            then = self._law(z + length * step, law.forces + length * along)
            if np.linalg.norm(then.fault) < (1 - 1e-4 * length) * now:
                return length
            length /= 2
        return 1.0

    def _law(self, z: np.ndarray, forces: np.ndarray) -> _Law:
        a, m = forces - self.c * z, self.m
        normal = np.maximum(a[:m], 0.0)
        along = np.array([a[rows] for rows in self.rows])
        size, bound = np.linalg.norm(along, axis=0), self.friction * normal[self.of]
        slips, length = size > bound, np.where(size > 0, size, 1.0)
        unit = along / length
        fault = forces.copy()
        fault[:m] -= normal
        for rows, u, t in zip(self.rows, unit, along, strict=True):
            fault[rows] -= np.where(slips, bound * u, t)
        return _Law(fault, forces, a[:m] > 0, slips, unit, bound / length)

    def _step(self, law: _Law) -> np.ndarray:
        """The Newton step (r,) at a law; NaN where its derivative is singular."""

        def fault(z: np.ndarray, forces: np.ndarray) -> np.ndarray:
            slope, found, m = forces - self.c[:, None] * z, forces.copy(), self.m
            found[:m] -= law.closed[:, None] * slope[:m]
            pressed = (self.friction * law.closed[self.of])[:, None] * slope[self.of]
            for i, rows in enumerate(self.rows):
                sliding = law.unit[i][:, None] * pressed
                for j, other in enumerate(self.rows):
                    across = law.share * ((i == j) - law.unit[i] * law.unit[j])
                    sliding = sliding + across[:, None] * slope[other]
                found[rows] -= np.where(law.slips[:, None], sliding, slope[rows])
            return found

        return self._solved(fault, np.arange(len(self.c)), -law.fault)

    def _solved(
        self,
        fault: Callable[[np.ndarray, np.ndarray], np.ndarray],
        rows: np.ndarray,
        wanted: np.ndarray,
    ) -> np.ndarray:
        """The jumps (s,) in `rows` whose linear `fault` is the `wanted` one (s,).

        Where these leave a body free to move, weak springs hold it: it goes where forces push it.
        `fault` takes jumps (r, j) and the forces (r, j) they bring up, column by column.
        """
        size, count = len(self.c), len(rows)
        if isinstance(self.stiffness, np.ndarray):
            unit = np.zeros((size, count))
            unit[rows, np.arange(count)] = 1.0
            scale = np.where(self.c > 0, self.c, 1.0)[rows]
            matrix = fault(unit, self.stiffness[:, rows]) / scale
            most = _FREE * np.abs(wanted).max(initial=0.0)
            for held in (False, True):
                matrix[np.diag_indices(count)] += _WEAK * held
                with suppress(np.linalg.LinAlgError):
                    found = np.linalg.solve(matrix, wanted)
                    if held or np.abs(found).max(initial=0.0) <= most:
                        return np.asarray(found / scale)
            return np.full(count, np.nan)

        def product(values: np.ndarray) -> np.ndarray:
            z = np.zeros((size, 1))
            z[rows, 0] = values.ravel() / self.c[rows]
            return fault(z, (self.stiffness @ z[:, 0])[:, None])[:, 0]

        matrix = LinearOperator((count, count), matvec=product, dtype=float)
        left = np.clip(_SHARE * np.abs(wanted).max(initial=0.0), _INEXACT, _LARGEST)
        most = {"restart": _RESTART, "maxiter": _RESTARTS}
        return np.asarray(gmres(matrix, wanted, rtol=left, **most)[0] / self.c[rows])


def _by_way(
    z: np.ndarray,
    end: float,
    step: float,
    found_at: Callable[[float, np.ndarray], _Found | None],
) -> _Found | None:
    """What is found at the `end` of a way from 0, from `z` (r,) on; None where none leads there.

    `found_at` takes how far it has gone, and the z found before. Its parts, the first one `step`,
    are as large as succeed.
    """
    gone = 0.0
    for _ in range(_TRIED):
        after = min(gone + step, end)
        if (found := found_at(after, z)) is not None:
            if after == end:
                return found
            z, gone, step = found[1], after, 2 * step
        elif (step := step / 2) < _SMALLEST:
            break
    return None
