"""An approximate solution of the contact problem with given closed multipliers."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from ..mechanics.fem.cell_sizes import Sizes, sizes
from ..mechanics.fem.elasticity import internal_force, stiffness
from .constraints import ContactConstraints
from .displacement import Displacement
from .scene import Scene

# What an iterate knows that neither the force nor the status changes.
_OF_DISPLACEMENT = "defect", "internal", "springs", "sizes"


@dataclass(frozen=True, kw_only=True)
class ContactIterate:
    """Displacement and mean stress (of cells in mixed form) under loads `force` (n, dim).

    The gaps of the multipliers `closed` (k,) are to vanish; see `condensation.Iterate`. `swelling`
    (size,) of initial strains; see `mechanics.fem.initial`. `extended`: internal forces are summed
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
