"""How far a solve is from what it takes for granted, the limits of that, and what is noted of it.

Linear theory has small strains and rotations. Pairs of faces are those of the undeformed bodies, so
that contact may slide by less than a face. Bodies without a contact zone between them, or beyond
its reach, may come to lie in one another. A macro-element under the end of the master has the mean
pressure of the part that is covered. The gap of curved bodies is known to what facets miss of it.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy import sparse

from ...case.model import Case
from ...lac.cells.catalogue import CellType, cell_type
from ...lac.cells.faces import circumference
from ...lac.operator import MIN_COVERAGE
from ...lac.pairing import candidate_pairs
from ...lac.threads import prefetch
from ...mechanics.fem.stress import largest_strain
from ..equilibrium.problem import ContactProblem
from ..equilibrium.state import Equilibrium
from ..results.records import Validity
from ..results.solution import Line
from ..scene.scene import Scene, ZoneScene
from .facet_gaps import facets_of

# Cells that are looked at together.
_AT_ONCE = 1 << 14
# A place is inside a cell from this share of the depth of the cell's own middle on.
_DEEP = 1e-3


def inside_others(
    points: np.ndarray,
    cells: dict[str, np.ndarray],
    body: np.ndarray,
    apart: np.ndarray | None = None,
) -> int:
    """How many cells have their middle inside a cell of another body.

    `cells` by type (n, n_nodes) on `points` (n_points, dim), `body` (n_points,) a number from zero
    on, `apart` (b, b) pairs of bodies whose meshes do not show where they are. Faces of cells are
    taken as plane. Bodies that touch, and faces of curved surfaces that overlap a little, count as
    apart: it takes about half a cell.

    Two squares of edge 1 overlap by less than half a cell, then by more:

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> quads = {"QUAD4": np.arange(8).reshape(2, 4)}
    >>> for x in (0.6, 0.4):
    ...     inside_others(np.concatenate([square, square + [x, 0.1]]), quads, np.repeat([0, 1], 4))
    0
    2
    """
    count, dim = int(body.max()) + 1, points.shape[1]
    low, high = np.full((count, dim), np.inf), np.full((count, dim), -np.inf)
    np.minimum.at(low, body, points)
    np.maximum.at(high, body, points)
    meet = np.all((low[:, None] < high) & (low < high[:, None]), axis=2)
    meet &= ~np.eye(count, dtype=bool)
    if apart is not None:
        meet &= ~apart
    if not meet.any():
        return 0
    blocks = [(cell_type(name), nodes) for name, nodes in cells.items()]
    parts = [
        nodes[first : first + _AT_ONCE, : kind.n_vertices]
        for kind, nodes in blocks
        for first in range(0, len(nodes), _AT_ONCE)
    ]
    balls = prefetch(lambda nodes: _ball(points[nodes]), parts)
    middle, radius = (np.concatenate(each) for each in zip(*balls, strict=True))
    owner = np.concatenate([body[nodes[:, 0]] for _, nodes in blocks])
    inside = np.zeros(len(owner), dtype=bool)
    for a in np.unique(np.nonzero(meet)[0]):
        boxes = np.flatnonzero(meet[a])
        mine = np.flatnonzero(owner == a)
        at = middle[mine][:, None]
        within = np.all((at > low[boxes]) & (at < high[boxes]), axis=2)
        mine = mine[np.any(within, axis=1)]
        if not len(mine):
            continue
        near = (middle + radius[:, None] > middle[mine].min(axis=0)) & (owner != a)[:, None]
        near &= middle - radius[:, None] < middle[mine].max(axis=0)
        theirs = np.flatnonzero(near.all(axis=1))
        around = middle[theirs], radius[theirs]
        i, j = candidate_pairs(middle[mine], np.zeros(len(mine)), *around, 0.0)
        i, j, first = mine[i], theirs[j], 0
        for kind, nodes in blocks:
            pick = (j >= first) & (j < first + len(nodes))
            hit = _contained(points, kind, nodes[j[pick] - first], middle[i[pick]])
            inside[i[pick][hit]] = True
            first += len(nodes)
    return int(inside.sum())


def _ball(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle (n, dim) of cells with vertices (n, n_vertices, dim), and radius (n,) around it."""
    middle = vertices.mean(axis=1)
    return middle, np.linalg.norm(vertices - middle[:, None], axis=2).max(axis=1)


def _contained(
    points: np.ndarray, kind: CellType, nodes: np.ndarray, place: np.ndarray
) -> np.ndarray:
    """Which places (n, dim) are inside their cell (n, n_nodes): behind all of its faces.

    By more than rounding, as a share of the depth of its own middle.
    """
    inside = np.ones(len(nodes), dtype=bool)
    middle = points[nodes[:, : kind.n_vertices]].mean(axis=1)
    for face in kind.faces:
        corner = points[nodes[:, face.nodes[: cell_type(face.type).n_vertices]]]
        a, b, *rest = np.moveaxis(corner, 1, 0)
        if kind.dim == 2:
            normal = (b - a)[:, ::-1] * [1.0, -1.0]
        else:
            # of a quadrangle, the angle of its diagonals
            one, other = (b - a, rest[0] - a) if len(rest) == 1 else (rest[0] - a, rest[1] - b)
            normal = np.cross(one, other)
        depth, own = (
            np.einsum("nd,nd->n", at - corner.mean(axis=1), normal) for at in (place, middle)
        )
        inside &= depth < _DEEP * own
    return inside


