"""The gap operator of a zone: initial gaps, recovery, and unknowns along contact frames.

With friction one node of each macro-element moves along n and t. Each row of the gap and of the
slip then has an unknown of its own, and condensation works as without friction. On a surface along
the axes the unknowns are so already, and nothing changes.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import sparse

from ...case.file import Zone
from ...lac.cells.catalogue import BY_NAME
from ...lac.cells.faces import FACE_POINTS, FaceBlock, surface_normals, surface_points
from ...lac.cells.neighbours import vertex_neighbours
from ...lac.cut import SubFaces
from ...lac.facets import Facets, facets, with_directions, with_master_normals, with_nodal_normals
from ...lac.multipliers import constants
from ...lac.operator import GapOperator, Scheme, gap_operator, without_round_off
from ...lac.partners import face_samples
from ...lac.reconstruction import form_of
from ...lac.recovery import RecoveryRequest
from ...mechanics.fem.supports import FreeMotion
from ...mechanics.mortar.points import gauss
from ...mechanics.mortar.quadric import Quadric, frame, meet_quadric
from ...mechanics.mortar.treatments import scheme_of, stabilisation
from ...system.errors import InputError
from ..options import Options
from .attributes import Attributes
from .cut_groups import CutZone

# Half of the largest angle between neighbouring faces of a master whose normals contact follows:
# those of a hexagon, whatever the rounding.
_SMOOTH = np.radians(30) + 1e-9


def operator_of(
    groups: Attributes,
    zone: Zone,
    faces: CutZone,
    master_faces: list[FaceBlock],
    noise: float,
    options: Options,
) -> GapOperator:
    """The gap operator of a zone; initial gaps below `noise` (a length) are zero."""
    points, count = groups.points, faces.count
    around = groups.axisymmetric
    slaves = [facets(points, f.type, f.nodes, f.macro, around) for f in faces.sub_faces]
    if zone.normal == "nodal":
        slaves = with_nodal_normals(slaves, points)
    scheme = scheme_of(zone.treatment, zone.points)
    closure = scheme.closure and options.safeguards.closure
    scheme = replace(scheme, closure=closure, slip=zone.friction > 0)
    if surface := groups.surface(zone.master):
        masters = [frame(points, groups.nodes(zone.master, "contact"))]
        if zone.normal == "master":
            slaves = with_directions(slaves, -surface.gradient(points))
        scheme = _without_segments(scheme, surface)
    else:
        materials = groups.materials_behind(master_faces)
        masters = _master_facets(points, master_faces, materials, around)
        if zone.normal == "master":
            _refuse_sharp(groups, zone, masters)
            slaves = with_master_normals(slaves, masters, points)
        if not options.shortcuts.quadrature:
            slaves, masters = ([_as_bent(block) for block in side] for side in (slaves, masters))
    asked = _recovery(groups, zone, faces.slave_faces) if scheme.space is constants else None
    operator = gap_operator(slaves, masters, count, len(points), None, scheme, asked)
    return replace(operator, initial=_initial_gaps(zone, operator, groups, faces.sub_faces, noise))


def _without_segments(scheme: Scheme, surface: Quadric) -> Scheme:
    """The scheme for a rigid surface without a mesh: points of whole faces in place of segments."""
    sample = partial(gauss, n=FACE_POINTS) if scheme.sample is face_samples else scheme.sample
    meet = partial(meet_quadric, surface)
    return replace(scheme, sample=sample, meet=meet, closure=False, nearest=False)


def _refuse_sharp(groups: Attributes, zone: Zone, masters: list[Facets]) -> None:
    angle, place = _sharpest(masters, groups.points)
    if angle > _SMOOTH:
        at = ", ".join(f"{x:.6g}" for x in place + groups.origin)
        allowed = (
            f"the master {zone.master} is not smooth: its faces turn by more than "
            f"{np.degrees(2 * _SMOOTH):.0f}° at ({at}); allowed there: element, nodal"
        )
        key = f"contact[{groups.case.zones.index(zone)}].normal"
        raise InputError(groups.case.path, key, zone.normal, allowed)


def _sharpest(masters: Sequence[Facets], points: np.ndarray) -> tuple[float, np.ndarray]:
    """The largest angle between a face and the mean normal at one of its nodes, and the place.

    The angle is in radians, half the angle of an edge between two faces.
    """
    normals = surface_normals(points, masters)
    found = []
    for block in masters:
        cosine = np.einsum("fad,fd->fa", normals[block.nodes], block.normal)
        worst = int(cosine.argmin())
        found.append((float(cosine.min()), int(block.nodes.ravel()[worst])))
    cosine, node = min(found)
    return float(np.arccos(np.clip(cosine, -1.0, 1.0))), points[node]


def _recovery(groups: Attributes, zone: Zone, slave_faces: list[FaceBlock]) -> RecoveryRequest:
    """How a zone's pressure is recovered, and which of its macro-elements may be neighbours."""
    count = sum(len(block.nodes) for block in slave_faces)
    order = min(block.owner_type.order for block in slave_faces)
    corners = min(block.type.n_vertices for block in slave_faces)
    vertices = [(b.number, b.nodes[:, : b.type.n_vertices]) for b in slave_faces]
    material = np.zeros(count, dtype=int)
    for block, number in zip(slave_faces, groups.materials_behind(slave_faces), strict=True):
        material[block.number] = number
    form = form_of(zone.recovery, order, corners)
    if form.sweeps and zone.sweeps:
        form = replace(form, sweeps=zone.sweeps)
    stabilise = None
    if zone.stabilised:
        softness = np.array([1 / m.young for m in groups.case.materials.values()] + [0.0])
        stabilise = partial(stabilisation, soft_of=(softness[material], softness))
    near, slip = vertex_neighbours(vertices, count), zone.friction > 0
    return RecoveryRequest(form, near, material, stabilise, slip)


