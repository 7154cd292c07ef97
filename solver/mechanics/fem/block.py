"""Cells of one type with their material: what elasticity is assembled from."""

from dataclasses import dataclass, replace

import numpy as np

from ...lac.cells.catalogue import CellType
from .volume_rules import volume_rule


@dataclass(frozen=True)
class Block:
    """Cells of one type with their material.

    `cells` (n, n_nodes) node numbers; `lame` and `shear` (n,) Lamé's λ and μ, in units of stress
    (plane strain in 2D); `straight`: all their edges are; `axisymmetric`: sections of rings; `rows`
    (n,): their places among all cells of the type, where it matters.
    """

    type: CellType
    cells: np.ndarray
    lame: np.ndarray
    shear: np.ndarray
    straight: bool = True
    axisymmetric: bool = False
    rows: np.ndarray | None = None

    @property
    def rule(self) -> tuple[np.ndarray, np.ndarray]:
        """The quadrature points (q, dim) and weights (q,) of the block."""
        return volume_rule(self.type.name, self.straight)

    @property
    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """The point (1, dim) in the middle of its cells, with all the weight (1,) of the rule."""
        reference, weights = self.rule
        return (weights @ reference / weights.sum())[None], weights.sum()[None]

    def of(self, chosen: np.ndarray | slice) -> "Block":
        """The chosen (n,) of its cells."""
        cells, lame, shear = self.cells[chosen], self.lame[chosen], self.shear[chosen]
        rows = None if self.rows is None else self.rows[chosen]
        return replace(self, cells=cells, lame=lame, shear=shear, rows=rows)
