"""Closure: integrals over segments made to sum exactly to the integrals over whole faces.

The patch test asks that the contact forces of a uniform pressure be those of that pressure on each
whole face, ∫ N_a dS. Sums over segments miss it on faces that are no affine images of their
reference face, since the place of a point on them is then no polynomial of its coordinates. The
defect is returned to the segments such that gaps of linear displacement fields stay exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import lsmr

from solver.elements import face_rule, shape_functions
from solver.faces import area_vectors
from solver.lac.facets import Facets
from solver.lac.segments import Segments

# A face counts as fully covered when the segments miss less than this share of its area.
_FULL = 1e-11
# Two plane surfaces cover each other when their areas differ by less than this share,
_FULL_SURFACE = 1e-9
# and the segments, which follow bent edges by chords, miss less than this share of them.
_CHORDS = 0.02
# The conditions of a plane closure count as met to this share of the largest integral; each pass
# gains the digits that the one before lost to rounding.
_CLOSED, _PASSES = 1e-11, 3
# Normals that differ by less are one normal.
_ONE_NORMAL = 1e-9

Found = Sequence[tuple[int, int, Segments]]


@dataclass
class Integrals:
    """Per segment: ∫ N n dS of both sides (s, n_nodes, dim), ∫ gap dS, area (s,), normal (s, dim).

    The normal is that of the segment's first point.
    """

    slave: np.ndarray
    master: np.ndarray
    gap: np.ndarray
    area: np.ndarray
    normal: np.ndarray


def close_faces(
    slaves: list[Facets], masters: list[Facets], found: Found, parts: list[Integrals]
) -> int:
    """Return the defect of ∫ N_a dS on fully covered faces to their segments, in place.

    In proportion to area. The defect sums to zero, and so does its first moment, since both
    integrals are exact for linear functions. Slave faces must be flat, master faces straight as
    well (the segments follow a bent master edge by a chord). Returns the number of faces treated.
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
        np.add.at(summed, face, np.einsum("sad,sd->sa", vectors, part.normal))
    exact = shape_integrals(block) * highest[:, None]
    whole = exact.sum(axis=1)
    full = np.abs(area - whole) <= _FULL * whole
    full &= shape & (highest - lowest <= _ONE_NORMAL)
    defect = np.where(full[:, None], exact - summed, 0.0)
    for face, part, vectors in mine:
        share = defect[face] * (part.area / area[face])[:, None]
        np.add(vectors, share[..., None] * part.normal[:, None], out=vectors)
    return int(full.sum())


def close_plane(
    slaves: list[Facets], masters: list[Facets], covering: sparse.csr_matrix, n_nodes: int
) -> tuple[sparse.csr_matrix, sparse.csr_matrix] | None:
    """The closed integrals of plane parallel surfaces that cover each other, where edges are bent.

    `covering` (m, n_nodes) holds ∫ N_b dS over each of m macro-elements as the segments give it,
    which follow bent edges by chords. Returns ∫ N_a dS of slave nodes (m, n_nodes), exact, and of
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
    slave = _whole_integrals(slaves, covering.shape)
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


def _whole_integrals(slaves: list[Facets], shape: tuple[int, int]) -> sparse.csr_matrix:
    """∫ N_a dS (m, n_nodes) over whole macro-elements."""
    rows = [np.repeat(b.number, b.type.n_nodes) for b in slaves]
    columns = [b.nodes.ravel() for b in slaves]
    values = [shape_integrals(b).ravel() for b in slaves]
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


def surface_vectors(block: Facets, slopes: np.ndarray) -> np.ndarray:
    """Outward normal × surface measure (n, q, dim) at points with reference gradients `slopes`."""
    n, n_nodes, dim = block.corner.shape
    nodes = np.arange(n * n_nodes).reshape(n, n_nodes)
    return area_vectors(block.corner.reshape(-1, dim), nodes, slopes)
