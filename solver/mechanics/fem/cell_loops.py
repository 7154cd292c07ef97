"""Loops over the solid cells of large meshes, compiled by Numba: stiffness, forces, nodal stress.

Each thread adds up the rows of its own nodes, from every cell that has one of them, in the order of
the cells. So no list of cell matrices is stored, and the number of threads changes no digit. The
nodes of a thread are a slab of the mesh: few cells have nodes of two threads.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...system.compiled import available, compiled, part_of_compiled
from ...system.errors import SolveError
from ...system.threads import ahead, workers
from . import shape_functions

if TYPE_CHECKING:
    from .elasticity import Block

# Nodes from which these loops pay for loading Numba: 60,000 unknowns.
_LEAST = 20_000


def serve(n_nodes: int, blocks: Sequence["Block"]) -> bool:
    """Whether these loops serve a mesh: one of solid cells, large enough to pay for Numba."""
    return available() and n_nodes >= _LEAST and all(block.type.dim == 3 for block in blocks)


def add_stiffness(
    points: np.ndarray, block: "Block", starts: np.ndarray, columns: np.ndarray, out: np.ndarray
) -> None:
    """Add the stiffness of a block's cells to the blocks `out` (nnz, 3, 3) of a sum.

    `starts` (n_nodes + 1,), `columns` (nnz,): its pattern, rows sorted. Raises SolveError where a
    Jacobian is not positive, as do the others.
    """
    _shared(_stiffness_rows, points, block, starts, columns, out)


def add_forces(
    points: np.ndarray, block: "Block", displacement: np.ndarray, out: np.ndarray
) -> None:
    """Add the internal forces of a block's cells to `out` (n_nodes, 3).

    `displacement` (parts, n_nodes, 3); see `elasticity.internal_force`.
    """
    _shared(_force_rows, points, block, displacement, out)


def add_nodal_stress(
    points: np.ndarray, block: "Block", displacement: np.ndarray, fit: np.ndarray, out: np.ndarray
) -> None:
    """Add the stress at the nodes of a block's cells, seen from each cell, to `out` (n_nodes, 6).

    `fit` (n_nodes of a cell, q): see `nodal_stress.extrapolation`.
    """
    _shared(_stress_rows, points, block, displacement, fit, out)


def _shared(loop: Callable[..., None], points: np.ndarray, block: "Block", *more: object) -> None:
    """Call a loop for the nodes of each thread."""
    reference, weights = block.rule
    on_reference, count = shape_functions(block.type.name).gradients(reference), workers()
    owner, bad = np.zeros(len(points), dtype=np.int32), np.zeros(1, dtype=bool)
    if count > 1:
        # Across the longest side. The planes of a regular mesh are oblique to the slabs.
        along = points @ np.array([1e-6, 1e-3, 1.0])[np.ptp(points, axis=0).argsort().argsort()]
        cuts = np.quantile(along[::101], np.arange(1, count) / count)
        owner = np.searchsorted(cuts, along, side="right").astype(np.int32)
    known = points, block.cells, block.lame, block.shear, on_reference, weights
    about = [np.ascontiguousarray(array) for array in known]
    for _ in ahead(lambda mine: loop(mine, owner, bad, *about, *more), range(count)):
        pass
    if bad[0]:
        raise SolveError(f"{block.type.name} cells are inverted or degenerate")


@part_of_compiled
def _gradients(points, nodes, on_reference, out):  # type: ignore[no-untyped-def]
    """The gradients (n_nodes, 3) in a cell at a point, and its Jacobian's determinant."""
    a = b = c = d = e = f = g = h = i = 0.0
    x, y, z = points[nodes[0], 0], points[nodes[0], 1], points[nodes[0], 2]
    for n in range(1, len(nodes)):
        u, v, w = points[nodes[n], 0] - x, points[nodes[n], 1] - y, points[nodes[n], 2] - z
        r, s, t = on_reference[n, 0], on_reference[n, 1], on_reference[n, 2]
        a, b, c = a + u * r, b + u * s, c + u * t
        d, e, f = d + v * r, e + v * s, f + v * t
        g, h, i = g + w * r, h + w * s, i + w * t
    determinant = a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)
    if not determinant > 0:
        return 0.0
    by = 1 / determinant
    for n in range(len(nodes)):
        r, s, t = on_reference[n, 0], on_reference[n, 1], on_reference[n, 2]
        out[n, 0] = by * (r * (e * i - f * h) + s * (f * g - d * i) + t * (d * h - e * g))
        out[n, 1] = by * (r * (c * h - b * i) + s * (a * i - c * g) + t * (b * g - a * h))
        out[n, 2] = by * (r * (b * f - c * e) + s * (c * d - a * f) + t * (a * e - b * d))
    return determinant


