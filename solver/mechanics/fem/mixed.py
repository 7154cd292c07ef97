"""The mixed displacement–pressure form, for nearly incompressible material.

As ν → ½, λ grows without bound: s = λ div u loses its digits, since div u is what is left of
strains that cancel, and cells lock that cannot keep their volume point by point. Here s, the
volumetric part of σ = 2μ ε(u) + s I, is an unknown of its own:

    ∫ 2μ ε(u):ε(v) + ∫ s div v = f(v) for all v,      ∫ q (div u − s/λ) = 0 for all q.

s is constant in a cell as it was meshed, its pieces after a cut together; but linear in QUAD9 and
HEXA27, and linear between the vertices of TRIA6 and QUAD8, continuous within a body's material, the
term in s/λ then taken at vertices. Uniform s is in all of them, so the patch test stays exact. On
TRIA3 and TETRA4 a constant s is the displacement form itself: they gain digits, but they lock.

With K of 2μ ε alone, B of q div u and C = diag(∫ q²/λ), elimination of s leaves K + Bᵀ C⁻¹ B,
positive definite and, but for s at vertices, as sparse as ever. It is only what is factored: s is
kept, and refined by the residuals of both equations, in which no large numbers cancel.

Sources: Boffi, Brezzi, Fortin, Mixed Finite Element Methods and Applications, 2013, §8; Bathe,
Finite Element Procedures, §4.4–4.5; for s at vertices Bonet, Burton, Commun. Numer. Meth. Engng 14
(1998) 437–449.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ...lac.cells.catalogue import CellType
from ...lac.cells.shape import shape_functions
from .block import Block, degrees_of_freedom
from .elasticity import chunks, shapes_in

_CELLS_AT_ONCE = 2048


@dataclass(frozen=True)
class _Cells:
    """Cells of one type in mixed form.

    `block`, with their λ; `rows` (n,) their places among all cells of that type; `unknowns` (n, k)
    the numbers of what s is made of in each; `flux` (n, k, n_nodes, dim) the integrals of q ∂N/∂x;
    `at_nodes` (n, n_nodes, k) the values of the q at the nodes. `common` (dim,): the directions in
    which a displacement common to all nodes has no divergence.
    """

    block: Block
    rows: np.ndarray
    unknowns: np.ndarray
    flux: np.ndarray
    at_nodes: np.ndarray
    common: np.ndarray

    @property
    def name(self) -> str:
        return self.block.type.name

    @property
    def cells(self) -> np.ndarray:
        return self.block.cells


class MeanStress:
    """The unknown s of all cells in mixed form: `size` numbers, none where no cell is.

    `divergence` is B (size, n_dofs), `compliance` C (size,).
    """

    def __init__(self, parts: list[_Cells], compliance: np.ndarray, n_nodes: int, dim: int):
        self._parts, self._shape = parts, (n_nodes, dim)
        self.compliance = compliance
        self.divergence = self._assembled()

    @property
    def size(self) -> int:
        """How many unknowns s has."""
        return len(self.compliance)

    @property
    def n_cells(self) -> int:
        """How many cells are in mixed form."""
        return sum(len(part.cells) for part in self._parts)

    def stiffness(self) -> sparse.csr_matrix:
        """The part (n_dofs, n_dofs) of s in the stiffness once it is eliminated: Bᵀ C⁻¹ B."""
        scaled = sparse.diags(1 / self.compliance) @ self.divergence
        return (self.divergence.T @ scaled).tocsr()

    def on_nodes(self, values: np.ndarray) -> np.ndarray:
        """Values (size,) of the unknowns at nodes (n,), each at one of a cell that has it."""
        node = np.zeros(self.size, dtype=int)
        for part in self._parts:
            node[part.unknowns] = part.cells[:, :1]
        return np.bincount(node, values, minlength=self._shape[0])

    def force(self, stress: np.ndarray) -> np.ndarray:
        """Internal forces (n_nodes, dim) of s (size,): Bᵀ s."""
        return (self.divergence.T @ stress).reshape(self._shape)

    def cancellation(self, stress: np.ndarray) -> tuple[np.ndarray, float]:
        """As `stress.sizes`: the sizes of what `force` sums (n_nodes,), and of s."""
        size = np.abs(stress)
        sizes = (abs(self.divergence).T @ size).reshape(self._shape)
        return np.linalg.norm(sizes, axis=1), float(size.max(initial=0.0))

    def defect(self, deformation: np.ndarray, stress: np.ndarray) -> np.ndarray:
        """C s − B u (size,), summed cell by cell from differences of displacement.

        `deformation` (parts, n_nodes, dim) are parts whose sum is the displacement.
        """
        defect = self.compliance * stress
        for part in self._parts:
            nodal = deformation[:, part.cells]
            difference = (nodal - nodal[:, :, :1] * part.common).sum(axis=0)
            opened = np.einsum("ckai,cai->ck", part.flux, difference, optimize=True)
            defect -= np.bincount(part.unknowns.ravel(), opened.ravel(), minlength=self.size)
        return defect

    def integrals(
        self, points: np.ndarray, values: Callable[[Block], np.ndarray], count: int
    ) -> np.ndarray:
        """∫ q v (count, size) of `values` (count, n, q) at the quadrature points of a block."""
        found = np.zeros((count, self.size))
        for part in self._parts:
            for some in chunks(part.block, self._shape[1]):
                block = part.block.of(some)
                reference, weights = block.rule
                measure = (
                    shapes_in(
                        points, block.type, block.cells, reference, block.axisymmetric
                    ).measure
                    * weights
                )
                inside = _functions(points, block, block.cells, reference, measure)
                opened = np.einsum("cq,cqk,lcq->lck", measure, inside, values(block), optimize=True)
                for total, added in zip(found, opened, strict=True):
                    np.add.at(total, part.unknowns[some], added)
        return found

    def condensed_force(self, defect: np.ndarray) -> np.ndarray:
        """The part (n_dofs,) of a defect (size,) in the equations that are left: Bᵀ C⁻¹ defect."""
        return self.divergence.T @ (defect / self.compliance)

    def change(self, displacement: np.ndarray, defect: np.ndarray) -> np.ndarray:
        """The change of s (size,) along with one of displacement (n_dofs,) that mends a defect."""
        return (self.divergence @ displacement - defect) / self.compliance

    def by_cell(self, stress: np.ndarray, cells: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The values of s at the nodes of each cell (n, n_nodes) by type; NaN in displacement form.

        `cells` are all cells by type; types without mixed cells are left out.
        """
        values: dict[str, np.ndarray] = {}
        for part, nodal in self._nodal(stress):
            found = values.setdefault(part.name, np.full(cells[part.name].shape, np.nan))
            found[part.rows] = nodal
        return values

    def nodal_stress(self, stress: np.ndarray, blocks: Sequence[Block]) -> np.ndarray:
        """The part of s in the stress at nodes (n_nodes, 6), averaged over the cells around."""
        n = self._shape[0]
        total, count = np.zeros(n), np.zeros(n)
        for part, nodal in self._nodal(stress):
            total += np.bincount(part.cells.ravel(), nodal.ravel(), minlength=n)
        for block in blocks:
            count += np.bincount(block.cells.ravel(), minlength=n)
        added = np.zeros((n, 6))
        added[:, :3] = (total / np.maximum(count, 1))[:, None]
        return added

    def holding(self, nodal: np.ndarray) -> np.ndarray:
        """The s (size,) that takes the values (n_nodes,) at the nodes, as near as it can."""
        stress = np.zeros(self.size)
        for part in self._parts:
            read = np.linalg.pinv(part.at_nodes)
            stress[part.unknowns] = np.einsum("cka,ca->ck", read, nodal[part.cells])
        return stress

    def _nodal(self, stress: np.ndarray) -> Iterator[tuple[_Cells, np.ndarray]]:
        for part in self._parts:
            yield part, np.einsum("cak,ck->ca", part.at_nodes, stress[part.unknowns])

    def _assembled(self) -> sparse.csr_matrix:
        n, dim = self._shape
        total = sparse.csr_matrix((self.size, n * dim))
        for part in self._parts:
            dofs = degrees_of_freedom(part.cells, dim)
            rows = np.repeat(part.unknowns.ravel(), dofs.shape[1])
            columns = np.repeat(dofs[:, None], part.unknowns.shape[1], axis=1).ravel()
            entries = (part.flux.ravel(), (rows, columns))
            total = total + sparse.coo_matrix(entries, shape=total.shape).tocsr()
        return total


