"""The equations of `LocalAverageContact`: stiffness and gaps of closed facets in one matrix."""

from copy import copy
from typing import Any, Self

import numpy as np
from scipy import sparse
from scipy.sparse import bmat, csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from .errors import SolveError
from .motions import unheld_motion
from .recovery import settled_means
from .status import Trial

# Pressures and gaps of this share of the largest pressure, and of the mesh, are round-off.
_ROUND_OFF = 1e-10
# A pivot stays on the diagonal down to this share of its column's largest: fewer entries fill in.
_PIVOT = 0.01
_SINGULAR = "the system is singular"
_SINGULAR_FROM = 1e14


def numbered(matrix: csr_matrix, unknown: np.ndarray, size: int) -> csr_matrix:
    """A matrix by nodes in the unknowns of the bases, of which there are `size`.

    >>> numbered(csr_matrix([[5.0, 7.0]]), np.array([2, 0]), 3).toarray().tolist()
    [[7.0, 0.0, 5.0]]
    """
    entries = matrix.tocoo()
    places = entries.row, unknown[entries.col]
    return csr_matrix((entries.data, places), shape=(matrix.shape[0], size))


class SaddlePoint:
    """The equations with some facets closed: a saddle point, factored anew for each status.

    `contact` is the `LocalAverageContact`; the other arguments are those of its `solve`, checked.
    """

    def __init__(
        self,
        contact: Any,
        stiffness: csr_matrix,
        force: np.ndarray,
        gaps: csr_matrix,
        imposed: np.ndarray,
        held: np.ndarray,
        ground: csr_matrix | None,
    ):
        self.contact, self.size = contact, float(np.ptp(contact.mesh.p))
        self.force, self.free = force, np.setdiff1d(np.arange(len(force)), held)
        self.imposed = np.zeros(len(force))
        self.imposed[held] = imposed[held]
        motions = contact._bodies.motions
        at_held = [motions[held]]
        if ground is not None:
            at_held.append(ground / abs(ground).max() @ motions)
            stiffness = stiffness + ground
        self.supports = sum((rows.T @ rows).toarray() for rows in at_held)
        self.matrix = stiffness[self.free][:, self.free]
        self.gaps = gaps[:, self.free]
        self.load = (force - stiffness @ self.imposed)[self.free]
        self.before = contact.initial + gaps @ self.imposed
        # Makes the constraints as large as the stiffness, for the digits of the factor.
        self.scale = abs(self.matrix.diagonal()).mean() / abs(self.gaps).max()
        self.factored: tuple[bytes, Any] = b"", None

    def under(self, force: np.ndarray) -> Self:
        """The system under a further force (N,), with the same factor."""
        other = copy(self)
        other.load = self.load + force[self.free]
        return other

    def settled(self, closed: np.ndarray, loads: csr_matrix) -> tuple[np.ndarray, float]:
        """See `settled_means`; `loads` (N, k): forces that a pressure of one adds."""
        before = self.trial(closed).pressure

        def change(force: np.ndarray) -> np.ndarray:
            return np.asarray(self.under(force).trial(closed).pressure - before)

        return settled_means(before, np.zeros(len(self.force)), loads.dot, change)

    def _factor(self, closed: np.ndarray) -> tuple[Any, csc_matrix]:
        key = closed.tobytes()
        if key != self.factored[0]:
            self.factored = key, self._new_factor(closed)
        return self.factored[1]

    def _refuse_free_motion(self, closed: np.ndarray) -> None:
        """SolveError where a body moves freely with these facets closed."""
        contact, bodies = self.contact, self.contact._bodies
        held, smooth = (
            numbered(rows, contact._unknown, len(self.force))[closed] @ bodies.motions
            for rows in (contact._matrix, contact._smooth)
        )
        weight = sparse.diags(1 / contact.covered[closed])
        found = unheld_motion(self.supports, weight @ held, bodies.count, weight @ smooth)
        if found:
            what = f"nothing keeps {bodies.names[found[0]]} from a free motion ({found[1]})"
            count = int((~closed & contact._opposed).sum())
            raise SolveError(f"{what}, with {count} facets open: a support is missing")

    def _new_factor(self, closed: np.ndarray) -> tuple[Any, csc_matrix]:
        self._refuse_free_motion(closed)
        rows = self.scale * self.gaps[closed]
        system = bmat([[self.matrix, rows.T], [rows, None]], "csc")
        try:
            factor = splu(system, "MMD_AT_PLUS_A", _PIVOT, options={"SymmetricMode": True})
        except RuntimeError:
            raise SolveError(_SINGULAR) from None
        # A factor of a singular matrix makes almost any right-hand side as large as this.
        grown = factor.solve(np.random.default_rng(0).standard_normal(system.shape[0]))
        if not np.abs(grown).max() * abs(system).max() < _SINGULAR_FROM:
            raise SolveError(_SINGULAR)
        return factor, system

    def trial(self, closed: np.ndarray) -> Trial:
        """Pressure and gap (k,) with these facets closed."""
        factor, system = self._factor(closed)
        right = np.concatenate([self.load, -self.scale * self.before[closed]])
        found = factor.solve(right)
        for _ in range(2):  # the digits that pivoting lost
            found += factor.solve(right - system @ found)
        free, covered = len(self.free), self.contact.covered
        pressure = np.zeros(len(closed))
        pressure[closed] = -self.scale * found[free:]
        seen = np.where(self.contact._opposed, covered, np.inf)
        self.displacement = self.imposed.copy()
        self.displacement[self.free] = found[:free]
        least = _ROUND_OFF * np.ones(len(closed))
        return Trial(
            pressure=pressure,
            gap=np.where(closed, 0.0, (self.before + self.gaps @ found[:free]) / seen),
            pressure_limit=least * (np.abs(pressure).max(initial=0.0) or 1.0),
            gap_limit=least * self.size,
        )

    def stiffness(self) -> np.ndarray:
        """The forces (e, e) on eligible facets that their average gaps bring up, one at a time."""
        eligible = self.contact._opposed
        covered = self.contact.covered[eligible]
        factor, _ = self._factor(eligible)
        count = int(eligible.sum())
        right = np.zeros((len(self.free) + count, count))
        right[len(self.free) :] = self.scale * np.diag(covered)
        pressure = -self.scale * factor.solve(right)[len(self.free) :]
        return np.asarray(covered[:, None] * pressure)
