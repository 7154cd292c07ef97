"""Stress at nodes and along directions, as xx, yy, zz, xy, yz, xz; the sizes of what cells sum.

The sizes of stress, strain and gradients are those in the middle of each cell.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...lac.cells.catalogue import CellType
from ...lac.cells.shape import shape_functions
from . import cell_loops
from .block import Block
from .elasticity import Shapes, by_part, in_precision, shapes_in, stress_in

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")


def traction(stress: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """σ·v (n, dim) of stress (n, 6) and vectors (n, dim)."""
    xx, yy, zz, xy, yz, xz = stress.T
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    dim = vector.shape[-1]
    return np.einsum("ijn,nj->ni", tensor[:dim, :dim], vector)


def normal_stress(stress: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """d·σ·d (n,) of stress (n, 6) and unit directions (dim,) or (n, dim)."""
    direction = np.broadcast_to(direction, (len(stress), direction.shape[-1]))
    return np.einsum("ni,ni->n", traction(stress, direction), direction)


def nodal_stress(
    points: np.ndarray, blocks: list[Block], displacement: np.ndarray, extended: bool = False
) -> np.ndarray:
    """Stress (n_nodes, 6) as xx, yy, zz, xy, yz, xz, the mean over the cells around each node.

    Of axisymmetric cells zz is the hoop stress.

    In each cell the stress at the points of a low-order rule is fitted by the linear shape
    functions of its vertices (least squares) and read at its nodes; gradients at a node itself
    would not exist at a pyramid's apex. `extended`: strains are taken in extended precision.
    """
    n, dim = points.shape
    points, displacement = in_precision(points, displacement, extended)
    total, count = np.zeros((n, 6)), np.zeros(n)
    for block in blocks:
        count += np.bincount(block.cells.ravel(), minlength=n)
        if cell_loops.serve(n, blocks) and not extended:
            fit, parts = extrapolation(block.type, block.rule[0]), displacement.reshape(-1, n, dim)
            cell_loops.add_nodal_stress(points, block, parts, fit, total)
            continue
        stress = partial(_at_nodes, points, block, displacement)
        for part, nodal in by_part(block, dim, stress):
            places = 6 * block.cells[part][:, :, None] + np.arange(6)
            np.add.at(total.reshape(-1), places.ravel(), nodal.ravel())
    total /= np.maximum(count, 1)[:, None]
    return total


def _at_nodes(
    points: np.ndarray, block: Block, displacement: np.ndarray, part: slice
) -> np.ndarray:
    """The stress (n, n_nodes, 6) at the nodes of a part of a block's cells, seen from each cell."""
    reference, _ = block.rule
    found = shapes_in(points, block.type, block.cells[part], reference, block.axisymmetric)
    stress = stress_in(found, displacement, block, part)
    full = _voigt(stress, block.lame[part], block.shear[part])
    fit = extrapolation(block.type, reference)
    return np.asarray(np.einsum("aq,cqs->cas", fit, full, optimize=True))


def extrapolation(kind: CellType, reference: np.ndarray) -> np.ndarray:
    """The matrix (n_nodes, q): values at quadrature points to values at nodes, by a linear fit."""
    if len(reference) == 1:
        return np.ones((kind.n_nodes, 1))
    linear = shape_functions(kind.skeleton)
    vertices = linear.type.n_nodes
    at_nodes = np.vstack([np.eye(vertices), linear.values(kind.nodes[vertices:])])
    return at_nodes @ np.linalg.pinv(linear.values(reference))


def _voigt(stress: np.ndarray, lame: np.ndarray, shear: np.ndarray) -> np.ndarray:
    """(n, q, dim, dim) tensors as (n, q, 6); in plane strain σ_zz = ν (σ_xx + σ_yy)."""
    full = np.zeros((*stress.shape[:2], 6))
    for i in range(stress.shape[-1]):
        full[:, :, i] = stress[:, :, i, i]
    full[:, :, 3] = stress[:, :, 0, 1]
    if stress.shape[-1] == 3:
        full[:, :, 4], full[:, :, 5] = stress[:, :, 1, 2], stress[:, :, 0, 2]
    else:
        poisson = (lame / (2 * (lame + shear)))[:, None]
        full[:, :, 2] = poisson * (full[:, :, 0] + full[:, :, 1])
    return full


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """How large stresses are, and the terms that forces and stresses are summed from.

    `forces` (n_nodes,), `highest`: the sizes of what is summed up to forces, and to stresses at
    most. A sum keeps no more digits than its largest term leaves: times the unit of rounding, these
    are the errors of `internal_force` and of stresses. `slender`: the largest stress that these
    forces correspond to, which is large on the small faces of a slender cell. `stress` (n_nodes,):
    the largest norm of the stress itself in the cells around each node.
    """

    forces: np.ndarray
    highest: float
    slender: float
    stress: np.ndarray


