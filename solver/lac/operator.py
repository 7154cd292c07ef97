"""The gap operator of a zone: average gap of each macro-element as a linear map of displacement.

With ḡ = (initial + matrix · u) / covered area, the contact forces of pressures p are matrixᵀ · p.
Source: Abbas, Drouet, Hild, CMAME 339 (2018) 488–513, §2–4. Exactness of the integrals: sums over
segments miss ∫ N_a dS of a face that is no parallelogram, since the place of a point on it is no
polynomial of its coordinates; the closure here returns the defect to the segments.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from solver.elements import face_rule, shape_functions
from solver.faces import area_vectors
from solver.lac.facets import Facets
from solver.lac.segments import Segments, intersect

# A face counts as fully covered when the segments miss less than this share of its area.
_FULL = 1e-11
# Slave normals over one master face that differ by less are one normal.
_ONE_NORMAL = 1e-9


@dataclass(frozen=True)
class GapOperator:
    """Gap integrals of m macro-elements.

    `matrix` (m, n_dofs): derivative of ∫ gap; `initial` (m,): ∫ gap of the undeformed bodies;
    `area`, `covered` (m,): whole and intersected area; `centre`, `normal` (m, dim); `segments`:
    how many there are; `closed_faces`: on how many faces the closure of integrals was used.
    """

    matrix: sparse.csr_matrix
    initial: np.ndarray
    area: np.ndarray
    covered: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    segments: int
    closed_faces: int


def gap_operator(
    slaves: list[Facets],
    masters: list[Facets],
    n_macro: int,
    n_nodes: int,
    search: float,
    closure: bool = True,
) -> GapOperator:
    """Gap operator of slave sub-faces (numbered by macro-element) over master faces.

    `search` is the largest distance (a length) at which surfaces are looked for. They are first
    looked for nearby, and farther away only for sub-faces that found no partner there.
    """
    found = _search(slaves, masters, search)
    parts = [_integrals(slaves[a], masters[b], s) for a, b, s in found]
    closed = _close(slaves, masters, found, parts) if closure else 0
    dim = slaves[0].centre.shape[1]
    rows, columns, values = [], [], []
    initial, covered = np.zeros(n_macro), np.zeros(n_macro)
    for (a, b, segments), part in zip(found, parts, strict=True):
        macro = slaves[a].number[segments.slave]
        initial += np.bincount(macro, part.gap, minlength=n_macro)
        covered += np.bincount(macro, part.area, minlength=n_macro)
        for side, chosen, vectors, sign in (
            (slaves[a], segments.slave, part.slave, -1.0),
            (masters[b], segments.master, part.master, 1.0),
        ):
            dofs = dim * side.nodes[chosen][:, :, None] + np.arange(dim)
            rows.append(np.broadcast_to(macro[:, None, None], dofs.shape).ravel())
            columns.append(dofs.ravel())
            values.append(sign * vectors.ravel())
    entries = (_joined(values), (_joined(rows).astype(int), _joined(columns).astype(int)))
    matrix = sparse.coo_matrix(entries, shape=(n_macro, dim * n_nodes)).tocsr()
    area, centre, normal = _macro_geometry(slaves, n_macro)
    count = sum(len(s.slave) for _, _, s in found)
    return GapOperator(matrix, initial, area, covered, centre, normal, count, closed)


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(parts) if parts else np.empty(0)


def _search(
    slaves: list[Facets], masters: list[Facets], search: float
) -> list[tuple[int, int, Segments]]:
    """Segments of all pairs of blocks, nearby first, then within the whole search distance."""
    nearby = max(f.radius.max() for f in [*slaves, *masters])
    reach = min(nearby, search)
    found = _segments(slaves, masters, reach)
    if reach == search:
        return found
    for a, block in enumerate(slaves):
        covered = np.zeros(len(block.number))
        for b, _, segments in [f for f in found if f[0] == a]:
            covered += np.bincount(
                segments.slave, segments.weight.sum(axis=1), minlength=len(covered)
            )
        lonely = np.flatnonzero(covered < (1 - 1e-6) * _areas(block))
        if len(lonely):
            found = [(i, b, _without(s, lonely) if i == a else s) for i, b, s in found]
            subset = _subset(block, lonely)
            for _, b, segments in _segments([subset], masters, search):
                found.append((a, b, _renumbered(segments, lonely)))
    return found


def _segments(
    slaves: list[Facets], masters: list[Facets], reach: float
) -> list[tuple[int, int, Segments]]:
    return [
        (a, b, segments)
        for a, slave in enumerate(slaves)
        for b, master in enumerate(masters)
        for segments in intersect(slave, master, reach)
    ]


def _subset(face: Facets, chosen: np.ndarray) -> Facets:
    arrays = {k: v[chosen] for k, v in vars(face).items() if k != "type"}
    return Facets(type=face.type, **arrays)


def _without(segments: Segments, slaves: np.ndarray) -> Segments:
    kept = ~np.isin(segments.slave, slaves)
    return Segments(**{k: v[kept] for k, v in vars(segments).items()})


def _renumbered(segments: Segments, slaves: np.ndarray) -> Segments:
    return Segments(**{**vars(segments), "slave": slaves[segments.slave]})


@dataclass
class _Integrals:
    """Per segment: ∫ N n dS of both sides (s, n_nodes, dim), ∫ gap dS (s,), area (s,)."""

    slave: np.ndarray
    master: np.ndarray
    gap: np.ndarray
    area: np.ndarray
    normal: np.ndarray


def _integrals(slave: Facets, master: Facets, segments: Segments) -> _Integrals:
    measure = segments.weight[..., None] * segments.normal
    return _Integrals(
        np.einsum("sqa,sqd->sad", segments.slave_values, measure),
        np.einsum("sqa,sqd->sad", segments.master_values, measure),
        (segments.weight * segments.gap).sum(axis=1),
        segments.weight.sum(axis=1),
        segments.normal[:, 0],
    )


def _close(
    slaves: list[Facets],
    masters: list[Facets],
    found: list[tuple[int, int, Segments]],
    parts: list[_Integrals],
) -> int:
    """Return the defect of ∫ N_a dS on fully covered straight faces to their segments.

    In proportion to area. The defect sums to zero, and so does its first moment since both
    integrals are exact for linear functions: gaps of linear fields stay exact.
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
                count += _close_block(block, mine)
    return count