def split(
    points: np.ndarray,
    blocks: Sequence[Block],
    mixed: Sequence[np.ndarray],
    meshed: Sequence[np.ndarray],
) -> tuple[list[Block], MeanStress]:
    """Part the cells into those in displacement form and those in mixed form.

    `points` (n, dim); by block, `mixed` (n_cells,) says which cells are in mixed form and `meshed`
    (n_cells,) numbers the cells they were before the cut. Returns the blocks, those in mixed form
    with λ = 0, since 2μ ε is all that displacement alone makes of stress there, and s.
    """
    whole: list[Block] = []
    parts: list[tuple[Block, np.ndarray, np.ndarray]] = []
    for block, chosen, number in zip(blocks, mixed, meshed, strict=True):
        if not chosen.any():
            whole.append(block)
            continue
        if not chosen.all():
            whole.append(block.of(~chosen))
        part = block.of(chosen)
        whole.append(replace(part, lame=np.zeros(len(part.cells))))
        rows = np.arange(len(chosen)) if block.rows is None else block.rows
        parts.append((part, rows[chosen], number[chosen]))
    return whole, _mean_stress(points, parts)


def _mean_stress(
    points: np.ndarray, parts: Sequence[tuple[Block, np.ndarray, np.ndarray]]
) -> MeanStress:
    n_nodes, dim = points.shape
    numbers, size = _numbered([_keys(block, meshed, dim) for block, _, meshed in parts])
    cells, compliance = [], np.zeros(size)
    for (block, rows, _), unknowns in zip(parts, numbers, strict=True):
        flux, at_nodes, weight = _integrals(points, block)
        common = np.ones(dim)
        common[: int(block.axisymmetric)] = 0.0
        cells.append(_Cells(block, rows, unknowns, flux, at_nodes, common))
        soft = weight / block.lame[:, None]
        compliance += np.bincount(unknowns.ravel(), soft.ravel(), minlength=size)
    return MeanStress(cells, compliance, n_nodes, dim)