def _as_bent(block: Facets) -> Facets:
    """The faces treated as no affine images of their reference face."""
    return replace(block, affine=np.zeros(len(block.affine), dtype=bool))


def _initial_gaps(
    zone: Zone,
    operator: GapOperator,
    groups: Attributes,
    sub_faces: list[SubFaces],
    noise: float,
) -> np.ndarray:
    """∫ φ gap (k,) at the start: as meshed, without those below `noise`, or as the case says."""
    if zone.clearance is None:
        meshed = operator.initial
        initial = np.where(np.abs(meshed) <= noise * operator.covered, 0.0, meshed)
    else:
        faces = [(f.type.name, f.nodes, f.macro) for f in sub_faces]
        at = surface_points(groups.points, faces, groups.axisymmetric)
        means = at.means(groups.field(zone.clearance)(at.place))
        whole = operator.mean.T @ (operator.surface.area * means)
        initial = whole * operator.covered / operator.area
    return initial - zone.interference * operator.covered


def _master_facets(
    points: np.ndarray, faces: list[FaceBlock], materials: list[np.ndarray], around: bool
) -> list[Facets]:
    """Master faces by type, whatever cells are behind them, with their materials (n,)."""
    merged = []
    for name in dict.fromkeys(block.type.name for block in faces):
        alike = [i for i, block in enumerate(faces) if block.type.name == name]
        nodes = np.concatenate([faces[i].nodes for i in alike])
        number = np.concatenate([materials[i] for i in alike])
        merged.append(facets(points, BY_NAME[name], nodes, number, around))
    return merged


# Coefficients below this share of the largest of a macro-element's node are round-off.
_ROUND_OFF = 1e-13


