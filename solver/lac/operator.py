"""The gap operator of a zone: the average gap that each multiplier sees, linear in displacement.

With ḡ = (initial + matrix · u) / covered area, the contact forces of pressures p are matrixᵀ · p.
Source: Abbas, Drouet, Hild, CMAME 339 (2018) 488–513, §2–4.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse

from .cells.catalogue import cell_type
from .facets import Facets
from .friction import levers, tangents, turned_along
from .multipliers import (
    MASTER,
    SLAVE,
    Integrals,
    InterfaceData,
    Space,
    close_faces,
    constants,
    integrals,
)
from .partners import Samples, Surface, face_samples, on_one_surface, uncovered
from .recovery import Recovery, RecoveryRequest, recovery
from .segments import Segments, intersect

MIN_COVERAGE = 0.01
"""A macro-element covered by less than this share of its area is out of contact."""
# Coefficients below this share of their row's largest are round-off.
_ROUND_OFF = 1e-13
# The distance within which such faces are looked for grows by this factor at a time.
_WIDER = 8.0

Meet = Callable[..., list[Segments]]


@dataclass(frozen=True, kw_only=True)
class GapOperator:
    """Gap integrals seen by k multipliers φ; LAC has one on each macro-element, φ = 1.

    `matrix` (k, n_dofs): derivative of ∫ φ gap; `initial` (k,): ∫ φ gap of the undeformed bodies;
    `area`, `covered` (k,): ∫ φ over the whole and the intersected surface; `mean` (m, k): values
    by multiplier averaged over the macro-elements of `surface`; `nodes` (k,): the nodes that
    multipliers belong to, None for macro-elements; `segments`: how many there are; `closed_faces`:
    on how many faces the closure of integrals was used; `plain`: whether plain Gauss rules are
    exact on all of them. `at_nodes` (n, k): the values at `nodes`, then (n,), by multiplier, where
    some nodes have no multiplier of their own. `recovery`: what recovers the pressure, if asked
    for. `slip`: the `slip_operator` by tangent, if asked for, with its `levers`.
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
    plain: bool = False
    at_nodes: sparse.csr_matrix | None = None
    recovery: Recovery | None = None
    slip: tuple[sparse.csr_matrix, ...] = ()
    levers: np.ndarray | None = None


def meet_in_segments(
    slaves: Sequence[Facets],
    _: Sequence[Samples],
    masters: Sequence[Facets],
    reach: float,
    among: Sequence[np.ndarray] | None = None,
    weighted: bool = False,
    degree: int = 0,
) -> list[Segments]:
    """Segments between all pairs of blocks.

    `among`: by block, the slave faces that are looked at, all of them by default; `weighted`: with
    quadrature for integrands weighted by linear shape functions of the slave, or by polynomials of
    a `degree`.

    >>> [s.area.tolist() for s in meet_in_segments([slave], [], [master], 1.0)]
    [[1.0, 1.0]]
    """
    found = []
    for a, slave in enumerate(slaves):
        more = cell_type(slave.type.skeleton).degree if weighted else degree
        found += intersect(slaves, a, masters, reach, more, None if among is None else among[a])
    return found


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """How the gap is integrated: which points, which multipliers, and whether closure is due.

    `sample` gives points that measure whole slave faces, `meet` those where the surfaces meet,
    `space` the multipliers. `nearest`: the master has faces, and a macro-element meets the nearest
    surface of them. `lost`: measures the area that has no partner there, from slaves, masters,
    samples, segments, the reach and the number of macro-elements. `slip`: the slip is measured too.
    """

    sample: Callable[[list[Facets]], list[Samples]] = face_samples
    meet: Meet = meet_in_segments
    space: Space = constants
    closure: bool = True
    nearest: bool = True
    lost: Callable[..., np.ndarray] | None = None
    slip: bool = False


LAC = Scheme()


