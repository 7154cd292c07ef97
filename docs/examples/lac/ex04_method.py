r"""The method in one file: Local Average Contact of triangles, without the package.

Two blocks of triangles lie on each other along y = 0. The upper one is the slave. Its facets T
carry one pressure each, and the average gap of T must not be negative:

.. math:: \bar g_T = \frac{1}{|T|} \int_T (g_0 + [u] \cdot n) \, ds \ge 0, \quad p_T \ge 0, \quad
    p_T \bar g_T = 0 .

1. *Cut*: each slave facet needs a node inside. The triangle behind it is split at its midpoint.
2. *Segments*: halves of slave facets are intersected with the facets of the master.
3. *Operator*: Gauss points on each segment integrate the gap, row by row of B.
4. *Active set*: solve with the closed facets' gaps zero; open where p < 0, close where g < 0.

`LocalAverageContact` gives the same pressures to round-off. Only the left half of the top is
loaded, so that a part opens.
"""

import numpy as np
import skfem
from scipy.sparse import bmat, csr_matrix
from scipy.sparse.linalg import spsolve
from skfem.models.elasticity import lame_parameters, linear_elasticity

WIDTH, HEIGHT, LOAD = 4.0, 1.0, 25.0
FORM = linear_elasticity(*lame_parameters(2000.0, 0.3))


def block(n, m, low):
    """A block of triangles that stands on the height `low`."""
    mesh = skfem.MeshTri.init_tensor(
        np.linspace(0, WIDTH, n + 1), low + np.linspace(0, HEIGHT, m + 1)
    )
    return mesh.with_boundaries(
        {
            "left": lambda x: x[0] == 0,
            "low": lambda x: x[1] == low,
            "high": lambda x: x[1] == low + HEIGHT,
        }
    )


def cut(mesh, name):
    """The mesh with the triangles behind a boundary split in two, and its half facets.

    These are (2 k, 3): the two nodes, and the number of the facet.
    """
    facets, points, cells, halves = mesh.boundaries[name], mesh.p.T, mesh.t.T.tolist(), []
    middles = points[mesh.facets[:, facets]].mean(axis=0)
    for number, facet in enumerate(facets):
        a, b = mesh.facets[:, facet]
        new = len(points) + number
        cell = next(i for i, nodes in enumerate(cells) if a in nodes and b in nodes)
        [apex] = [node for node in cells[cell] if node not in (a, b)]
        cells[cell] = [a, new, apex]
        cells.append([new, b, apex])
        halves += [(a, new, number), (new, b, number)]
    points = np.vstack([points, middles])
    return skfem.MeshTri(points.T, np.array(cells).T), np.array(halves)


def segments(one, other):
    """Pairs of intervals that overlap, (i, j, start, end), of intervals (n, 2) and (m, 2)."""
    start = np.maximum.outer(one.min(axis=1), other.min(axis=1))
    end = np.minimum.outer(one.max(axis=1), other.max(axis=1))
    i, j = np.nonzero(end > start)
    return i, j, start[i, j], end[i, j]


def shape(x, ends):
    """Linear shape functions of intervals (s, 2) at x (s,): (s, 2)."""
    share = (x - ends[:, 0]) / (ends[:, 1] - ends[:, 0])
    return np.stack([1 - share, share], axis=1)


def gap_matrix(slave, halves, master, facets):
    """B (k, 2 n + 2 m), the vertical gap's integral on each slave facet, and the lengths (k,)."""
    n, nodes = slave.p.shape[1], master.facets[:, facets].T
    one, other = slave.p[0, halves[:, :2]], master.p[0, nodes]
    i, j, start, end = segments(one, other)
    rows, columns, values = [], [], []
    for at, weight in zip(*np.polynomial.legendre.leggauss(2), strict=True):
        x, w = (start + end) / 2 + at * (end - start) / 2, weight * (end - start) / 2
        # The slave lies above: what it goes down, and what the master comes up, closes the gap.
        for column, value in (
            (halves[i, :2], shape(x, one[i])),
            (n + nodes[j], -shape(x, other[j])),
        ):
            rows.append(np.repeat(halves[i, 2], 2))
            columns.append(2 * column.ravel() + 1)
            values.append((w[:, None] * value).ravel())
    shape_of = halves[:, 2].max() + 1, 2 * (n + master.p.shape[1])
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return csr_matrix(entries, shape=shape_of), np.bincount(halves[i, 2], end - start)


def solve(slave, halves, master, facets):
    """Pressures (k,), and how many solves it took to find which facets are in contact."""
    bases = [skfem.Basis(m, skfem.ElementVector(skfem.ElementTriP1())) for m in (slave, master)]
    K = bmat([[FORM.assemble(bases[0]), None], [None, FORM.assemble(bases[1])]], "csr")
    top = slave.facets_satisfying(lambda x: (x[1] == HEIGHT) & (x[0] < WIDTH / 2))
    push = skfem.LinearForm(lambda v, _: -LOAD * v[1])
    first = 2 * slave.p.shape[1]
    f = np.concatenate([push.assemble(bases[0].boundary(top)), np.zeros(2 * master.p.shape[1])])
    sides = [2 * np.flatnonzero(m.p[0] == 0) for m in (slave, master)]
    base = 2 * np.flatnonzero(master.p[1] == -HEIGHT) + 1
    held = np.concatenate([sides[0], first + sides[1], first + base])
    free = np.setdiff1d(np.arange(len(f)), held)

    B, length = gap_matrix(slave, halves, master, facets)
    B, K, f = B[:, free], K[free][:, free], f[free]
    closed, solves = np.ones(len(length), dtype=bool), 0
    while True:
        solves += 1
        system = bmat([[K, B[closed].T], [B[closed], None]], "csc")
        right = np.concatenate([f, np.zeros(closed.sum())])
        found = spsolve(system, right)
        found += spsolve(system, right - system @ found)  # the digits that pivoting lost
        pressure = np.zeros(len(closed))
        pressure[closed] = -found[len(free) :]
        gap = B @ found[: len(free)] / length
        wrong = np.where(closed, pressure < 0, gap < -1e-14)
        if not wrong.any():
            return pressure, solves
        closed ^= wrong


lower, upper = block(8, 3, -HEIGHT), block(14, 4, 0.0)
pressure, solves = solve(*cut(upper, "low"), lower, lower.boundaries["high"])


def visualize():
    """The pressure along the contact."""
    import matplotlib.pyplot as plt

    ends = np.linspace(0, WIDTH, len(pressure) + 1)
    ax = plt.subplots()[1]
    ax.stairs(pressure, ends)
    ax.set(xlabel="x", ylabel="contact pressure")
    return ax


if __name__ == "__main__":
    print(f"{(pressure > 0).sum()} of {len(pressure)} facets are in contact, {solves} solves")
    print(pressure.round(3))
