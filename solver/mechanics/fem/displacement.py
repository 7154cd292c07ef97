"""A displacement with more digits than a number holds."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

Extended = np.longdouble
"""64 bits of mantissa on x86, 113 on most others; no gain where it is double precision."""


@dataclass(frozen=True)
class Displacement:
    """A displacement as free rigid motions of the bodies plus a remainder, the deformation.

    A stiff body on a soft one moves far and strains little. With one number stored for each
    component, its strain would be lost in the rounding of the motion; the remainder keeps it. The
    rigid motion is the motion of the contact surface, so that the remainder is smallest there.
    `motions` (n_dofs, k) are the rigid motions that supports leave free, `fit` (k, n_dofs) yields
    the amounts of the motions in a displacement, `amount` (k,) are this one's. The remainder
    is the sum, never evaluated, of two parts `deformation` (2, n_dofs): the second holds what the
    first loses to rounding, so that each refinement gains its digits in full.

    Without this safeguard (`split` False) there are no motions and the second part stays zero.
    """

    motions: sparse.csr_matrix
    fit: sparse.csr_matrix
    amount: np.ndarray
    deformation: np.ndarray
    split: bool = True

    @classmethod
    def zero(
        cls, motions: sparse.csr_matrix, surface: np.ndarray, split: bool = True
    ) -> "Displacement":
        """No displacement; `surface` (n_dofs,) marks the unknowns of the contact surfaces."""
        motions = motions if split else motions[:, :0]
        seen = sparse.diags(surface.astype(float)) @ motions
        fit = sparse.csr_matrix(np.linalg.pinv((seen.T @ seen).toarray())) @ seen.T
        nothing = np.zeros(motions.shape[1]), np.zeros((2, len(surface)))
        return cls(motions, fit.tocsr(), *nothing, split)

    @property
    def total(self) -> np.ndarray:
        """The displacement (n_dofs,) itself."""
        return self.motions @ self.amount + self.deformation.sum(axis=0)

    def extended(self, seen: np.ndarray) -> np.ndarray:
        """The displacement with all of its digits where `seen` (n_dofs,), zero elsewhere."""
        found, moves = np.zeros(len(seen), dtype=Extended), self.motions[seen].tocoo()
        found[seen] = self.deformation[:, seen].astype(Extended).sum(axis=0)
        carried = moves.data * self.amount.astype(Extended)[moves.col]
        np.add.at(found, np.flatnonzero(seen)[moves.row], carried)
        return found

    def moved(self, change: np.ndarray) -> "Displacement":
        """This displacement with `change` (n_dofs,) added."""
        amount = self.amount + self.fit @ change
        first, second = self.deformation
        # What the amounts lose of a small change stays in the remainder.
        added = change - self.motions @ (amount - self.amount)
        total = first + added
        # What the sum lost (Knuth, The Art of Computer Programming, vol. 2, §4.2.2).
        back = total - first
        lost = (first - (total - back)) + (added - back) if self.split else 0.0
        deformation = np.stack([total, second + lost])
        return Displacement(self.motions, self.fit, amount, deformation, self.split)

    def opening(self, gaps: sparse.csr_matrix, dim: int, differences: bool = True) -> np.ndarray:
        """∫ gap (m,) that it opens, by the gap operator `gaps` (m, n_dofs), dofs dim · node + axis.

        A displacement common to all nodes opens nothing, and is by far the largest part where a
        body sinks deep into a soft one: only differences from one node of each row are summed.
        """
        if not differences:
            return gaps @ self.total
        rows = np.repeat(np.arange(gaps.shape[0]), np.diff(gaps.indptr))
        apart = _apart(self, gaps, rows, dim)
        opened = np.zeros(gaps.shape[0], dtype=Extended)
        np.add.at(opened, rows, gaps.data * apart)
        return opened.astype(float)

    def opening_size(self, gaps: sparse.csr_matrix, dim: int) -> np.ndarray:
        """The sum (m,) of the sizes of the terms of `opening`."""
        rows = np.repeat(np.arange(gaps.shape[0]), np.diff(gaps.indptr))
        sizes = np.abs(gaps.data * _apart(self, gaps, rows, dim)).astype(float)
        return np.bincount(rows, sizes, minlength=gaps.shape[0])


def _apart(
    displacement: Displacement, gaps: sparse.csr_matrix, rows: np.ndarray, dim: int
) -> np.ndarray:
    """The displacement of each entry of the gap operator, relative to its row's first node."""
    first = gaps.indices[np.minimum(gaps.indptr[:-1], len(gaps.indices) - 1)] // dim
    other = dim * first[rows] + gaps.indices % dim
    seen = np.zeros(gaps.shape[1], dtype=bool)
    seen[gaps.indices] = seen[other] = True
    whole = displacement.extended(seen)
    return whole[gaps.indices] - whole[other]