# A strain or rotation above the first is noted, one above the second is unreliable.
_NOTED_STRAIN, _SMALL_STRAIN = 1e-2, 1e-1
NOTED_SLIP = 0.1
"""A larger slip than this share of a macro-element is noted: linear theory has small ones."""
# One above this is unreliable.
_SMALL_SLIP = 1.0
# The same for a share of a macro-element that should have a partner.
_NOTED_UNPAIRED, _UNPAIRED = 1e-3, 1e-2
# The same for the change of a pressure by facets, and how deep they are, in elastic closings.
_NOTED_FACETS, _FACETS, _DEPTH = 1e-2, 0.1, 2.0
NOTED_DEPTH = 0.1
"""Deeper facets than this, in elastic closings, are worth a word."""
# The checks of a pressure along the surface whose tolerance may be wider.
OF_PRESSURE = (
    "multiplier",
    "pressure_l2",
    "pressure_means",
    "pressure_max",
    "pressure_oscillation",
)


def validity(problem: ContactProblem, states: Sequence[Equilibrium]) -> Validity:
    """How far the load steps are from what a solve takes for granted."""
    scene, facets = problem.scene, facets_of(problem, states)
    solid, apart, found = meshed(scene), _apart(scene), []
    for state in states:
        moved, closed = state.displacement, state.status.closed
        strain, rotation = largest_strain(scene.points, scene.blocks, moved)
        slips = (_slip(scene, z, moved, closed) for z in scene.zones if _bent(z, scene))
        one = Validity(
            strain=strain,
            rotation=max(rotation, _turn(scene, moved)),
            slip=max(slips, default=0.0),
            pushed_past=inside_others(scene.points + moved, solid, scene.body, apart),
            partly_covered=sum(_partly_covered(zone, closed) for zone in scene.zones),
            unpaired=max((_unpaired(zone, closed) for zone in scene.zones), default=0.0),
            facets=facets.pressure,
            facet_depth=facets.depth,
        )
        found.append(one)
    return Validity.worst(found)


def _apart(scene: Scene) -> np.ndarray:
    """Pairs of bodies (b, b) whose gap a zone gives: their meshes may lie in one another."""
    found = np.zeros((scene.n_bodies, scene.n_bodies), dtype=bool)
    for zone in scene.zones:
        if zone.zone.clearance is not None:
            slave, master = (
                np.unique(np.concatenate([scene.body[b.nodes[:, 0]] for b in side] or [[]]))
                for side in (zone.slave_faces, zone.master_faces)
            )
            pair = np.ix_(slave.astype(int), master.astype(int))
            found[pair] = True
    return found | found.T


def meshed(scene: Scene) -> dict[str, np.ndarray]:
    """The cells by type, without those that carry the motion of a surface."""
    frames = scene.held.frames.items()
    hidden = [scene.given.groups[name] for name, frame in frames if frame.without_cells]
    kept = {}
    for kind, cells in scene.mesh.cells.items():
        parts = [scene.mesh.members(kind, group) for group in hidden]
        kept[kind] = cells[~np.any([np.zeros(len(cells), dtype=bool), *parts], axis=0)]
    return kept


def _turn(scene: Scene, moved: np.ndarray) -> float:
    """The largest rotation of a rigid body, in radians."""
    found = [0.0]
    for frame in scene.held.frames.values():
        amount = frame.amount(moved[frame.nodes])
        found.append(float(np.linalg.norm([amount.get(key, 0.0) for key in ("rx", "ry", "rz")])))
    return max(found)


def _bent(zone: ZoneScene, scene: Scene) -> bool:
    """Whether sliding changes what a zone takes for granted: a rigid plane is the same all over."""
    return scene.case.surfaces.get(zone.zone.master) != "plane"


