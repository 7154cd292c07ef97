"""Stress as six components xx, yy, zz, xy, yz, xz: along directions, and at nodes from cells."""

from functools import partial

import numpy as np

from ...lac.cells.catalogue import CellType
from ...lac.cells.shape import shape_functions
from . import cell_loops
from .block import Block
from .elasticity import by_part, in_precision, shapes_in, stress_in

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
    found = shapes_in(points, block, block.cells[part], reference)
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
