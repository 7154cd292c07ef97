"""The contact surfaces of a case in its mesh, and which of them are refused."""

from typing import TypeAlias

import meshio

from ..case.model import Case, Zone
from ..lac.cells.faces import FaceBlock
from ..mechanics.mortar.treatments import TREATMENTS
from ..system.errors import InputError
from .cut_groups import faces_of

# Slave and master faces of each zone.
Surfaces: TypeAlias = list[tuple[list[FaceBlock], list[FaceBlock]]]


def surfaces_of(case: Case, mesh: meshio.Mesh) -> Surfaces:
    """Slave and master faces of each zone.

    Raises InputError where a treatment does not exist for a slave face, where a slave face of an
    axisymmetric body lies on the axis, and where two zones share a slave face.
    """
    surfaces: Surfaces = []
    for i, zone in enumerate(case.zones):
        slave, master = (
            faces_of(mesh, getattr(zone, side), case, case.zone_key(i, side))
            for side in ("slave", "master")
        )
        _refuse_untreated(case, i, zone, slave)
        if case.axisymmetric:
            _refuse_on_axis(case, mesh, i, slave)
        _refuse_common_faces(case, i, slave, surfaces)
        surfaces.append((slave, master))
    return surfaces


def _refuse_untreated(case: Case, i: int, zone: Zone, slave: list[FaceBlock]) -> None:
    treatment = TREATMENTS[zone.treatment]
    for block in slave:
        if block.type.name not in treatment.faces:
            others = [name for name, t in TREATMENTS.items() if block.type.name in t.faces]
            allowed = (
                f"does not exist for slave faces {block.type.name} of {block.owner_type.name}: "
                f"{treatment.why}; allowed there: {', '.join(others)}"
            )
            raise InputError(case.path, f"contact[{i}].treatment", zone.treatment, allowed)


def _refuse_common_faces(case: Case, i: int, slave: list[FaceBlock], others: Surfaces) -> None:
    """A face has one multiplier, the pressure of one zone."""
    for zone, (faces, _) in zip(case.zones, others, strict=False):
        if common := sum(len(a.common(b)[0]) for a in slave for b in faces):
            allowed = (
                f"{common} of its faces are slave faces of zone {zone.name} too: give one zone "
                "both master surfaces, as a list"
            )
            raise InputError(case.path, case.zone_key(i, "slave"), case.zones[i].slave, allowed)


def _refuse_on_axis(case: Case, mesh: meshio.Mesh, i: int, slave: list[FaceBlock]) -> None:
    """Refuse slave faces of no area, and treatments that divide by the area of one node."""
    zone = case.zones[i]
    for block in slave:
        ends = mesh.points[block.nodes[:, : block.type.n_vertices], 0] == 0
        if flat := int(ends.all(axis=1).sum()):
            allowed = f"{flat} of its faces lie on the axis: they have no area"
            raise InputError(case.path, case.zone_key(i, "slave"), zone.slave, allowed)
        if ends.any() and zone.treatment == "node_to_segment" and block.type.order == 2:
            allowed = (
                f"does not exist for slave faces {block.type.name} that end on the axis: a uniform "
                "pressure has no force at the node there; allowed there: lac, quadrature, nodal"
            )
            raise InputError(case.path, f"contact[{i}].treatment", zone.treatment, allowed)