def with_contact_frames(
    free: FreeMotion, operators: Sequence[GapOperator], slave: np.ndarray
) -> FreeMotion:
    """The free motion with unknowns turned where rows of gap and slip share those of a node.

    The frame of a node is the factor Q of its coefficients C = L Qᵀ: row by row, each direction of
    the gap and of the slips adds one unknown. `slave` (n,): the nodes of slave surfaces.
    """
    frictional = [operator for operator in operators if operator.slip]
    if not frictional:
        return free
    dim = len(frictional[0].slip) + 1
    seen = sum(_columns(operator, dim) for operator in operators)
    alone = (seen == 1) & slave & _whole(free, dim)
    turned, frames = [], []
    for operator in frictional:
        nodes, coefficients = _own(operator, alone)
        size = np.abs(coefficients)
        there = size > _ROUND_OFF * size.max(axis=(1, 2), keepdims=True)
        mixed = (there.sum(axis=2) > 1).any(axis=1)
        turned.append(nodes[mixed])
        frames.append(_orthonormal(coefficients[mixed]))
    nodes = np.concatenate(turned)
    if not len(nodes):
        return free
    dofs = dim * nodes[:, None] + np.arange(dim)
    unknowns = free.basis.indices[free.basis.indptr[dofs]]
    rotation = _rotation(free.basis.shape[1], unknowns, np.concatenate(frames))
    return FreeMotion((free.basis @ rotation).tocsr(), free.offset, None)


def _orthonormal(rows: np.ndarray) -> np.ndarray:
    """Directions (m, dim, dim), in columns, of which the first k span the first k `rows`."""
    return np.asarray(np.linalg.qr(np.swapaxes(rows, 1, 2))[0])


def _columns(operator: GapOperator, dim: int) -> np.ndarray:
    """How many macro-elements see each node (n,)."""
    there = without_round_off(operator.matrix).tocoo()
    shape = (there.shape[0], there.shape[1] // dim)
    pairs = sparse.csr_matrix((np.ones(there.nnz), (there.row, there.col // dim)), shape=shape)
    return np.bincount(pairs.indices, minlength=shape[1])


def _whole(free: FreeMotion, dim: int) -> np.ndarray:
    """Which nodes (n,) have all of their degrees of freedom as unknowns."""
    basis = free.basis
    single = np.diff(basis.indptr) == 1
    used = np.diff(basis.tocsc().indptr)
    single[single] = used[basis.indices[basis.indptr[:-1][single]]] == 1
    return single.reshape(-1, dim).all(axis=1)


def _own(operator: GapOperator, alone: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (m,), and the coefficients (m, dim, dim) of the rows of gap and slip there.

    One for each macro-element that has nodes `alone` (n,): that with the largest coefficient.
    """
    dim = len(operator.slip) + 1
    entries = abs(operator.matrix).tocoo()
    node = entries.col // dim
    kept = alone[node]
    if not kept.any():  # the surfaces do not meet, which is refused later
        return np.empty(0, dtype=int), np.empty((0, dim, dim))
    order = np.flatnonzero(kept)[np.lexsort((entries.data[kept], entries.row[kept]))]
    row = entries.row[order]
    best = order[np.flatnonzero(np.diff(row, append=operator.matrix.shape[0]))]
    row, node = entries.row[best], node[best]
    rows = [matrix.tocsr() for matrix in (operator.matrix, *operator.slip)]
    dofs = dim * node[:, None] + np.arange(dim)
    places = row.repeat(dim), dofs.ravel()
    values = [np.asarray(matrix[places]).reshape(dofs.shape) for matrix in rows]
    return node, np.stack(values, axis=1)


def _rotation(size: int, unknowns: np.ndarray, frames: np.ndarray) -> sparse.csr_matrix:
    """The turn (n, n) of unknowns (m, dim) into frames (m, dim, dim), by column."""
    rows = np.repeat(unknowns, unknowns.shape[1], axis=1).ravel()
    columns = np.tile(unknowns, (1, unknowns.shape[1])).ravel()
    others = np.setdiff1d(np.arange(size), unknowns)
    entries = np.concatenate([frames.ravel(), np.ones(len(others))])
    places = np.concatenate([rows, others]), np.concatenate([columns, others])
    return sparse.csr_matrix((entries, places), shape=(size, size))
