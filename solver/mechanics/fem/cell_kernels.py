"""What Numba compiles for `cell_loops`: the loops over the cells.

Of each loop, `mine` is the number of its thread and `owner` (n_nodes,) the thread of each node; it
sets `bad` and returns where a Jacobian is not positive. Points and displacements have three
components.
"""

import numpy as np

from ...system.compiled import compiled, part_of_compiled


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
def size_rows(  # type: ignore[no-untyped-def]
    mine, owner, bad, points, cells, lame, shear, on_reference, weights, displacement, force, most,
    highest
):  # fmt: skip
    """Add to `force` (n_nodes,); raise `most` (n_nodes,) and `highest` (threads, 2)."""
    count = cells.shape[1]
    apart, gradient = np.empty((count, 3)), np.empty((count, 3))
    slope, stress = np.empty(count), np.empty(6)
    for c in range(len(cells)):
        nodes = cells[c]
        if not _owned(nodes, owner, mine):
            continue
        volume = weights[0] * _gradients(points, nodes, on_reference[0], gradient)
        if volume == 0.0:
            bad[0] = True
            return
        _apart(displacement, nodes, apart)
        term = steepest = extent = 0.0
        for n in range(count):
            x, y, z = gradient[n, 0], gradient[n, 1], gradient[n, 2]
            u, v, w = apart[n, 0], apart[n, 1], apart[n, 2]
            slope[n] = np.sqrt(x * x + y * y + z * z)
            term += slope[n] * np.sqrt(u * u + v * v + w * w)
            steepest = max(steepest, slope[n])
        term *= lame[c] + 2 * shear[c]
        for j in range(3):
            low = high = points[nodes[0], j]
            for n in range(1, count):
                low, high = min(low, points[nodes[n], j]), max(high, points[nodes[n], j])
            extent += (high - low) ** 2
        highest[mine, 0] = max(highest[mine, 0], term)
        highest[mine, 1] = max(highest[mine, 1], term * np.sqrt(extent) * steepest)
        _stress(apart, gradient, lame[c], shear[c], stress)
        xx, yy, zz, xy, yz, xz = stress
        norm = np.sqrt(xx * xx + yy * yy + zz * zz + 2 * (xy * xy + yz * yz + xz * xz))
        for n in range(count):
            if owner[nodes[n]] == mine:
                force[nodes[n]] += volume * term * slope[n]
                most[nodes[n]] = max(most[nodes[n]], norm)


@compiled
def force_rows(  # type: ignore[no-untyped-def]
    mine, owner, bad, points, cells, lame, shear, on_reference, weights, displacement, out
):  # fmt: skip
    """Add internal forces to `out` (n_nodes, 3)."""
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
def stress_rows(  # type: ignore[no-untyped-def]
    mine, owner, bad, points, cells, lame, shear, on_reference, weights, displacement, fit, out
):  # fmt: skip
    """Add stress at nodes to `out` (n_nodes, 6)."""
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
def stiffness_rows(  # type: ignore[no-untyped-def]  # noqa: C901 -- one kernel
    mine, owner, bad, points, cells, lame, shear, on_reference, weights, starts, columns, out
):  # fmt: skip
    """Add blocks of the stiffness to `out` (nnz, 3, 3)."""
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