def sizes(points: np.ndarray, blocks: list[Block], displacement: np.ndarray) -> Sizes:
    """Taken at the middle of each cell, from a displacement (n_nodes, dim) or several parts."""
    force, largest = np.zeros((2, len(points)))
    parts = displacement.reshape(-1, *points.shape)
    highest = slender = 0.0
    whole = None if cell_loops.serve(len(points), blocks) else parts.sum(axis=0)
    for block in blocks:
        if whole is None:
            term, on_small_faces = cell_loops.add_sizes(points, block, parts, force, largest)
            highest, slender = max(highest, term), max(slender, on_small_faces)
            continue
        seen = partial(_cell_sizes, points, block, whole)
        for part, (forces, term, on_small_faces, norm) in by_part(block, points.shape[1], seen):
            nodes = block.cells[part].ravel()
            np.add.at(force, nodes, forces.ravel())
            np.maximum.at(largest, nodes, np.repeat(norm, block.type.n_nodes))
            highest, slender = max(highest, term), max(slender, on_small_faces)
    return Sizes(forces=force, highest=highest, slender=slender, stress=largest)


def _cell_sizes(
    points: np.ndarray, block: Block, displacement: np.ndarray, part: slice
) -> tuple[np.ndarray, float, float, np.ndarray]:
    """By cell, for `sizes`: forces (n, n_nodes), the highest and slender stress, norms (n,)."""
    cells = block.cells[part]
    found, volume = _in_the_middle(points, block, part)
    slope = np.linalg.norm(found.gradient[:, 0], axis=2)
    nodal = displacement[cells]
    apart = np.linalg.norm(nodal - nodal[:, :1], axis=2)
    stiff = block.lame[part] + 2 * block.shear[part]
    terms = stiff * np.einsum("ca,ca->c", slope, apart)
    if found.hoop is not None:
        around = np.abs(found.hoop[:, 0]) * np.abs(nodal[..., 0])
        terms += stiff * around.sum(axis=1)
    extent = np.linalg.norm(np.ptp(points[cells], axis=1), axis=1)
    on_small_faces = terms * extent * slope.max(axis=1)
    norm = np.linalg.norm(stress_in(found, displacement, block, part), axis=(2, 3))[:, 0]
    forces = (volume * terms)[:, None] * slope
    return forces, float(terms.max(initial=0.0)), float(on_small_faces.max(initial=0.0)), norm


def largest_strain(
    points: np.ndarray, blocks: list[Block], displacement: np.ndarray
) -> tuple[float, float]:
    """The largest principal strain, by size, and rotation (radians) in the middle of the cells.

    Of a displacement (n_nodes, dim). Both are small where linear elasticity holds.
    """
    largest = np.zeros(2)
    for block in blocks:
        seen = partial(_cell_strain, points, block, displacement)
        for _, of_part in by_part(block, points.shape[1], seen):
            largest = np.maximum(largest, of_part)
    return float(largest[0]), float(largest[1])


def _cell_strain(
    points: np.ndarray, block: Block, displacement: np.ndarray, part: slice
) -> tuple[float, float]:
    found, _ = _in_the_middle(points, block, part)
    nodal = displacement[block.cells[part]]
    slope = found.slopes(nodal - nodal[:, :1], nodal[..., 0])[:, 0]
    turned = np.swapaxes(slope, 1, 2)
    size = np.linalg.norm(slope + turned, axis=(1, 2))
    # The largest principal value is at least this share of the norm.
    near = size >= size.max() / np.sqrt(slope.shape[1])
    principal = np.linalg.eigvalsh((slope + turned)[near]) / 2
    angle = np.linalg.norm(slope - turned, axis=(1, 2)) / np.sqrt(8)
    return float(np.abs(principal).max()), float(angle.max())


def steepness(points: np.ndarray, blocks: list[Block]) -> list[np.ndarray]:
    """The sizes of the gradients of the shape functions (n, n_nodes) in the middle of each cell."""

    def seen(block: Block, part: slice) -> np.ndarray:
        return np.linalg.norm(_in_the_middle(points, block, part)[0].gradient[:, 0], axis=2)

    dim = points.shape[1]
    return [
        np.concatenate([found for _, found in by_part(block, dim, partial(seen, block))])
        for block in blocks
    ]


def steepest(points: np.ndarray, blocks: list[Block]) -> float:
    """The largest sum over a cell's nodes of the sizes of `steepness`."""
    return max(float(found.sum(axis=1).max()) for found in steepness(points, blocks))


def _in_the_middle(points: np.ndarray, block: Block, part: slice) -> tuple[Shapes, np.ndarray]:
    """The shapes in the middle (q = 1) of a part of a block's cells, and their sizes (n,)."""
    middle, weight = block.middle
    shapes = shapes_in(points, block.type, block.cells[part], middle, block.axisymmetric)
    return shapes, shapes.measure[:, 0] * weight
