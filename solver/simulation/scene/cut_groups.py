"""The groups of a mesh file on the mesh with cut slave cells: surfaces, and what joins nodes.

Supports that fix no displacement are here: springs, nodes that move as one or as others do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeAlias

import meshio
import numpy as np

from ...case.acting import Scalar
from ...case.expressions import evaluate
from ...case.file import Zone
from ...case.model import Case
from ...case.solutions.base import ExactSolution
from ...lac.cells.catalogue import BY_MESHIO, BY_NAME
from ...lac.cells.faces import FaceBlock
from ...lac.cut import CutMesh, SubFaces
from ...lac.facets import facets
from ...lac.motions import body_numbers
from ...mechanics.fem.faces import FaceError, boundary_faces, volume_cells
from ...mechanics.fem.loads import Field
from ...mechanics.mortar.treatments import TREATMENTS
from ...system.errors import InputError
from .groups import ALL

_NO_AREA = "lie on the axis: they have no area"


@dataclass(frozen=True)
class CutZone:
    """A contact zone: its slave faces as meshed, and their sub-faces after the cut.

    Macro-elements of sub-faces are counted within the zone.
    """

    slave_faces: list[FaceBlock]
    sub_faces: list[SubFaces]

    @property
    def count(self) -> int:
        """How many macro-elements there are."""
        return sum(len(block.nodes) for block in self.slave_faces)


def faces_of(mesh: meshio.Mesh, group: str, case: Case, key: str) -> list[FaceBlock]:
    """The faces of a group that the case names under `key`; refuses those not on a boundary."""
    try:
        return boundary_faces(mesh, group)
    except FaceError as error:
        raise InputError(case.path, key, group, str(error)) from None


class CutGroups:
    """The groups of the mesh file carried over to the cut mesh.

    Points are counted from `origin` (dim,), as in the scene.
    """

    def __init__(
        self,
        case: Case,
        mesh: meshio.Mesh,
        cut_mesh: CutMesh,
        zones: Sequence[CutZone],
        origin: np.ndarray,
    ):
        self.case, self.mesh, self.cut = case, mesh, cut_mesh
        self.points, self.origin, self.zones = cut_mesh.points, origin, zones
        self.axisymmetric = case.axisymmetric
        self._faces: dict[str, list[tuple[str, np.ndarray]]] = {}
        self._nodes: dict[str, np.ndarray] = {}

    def as_in(self, other: CutGroups) -> Self:
        """With the nodes and faces found in `other` groups of the mesh, wherever bodies move."""
        self._faces, self._nodes = other._faces, other._nodes
        return self

    def whole_cell_mask(self, group: str) -> dict[str, np.ndarray]:
        """Which volume cells (n,) of each type, as meshed, belong to a group."""
        whole = {name: np.zeros(len(c), bool) for name, c in volume_cells(self.mesh).items()}
        for block, members in zip(self.mesh.cells, self.mesh.cell_sets.get(group, []), strict=True):
            name = _type_name(block.type)
            if name in whole and members is not None:
                whole[name][np.asarray(members, dtype=int)] = True
        return whole

    def cell_mask(self, group: str) -> dict[str, np.ndarray]:
        """Which cells (n,) of each type of the cut mesh belong to a group of volume cells."""
        whole = self.whole_cell_mask(group)
        return {name: self.cut.members(name, whole) for name in self.cut.cells}

    def faces(self, group: str, key: str) -> list[tuple[str, np.ndarray]]:
        """The faces of a group, slave faces replaced by their sub-faces: (type, nodes)."""
        if group not in self._faces:
            blocks = self.as_cut(faces_of(self.mesh, group, self.case, key))
            self._faces[group] = [(block.type.name, _kept(block.nodes)) for block in blocks]
        return self._faces[group]

    def faces_with_area(self, group: str, key: str) -> list[tuple[str, np.ndarray]]:
        """The faces of a group that do not lie on the axis of revolution; refused without any."""
        found = self.faces(group, key)
        if not self.axisymmetric:
            return found
        found = [(name, nodes[(self.points[nodes, 0] != 0).any(axis=1)]) for name, nodes in found]
        if not sum(len(nodes) for _, nodes in found):
            raise InputError(self.case.path, key, group, f"all of its faces {_NO_AREA}")
        return found

    def as_cut(self, faces: Sequence[FaceBlock]) -> list[FaceBlock]:
        """The faces as meshed, slave faces replaced by their sub-faces."""
        found: list[FaceBlock] = []
        for block in faces:
            whole = np.ones(len(block.nodes), dtype=bool)
            for zone in self.zones:
                for slave in zone.slave_faces:
                    mine, theirs = block.common(slave)
                    if len(mine):
                        whole[mine] = False
                        number = np.full(zone.count, -1)
                        number[slave.number[theirs]] = mine
                        found += [_part(block, sub, number) for sub in zone.sub_faces]
            found.append(block.of(whole))
        return [block for block in found if len(block.nodes)]

    def nodes(self, group: str, key: str) -> np.ndarray:
        """All nodes of a group: of its volume cells, faces, edges and points."""
        if group not in self._nodes:
            self._nodes[group] = _kept(self._nodes_of(group, key))
        return self._nodes[group]

    def _nodes_of(self, group: str, key: str) -> np.ndarray:
        dim = self.points.shape[1]
        if group == ALL:
            return np.arange(len(self.points))
        parts = [np.asarray(self.mesh.point_sets.get(group, []), dtype=int)]
        if group in self.mesh.cell_sets:
            mask = self.cell_mask(group)
            parts += [self.cut.cells[name][mask[name]].ravel() for name in mask]
            dims = set()
            for block, members in zip(self.mesh.cells, self.mesh.cell_sets[group], strict=True):
                if members is not None and len(members):
                    dims.add(BY_NAME[_type_name(block.type)].dim)
                    parts.append(block.data[np.asarray(members, dtype=int)].ravel())
            if dim - 1 in dims:
                parts += [nodes.ravel() for _, nodes in self.faces(group, key)]
        return np.unique(np.concatenate(parts))

    def field(self, values: Scalar | tuple[Scalar, ...]) -> Field:
        """A case's number, expression or vector as a function of the local coordinates."""

        def value(local: np.ndarray) -> np.ndarray:
            place = local + self.origin
            if isinstance(values, tuple):
                return np.stack([evaluate(v, place) for v in values], axis=1)
            return evaluate(values, place)

        return value

    def carried(self, name: str, point: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Where a point (dim,) of the mesh as given, which moves with a rigid body, is now."""
        return point

    @cached_property
    def body(self) -> np.ndarray:
        """The body (n,) of each node."""
        return body_numbers(len(self.points), self.cut.cells)

    @cached_property
    def exact_part(self) -> np.ndarray:
        """The part (n,) of the case's exact solution that each node belongs to."""
        return self.exact.node_parts(self.points + self.origin, self.body)

    @property
    def exact(self) -> ExactSolution:
        """The exact solution that the case names."""
        if self.case.reference.exact is None:
            raise AssertionError("a value is taken from a solution that the case does not name")
        return self.case.reference.exact

    def exact_displacement(self, nodes: np.ndarray) -> np.ndarray:
        """The displacement (k, dim) of the case's exact solution at nodes (k,)."""
        place = self.points[nodes] + self.origin
        return self.exact.displacement(place, self.exact_part[nodes])


def _kept(values: np.ndarray) -> np.ndarray:
    """Values that all who ask get, and nobody changes."""
    values.flags.writeable = False
    return values


def _part(block: FaceBlock, sub: SubFaces, number: np.ndarray) -> FaceBlock:
    """The sub-faces of a block's faces, which `number` (m,) gives by macro-element, or −1."""
    face = number[sub.macro]
    return replace(block.of(face[face >= 0]), type=sub.type, nodes=sub.nodes[face >= 0])


def _type_name(meshio_name: str) -> str:
    return BY_MESHIO[meshio_name].name


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
            allowed = f"{flat} of its faces {_NO_AREA}"
            raise InputError(case.path, case.zone_key(i, "slave"), zone.slave, allowed)
        if ends.any() and zone.treatment == "node_to_segment" and block.type.order == 2:
            allowed = (
                f"does not exist for slave faces {block.type.name} that end on the axis: a uniform "
                "pressure has no force at the node there; allowed there: lac, quadrature, nodal"
            )
            raise InputError(case.path, f"contact[{i}].treatment", zone.treatment, allowed)


def refuse_bent(case: Case, points: np.ndarray, surfaces: Surfaces) -> None:
    """Raise InputError where hexahedra cut from a HEXA20 would leave its bent face.

    They lie askew in it: quadratic faces with the nodes of the cut are no parts of the whole face.
    """
    for number, (zone, (slave, _)) in enumerate(zip(case.zones, surfaces, strict=True)):
        if zone.hexahedra != "hexahedra" or not TREATMENTS[zone.treatment].cut:
            continue
        for block in slave:
            made = facets(points, block.type, block.nodes, block.number, case.axisymmetric)
            if block.owner_type.name == "HEXA20" and not made.flat.all():
                key = f"contact[{number}].hexahedra"
                allowed = "HEXA20 keep bent slave faces under pyramids alone; allowed: pyramids"
                raise InputError(case.path, key, zone.hexahedra, allowed)
