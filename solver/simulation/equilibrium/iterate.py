"""An approximate solution with given closed multipliers."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...mechanics.fem.displacement import Displacement
from ...mechanics.fem.elasticity import internal_force, stiffness
from ...mechanics.fem.stress import Sizes, sizes
from ..scene.parts.part import Term
from ..scene.scene import Scene
from .constraints import ContactConstraints

# What an iterate knows that neither the force nor the status changes; the same of its constraints.
_OF_DISPLACEMENT = "terms", "elastic", "sizes"
_OF_GAPS = "_integrals", "opening_size"


@dataclass(frozen=True, kw_only=True)
class ContactIterate:
    """Displacement under loads `force` (n, dim), and the `inner` unknowns of the scene's parts.

    The gaps of the multipliers `closed` (k,) are to vanish; see `condensation.Iterate`.
    `extended`: internal forces are summed in extended precision.
    """

    scene: Scene
    constraints: ContactConstraints
    closed: np.ndarray
    force: np.ndarray
    displacement: Displacement
    inner: tuple[Any, ...]
    extended: bool = False

    @property
    def deformation(self) -> np.ndarray:
        """Both parts (2, n, dim) of the displacement less a rigid motion of each body."""
        return self.displacement.deformation.reshape(2, *self.force.shape)

    @cached_property
    def terms(self) -> list[Term]:
        """What the scene's parts add."""
        pairs = zip(self.scene.parts, self.inner, strict=True)
        return [part.term(self.displacement, inner) for part, inner in pairs]

    @cached_property
    def elastic(self) -> np.ndarray:
        """Internal forces (n, dim) of the blocks of cells."""
        points, blocks = self.scene.points, self.scene.blocks
        if self.scene.options.safeguards.differences:
            return internal_force(points, blocks, self.deformation, self.extended)
        return (stiffness(points, blocks) @ self.displacement.total).reshape(self.force.shape)

    @property
    def internal(self) -> np.ndarray:
        """Internal forces (n, dim), those of all parts included."""
        return sum((term.force for term in self.terms), self.elastic)

    @property
    def ground(self) -> np.ndarray:
        """The part (n, dim) of the internal forces that acts on the ground, outside of bodies."""
        return sum((term.ground for term in self.terms), np.zeros(self.force.shape))

    @cached_property
    def sizes(self) -> Sizes:
        """The size of its stresses, and of the terms that they are summed from."""
        return sizes(self.scene.points, self.scene.blocks, self.deformation)

    @property
    def gap(self) -> np.ndarray:
        """The average gap (k,); zero for multipliers that are out of contact."""
        known = self.constraints.eligible | self.constraints.unloaded
        covered = np.where(known, self.constraints.covered, np.inf)
        return self._integrals / covered

    @cached_property
    def _integrals(self) -> np.ndarray:
        """∫ gap (k,)."""
        dim, differences = self.scene.points.shape[1], self.scene.options.safeguards.differences
        opened = self.displacement.opening(self.constraints.gaps, dim, differences)
        return self.constraints.initial + opened

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
        """The forces (n_free,) to balance once the inner unknowns are eliminated."""
        for term in self.terms:
            if term.condensed is not None:
                force = force + self.scene.free.gathered(term.condensed)
        return force

    def violation(self) -> np.ndarray:
        """By how much ∫ gap of the closed multipliers is below zero."""
        return -self._integrals[self.closed]

    def advanced(self, change: np.ndarray) -> "ContactIterate":
        """The iterate with the free unknowns changed by `change` (n_free,)."""
        move = self.scene.free.spread(change)
        inner = tuple(term.advanced(move) for term in self.terms)
        moved = replace(self, displacement=self.displacement.moved(move), inner=inner)
        return moved._with_cached(self, "sizes")

    def under(self, force: np.ndarray) -> "ContactIterate":
        """The same displacement under another force (n, dim), a correction of this one.

        What does not depend on the force is not computed anew, and the sizes of stresses stay those
        that they were, also after the iterates that follow: they scale round-off alone.
        """
        return replace(self, force=force)._with_cached(self, *_OF_DISPLACEMENT, *_OF_GAPS)

    def with_closed(
        self, closed: np.ndarray, constraints: ContactConstraints | None = None
    ) -> "ContactIterate":
        """The same displacement, others closed (k,), and with other constraints if given."""
        other = replace(self, closed=closed, constraints=constraints or self.constraints)
        return other._with_cached(self, *_OF_DISPLACEMENT, *(() if constraints else _OF_GAPS))

    def _with_cached(self, other: "ContactIterate", *names: str) -> "ContactIterate":
        known = vars(other)
        vars(self).update({name: known[name] for name in names if name in known})
        return self
