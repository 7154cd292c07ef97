"""What every part of a model answers, and what it adds to an iterate."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from ....case.acting import Step
from ....mechanics.fem.block import Block
from ....mechanics.fem.displacement import Displacement

Nodal: TypeAlias = Any
"""An array of values at nodes, or 0 where there is nothing."""


class Term:
    """What a part adds to the equations at an iterate. What is not stated is nothing."""

    force: Nodal = 0.0
    """Internal forces (n, dim)."""
    ground: Nodal = 0.0
    """Those of them that act on the ground, outside of bodies."""
    condensed: np.ndarray | None = None
    """Forces (n_dofs,) by what the inner unknowns violate, once these are eliminated."""
    rounded: tuple[Nodal, float] = 0.0, 0.0
    """Sizes (n,) of what `force` sums, and of stresses that are summed in double precision."""
    energy: Nodal = 0.0
    """Strain energy (n,) beside the work of internal forces, each at a node of its body."""

    def advanced(self, change: np.ndarray) -> Any:  # noqa: ARG002
        """The inner unknowns once the displacement changes by `change` (n_dofs,)."""
        return None

    def stress(self, blocks: list[Block]) -> Nodal:  # noqa: ARG002
        """The part of the stress at nodes (n, 6)."""
        return 0.0

    def by_cell(self, cells: dict[str, np.ndarray]) -> dict[str, np.ndarray]:  # noqa: ARG002
        """The mean stress at the nodes of cells in mixed form (n, n_nodes), by type."""
        return {}


class ModelPart:
    """A part of a model beside its elastic cells. What is not stated is nothing."""

    holder = ""
    """The name of the reaction, for a part that acts on the ground."""
    stiffness: sparse.csr_matrix | None = None
    """What it adds to the stiffness (n_dofs, n_dofs)."""
    diagonal: Nodal = 0.0
    """That on the diagonal (n_dofs,), as far as forces are rounded by it."""
    resisting: sparse.csr_matrix | None = None
    """Rows (k, n_dofs) that resist the motions of bodies."""
    factored = ""
    """Why multigrid does not serve."""
    loaded: np.ndarray = np.empty(0, dtype=int)
    """Nodes whose bodies it loads, also where they are held whole."""
    note: tuple[str, str] | None = None
    """A line of the plan: what, and why."""

    def load(self, step: Step) -> Nodal:  # noqa: ARG002
        """Forces (n, dim) on the bodies in a step."""
        return 0.0

    def start(self, step: Step) -> Any:  # noqa: ARG002
        """The inner unknowns at no displacement."""
        return None

    def term(self, displacement: Displacement, inner: Any) -> Term:
        """What it adds at a displacement and the inner unknowns."""
        raise NotImplementedError