def gap_operator(
    slaves: list[Facets],
    masters: list[Facets],
    n_macro: int,
    n_nodes: int,
    search: float | None = None,
    scheme: Scheme = LAC,
    asked: RecoveryRequest | None = None,
) -> GapOperator:
    """Gap operator of slave sub-faces (numbered by macro-element) over master faces.

    `search` is the largest distance (a length) at which surfaces are looked for, by default the
    extent of both. They are first looked for nearby, and farther away only for sub-faces that found
    no partner there. Beside a step of the master the nearer side alone counts. Faces that meet
    along directions other than their own normals have no closure. `asked`: how the pressure is
    recovered, for the multipliers of macro-elements alone.

    A slave edge of length 2 under two master edges, open by 1/2:

    >>> operator = gap_operator([slave], [master], 1, len(points), 1.0)
    >>> operator.matrix.toarray().reshape(5, 2)[:, 1].round(15).tolist()
    [-1.0, -1.0, 0.5, 1.0, 0.5]
    >>> operator.initial.round(15).tolist(), operator.covered.round(15).tolist()
    ([1.0], [2.0])
    """
    if asked is not None and scheme.meet is meet_in_segments:
        scheme = replace(scheme, meet=partial(scheme.meet, degree=asked.form.degree))
    if any(block.directions is not None for block in slaves):
        scheme = replace(scheme, closure=False)
    samples = scheme.sample(slaves)
    reach = _extent([*slaves, *masters]) if search is None else search
    found = _search(slaves, samples, masters, reach, scheme.meet)
    if scheme.nearest:
        found = on_one_surface(found, slaves, n_macro)
    data = InterfaceData(slaves=slaves, samples=samples, found=found, n_macro=n_macro)
    space = scheme.space(data)
    parts = [integrals(space, segments) for segments in found]
    parts, closed = close_faces(parts) if scheme.closure else (parts, 0)
    shape = space.count, n_nodes, slaves[0].centre.shape[1]
    slave, master = (_assembled(parts, side, *shape) for side in (SLAVE, MASTER))
    initial, covered = np.zeros(space.count), np.zeros(space.count)
    for part in parts:
        np.add.at(initial, part.number, part.gap)
        np.add.at(covered, part.number, part.weight)
    lost = np.zeros(n_macro)
    if scheme.nearest and scheme.lost:
        lost = scheme.lost(slaves, masters, samples, found, reach, n_macro)
    surface = _surface(data, lost)
    ones = ((segments, np.ones((*segments.weight.shape, 1))) for segments in found)
    averages = space.averages(samples, [block.number for block in slaves], n_macro)
    return GapOperator(
        matrix=(master - (slave if space.nodes is None else without_round_off(slave))).tocsr(),
        initial=initial,
        area=averages.area,
        covered=covered,
        mean=averages.mean,
        nodes=space.nodes,
        surface=surface,
        segments=sum(len(segments.gap) for segments in found),
        closed_faces=closed,
        plain=scheme.closure and all(block.affine.all() for block in [*slaves, *masters]),
        recovery=None if asked is None else recovery(asked, found, surface, n_nodes, scheme.slip),
        slip=slip_operator(parts, surface.normal, n_nodes) if scheme.slip else (),
        levers=levers(list(ones), surface.normal, 1) if scheme.slip else None,
    )


def _extent(faces: list[Facets]) -> float:
    """The extent of surfaces plus the radius of their largest face."""
    centres = np.concatenate([block.centre for block in faces])
    largest = max(block.radius.max() for block in faces)
    return float(np.linalg.norm(np.ptp(centres, axis=0)) + largest)


def _search(
    slaves: list[Facets],
    samples: list[Samples],
    masters: list[Facets],
    search: float,
    meet: Meet,
) -> list[Segments]:
    """Segments of all pairs of blocks, nearby first, then ever farther, up to `search`.

    Only faces that are not covered whole are looked for farther away.
    """
    near, *farther = _reaches([*slaves, *masters], search)
    found = meet(slaves, samples, masters, near)
    for reach in farther:
        bare = uncovered(samples, found)
        if not any(len(faces) for faces in bare):
            break
        kept = [s.of(~np.isin(s.slave.face, bare[s.slave.index])) for s in found]
        found = kept + meet(slaves, samples, masters, reach, bare)
    return found


def _reaches(faces: list[Facets], search: float) -> list[float]:
    """Distances, ascending up to `search`, at which partners are looked for.

    The first is about the size of usual faces: in a graded mesh, all small faces are within the
    size of the largest one. A rigid surface is one face without end, and everything is near it.
    """
    radii = np.concatenate([block.radius for block in faces])
    usual, largest = float(np.median(radii)), float(radii.max())
    if not np.isfinite(largest):
        return [search]
    reaches = [largest]
    while reaches[0] > _WIDER * usual:
        reaches.insert(0, reaches[0] / _WIDER)
    return [reach for reach in reaches if reach < search] + [search]