def _at_vertices(kind: CellType) -> bool:
    return kind.order == 2 and kind.dim == 2 and not kind.centred


def _is_linear(kind: CellType) -> bool:
    return kind.order == 2 and kind.centred


def _keys(block: Block, meshed: np.ndarray, dim: int) -> np.ndarray:
    """What identifies the unknowns s of a block's cells: (n, k, 3) numbers."""
    if _at_vertices(block.type):
        # s jumps where the material changes.
        material = np.stack([block.lame, block.shear], axis=1).view(np.int64)
        own, number = material[:, None], block.cells[:, : block.type.n_vertices]
    else:
        count = dim + 1 if _is_linear(block.type) else 1
        number = np.repeat(meshed[:, None], count, axis=1)
        own = np.stack([np.arange(count), np.full(count, -1)], axis=1)[None]
    own = np.broadcast_to(own, (*number.shape, 2))
    return np.concatenate([number[..., None], own], axis=2)


def _numbered(keys: list[np.ndarray]) -> tuple[list[np.ndarray], int]:
    """Keys (n, k, 3) by block as consecutive numbers (n, k), and how many there are."""
    if not keys:
        return [], 0
    flat = np.concatenate([key.reshape(-1, 3) for key in keys])
    different, number = np.unique(flat, axis=0, return_inverse=True)
    ends = np.cumsum([key.shape[0] * key.shape[1] for key in keys])[:-1]
    pieces = np.split(number.ravel(), ends)
    return [p.reshape(k.shape[:2]) for p, k in zip(pieces, keys, strict=True)], len(different)


def _integrals(points: np.ndarray, block: Block) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fluxes (n, k, n_nodes, dim), values at nodes (n, n_nodes, k) and ∫ q² (n, k).

    At vertices the sum of its row, ∫ q, stands for ∫ q².
    """
    starts = range(0, len(block.cells), _CELLS_AT_ONCE)
    found = [_chunk(points, block, block.cells[i : i + _CELLS_AT_ONCE]) for i in starts]
    flux, at_nodes, weight = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
    return flux, at_nodes, weight


def _chunk(
    points: np.ndarray, block: Block, cells: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    reference, weights = block.rule
    found = shapes_in(points, block.type, cells, reference, block.axisymmetric)
    measure = found.measure * weights
    places = np.concatenate([reference, block.type.nodes])
    values = _functions(points, block, cells, places, measure)
    inside, at_nodes = values[:, : len(weights)], values[:, len(weights) :]
    flux = np.einsum("cq,cqk,cqai->ckai", measure, inside, found.divergence, optimize=True)
    once = np.ones_like(inside) if _at_vertices(block.type) else inside
    return flux, at_nodes, np.einsum("cq,cqk,cqk->ck", measure, inside, once, optimize=True)


def _functions(
    points: np.ndarray, block: Block, cells: np.ndarray, places: np.ndarray, measure: np.ndarray
) -> np.ndarray:
    """The functions that s is made of in each cell, (n, places, k), at reference places.

    Those linear in the cell are made orthogonal, with the weights `measure` (n, q) at the first q.
    """
    if _at_vertices(block.type):
        values = shape_functions(block.type.skeleton).values(places)
        return np.broadcast_to(values, (len(cells), *values.shape))
    one = np.ones((len(cells), len(places), 1))
    if not _is_linear(block.type):
        return one
    corner = points[cells] - points[cells].mean(axis=1, keepdims=True)
    shape = shape_functions(block.type.name).values(places)
    functions = np.concatenate([one, np.einsum("qa,cad->cqd", shape, corner)], axis=2)
    weight = np.zeros(functions.shape[:2])
    weight[:, : measure.shape[1]] = measure
    for k in range(1, functions.shape[2]):
        for j in range(k):
            base, other = functions[:, :, j], functions[:, :, k]
            share = (weight * base * other).sum(axis=1) / (weight * base**2).sum(axis=1)
            functions[:, :, k] -= share[:, None] * base
    return functions
