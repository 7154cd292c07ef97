"""The gap operator of a zone: the average gap that each multiplier sees, linear in displacement.

With ḡ = (initial + matrix · u) / covered area, the contact forces of pressures p are matrixᵀ · p.
Source: Abbas, Drouet, Hild, CMAME 339 (2018) 488–513, §2–4.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from solver.mechanics.fem import mortar_degree
from solver.mechanics.mortar.closure import Integrals, close_faces, close_plane
from solver.mechanics.mortar.facets import Facets
from solver.mechanics.mortar.multipliers import Found, Meeting, Multipliers, Space, constants
from solver.mechanics.mortar.segments import Segments, intersect
from solver.mechanics.mortar.surface_points import Samples, face_samples

# Slave-side entries of dual multipliers below this share of their row's largest are round-off.
_ROUND_OFF = 1e-13

Meet = Callable[..., list[tuple[int, int, Segments]]]


@dataclass(frozen=True)
class Surface:
    """The m macro-elements of a slave surface.

    `area`, `covered` (m,): whole and intersected area; `centre`, `normal` (m, dim).
    """

    area: np.ndarray
    covered: np.ndarray
    centre: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class GapOperator:
    """Gap integrals seen by k multipliers φ; LAC has one on each macro-element, φ = 1.

    `matrix` (k, n_dofs): derivative of ∫ φ gap; `initial` (k,): ∫ φ gap of the undeformed bodies;
    `area`, `covered` (k,): ∫ φ over the whole and the intersected surface; `mean` (m, k): values
    by multiplier averaged over the macro-elements of `surface`; `nodes` (k,): the nodes that
    multipliers belong to, None for macro-elements; `segments`: how many there are; `closed_faces`:
    on how many faces the closure of integrals was used; `unclipped`: how many segments are whole
    slave faces; `plain`: whether plain Gauss rules are exact on all of them. `at_nodes` (n, k): the
    values at `nodes`, then (n,), by multiplier, where some nodes have no multiplier of their own.
    """

    matrix: sparse.csr_matrix
    initial: np.ndarray
    area: np.ndarray
    covered: np.ndarray
    mean: sparse.csr_matrix
    nodes: np.ndarray | None
    surface: Surface
    segments: int
    closed_faces: int
    unclipped: int = 0
    plain: bool = False
    at_nodes: sparse.csr_matrix | None = None


def meet_in_segments(
    slaves: list[Facets],
    _: list[Samples],
    masters: list[Facets],
    reach: float,
    weighted: bool = False,
    clip_all: bool = False,
) -> list[tuple[int, int, Segments]]:
    """Segments between all pairs of blocks: (slave block, master block, segments).

    `weighted`: with quadrature for integrands weighted by linear shape functions of the slave;
    `clip_all`: slave faces that lie within one master face are clipped as the others.
    """
    return [
        (a, b, segments)
        for a, slave in enumerate(slaves)
        for b, master in enumerate(masters)
        for segments in intersect(
            slave, master, reach, mortar_degree(slave.type.skeleton) if weighted else 0, clip_all
        )
    ]


@dataclass(frozen=True)
class Scheme:
    """How the gap is integrated: which points, which multipliers, and whether closure is due.

    `sample` gives points that measure whole slave faces, `meet` those where the surfaces meet,
    `space` the multipliers.
    """

    sample: Callable[[list[Facets]], list[Samples]] = face_samples
    meet: Meet = meet_in_segments
    space: Space = constants
    closure: bool = True


LAC = Scheme()


def gap_operator(
    slaves: list[Facets],
    masters: list[Facets],
    n_macro: int,
    n_nodes: int,
    search: float,
    scheme: Scheme = LAC,
) -> GapOperator:
    """Gap operator of slave sub-faces (numbered by macro-element) over master faces.

    `search` is the largest distance (a length) at which surfaces are looked for. They are first
    looked for nearby, and farther away only for sub-faces that found no partner there. Faces that
    meet along directions other than their own normals have no closure.
    """
    if any(block.directions is not None for block in slaves):
        scheme = replace(scheme, closure=False)
    samples = scheme.sample(slaves)
    found = _search(slaves, samples, masters, search, scheme.meet)
    space = scheme.space(Meeting(slaves, samples, found, n_macro))
    parts = [_integrals(space, a, segments) for a, _, segments in found]
    closed = close_faces(slaves, masters, found, parts) if scheme.closure else 0
    slave = _assembled(space, slaves, found, [p.slave for p in parts], n_nodes, "slave")
    master = _assembled(space, masters, found, [p.master for p in parts], n_nodes, "master")
    matrix = (master - (_diagonal(slave) if space.dual else slave)).tocsr()
    initial, covered = np.zeros(space.count), np.zeros(space.count)
    for (a, _, segments), part in zip(found, parts, strict=True):
        number = space.number[a][segments.slave]
        np.add.at(initial, number, part.gap)
        np.add.at(covered, number, part.weight)
    averages = space.averages(samples, [block.number for block in slaves], n_macro)
    surface = _surface(slaves, samples, found, n_macro)
    if scheme.closure and found:
        plane = _plane_closure(slaves, masters, space, found, parts, n_nodes)
        if plane is not None:
            matrix = sparse.kron(plane, slaves[0].normal[:1]).tocsr()
            initial, covered = initial * (averages.area / covered), averages.area
            surface = replace(surface, covered=surface.area)
            closed = sum(len(block.number) for block in [*slaves, *masters])
    count = sum(len(s.slave) for _, _, s in found)
    return GapOperator(
        matrix,
        initial,
        averages.area,
        covered,
        averages.mean,
        space.nodes,
        surface,
        count,
        closed,
        sum(int(s.whole.sum()) for _, _, s in found),
        scheme.closure and all(block.affine.all() for block in [*slaves, *masters]),
    )


def _search(
    slaves: list[Facets],
    samples: list[Samples],
    masters: list[Facets],
    search: float,
    meet: Meet,
) -> list[tuple[int, int, Segments]]:
    """Segments of all pairs of blocks, nearby first, then within the whole search distance."""
    nearby = max(f.radius.max() for f in [*slaves, *masters])
    reach = min(nearby, search)
    found = meet(slaves, samples, masters, reach)
    if reach == search:
        return found
    for a, (block, sample) in enumerate(zip(slaves, samples, strict=True)):
        covered = np.zeros(len(block.number))
        for segments in [f[2] for f in found if f[0] == a]:
            covered += np.bincount(
                segments.slave, segments.weight.sum(axis=1), minlength=len(covered)
            )
        lonely = np.flatnonzero(covered < (1 - 1e-6) * sample.weight.sum(axis=1))
        if len(lonely):
            found = [(i, b, _without(s, lonely) if i == a else s) for i, b, s in found]
            subset = _subset(block, lonely)
            for _, b, segments in meet([subset], [sample.of(lonely)], masters, search):
                found.append((a, b, _renumbered(segments, lonely)))
    return found


def _subset(face: Facets, chosen: np.ndarray) -> Facets:
    arrays = {k: v[chosen] for k, v in vars(face).items() if isinstance(v, np.ndarray)}
    return Facets(type=face.type, **arrays)


def _without(segments: Segments, slaves: np.ndarray) -> Segments:
    kept = ~np.isin(segments.slave, slaves)
    return Segments(**{k: v[kept] for k, v in vars(segments).items()})


def _renumbered(segments: Segments, slaves: np.ndarray) -> Segments:
    return Segments(**{**vars(segments), "slave": slaves[segments.slave]})


def _integrals(space: Multipliers, block: int, segments: Segments) -> Integrals:
    functions = space.at(block, segments.slave, segments.slave_values)
    weights = segments.weight[..., None] * functions
    measure = weights[..., None] * segments.normal[:, :, None]
    return Integrals(
        np.einsum("sqa,sqkd->skad", segments.slave_values, measure),
        np.einsum("sqa,sqkd->skad", segments.master_values, measure),
        np.einsum("sqk,sq->sk", weights, segments.gap),
        weights.sum(axis=1),
        segments.weight.sum(axis=1),
        segments.normal[:, 0],
    )


def _assembled(
    space: Multipliers,
    blocks: list[Facets],
    found: Found,
    vectors: list[np.ndarray],
    n_nodes: int,
    side: str,
) -> sparse.csr_matrix:
    """∫ φ N n of one side (k, n_dofs) from those of the segments (s, k, n_nodes, dim)."""
    dim = blocks[0].centre.shape[1]
    rows, columns, values = [], [], []
    for (a, b, segments), part in zip(found, vectors, strict=True):
        nodes = blocks[a if side == "slave" else b].nodes[getattr(segments, side)]
        dofs = dim * nodes[:, None, :, None] + np.arange(dim)
        rows.append(_spread(space.number[a][segments.slave][:, :, None, None], part))
        columns.append(_spread(dofs, part))
        values.append(part.ravel())
    entries = (_joined(values), (_joined(rows).astype(int), _joined(columns).astype(int)))
    return sparse.coo_matrix(entries, shape=(space.count, dim * n_nodes)).tocsr()


def _spread(numbers: np.ndarray, part: np.ndarray) -> np.ndarray:
    return np.broadcast_to(numbers, part.shape).ravel()


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(parts) if parts else np.empty(0)


def _diagonal(slave: sparse.csr_matrix) -> sparse.csr_matrix:
    """Without the round-off that dual multipliers leave at other nodes than their own."""
    largest = abs(slave).max(axis=1).toarray().ravel()
    limit = np.repeat(_ROUND_OFF * largest, np.diff(slave.indptr))
    slave.data[np.abs(slave.data) <= limit] = 0.0
    slave.eliminate_zeros()
    return slave


def _plane_closure(
    slaves: list[Facets],
    masters: list[Facets],
    space: Multipliers,
    found: Found,
    parts: list[Integrals],
    n_nodes: int,
) -> sparse.csr_matrix | None:
    """∫ φ (N_b − N_a) dS (k, n_nodes), closed over whole plane surfaces, where that is needed."""
    rows, columns, values = [], [], []
    for (a, b, segments), part in zip(found, parts, strict=True):
        normal = np.einsum("skad,sd->ska", part.master, part.normal)
        nodes = masters[b].nodes[segments.master][:, None]
        rows.append(_spread(space.number[a][segments.slave][:, :, None], normal))
        columns.append(_spread(nodes, normal))
        values.append(normal.ravel())
    entries = (_joined(values), (_joined(rows), _joined(columns)))
    covering = sparse.coo_matrix(entries, shape=(space.count, n_nodes)).tocsr()
    closed = close_plane(slaves, masters, space, covering)
    return None if closed is None else closed[1] - closed[0]


def _surface(slaves: list[Facets], samples: list[Samples], found: Found, n_macro: int) -> Surface:
    dim = slaves[0].centre.shape[1]
    area, covered = np.zeros(n_macro), np.zeros(n_macro)
    centre, normal = np.zeros((n_macro, dim)), np.zeros((n_macro, dim))
    for block, sample in zip(slaves, samples, strict=True):
        area += np.bincount(block.number, sample.weight.sum(axis=1), minlength=n_macro)
        place = np.einsum(
            "fq,qa,fad->fd", sample.weight, sample.values, block.corner, optimize=True
        )
        np.add.at(centre, block.number, place)
        np.add.at(normal, block.number, np.einsum("fq,fqd->fd", sample.weight, sample.normal))
    for a, _, segments in found:
        macro = slaves[a].number[segments.slave]
        covered += np.bincount(macro, segments.weight.sum(axis=1), minlength=n_macro)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return Surface(area, covered, centre / area[:, None], normal)