def slip_operator(
    parts: Sequence[Integrals], normal: np.ndarray, n_nodes: int
) -> tuple[sparse.csr_matrix, ...]:
    """The dim − 1 matrices (m, n_dofs) ∫ (N_master − N_slave) t, by tangent.

    `parts`: the closed integrals of m macro-elements; `normal` (m, dim): their mean normals,
    whose `tangents` these are.

    A slave edge of length 2, whose tangent is −x, under two master edges:

    >>> (segments,) = intersect([slave], 0, [master], 1.0)
    >>> data = InterfaceData(slaves=[slave], samples=[], found=[segments], n_macro=1)
    >>> part = integrals(constants(data), segments)
    >>> (along,) = slip_operator([part], np.array([[0.0, 1.0]]), len(points))
    >>> along.toarray().reshape(5, 2)[:, 0].round(15).tolist()
    [1.0, 1.0, -0.5, -1.0, -0.5]
    """
    shape = len(normal), n_nodes, normal.shape[1]
    found = []
    for tangent in tangents(normal):
        turned = [turned_along(part, tangent) for part in parts]
        slave, master = (_assembled(turned, side, *shape) for side in (SLAVE, MASTER))
        along = (master - slave).tocsr()
        along.eliminate_zeros()
        found.append(along)
    return tuple(found)


def _assembled(
    parts: Sequence[Integrals], side: int, count: int, n_nodes: int, dim: int
) -> sparse.csr_matrix:
    """The vectors of one side, by `count` multipliers (k, n_dofs)."""
    rows, columns, values = [], [], []
    for part in parts:
        vectors = part.vectors[side]
        dofs = dim * part.segments.sides[side].nodes[:, None, :, None] + np.arange(dim)
        rows.append(_spread(part.number[:, :, None, None], vectors))
        columns.append(_spread(dofs, vectors))
        values.append(vectors.ravel())
    entries = (_joined(values), (_joined(rows).astype(int), _joined(columns).astype(int)))
    return sparse.coo_matrix(entries, shape=(count, dim * n_nodes)).tocsr()


def _spread(numbers: np.ndarray, part: np.ndarray) -> np.ndarray:
    return np.broadcast_to(numbers, part.shape).ravel()


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(parts) if parts else np.empty(0)


def without_round_off(rows: sparse.csr_matrix) -> sparse.csr_matrix:
    """Rows without the coefficients that are round-off of their largest.

    Nodal multipliers then see no node where their integral vanishes: dual ones see their own alone,
    linear ones no other end of a quadratic edge, ∫ t (1 − t) (1 − 2t) dt = 0. Each has an unknown
    of its own, and can be condensed.

    >>> without_round_off(sparse.csr_matrix([[2.0, 1e-14, 1e-3]])).toarray().tolist()
    [[2.0, 0.0, 0.001]]
    """
    found = rows.copy()
    if not found.nnz:
        return found
    largest = abs(found).max(axis=1).toarray().ravel()
    found.data[np.abs(found.data) <= _ROUND_OFF * np.repeat(largest, np.diff(found.indptr))] = 0.0
    found.eliminate_zeros()
    return found


def _surface(data: InterfaceData, lost: np.ndarray) -> Surface:
    n_macro, dim = data.n_macro, data.slaves[0].centre.shape[1]
    area, covered = np.zeros(n_macro), np.zeros(n_macro)
    centre, normal = np.zeros((n_macro, dim)), np.zeros((n_macro, dim))
    for block, sample in zip(data.slaves, data.samples, strict=True):
        area += np.bincount(block.number, sample.weight.sum(axis=1), minlength=n_macro)
        place = np.einsum(
            "fq,qa,fad->fd", sample.weight, sample.values, block.corner, optimize=True
        )
        np.add.at(centre, block.number, place)
        np.add.at(normal, block.number, np.einsum("fq,fqd->fd", sample.weight, sample.normal))
    for segments in data.found:
        covered += np.bincount(segments.macro, segments.area, minlength=n_macro)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    centre /= area[:, None]
    return Surface(area=area, covered=covered, lost=lost, centre=centre, normal=normal)
