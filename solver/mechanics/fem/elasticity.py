"""Linear elasticity over mixed cells: stiffness, internal forces, stress at nodes.

One block per cell type; every degree of freedom belongs to a node (`dof = dim · node + component`).
Axisymmetric blocks lie in a meridian plane of radius x ≥ 0 and height y: their forces are those on
whole rings, and their third axis is the circumference, with the hoop strain u_x / x.
Source: Bathe, Finite Element Procedures, §5.3. Works on arrays alone.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np
from scipy import sparse

from ...lac.cells.catalogue import CellType
from ...lac.cells.faces import circumference
from ...lac.cells.shape import invert, shape_functions
from ...lac.errors import SolveError
from ...lac.threads import prefetch
from . import cell_loops
from .block import Block, CellSum

# Bytes of gradients, and of matrices, handled at once: so few stay in the processor's cache.
_CHUNK_BYTES, _MATRIX_BYTES = 1 << 22, 3 << 20
_ALL = slice(None)

Found = TypeVar("Found")


def lame_parameters(young: np.ndarray, poisson: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lamé's λ and μ from Young's modulus and Poisson's ratio (3D and plane strain)."""
    shear = young / (2 * (1 + poisson))
    return 2 * shear * poisson / (1 - 2 * poisson), shear


def physical_gradients(
    points: np.ndarray, cells: np.ndarray, kind: CellType, reference: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gradients (n, q, n_nodes, dim) and Jacobian determinants (n, q) at reference points (q, dim).

    Raises SolveError where a Jacobian is not positive, naming how many cells.
    """
    found = shapes_in(points, kind, cells, reference)
    return found.gradient, found.measure


def _slopes(nodal: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """Slopes (n, q, d, dim) of nodal values (n, n_nodes, d), given gradients (q, n_nodes, dim).

    Each component is contiguous in memory: what follows runs along cells and points.
    """
    by_component = np.ascontiguousarray(np.moveaxis(nodal, 2, 0))[:, None]
    return np.moveaxis(by_component @ np.ascontiguousarray(gradients.T), (0, 1), (2, 3))


def hoop_values(
    points: np.ndarray, cells: np.ndarray, kind: CellType, reference: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """N / r (n, q, n_nodes) and 2πr (n, q) at reference points (q, dim) of axisymmetric cells.

    The first makes hoop strains u_r / r of radial displacements at nodes.
    """
    values = shape_functions(kind.name).values(reference)
    place = values @ points[cells]
    return values / place[..., :1], circumference(place)


def with_hoop(slope: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """Displacement gradients (n, q, 2, 2) and hoop strains (n, q) as (n, q, 3, 3)."""
    whole = np.zeros((*strain.shape, 3, 3), dtype=slope.dtype)
    whole[..., :2, :2], whole[..., 2, 2] = slope, strain
    return whole


@dataclass(frozen=True)
class Shapes:
    """What strains and integrals of n cells are made of at q points.

    `on_reference` (q, n_nodes, dim), gradients on the reference cell; `inverse` (n, q, dim, dim) of
    the Jacobians; `measure` (n, q) without the weights of quadrature; `hoop` (n, q, n_nodes), N / r
    of axisymmetric cells.
    """

    on_reference: np.ndarray
    inverse: np.ndarray
    measure: np.ndarray
    hoop: np.ndarray | None

    @cached_property
    def gradient(self) -> np.ndarray:
        """Gradients (n, q, n_nodes, dim) in the cells."""
        return np.matmul(self.on_reference, np.ascontiguousarray(self.inverse))

    def slopes(self, apart: np.ndarray, radial: np.ndarray) -> np.ndarray:
        """The gradients (n, q, dim, dim) of a displacement, (n, q, 3, 3) in axisymmetric cells.

        `apart` (n, n_nodes, dim): its differences from one node of each cell; `radial` (n, n_nodes)
        its first component.
        """
        slope = _slopes(apart, self.on_reference)
        slope = np.einsum("cqij,cqjk->cqik", slope, self.inverse)
        if self.hoop is None:
            return slope
        return with_hoop(slope, np.einsum("cqa,ca->cq", self.hoop, radial))

    @property
    def divergence(self) -> np.ndarray:
        """The divergence (n, q, n_nodes, dim) of each component of displacement at a node."""
        if self.hoop is None:
            return self.gradient
        found = self.gradient.copy()
        found[..., 0] += self.hoop
        return found


def shapes_in(
    points: np.ndarray,
    kind: CellType,
    cells: np.ndarray,
    reference: np.ndarray,
    axisymmetric: bool = False,
) -> Shapes:
    """The shapes of cells (n, n_nodes) at reference points (q, dim).

    Raises SolveError where a Jacobian is not positive, naming how many cells.
    """
    gradients, corner = shape_functions(kind.name).gradients(reference), points[cells]
    measure, inverse = invert(_slopes(corner - corner[:, :1], gradients))
    if (bad := (measure <= 0).any(axis=1)).any():
        raise SolveError(f"{int(bad.sum())} {kind.name} cells are inverted or degenerate")
    if not axisymmetric:
        return Shapes(gradients, inverse, measure, None)
    hoop, around = hoop_values(points, cells, kind, reference)
    return Shapes(gradients, inverse, measure * around, hoop)


def chunks(block: Block, dim: int) -> Iterator[slice]:
    """Parts of a block whose gradients fit into the processor's cache."""
    points, _ = block.rule
    return _parts(block, len(points) * block.type.n_nodes * dim * 8, _CHUNK_BYTES)


def by_part(
    block: Block, dim: int, found: Callable[[slice], Found]
) -> Iterator[tuple[slice, Found]]:
    """The `chunks` of a block, and what is `found` for each, in their order; threads find it."""
    return prefetch(lambda part: (part, found(part)), chunks(block, dim))


def _parts(block: Block, size: int, limit: int) -> Iterator[slice]:
    """Parts of a block's cells that need `limit` bytes at most, one cell `size` bytes."""
    step = max(1, limit // size)
    for start in range(0, len(block.cells), step):
        yield slice(start, start + step)


def element_matrices(points: np.ndarray, block: Block, part: slice = _ALL) -> np.ndarray:
    """Stiffness matrices (n, dim · n_nodes, dim · n_nodes) of a part of a block's cells."""
    dim, nodes = points.shape[1], block.type.n_nodes
    reference, weights = block.rule
    found = shapes_in(points, block.type, block.cells[part], reference, block.axisymmetric)
    measure = weights * found.measure
    products = _products(found.gradient, measure)
    volume = products if found.hoop is None else _products(found.divergence, measure)
    shear = block.shear[part, None, None, None, None]
    stiffness = volume * block.lame[part, None, None, None, None]
    stiffness += shear * np.swapaxes(products, 2, 4)
    trace = block.shear[part, None, None] * np.einsum("caibi->cab", products)
    for i in range(dim):
        stiffness[:, :, i, :, i] += trace
    if found.hoop is not None:
        hoop = _products(found.hoop[..., None], measure)[:, :, 0, :, 0]
        stiffness[:, :, 0, :, 0] += 2 * block.shear[part, None, None] * hoop
    return stiffness.reshape(-1, nodes * dim, nodes * dim)


def _products(values: np.ndarray, measure: np.ndarray) -> np.ndarray:
    """∫ v vᵀ (n, n_nodes, d, n_nodes, d) of values (n, q, n_nodes, d), measure (n, q)."""
    flat = values.reshape(*values.shape[:2], -1)
    weighted = flat * measure[:, :, None]
    products = np.matmul(np.swapaxes(weighted, 1, 2), flat)
    return products.reshape(len(values), *values.shape[2:], *values.shape[2:])


def stiffness(points: np.ndarray, blocks: list[Block], single: bool = False) -> sparse.bsr_matrix:
    """The stiffness matrix (n_dofs, n_dofs), symmetric, a block for each pair of nodes.

    Both halves are stored; `assembly.selected` makes the matrix of some degrees of freedom.
    `single`: in single precision.
    """
    n, dim = points.shape
    total = CellSum([block.cells for block in blocks], n, dim, single)
    for block in blocks:
        if cell_loops.serve(n, blocks):
            cell_loops.add_stiffness(points, block, *total.arrays)
            continue
        matrices, size = partial(element_matrices, points, block), dim * block.type.n_nodes
        total.add(block.cells, matrices, _parts(block, 8 * size**2, _MATRIX_BYTES))
    return total.matrix


def internal_force(
    points: np.ndarray, blocks: list[Block], displacement: np.ndarray, extended: bool = False
) -> np.ndarray:
    """Internal forces (n_nodes, dim) of a displacement (n_nodes, dim), summed cell by cell.

    Strains are taken from differences of displacement within the cell: the large common part of a
    displacement, which carries no strain, then costs no digits, as it would in the assembled
    product K·u. A displacement may come in several parts (parts, n_nodes, dim), of which it is the
    sum to more digits than one number holds: their differences are summed, not they themselves.
    `extended`: in extended precision, as the result is then; some fifty times slower.
    """
    n, dim = points.shape
    points, displacement = in_precision(points, displacement, extended)
    force = np.zeros((dim, n), dtype=points.dtype)
    if not displacement.any():
        return force.T.copy()
    if cell_loops.serve(n, blocks) and not extended:
        force = force.reshape(n, dim)
        for block in blocks:
            cell_loops.add_forces(points, block, displacement.reshape(-1, n, dim), force)
        return force
    for block in blocks:
        forces = partial(_cell_forces, points, block, displacement)
        for part, nodal in by_part(block, dim, forces):
            for component, added in zip(force, nodal, strict=True):
                np.add.at(component, block.cells[part].ravel(), added.ravel())
    return force.T.copy()


def _cell_forces(
    points: np.ndarray, block: Block, displacement: np.ndarray, part: slice
) -> np.ndarray:
    """The forces (dim, n, n_nodes) of a displacement on the nodes of a part of a block's cells."""
    dim, (reference, weights) = points.shape[1], block.rule
    found = shapes_in(points, block.type, block.cells[part], reference, block.axisymmetric)
    stress = stress_in(found, displacement, block, part)
    stress *= (weights * found.measure)[:, :, None, None]
    pulled = np.einsum("cqij,cqkj->ikcq", stress[..., :dim, :dim], found.inverse)
    nodal = (pulled @ np.moveaxis(found.on_reference, 2, 0)).sum(axis=1)
    if found.hoop is not None:
        nodal[0] += np.einsum("cqa,cq->ca", found.hoop, stress[..., 2, 2])
    return np.asarray(nodal)


def in_precision(
    points: np.ndarray, displacement: np.ndarray, extended: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Both in double precision, or `extended`."""
    kind = np.longdouble if extended else float
    return np.asarray(points, dtype=kind), np.asarray(displacement, dtype=kind)


def stress_in(found: Shapes, displacement: np.ndarray, block: Block, part: slice) -> np.ndarray:
    """In-plane or 3D stress tensors (n, q, dim, dim) of a displacement (parts, n_nodes, dim).

    `found`: the shapes in a part of the block's cells. Tensors of axisymmetric cells are 3D, the
    third axis the circumference.
    """
    cells, lame, shear = block.cells[part], block.lame[part], block.shear[part]
    nodal = displacement.reshape(-1, *displacement.shape[-2:])[:, cells]
    slope = found.slopes((nodal - nodal[:, :, :1]).sum(axis=0), nodal[..., 0].sum(axis=0))
    stress = shear[:, None, None, None] * (slope + np.swapaxes(slope, 2, 3))
    pressure = lame[:, None] * np.einsum("cqii->cq", slope)
    for i in range(slope.shape[-1]):
        stress[:, :, i, i] += pressure
    return stress