def _all_affine(
    slaves: list[Facets],
    masters: list[Facets],
    found: list[tuple[int, int, Segments]],
    number: int,
    index: int,
) -> bool:
    return all(
        slaves[f[0]].affine[f[2].slave].all() and masters[f[1]].affine[f[2].master].all()
        for f in found
        if f[index] == number
    )


def _close_block(
    block: Facets, mine: list[tuple[np.ndarray, _Integrals, np.ndarray]]
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
    exact = _shape_integrals(block) * highest[:, None]
    whole = exact.sum(axis=1)
    full = np.abs(area - whole) <= _FULL * whole
    full &= block.straight & (highest - lowest <= _ONE_NORMAL)
    defect = np.where(full[:, None], exact - summed, 0.0)
    for face, part, vectors in mine:
        share = defect[face] * (part.area / area[face])[:, None]
        vectors += share[..., None] * part.normal[:, None]
    return int(full.sum())


def _shape_integrals(block: Facets) -> np.ndarray:
    """∫ N_a dS (n, n_nodes) of straight faces, exact."""
    reference, weights = face_rule(block.type.name)
    values, slopes = shape_functions(block.type.name).both(reference)
    vectors = _vectors(block, slopes)
    return np.einsum("q,qa,fqd,fd->fa", weights, values, vectors, block.normal, optimize=True)


def _areas(block: Facets) -> np.ndarray:
    reference, weights = face_rule(block.type.name)
    vectors = _vectors(block, shape_functions(block.type.name).gradients(reference))
    return np.linalg.norm(vectors, axis=2) @ weights


def _vectors(block: Facets, slopes: np.ndarray) -> np.ndarray:
    n, n_nodes, dim = block.corner.shape
    nodes = np.arange(n * n_nodes).reshape(n, n_nodes)
    return area_vectors(block.corner.reshape(-1, dim), nodes, slopes)


def _macro_geometry(
    slaves: list[Facets], n_macro: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Area (m,), centroid (m, dim) and mean unit normal (m, dim) of each macro-element."""
    dim = slaves[0].centre.shape[1]
    area, centre, normal = np.zeros(n_macro), np.zeros((n_macro, dim)), np.zeros((n_macro, dim))
    for block in slaves:
        reference, weights = face_rule(block.type.name)
        values, slopes = shape_functions(block.type.name).both(reference)
        vectors = _vectors(block, slopes) * weights[:, None]
        measure = np.linalg.norm(vectors, axis=2)
        area += np.bincount(block.number, measure.sum(axis=1), minlength=n_macro)
        place = np.einsum("fq,qa,fad->fd", measure, values, block.corner, optimize=True)
        np.add.at(centre, block.number, place)
        np.add.at(normal, block.number, vectors.sum(axis=1))
    return area, centre / area[:, None], normal / np.linalg.norm(normal, axis=1)[:, None]
