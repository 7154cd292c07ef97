"""The groups of a mesh file carried over to the mesh with cut slave cells."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import meshio
import numpy as np

from ..case.expressions import evaluate
from ..case.model import Case, Scalar
from ..lac.cells.catalogue import BY_MESHIO, BY_NAME
from ..lac.cells.faces import FaceBlock
from ..lac.cut import CutMesh, SubFaces
from ..mechanics.fem.bodies import body_numbers
from ..mechanics.fem.faces import FaceError, boundary_faces, volume_cells
from ..mechanics.fem.loads import Field
from ..system.errors import InputError
from .groups import ALL


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
        blocks = self.as_cut(faces_of(self.mesh, group, self.case, key))
        return [(block.type.name, block.nodes) for block in blocks]

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

    @cached_property
    def body(self) -> np.ndarray:
        """The body (n,) of each node."""
        return body_numbers(len(self.points), self.cut.cells)


def _part(block: FaceBlock, sub: SubFaces, number: np.ndarray) -> FaceBlock:
    """The sub-faces of a block's faces, which `number` (m,) gives by macro-element, or −1."""
    face = number[sub.macro]
    return replace(block.of(face[face >= 0]), type=sub.type, nodes=sub.nodes[face >= 0])


def _type_name(meshio_name: str) -> str:
    return BY_MESHIO[meshio_name].name
