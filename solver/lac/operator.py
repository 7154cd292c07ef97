"""The gap operator of a zone: average gap of each macro-element as a linear map of displacement.

With ḡ = (initial + matrix · u) / covered area, the contact forces of pressures p are matrixᵀ · p.
Source: Abbas, Drouet, Hild, CMAME 339 (2018) 488–513, §2–4.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from solver.elements import face_rule, shape_functions
from solver.lac.closure import Integrals, close_faces, close_plane, surface_vectors
from solver.lac.facets import Facets
from solver.lac.segments import Segments, intersect


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
    parts = [_integrals(s) for _, _, s in found]
    closed = close_faces(slaves, masters, found, parts) if closure else 0
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
    if closure and found:
        plane = _plane_closure(slaves, masters, found, parts, (n_macro, n_nodes))
        if plane is not None:
            matrix = sparse.kron(plane, slaves[0].normal[:1]).tocsr()
            initial, covered = initial * (area / covered), area
            closed = sum(len(block.number) for block in [*slaves, *masters])
    count = sum(len(s.slave) for _, _, s in found)
    return GapOperator(matrix, initial, area, covered, centre, normal, count, closed)


def _plane_closure(
    slaves: list[Facets],
    masters: list[Facets],
    found: list[tuple[int, int, Segments]],
    parts: list[Integrals],
    shape: tuple[int, int],
) -> sparse.csr_matrix | None:
    """∫ (N_b − N_a) dS (m, n_nodes), closed over whole plane surfaces, where that is needed."""
    rows, columns, values = [], [], []
    for (a, b, segments), part in zip(found, parts, strict=True):
        nodes = masters[b].nodes[segments.master]
        rows.append(np.broadcast_to(slaves[a].number[segments.slave][:, None], nodes.shape).ravel())
        columns.append(nodes.ravel())
        values.append(np.einsum("sad,sd->sa", part.master, part.normal).ravel())
    entries = (_joined(values), (_joined(rows), _joined(columns)))
    covering = sparse.coo_matrix(entries, shape=shape).tocsr()
    closed = close_plane(slaves, masters, covering, shape[1])
    return None if closed is None else closed[1] - closed[0]


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
        for segments in [f[2] for f in found if f[0] == a]:
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


def _integrals(segments: Segments) -> Integrals:
    measure = segments.weight[..., None] * segments.normal
    return Integrals(
        np.einsum("sqa,sqd->sad", segments.slave_values, measure),
        np.einsum("sqa,sqd->sad", segments.master_values, measure),
        (segments.weight * segments.gap).sum(axis=1),
        segments.weight.sum(axis=1),
        segments.normal[:, 0],
    )


def _areas(block: Facets) -> np.ndarray:
    reference, weights = face_rule(block.type.name)
    vectors = surface_vectors(block, shape_functions(block.type.name).gradients(reference))
    return np.linalg.norm(vectors, axis=2) @ weights


def _macro_geometry(
    slaves: list[Facets], n_macro: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Area (m,), centroid (m, dim) and mean unit normal (m, dim) of each macro-element."""
    dim = slaves[0].centre.shape[1]
    area, centre, normal = np.zeros(n_macro), np.zeros((n_macro, dim)), np.zeros((n_macro, dim))
    for block in slaves:
        reference, weights = face_rule(block.type.name)
        values, slopes = shape_functions(block.type.name).both(reference)
        vectors = surface_vectors(block, slopes) * weights[:, None]
        measure = np.linalg.norm(vectors, axis=2)
        area += np.bincount(block.number, measure.sum(axis=1), minlength=n_macro)
        place = np.einsum("fq,qa,fad->fd", measure, values, block.corner, optimize=True)
        np.add.at(centre, block.number, place)
        np.add.at(normal, block.number, vectors.sum(axis=1))
    return area, centre / area[:, None], normal / np.linalg.norm(normal, axis=1)[:, None]
