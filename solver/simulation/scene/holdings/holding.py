"""What every holding of a model answers: what it fixes, joins and pulls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ....mechanics.fem.supports import Fixed, FreeMotion
from .frame import Frame


class Holding:
    """Something that holds or joins bodies. What is not stated is nothing."""

    keys: Sequence[str] = ()
    """The keys of the case file of what `link` joins."""
    holder = ""
    """The name of the reaction, where `link` joins nodes that nothing fixes."""
    frames: Mapping[str, Frame] = {}
    """The rigid bodies by name."""
    moving: np.ndarray | None = None
    """Nodes (n,), a mask, of rigid bodies that move, and so need no stiffness."""

    def fixed(
        self,
        before: Mapping[str, Fixed],  # noqa: ARG002
        name: str | None = None,  # noqa: ARG002
    ) -> dict[str, Fixed]:
        """The displacements it imposes, by key of the case file, after those of others `before`.

        With a `name` of the steps of a case, only values of that name are not zero.
        """
        return {}

    def link(self, free: FreeMotion) -> FreeMotion:
        """What it leaves free of a motion, or frees again; LinkError where it cannot."""
        return free

    def force(self, name: str | None = None) -> Any:  # noqa: ARG002
        """The forces (n, dim) on what it holds, in all or of a `name`; 0 where there are none."""
        return 0.0