def _slip(scene: Scene, zone: ZoneScene, moved: np.ndarray, closed: np.ndarray) -> float:
    """The largest mean slip under a closed multiplier, by the size of macro-elements there."""
    operator, surface = zone.operator, zone.operator.surface
    mine, dim = closed[zone.numbers], moved.shape[1]
    size = surface.area
    if scene.case.axisymmetric:
        size = size / circumference(surface.centre)
    by_multiplier, area = operator.mean.T, surface.area
    normal = by_multiplier @ (area[:, None] * surface.normal)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    size = (by_multiplier @ (area * size ** (1 / (dim - 1)))) / (by_multiplier @ area)
    gaps = operator.matrix.tocoo()
    along = gaps.data * normal[gaps.row, gaps.col % dim]
    shape = (len(mine), len(moved))
    shares = sparse.csr_array((along, (gaps.row, gaps.col // dim)), shape=shape)
    jump = (shares @ moved)[mine] / operator.covered[mine, None]
    slip = jump - normal[mine] * np.einsum("kd,kd->k", jump, normal[mine])[:, None]
    return float((np.linalg.norm(slip, axis=1) / size[mine]).max(initial=0.0))


def _partly_covered(zone: ZoneScene, closed: np.ndarray) -> int:
    """How many closed macro-elements the master covers in part."""
    surface = zone.operator.surface
    share = surface.covered / surface.area
    pressed = zone.by_macro_element(closed.astype(float)) > 0
    return int((pressed & (share > MIN_COVERAGE) & (share < 1 - MIN_COVERAGE)).sum())


def _unpaired(zone: ZoneScene, closed: np.ndarray) -> float:
    """The largest share of a macro-element that lost its partner, closed or not covered at all.

    One that is not covered counts beside closed ones. Elsewhere it turns away from a master that
    it does not touch, as the flank of a rounding does.
    """
    surface = zone.operator.surface
    pressed = zone.by_macro_element(closed.astype(float)) > 0
    bare = surface.covered <= MIN_COVERAGE * surface.area
    bare &= zone.near @ pressed > 0
    return float(np.max((surface.lost / surface.area)[pressed | bare], initial=0.0))


def remarks(found: Validity) -> Iterator[Line]:
    """Lines of the plan for what is not small, or not as a user may expect."""
    if max(found.strain, found.rotation) > _NOTED_STRAIN:
        what = f"largest strain {found.strain:.1e}, rotation {found.rotation:.1e}"
        yield Line(what, "linear theory leaves out terms of this size, relative to what it keeps")
    if found.slip > NOTED_SLIP:
        what = f"contact slides by up to {found.slip:.2g} of a face"
        yield Line(what, "pairs of faces belong to the undeformed bodies")
    if found.partly_covered:
        what = f"the master ends inside {found.partly_covered} macro-elements in contact"
        yield Line(what, "their pressure is the mean over the part that it covers")
    if found.facets > _NOTED_FACETS or found.facet_depth > NOTED_DEPTH:
        what = f"facets of curved surfaces change the pressure by about {found.facets:.1%}"
        deep = f"{found.facet_depth:.2g}"
        why = f"they are {deep} times as deep as the bodies close, or as the gap that is left"
        yield Line(what, why)
    if found.unpaired > _NOTED_UNPAIRED:
        what = f"{found.unpaired:.1%} of a macro-element lies opposite the master without a partner"
        yield Line(what, "the master has a step there, or turns away too far")


def allowed_of_pressure(case: Case, limit: float) -> float:
    """The limit of an error of the pressure, or the case's own tolerance where it is wider."""
    tolerance = case.reference.tolerance
    own = (tolerance[check] for check in OF_PRESSURE if check in tolerance)
    return max(limit, *own, 0.0)


def broken_by_facets(case: Case, found: Validity) -> str:
    """Why the facets of curved surfaces make a pressure unreliable; empty where they do not."""
    if found.facets > allowed_of_pressure(case, _FACETS):
        what = f"change its pressure by {found.facets:.0%}"
    elif found.facet_depth > _DEPTH:
        what = f"are {found.facet_depth:.2g} times as deep as the bodies close, or as the gap left"
    else:
        return ""
    return (
        f"the facets of curved contact {what}: give the gap (`clearance`, 0 where the bodies fit), "
        "take quadratic cells, or mesh the curved surface finer (halved cells keep the facets)"
    )


def limits_passed(case: Case, found: Validity) -> list[str]:
    """Why a result is unreliable; empty where it is not.

    A case that names an exact solution asks for one of linear theory, whatever the size.
    """
    reasons = []
    if found.unpaired > _UNPAIRED:
        reasons.append(
            f"{found.unpaired:.2g} of a macro-element lies opposite the master but has no partner: "
            "refine the slave at steps of the master, or its surface where it turns away"
        )
    if why := broken_by_facets(case, found):
        reasons.append(why)
    if case.reference.exact is not None:
        return reasons
    if max(found.strain, found.rotation) > _SMALL_STRAIN:
        reasons.append(
            f"strain {found.strain:.2g} with rotation {found.rotation:.2g} is beyond small strain: "
            f"above {_SMALL_STRAIN:g} linear theory does not describe the bodies"
        )
    if found.slip > _SMALL_SLIP:
        reasons.append(
            f"contact slides by {found.slip:.2g} of a face: above {_SMALL_SLIP:g} the faces that "
            "were paired are no longer opposite each other (`motion: large` follows them)"
        )
    if found.pushed_past:
        reasons.append(
            f"the middle of cells ({found.pushed_past}) is inside another body: the bodies were "
            "pushed past each other where no contact zone, or none within its reach, keeps them "
            "apart"
        )
    return reasons
