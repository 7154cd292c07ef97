"""Cells of one type with their material: what elasticity is assembled from.

Quadrature makes the patch test exact, which asks that the integrals of the shape functions'
physical gradients be exact. The degrees below are the lowest found to suffice for straight-edged
cells; on pyramids a conical product of Gauss and Gauss–Jacobi points turns the integrals of the
rational gradients into polynomials (Stroud, Approximate Calculation of Multiple Integrals, 1971,
§2.4–2.5).
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ...lac.cells.catalogue import BY_NAME, CellType
from ...lac.cells.quadrature import Rule, product_rule, simplex_rule

# degree along each part of the cell: (linear, quadratic)
_DEGREES = {
    "SEG": ((3,), (5,)),
    "TRIA": ((2,), (4,)),
    "QUAD": ((3,), (5,)),
    "TETRA": ((1,), (2,)),
    "HEXA": ((3,), (5,)),
    "PENTA": ((4, 3), (6, 5)),
    "PYRA": ((3, 3), (5, 4)),
}


@cache
def volume_rule(name: str, straight: bool = True) -> Rule:
    """Points (n, dim) and weights (n,) for the stiffness of the cell type `name`.

    Cells whose edges are not `straight` need more points where the type is TETRA10; the rules of
    the others suffice for bent cells as well.
    """
    shape = BY_NAME[name].shape
    if name == "TETRA10" and not straight:
        return simplex_rule(3, 4)
    degrees = _DEGREES[shape][BY_NAME[name].order - 1]
    if shape in ("TRIA", "TETRA"):
        return simplex_rule(BY_NAME[name].dim, degrees[0])
    if shape == "PENTA":
        return product_rule(simplex_rule(2, degrees[0]), simplex_rule(1, degrees[1]))
    if shape == "PYRA":
        return _conical(*degrees)
    line = simplex_rule(1, degrees[0])
    rule = line
    for _ in range(BY_NAME[name].dim - 1):
        rule = product_rule(rule, line)
    return rule


def _conical(base: int, axis: int) -> Rule:
    """`base` Gauss points each way over the square, `axis` Gauss–Jacobi points to the apex."""
    from scipy.special import roots_jacobi

    x, u = np.polynomial.legendre.leggauss(base)
    t, v = roots_jacobi(axis, 2, 0)  # weight (1 − t)²: the shrinking cross-section
    z = (t + 1) / 2
    points = [[a * (1 - h), b * (1 - h), h] for h in z for b in x for a in x]
    return np.array(points), np.einsum("k,j,i->kji", v / 8, u, u).ravel()


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