@part_of_compiled
def _owned(nodes, owner, mine):  # type: ignore[no-untyped-def]
    """Whether one of the nodes is `mine`."""
    found = False
    for node in nodes:
        found |= owner[node] == mine
    return found


@part_of_compiled
def _apart(displacement, nodes, out):  # type: ignore[no-untyped-def]
    """The displacement of a cell's nodes relative to the first, its parts summed up."""
    for n in range(len(nodes)):
        for j in range(3):
            out[n, j] = 0.0
            for part in range(len(displacement)):
                out[n, j] += displacement[part, nodes[n], j] - displacement[part, nodes[0], j]


@part_of_compiled
def _stress(apart, gradient, lame, shear, out):  # type: ignore[no-untyped-def]
    """The stress xx, yy, zz, xy, yz, xz of a displacement `apart` (n_nodes, 3) at a point."""
    a = b = c = d = e = f = g = h = i = 0.0
    for n in range(len(apart)):
        u, v, w = apart[n, 0], apart[n, 1], apart[n, 2]
        r, s, t = gradient[n, 0], gradient[n, 1], gradient[n, 2]
        a, b, c = a + u * r, b + u * s, c + u * t
        d, e, f = d + v * r, e + v * s, f + v * t
        g, h, i = g + w * r, h + w * s, i + w * t
    pressure = lame * (a + e + i)
    out[0], out[1], out[2] = 2 * shear * a + pressure, 2 * shear * e + pressure, 0.0
    out[2] = 2 * shear * i + pressure
    out[3], out[4], out[5] = shear * (b + d), shear * (f + h), shear * (c + g)


@compiled
def _force_rows(  # type: ignore[no-untyped-def]
    mine, owner, bad, points, cells, lame, shear, on_reference, weights, displacement, out
):  # fmt: skip
    count = cells.shape[1]
    apart, gradient = np.empty((count, 3)), np.empty((count, 3))
    force, stress = np.empty((count, 3)), np.empty(6)
    for c in range(len(cells)):
        nodes = cells[c]
        if not _owned(nodes, owner, mine):
            continue
        _apart(displacement, nodes, apart)
        force[:] = 0.0
        for q in range(len(weights)):
            measure = weights[q] * _gradients(points, nodes, on_reference[q], gradient)
            if measure == 0.0:
                bad[0] = True
                return
            _stress(apart, gradient, measure * lame[c], measure * shear[c], stress)
            xx, yy, zz, xy, yz, xz = stress
            for n in range(count):
                x, y, z = gradient[n, 0], gradient[n, 1], gradient[n, 2]
                force[n, 0] += xx * x + xy * y + xz * z
                force[n, 1] += xy * x + yy * y + yz * z
                force[n, 2] += xz * x + yz * y + zz * z
        for n in range(count):
            if owner[nodes[n]] == mine:
                for j in range(3):
                    out[nodes[n], j] += force[n, j]


