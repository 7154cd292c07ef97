"""Treatments of the interface: how the gap is weighted and integrated, by the case file's name.

They share everything else: pairing, segments, gap operator, active set, solve, checks, results.
`docs/treatments.md` has the formulas.

Which area has lost its partner is found by lines through points of the faces, a route that shares
nothing with the segments but the projection onto a face.

Multipliers of slave nodes that cannot answer one are added to those of their neighbours. Supports
hold the displacement of such a node along the normal; or the node has a multiplier of another
zone in nearly the same direction, where zones share nodes. Where the master follows node by node
the constraints would depend on one another. The node's function is added in equal parts to
those of the free nodes on the same faces: functions still sum to one, and a uniform pressure stays
exact. Source: Bernardi, Maday, Patera, A new nonconforming approach to domain decomposition: the
mortar element method, in: Nonlinear Partial Differential Equations and Their Applications, 1994
(elements at the ends of an interface, and points where several meet); Puso, Laursen, Mesh tying on
curved interfaces in 3D, Eng. Comput. 20 (2003) 305–319.

Stabilised contact gives way to pressures that scatter, by a compliance S of the constraints. The
average gap of a closed macro-element is zero in LAC. A slave that is finer than its master then
has to follow the master's facets, and the forces that bend it scatter. With S the gap is

    |T| ḡ + S p = 0,    S = (I − R)ᵀ D (I − R),

R p the linear least squares fit to neighbours (the form `none` of a recovery). S p is zero
for a linear pressure, so that the patch test stays exact, and small for smooth ones. D is the area
of the macro-element times a displacement per pressure,

    D = |T| ((1 + (H / h)⁴) H / Eₘ + 4 s³ h / Eₛ) / 10,

with the sizes H, h and Young's moduli E of master and slave. The fourth power: the scatter has the
wavelength H of the facets, of which I − R leaves a part of (h / H)². s: half of the aspect ratio of
stretched faces, whose inner node hardly moves; else 1. In H / h their h is larger by √s.
Source: the form of the stabilisation is that of P. Bochev, C. Dohrmann, M. Gunzburger, SIAM J.
Numer. Anal. 44 (2006) 82–101: pressures less their projection.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse

from ...lac.cells.catalogue import BY_NAME
from ...lac.cells.shape import gauss_rule
from ...lac.facets import Facets
from ...lac.operator import LAC, GapOperator, Scheme, meet_in_segments
from ...lac.partners import MISSED, Samples, bare_faces, extents, missed_area, sampled
from ...lac.reconstruction import FORMS, Moments, reconstruct
from ...lac.segments import Segments
from .points import all_hits, at_nodes, dual, gauss, linear, meet_at_points, one_each

# Lines through so many Gauss points each way tell whether a face lies within the master's outline.
_LINES = 4


def _lines(block: Facets) -> Samples:
    """Points of faces: their nodes, without weight, and Gauss points.

    If all see the master, so does the whole face.
    """
    places, weights = gauss_rule(block.type.name, _LINES)
    nodes = block.type.nodes
    rule = np.concatenate([nodes, places]), np.concatenate([np.zeros(len(nodes)), weights])
    return sampled(block, rule)


def without_partner(
    slaves: Sequence[Facets],
    masters: Sequence[Facets],
    samples: Sequence[Samples],
    found: Sequence[Segments],
    reach: float,
    n_macro: int,
) -> np.ndarray:
    """The area (m,) of macro-elements that lies opposite the master but in no segment.

    Of faces that are not covered whole, lines along the normal tell how much is opposite a master
    face: one that looks at the point, and is no farther from the segments of the macro-element
    than its own size. What lies beyond is a step. Faces that the master's edge crosses are known
    to one of their points.

    >>> samples, found = face_samples([slave]), meet_in_segments([slave], [], [master], 1.0)
    >>> both = [slave], [master], samples
    >>> [without_partner(*both, some, 1.0, 1).round(12).tolist()
    ...  for some in (found, [found[0].of(np.array([0]))])]
    [[0.0], [1.0]]
    """
    lost = np.zeros(n_macro)
    missed = missed_area(samples, found)
    bare = bare_faces(samples, missed)
    if not any(len(faces) for faces in bare):
        return lost
    low, high = np.full(n_macro, np.inf), np.full(n_macro, -np.inf)
    for segments in found:
        np.minimum.at(low, segments.macro, segments.gap.min(axis=1))
        np.maximum.at(high, segments.macro, segments.gap.max(axis=1))
    size = extents(slaves, n_macro)
    low, high = (np.where(high < low, sign * reach, x) for x, sign in ((low, -1), (high, 1)))
    for a, (block, faces) in enumerate(zip(slaves, bare, strict=True)):
        if not len(faces):
            continue
        sample = _lines(block)
        point, gap = all_hits(block, sample, masters, reach, faces)
        face = point // len(sample.values)
        macro = block.number[face]
        near = (gap >= low[macro] - size[macro]) & (gap <= high[macro] + size[macro])
        met = np.zeros(sample.weight.shape, dtype=bool)
        met.flat[point[near]] = True
        opposite = np.where(met, sample.weight, 0.0).sum(axis=1)[faces]
        whole, largest = sample.weight.sum(axis=1)[faces], sample.weight.max(axis=1)[faces]
        # The edge of the master is known to the share of one row of points.
        unsure = np.where(met[faces].all(axis=1), 0.0, _LINES ** (block.type.dim - 1) * largest)
        beyond = opposite - (whole - missed[a][faces]) - unsure
        np.add.at(lost, block.number[faces], np.where(beyond > MISSED * whole, beyond, 0.0))
    return lost


DEFAULT_POINTS = 4
# Slave nodes at the end of a bent surface may look past the master's by this part of a face.
_BEYOND = 0.05
_ALL = tuple(name for name, kind in BY_NAME.items() if kind.dim < 3)
_LINEAR = tuple(name for name in _ALL if BY_NAME[name].order == 1)


@dataclass(frozen=True)
class Treatment:
    """One treatment.

    `cut`: whether slave faces are cut, so that each macro-element owns an unknown; `scheme` the
    integration, given the number of points; `faces` the slave faces that it exists for, and `why`
    not for others; `what` it is, in words. `joins`: whether multipliers of held nodes join those of
    their neighbours.
    """

    what: str
    cut: bool
    scheme: Callable[[int], Scheme]
    faces: tuple[str, ...] = _ALL
    why: str = ""
    joins: bool = False


def _quadrature(points: int) -> Scheme:
    return Scheme(sample=partial(gauss, n=points), meet=meet_at_points, closure=False)


_NODES = Scheme(
    sample=at_nodes, meet=partial(meet_at_points, beyond=_BEYOND), space=one_each, closure=False
)
_NODAL = Scheme(meet=partial(meet_in_segments, weighted=True), space=linear)

TREATMENTS: dict[str, Treatment] = {
    "lac": Treatment("one pressure for each macro-element, exact segments", True, lambda _: LAC),
    "uncut": Treatment("one pressure for each slave face, not cut", False, lambda _: LAC),
    "quadrature": Treatment(
        "one pressure for each macro-element, points projected to the master", True, _quadrature
    ),
    "node_to_segment": Treatment(
        "a force at each slave node, which meets one master face",
        False,
        lambda _: _NODES,
        (*_LINEAR, "SEG3", "QUAD9"),
        "forces of a uniform pressure are zero at vertices of TRIA6, negative at those of QUAD8",
    ),
    "nodal": Treatment(
        "mortar: pressure linear between slave vertices, exact segments",
        False,
        lambda _: _NODAL,
        joins=True,
    ),
    "nodal_dual": Treatment(
        "mortar: dual multipliers at slave nodes, exact segments",
        False,
        lambda _: replace(_NODAL, space=dual),
        _LINEAR,
        "it is built of linear shape functions; quadratic ones ask for a change of their basis",
        joins=True,
    ),
}


def scheme_of(name: str, points: int | None) -> Scheme:
    """The integration of a treatment, by as many points each way where it has them.

    >>> scheme_of("quadrature", 2).closure, scheme_of("lac", None).closure
    (False, True)
    """
    scheme = TREATMENTS[name].scheme(points or DEFAULT_POINTS)
    return replace(scheme, lost=without_partner)


# A node is held along its normal where less than this share of a motion that way is free.
_HELD = 1e-12
# Normals of two zones at a node are independent from an angle of this sine on, 30 degrees up to
# rounding: half the angle between two faces of a coarse smooth surface is no corner.
_INDEPENDENT = 0.5 - 1e-9


def merge_fixed_multipliers(
    operator: GapOperator, basis: sparse.csr_matrix, taken: np.ndarray | None = None
) -> GapOperator:
    """The operator without multipliers of held nodes; `basis` (n_dofs, n_free) is what is free.

    `taken` (n_nodes, dim, dim): the projection on the directions of multipliers that other zones
    have at each node; those of the operator are added to it. The operator stays as it is where all
    nodes are held, or none.

    A support holds node 0, so that the multiplier of node 1 stands for the whole edge:

    >>> operator = gap_operator([slave], [master], 1, 5, 1.0, scheme_of("nodal", None))
    >>> operator.area.round(15).tolist()
    [1.0, 1.0]
    >>> free = sparse.identity(10, format="csr")[:, 2:]
    >>> merge_fixed_multipliers(operator, free).area.round(15).tolist()
    [2.0]
    """
    if operator.nodes is None:
        raise ValueError("the multipliers do not belong to nodes")
    held = _held(operator, operator.nodes, basis, taken)
    if held.all() or not held.any():
        return operator
    of_nodes = _of_nodes(operator.mean, held)
    onto = of_nodes.T.tocsr()
    return replace(
        operator,
        matrix=(onto @ operator.matrix).tocsr(),
        initial=onto @ operator.initial,
        area=onto @ operator.area,
        covered=onto @ operator.covered,
        mean=(operator.mean @ of_nodes).tocsr(),
        at_nodes=of_nodes,
    )


def _of_nodes(mean: sparse.csr_matrix, held: np.ndarray) -> sparse.csr_matrix:
    """Values of all nodes (n, k) by those of the free ones: held ones take the mean around them."""
    sharing = (mean != 0).astype(float)
    shares = (sharing[:, held].T @ sharing[:, ~held] != 0).astype(float)
    count = np.asarray(shares.sum(axis=1)).ravel()
    shares = (sparse.diags(1 / np.maximum(count, 1)) @ shares).tocoo()
    free = np.flatnonzero(~held)
    rows = np.concatenate([free, np.flatnonzero(held)[shares.row]])
    columns = np.concatenate([np.arange(len(free)), shares.col])
    values = np.concatenate([np.ones(len(free)), shares.data])
    return sparse.coo_matrix((values, (rows, columns)), shape=(len(held), len(free))).tocsr()


def _held(
    operator: GapOperator, nodes: np.ndarray, basis: sparse.csr_matrix, taken: np.ndarray | None
) -> np.ndarray:
    """Which multipliers (k,), each at its node, see a node without a free direction for them."""
    k, dim = len(nodes), operator.surface.centre.shape[1]
    rows = np.repeat(np.arange(k), dim)
    columns = (dim * nodes[:, None] + np.arange(dim)).ravel()
    own = np.asarray(operator.matrix[rows, columns]).ravel()
    normal = sparse.coo_matrix((own, (rows, columns)), shape=operator.matrix.shape).tocsr()
    size, free = sparse.linalg.norm(normal, axis=1), (normal @ basis).tocsr()
    held = (size > 0) & (sparse.linalg.norm(free, axis=1) <= _HELD * size)
    if taken is not None:
        along = np.asarray((free @ basis.T).tocsr()[rows, columns]).reshape(k, dim)
        rest = along - np.einsum("nij,nj->ni", taken[nodes], along)
        length, left = (np.linalg.norm(v, axis=1) for v in (along, rest))
        held |= left < _INDEPENDENT * length
        unit = rest[~held] / np.where(left > 0, left, 1.0)[~held, None]
        taken[nodes[~held]] += unit[:, :, None] * unit[:, None]
    return held


_SHARE = 0.1
# A master face counts as at most so many slave faces wide.
_COARSEST = 8.0
# Faces longer than wide by more than the first factor are stretched, by the second at most.
_STRETCHED, _LONGEST = 2.0, 4.0


@dataclass(frozen=True, kw_only=True)
class Stabilisation:
    """D (m,) of macro-elements, their moments, and which are neighbours, `near` (m, m)."""

    weight: np.ndarray
    moments: Moments
    near: sparse.csr_matrix

    def scatter(self, closed: np.ndarray) -> sparse.csr_matrix:
        """I − R (c, c) of the c closed macro-elements (m,)."""
        form = FORMS["none"]
        found = reconstruct(self.moments, self.near, closed, form)
        k = form.count(self.moments.local.centre.shape[1])
        return found.matrix[k - 1 :: k][closed][:, closed].tocsr()


def _stretch(spread: np.ndarray) -> np.ndarray:
    """The aspect ratio of macro-elements (m,) over that from which they are stretched; at least 1.

    `spread` (m, d, d): see `Moments`. The inner node of a stretched face hardly moves, since the
    long edges beside it hold it, and the pressure scatters along the face as it does without cut.
    """
    if spread.shape[1] == 2:
        return np.ones(len(spread))
    narrow, long = np.sqrt(np.maximum(np.linalg.eigvalsh(spread)[:, 1:], 0.0)).T
    return np.clip(long / np.where(narrow > 0, _STRETCHED * narrow, np.inf), 1.0, _LONGEST)


def stabilisation(
    found: Sequence[Segments],
    moments: Moments,
    near: sparse.csr_matrix,
    area: np.ndarray,
    soft_of: tuple[np.ndarray, np.ndarray],
) -> Stabilisation:
    """That of m macro-elements of covered `area` (m,), from the segments that cover them.

    `soft_of`: 1 / E of the slave's cells behind each macro-element (m,), and by the numbers of the
    master's faces.

    Master edges of length 1 over a slave edge of length 2, with 1 / E = 1/4 and 1/2: they count as
    no finer, D = (2 · 1 · 1/4 + 4 · 2 · 1/2) · 2 / 10:

    >>> found = meet_in_segments([slave], [], [master], 1.0, degree=1)
    >>> at = Surface(area=np.array([2.0]), covered=np.array([2.0]), centre=np.array([[1.0, 0.0]]),
    ...              normal=np.array([[0.0, 1.0]]), lost=np.zeros(1))
    >>> soft, alone = (np.array([0.5]), np.full(2, 0.25)), sparse.eye_array(1, dtype=bool).tocsr()
    >>> stabilisation(found, moments(found, at), alone, at.covered, soft).weight.round(12)
    array([0.9])
    """
    dim = moments.local.centre.shape[1]
    sizes, soft, covered = np.zeros((3, len(area)))
    for segments in found:
        faces, face = segments.master.faces, segments.master.face
        compliant = soft_of[1][faces.number[face]]
        size = faces.radius[face] * (2.0 if dim == 2 else np.sqrt(2.0)) / faces.type.order
        size = np.where(compliant > 0, size, 0.0)  # facets of rigid masters are their shape
        np.add.at(covered, segments.macro, segments.area)
        np.add.at(sizes, segments.macro, segments.area * size)
        np.add.at(soft, segments.macro, segments.area * size * compliant)
    covered = np.where(covered > 0, covered, 1.0)
    own = 1 / np.linalg.norm(moments.local.axes[:, 0], axis=1)
    stretch = _stretch(moments.spread)
    ratio = np.clip(sizes / covered / (own * np.sqrt(stretch)), 1.0, _COARSEST)
    slave = 4 * own * stretch**3 * soft_of[0]
    weight = _SHARE * area * ((1 + ratio**4) * soft / covered + slave)
    return Stabilisation(weight=weight, moments=moments, near=near)
