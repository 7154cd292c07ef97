"""Cells of one type with their material, their quadrature, and the sparse sum of their matrices.

Quadrature makes the patch test exact, which asks that the integrals of the shape functions'
physical gradients be exact. The degrees below are the lowest found to suffice for straight-edged
cells; on pyramids a conical product of Gauss and Gauss–Jacobi points turns the integrals of the
rational gradients into polynomials (Stroud, Approximate Calculation of Multiple Integrals, 1971,
§2.4–2.5).

Sums: each block of entries is added straight to its place. Which nodes share a cell is known before
any matrix is, so the sum's pattern is made first, and no list of all the entries of all cells is
ever held: memory is for the sum and a few cells only. Every degree of freedom belongs to a node
(`dof = dim · node + component`), and every pair of nodes that share a cell has a block: an index
for dim² entries.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy import sparse

from ...lac.cells.catalogue import BY_NAME, CellType
from ...lac.cells.shape import Rule, conical_rule, product_rule, simplex_rule
from ...lac.threads import prefetch

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
        return conical_rule(*degrees)
    line = simplex_rule(1, degrees[0])
    rule = line
    for _ in range(BY_NAME[name].dim - 1):
        rule = product_rule(rule, line)
    return rule


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


# Nodes whose neighbours are found at once.
_NODES_AT_ONCE = 1 << 16


class CellSum:
    """A sum of matrices over cells: `cells` are the nodes (n, n_nodes) of all of them, by type.

    `single`: the sum is in single precision.
    """

    def __init__(self, cells: Sequence[np.ndarray], n_nodes: int, dim: int, single: bool = False):
        self._dim = dim
        self._near = _neighbours(cells, n_nodes)
        kind = np.float32 if single else float
        self._data = np.zeros((self._near.nnz, dim, dim), dtype=kind)

    def add(
        self,
        cells: np.ndarray,
        matrices: Callable[[slice], np.ndarray],
        parts: Iterable[slice] = (slice(None),),
    ) -> None:
        """Add the matrices of cells (n, n_nodes), part by part.

        `matrices` yields those of a part of them, (n, dim · n_nodes, dim · n_nodes).
        """
        size = self._dim**2

        def placed(part: slice) -> tuple[np.ndarray, np.ndarray]:
            place, values = self._places(cells[part]), matrices(part)
            n, k, _ = place.shape
            values = values.reshape(n, k, self._dim, k, self._dim).swapaxes(2, 3)
            entries = size * place[..., None].astype(np.intp) + np.arange(size)
            # In the precision of the sum: NumPy adds mixed ones four times slower.
            return entries.ravel(), values.astype(self._data.dtype, copy=False).ravel()

        for entries, values in prefetch(placed, parts):
            np.add.at(self._data.reshape(-1), entries, values)

    def _places(self, cells: np.ndarray) -> np.ndarray:
        """The numbers (n, n_nodes, n_nodes) of the blocks of cells (n, n_nodes)."""
        n, k = cells.shape
        # A search takes time in proportion to all the rows that it is given.
        nodes, row = np.unique(cells, return_inverse=True)
        rows = np.repeat(row.reshape(n, k), k, axis=1).ravel()
        found = self._near[nodes][rows, np.tile(cells, k).ravel()]
        return np.asarray(found).reshape(n, k, k)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where its rows start (n_nodes + 1,), the columns (nnz,), the blocks (nnz, dim, dim)."""
        return self._near.indptr, self._near.indices, self._data

    @property
    def matrix(self) -> sparse.bsr_matrix:
        """The sum (dim · n_nodes, dim · n_nodes) in blocks, both halves stored, rows sorted."""
        starts, columns, blocks = self.arrays
        size = self._dim * self._near.shape[0]
        return sparse.bsr_matrix((blocks, columns, starts), shape=(size, size))


def selected(matrix: sparse.spmatrix, kept: np.ndarray) -> sparse.csr_matrix:
    """The rows and columns `kept` (k,), ascending, of a matrix (n, n), entry by entry."""
    whole = matrix.tocsr()
    chosen = np.zeros(matrix.shape[0], dtype=bool)
    chosen[kept] = True
    there = chosen[whole.indices]
    there &= np.repeat(chosen, np.diff(whole.indptr))
    before = np.concatenate([[0], np.cumsum(there)])[whole.indptr]
    number = np.cumsum(chosen, dtype=np.int32) - 1
    arrays = whole.data[there], number[whole.indices[there]], before[np.r_[0, kept + 1]]
    return sparse.csr_matrix(arrays, shape=(len(kept), len(kept)))


def degrees_of_freedom(cells: np.ndarray, dim: int) -> np.ndarray:
    """Degrees of freedom (n, dim · n_nodes) of cells (n, n_nodes)."""
    return (dim * cells[:, :, None] + np.arange(dim)).reshape(len(cells), -1)


def _neighbours(cells: Sequence[np.ndarray], n_nodes: int) -> sparse.csr_matrix:
    """Which nodes share a cell (n_nodes, n_nodes), rows sorted; the entries are numbered."""
    nodes = np.concatenate([np.empty(0, np.int32), *(c.ravel().astype(np.int32) for c in cells)])
    sizes = np.repeat([c.shape[1] for c in cells], [len(c) for c in cells])
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    ones = np.ones(len(nodes), dtype=bool)
    owned = sparse.csr_matrix((ones, nodes, starts), shape=(len(sizes), n_nodes))
    around = owned.T.tocsr()

    def near(first: int) -> tuple[np.ndarray, np.ndarray]:
        found = around[first : first + _NODES_AT_ONCE] @ owned
        found.sort_indices()
        return found.indices.astype(np.int32, copy=False), np.diff(found.indptr)

    parts = list(prefetch(near, range(0, n_nodes, _NODES_AT_ONCE)))
    columns = np.concatenate([np.empty(0, np.int32), *(indices for indices, _ in parts)])
    counts = np.concatenate([[0], *(count for _, count in parts)])
    arrays = np.arange(len(columns), dtype=np.int32), columns, np.cumsum(counts, dtype=np.int32)
    return sparse.csr_matrix(arrays, shape=(n_nodes, n_nodes))
