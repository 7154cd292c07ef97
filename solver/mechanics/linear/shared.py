"""What the solvers of one part of a problem share, whatever is closed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .unknowns import Unknowns

if TYPE_CHECKING:
    from .condensed_matrix import Symmetric
    from .hierarchy import Hierarchy


class Shared:
    """The hierarchy of one stiffness matrix, set up once for all contact statuses.

    `slow`: whether iterations were so slow that coarse levels take two steps each from then on.
    """

    def __init__(self) -> None:
        """Nothing is set up yet."""
        self._hierarchy: Hierarchy | None = None
        self.slow = False

    def hierarchy(self, matrix: Symmetric, unknowns: Unknowns) -> Hierarchy:
        """The hierarchy of `matrix`, the same at each call until it is closed."""
        if self._hierarchy is None:
            from .hierarchy import Hierarchy  # only where multigrid solves

            self._hierarchy = Hierarchy(matrix, unknowns)
        return self._hierarchy

    def close(self) -> None:
        """Release its memory."""
        self._hierarchy = None
