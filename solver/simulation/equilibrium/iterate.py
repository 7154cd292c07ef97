"""An approximate solution with given closed multipliers, with more digits than a number holds."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from ...mechanics.fem.elasticity import internal_force, stiffness
from ...mechanics.fem.stress import Sizes, sizes
from ..scene.scene import Scene
from .constraints import ContactConstraints

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

    def moved(self, change: np.ndarray) -> "Displacement":
        """This displacement with `change` (n_dofs,) added."""
        more = self.fit @ change
        first, second = self.deformation
        added = change - self.motions @ more
        total = first + added
        # What the sum lost (Knuth, The Art of Computer Programming, vol. 2, §4.2.2).
        back = total - first
        lost = (first - (total - back)) + (added - back) if self.split else 0.0
        deformation = np.stack([total, second + lost])
        return Displacement(self.motions, self.fit, self.amount + more, deformation, self.split)

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
    whole = np.zeros(gaps.shape[1], dtype=Extended)
    whole[seen] = displacement.deformation[:, seen].astype(Extended).sum(axis=0)
    whole[seen] += (displacement.motions @ displacement.amount)[seen]
    return whole[gaps.indices] - whole[other]


# What an iterate knows that neither the force nor the status changes.
_OF_DISPLACEMENT = "defect", "internal", "springs", "sizes"


@dataclass(frozen=True, kw_only=True)
class ContactIterate:
    """Displacement and mean stress (of cells in mixed form) under loads `force` (n, dim).

    The gaps of the multipliers `closed` (k,) are to vanish; see `condensation.Iterate`. `swelling`
    (size,) of initial strains; see `mechanics.fem.loads`. `extended`: internal forces are summed
    in extended precision.
    """

    scene: Scene
    constraints: ContactConstraints
    closed: np.ndarray
    force: np.ndarray
    displacement: Displacement
    mean_stress: np.ndarray
    swelling: np.ndarray
    extended: bool = False

    @property
    def deformation(self) -> np.ndarray:
        """Both parts (2, n, dim) of the displacement less a rigid motion of each body."""
        return self.displacement.deformation.reshape(2, *self.force.shape)

    @cached_property
    def defect(self) -> np.ndarray:
        """By how much the mean stress differs from λ (div u − tr ε₀); see `mechanics.fem.mixed`."""
        return self.scene.mean.defect(self.deformation, self.mean_stress) + self.swelling

    @cached_property
    def internal(self) -> np.ndarray:
        """Internal forces (n, dim), those in springs included."""
        points, blocks = self.scene.points, self.scene.blocks
        if self.scene.options.safeguards.differences:
            internal = internal_force(points, blocks, self.deformation, self.extended)
        else:
            product = stiffness(points, blocks) @ self.displacement.total
            internal = product.reshape(self.force.shape)
        return internal + self.scene.mean.force(self.mean_stress) + self.springs

    @cached_property
    def springs(self) -> np.ndarray:
        """The forces (n, dim) in springs to the ground."""
        return (self.scene.springs @ self.displacement.total).reshape(self.force.shape)

    @cached_property
    def sizes(self) -> Sizes:
        """The size of its stresses, and of the terms that they are summed from."""
        return sizes(self.scene.points, self.scene.blocks, self.deformation)

    @property
    def gap(self) -> np.ndarray:
        """The average gap (k,); zero for multipliers that are out of contact."""
        known = self.constraints.eligible | self.constraints.unloaded
        covered = np.where(known, self.constraints.covered, np.inf)
        return (self.constraints.initial + self._opening(self.constraints.gaps)) / covered

    def _opening(self, gaps: sparse.csr_matrix) -> np.ndarray:
        dim = self.scene.points.shape[1]
        return self.displacement.opening(gaps, dim, self.scene.options.safeguards.differences)

    @cached_property
    def opening_size(self) -> np.ndarray:
        """The sum of the sizes (k,) of what changes ∫ gap."""
        dim = self.scene.points.shape[1]
        return self.displacement.opening_size(self.constraints.gaps, dim)

    def residual(self) -> np.ndarray:
        """Loads less internal forces (n_free,), contact forces left out."""
        left = (self.force - self.internal).astype(float, copy=False).ravel()
        return self.scene.free.gathered(left)

    def condensed(self, force: np.ndarray) -> np.ndarray:
        """The forces (n_free,) to balance once the change of mean stress is eliminated."""
        if not self.scene.mean.size:
            return force
        return force + self.scene.free.gathered(self.scene.mean.condensed_force(self.defect))

    def violation(self) -> np.ndarray:
        """By how much ∫ gap of the closed multipliers is below zero."""
        gaps, initial = self.constraints.gaps[self.closed], self.constraints.initial[self.closed]
        return -(initial + self._opening(gaps))

    def advanced(self, change: np.ndarray) -> "ContactIterate":
        """The iterate with the free unknowns changed by `change` (n_free,)."""
        move = self.scene.free.spread(change)
        stress = self.mean_stress + self.scene.mean.change(move, self.defect)
        moved = replace(self, displacement=self.displacement.moved(move), mean_stress=stress)
        return moved._with_cached(self, "sizes")

    def under(self, force: np.ndarray) -> "ContactIterate":
        """The same displacement under another force (n, dim), a correction of this one.

        What does not depend on the force is not computed anew, and the sizes of stresses stay those
        that they were, also after the iterates that follow: they scale round-off alone.
        """
        return replace(self, force=force)._with_cached(self, *_OF_DISPLACEMENT)

    def with_closed(self, closed: np.ndarray) -> "ContactIterate":
        """The same displacement with other multipliers closed (k,)."""
        return replace(self, closed=closed)._with_cached(self, *_OF_DISPLACEMENT)

    def _with_cached(self, other: "ContactIterate", *names: str) -> "ContactIterate":
        known = vars(other)
        vars(self).update({name: known[name] for name in names if name in known})
        return self
