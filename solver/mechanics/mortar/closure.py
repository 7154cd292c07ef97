"""Closure: integrals over segments made to sum exactly to the integrals over whole faces.

The patch test asks that the contact forces of a uniform pressure be those of that pressure on each
whole face, ∫ N_a dS. Sums over segments miss it on faces that are no affine images of their
reference face, since the place of a point on them is then no polynomial of its coordinates. The
defect is returned to the segments such that gaps of linear displacement fields stay exact.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import lsmr

from solver.mechanics.fem import face_rule, shape_functions
from solver.mechanics.fem.gauss import gauss_rule
from solver.mechanics.mortar.facets import Facets, surface_vectors
from solver.mechanics.mortar.multipliers import Found, Multipliers

# A face counts as fully covered when the segments miss less than this share of its area.
_FULL = 1e-11
# Two plane surfaces cover each other when their areas differ by less than this share,
_FULL_SURFACE = 1e-9
# and the segments, which follow bent edges by chords, miss less than this share of them.
_CHORDS = 0.02
# The conditions of a plane closure count as met to this share of the largest integral; each pass
# gains the digits that the one before lost to rounding.
_CLOSED, _PASSES = 1e-11, 3
# Points each way that integrate a product of shape functions over a face with bent edges.
_WHOLE_POINTS = 5
# Normals that differ by less are one normal.
_ONE_NORMAL = 1e-9


@dataclass
class Integrals:
    """Per segment: ∫ φ N n dS of both sides (s, k, n_nodes, dim) for k multipliers φ, and more.

    `gap`, `weight` (s, k): ∫ φ gap dS and ∫ φ dS; `area` (s,); `normal` (s, dim) that of the first
    point.
    """

    slave: np.ndarray
    master: np.ndarray
    gap: np.ndarray
    weight: np.ndarray
    area: np.ndarray
    normal: np.ndarray


def close_faces(
    slaves: list[Facets], masters: list[Facets], found: Found, parts: list[Integrals]
) -> int:
    """Return the defect of ∫ N_a dS on fully covered faces to their segments, in place.

    In proportion to area, and in each segment to the integrals of the multipliers, which sum to
    the area. The defect sums to zero, and so does its first moment, since both integrals are exact
    for linear functions. Slave faces must be flat, master faces straight as well (the segments
    follow a bent master edge by a chord). Returns the number of faces treated.
    """
    count = 0
    for blocks, index, side in ((slaves, 0, "slave"), (masters, 1, "master")):
        for number, block in enumerate(blocks):
            mine = [
                (getattr(f[2], side), p, getattr(p, side))
                for f, p in zip(found, parts, strict=True)
                if f[index] == number
            ]
            if mine and not _all_affine(slaves, masters, found, number, index):
                shape = block.flat if side == "slave" else block.straight
                count += _close_block(block, shape, mine)
    return count


def _all_affine(
    slaves: list[Facets], masters: list[Facets], found: Found, number: int, index: int
) -> bool:
    return all(
        slaves[f[0]].affine[f[2].slave].all() and masters[f[1]].affine[f[2].master].all()
        for f in found
        if f[index] == number
    )


def _close_block(
    block: Facets, shape: np.ndarray, mine: list[tuple[np.ndarray, Integrals, np.ndarray]]
) -> int:
    n = len(block.number)
    cosine = [np.abs(np.einsum("sd,sd->s", p.normal, block.normal[face])) for face, p, _ in mine]
    area, lowest, highest = np.zeros(n), np.ones(n), np.zeros(n)
    summed = np.zeros((n, block.type.n_nodes))
    for (face, part, vectors), c in zip(mine, cosine, strict=True):
        area += np.bincount(face, part.area, minlength=n)
        np.minimum.at(lowest, face, c)
        np.maximum.at(highest, face, c)
        np.add.at(summed, face, np.einsum("skad,sd->sa", vectors, part.normal))
    exact = shape_integrals(block) * highest[:, None]
    whole = exact.sum(axis=1)
    full = np.abs(area - whole) <= _FULL * whole
    full &= shape & (highest - lowest <= _ONE_NORMAL)
    defect = np.where(full[:, None], exact - summed, 0.0)
    for face, part, vectors in mine:
        share = defect[face][:, None] * (part.weight / area[face][:, None])[..., None]
        np.add(vectors, share[..., None] * part.normal[:, None, None], out=vectors)
    return int(full.sum())


def close_plane(
    slaves: list[Facets], masters: list[Facets], space: Multipliers, covering: sparse.csr_matrix
) -> tuple[sparse.csr_matrix, sparse.csr_matrix] | None:
    """The closed integrals of plane parallel surfaces that cover each other, where edges are bent.

    `covering` (k, n_nodes) holds ∫ φ N_b dS for each of k multipliers as the segments give it,
    which follow bent edges by chords. Returns ∫ φ N_a dS of slave nodes (k, n_nodes), exact, and of
    master nodes: the smallest change of `covering` (least squares, on its own pattern) that gives
    each master node its exact integral, and each row the sum and first moment of its slave row.
    None where the surfaces are not plane and parallel, do not cover each other, or have straight
    edges only (`close_faces` serves there).
    """
    blocks = [*slaves, *masters]
    tangents = slaves[0].tangents[0]
    tilt = max(float(np.abs(b.normal @ tangents.T).max()) for b in blocks)
    flat = all(b.flat.all() for b in blocks) and tilt <= _ONE_NORMAL
    if not flat or all(b.straight.all() for b in blocks):
        return None
    slave = _whole_integrals(slaves, space, covering.shape)
    n_nodes = covering.shape[1]
    master = np.zeros(n_nodes)
    for block in masters:
        master += np.bincount(block.nodes.ravel(), shape_integrals(block).ravel(), n_nodes)
    area = slave.sum()
    if abs(master.sum() - area) > _FULL_SURFACE * area:
        return None
    if abs(covering.sum() - area) > _CHORDS * area:
        return None
    places = np.zeros((n_nodes, len(tangents)))
    for block in blocks:
        places[block.nodes] = block.corner @ tangents.T
    closed = _smallest_change(covering.tocoo(), slave, master, places)
    return None if closed is None else (slave, closed)


def _whole_integrals(
    slaves: list[Facets], space: Multipliers, shape: tuple[int, int]
) -> sparse.csr_matrix:
    """∫ φ N_a dS (k, n_nodes) over whole slave faces, flat ones."""
    rows, columns, values = [], [], []
    for a, block in enumerate(slaves):
        places, weights = gauss_rule(block.type.name, _WHOLE_POINTS)
        shapes, slopes = shape_functions(block.type.name).both(places)
        measure = np.einsum("fqd,fd,q->fq", surface_vectors(block, slopes), block.normal, weights)
        everywhere = np.broadcast_to(shapes, (len(measure), *shapes.shape))
        functions = space.at(a, np.arange(len(measure)), everywhere)
        part = np.einsum("fq,fqk,qa->fka", measure, functions, shapes, optimize=True)
        rows.append(np.broadcast_to(space.number[a][:, :, None], part.shape).ravel())
        columns.append(np.broadcast_to(block.nodes[:, None], part.shape).ravel())
        values.append(part.ravel())
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.coo_matrix(entries, shape=shape).tocsr()


def _smallest_change(
    covering: sparse.coo_matrix, slave: sparse.csr_matrix, master: np.ndarray, places: np.ndarray
) -> sparse.csr_matrix | None:
    """Change `covering` (m, n) to column sums `master` and the row sums and moments of `slave`.

    `places` (n, dim − 1) in the plane. None where no such change exists.
    """
    row, column, (m, n) = covering.row, covering.col, covering.shape
    count = np.maximum(np.bincount(row, minlength=m), 1)
    weights, wanted = [np.ones(len(row))], [master, np.asarray(slave.sum(axis=1)).ravel()]
    slave = slave.tocoo()
    for x in places.T:
        # Each row's moments are counted from its own middle and in its own size.
        middle = np.bincount(row, x[column], minlength=m) / count
        arm, size = x[column] - middle[row], np.zeros(m)
        np.maximum.at(size, row, np.abs(arm))
        size[size == 0] = 1.0
        weights.append(arm / size[row])
        moment = slave.data * (x[slave.col] - middle[slave.row]) / size[slave.row]
        wanted.append(np.bincount(slave.row, moment, minlength=m))
    rows = np.concatenate([column, *(n + k * m + row for k in range(len(weights)))])
    columns = np.tile(np.arange(len(row)), 1 + len(weights))
    values = np.concatenate([np.ones(len(row)), *weights])
    shape = (n + len(weights) * m, len(row))
    conditions = sparse.coo_matrix((values, (rows, columns)), shape=shape).tocsr()
    target, entries = np.concatenate(wanted), covering.data.copy()
    for _ in range(_PASSES):
        missing = target - conditions @ entries
        entries += lsmr(conditions, missing, atol=1e-15, btol=1e-15, conlim=0, maxiter=20 * m)[0]
    missed = np.abs(target - conditions @ entries).max()
    if missed > _CLOSED * np.abs(entries).max():
        return None
    return sparse.coo_matrix((entries, (row, column)), shape=(m, n)).tocsr()


def shape_integrals(block: Facets) -> np.ndarray:
    """∫ N_a dS (n, n_nodes) of flat faces, exact."""
    reference, weights = face_rule(block.type.name)
    values, slopes = shape_functions(block.type.name).both(reference)
    vectors = surface_vectors(block, slopes)
    return np.einsum("q,qa,fqd,fd->fa", weights, values, vectors, block.normal, optimize=True)