@compiled
def _stress_rows(  # type: ignore[no-untyped-def]
    mine, owner, bad, points, cells, lame, shear, on_reference, weights, displacement, fit, out
):  # fmt: skip
    count = cells.shape[1]
    apart, gradient = np.empty((count, 3)), np.empty((count, 3))
    stress = np.empty((len(weights), 6))
    for c in range(len(cells)):
        nodes = cells[c]
        if not _owned(nodes, owner, mine):
            continue
        _apart(displacement, nodes, apart)
        for q in range(len(weights)):
            if _gradients(points, nodes, on_reference[q], gradient) == 0.0:
                bad[0] = True
                return
            _stress(apart, gradient, lame[c], shear[c], stress[q])
        for n in range(count):
            if owner[nodes[n]] == mine:
                for j in range(6):
                    value = 0.0
                    for q in range(len(weights)):
                        value += fit[n, q] * stress[q, j]
                    out[nodes[n], j] += value


@compiled
def _stiffness_rows(  # type: ignore[no-untyped-def]  # noqa: C901 -- one kernel
    mine, owner, bad, points, cells, lame, shear, on_reference, weights, starts, columns, out
):  # fmt: skip
    count = cells.shape[1]
    gradient, measure = np.empty((len(weights), count, 3)), np.empty(len(weights))
    for c in range(len(cells)):
        nodes = cells[c]
        if not _owned(nodes, owner, mine):
            continue
        for q in range(len(weights)):
            measure[q] = weights[q] * _gradients(points, nodes, on_reference[q], gradient[q])
            if measure[q] == 0.0:
                bad[0] = True
                return
        for n in range(count):
            for m in range(n, count):
                here, there = owner[nodes[n]] == mine, owner[nodes[m]] == mine and m > n
                if not (here or there):
                    continue
                xx = xy = xz = yx = yy = yz = zx = zy = zz = 0.0
                for q in range(len(weights)):
                    x, y, z = gradient[q, n, 0], gradient[q, n, 1], gradient[q, n, 2]
                    r, s, t = gradient[q, m, 0], gradient[q, m, 1], gradient[q, m, 2]
                    x, y, z = measure[q] * x, measure[q] * y, measure[q] * z
                    xx, xy, xz = xx + x * r, xy + x * s, xz + x * t
                    yx, yy, yz = yx + y * r, yy + y * s, yz + y * t
                    zx, zy, zz = zx + z * r, zy + z * s, zz + z * t
                first, second = lame[c], shear[c]
                trace, both = second * (xx + yy + zz), first + second
                xx, yy, zz = both * xx + trace, both * yy + trace, both * zz + trace
                xy, yx = first * xy + second * yx, first * yx + second * xy
                xz, zx = first * xz + second * zx, first * zx + second * xz
                yz, zy = first * yz + second * zy, first * zy + second * yz
                if here:
                    place = _place(starts, columns, nodes[n], nodes[m])
                    _add_block(out[place], xx, xy, xz, yx, yy, yz, zx, zy, zz)
                if there:
                    place = _place(starts, columns, nodes[m], nodes[n])
                    _add_block(out[place], xx, yx, zx, xy, yy, zy, xz, yz, zz)


@part_of_compiled
def _add_block(block, xx, xy, xz, yx, yy, yz, zx, zy, zz):  # type: ignore[no-untyped-def]
    """Add nine numbers to a block (3, 3), row by row."""
    block[0, 0] += xx
    block[0, 1] += xy
    block[0, 2] += xz
    block[1, 0] += yx
    block[1, 1] += yy
    block[1, 2] += yz
    block[2, 0] += zx
    block[2, 1] += zy
    block[2, 2] += zz


@part_of_compiled
def _place(starts, columns, row, column):  # type: ignore[no-untyped-def]
    """Where the entry of a row and column is stored, columns sorted."""
    low, high = starts[row], starts[row + 1] - 1
    while low < high:
        middle = (low + high) // 2
        if columns[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low
