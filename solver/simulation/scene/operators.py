"""The gap operator of a zone, as its keys ask for it: directions, initial gaps, recovery."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...case.file import Zone
from ...lac.cells.catalogue import BY_NAME
from ...lac.cells.faces import FACE_POINTS, FaceBlock, surface_normals, surface_points
from ...lac.cells.neighbours import vertex_neighbours
from ...lac.cut import SubFaces
from ...lac.facets import Facets, facets, with_directions, with_master_normals, with_nodal_normals
from ...lac.multipliers import constants
from ...lac.operator import GapOperator, Scheme, gap_operator
from ...lac.partners import face_samples
from ...lac.reconstruction import form_of
from ...lac.recovery import RecoveryRequest
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
    compliance = None
    if zone.stabilised:
        softness = np.array([1 / m.young for m in groups.case.materials.values()] + [0.0])
        compliance = partial(stabilisation, soft_of=(softness[material], softness))
    return RecoveryRequest(form, vertex_neighbours(vertices, count), material, compliance)


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
