"""From a case and its mesh to arrays: cut mesh, materials, supports, loads, gap operators."""

from dataclasses import dataclass, replace
from itertools import pairwise

import meshio
import numpy as np

from solver.bodies import body_numbers
from solver.case import Case, Load, Scalar, Support, Zone
from solver.clock import Clock
from solver.elasticity import Block, lame_parameters
from solver.elements import has_straight_edges
from solver.errors import InputError
from solver.expressions import evaluate
from solver.faces import FaceBlock, boundary_faces, nodal_normals, volume_cells
from solver.groups import ALL, check_groups
from solver.lac.cut import CutMesh, SubFaces, cut, needs_cut
from solver.lac.facets import Facets, facets
from solver.lac.operator import GapOperator, gap_operator
from solver.loads import body_forces, face_forces
from solver.mesh.catalogue import BY_MESHIO, BY_NAME
from solver.supports import Fixed, FreeMotion, free_motion

# An average initial gap below this many roundings of the coordinates is none.
_GAP_ROUND_OFF = 8 * np.finfo(float).eps


@dataclass(frozen=True)
class ZoneScene:
    """One zone: the zone as solved (swapped or not), its macro-elements' numbers and its faces.

    `slave_faces`, `master_faces` as meshed, `sub_faces` after the cut (their `macro` counts from 0
    within the zone); macro-elements of the zone are `first` … `first + count − 1` of all.
    """

    zone: Zone
    first: int
    count: int
    slave_faces: list[FaceBlock]
    master_faces: list[FaceBlock]
    sub_faces: list[SubFaces]
    operator: GapOperator

    @property
    def numbers(self) -> slice:
        """The zone's macro-elements among all."""
        return slice(self.first, self.first + self.count)


@dataclass(frozen=True)
class Scene:
    """The discrete problem.

    `points` (n, dim) are counted from `origin` (dim,), the mean of the mesh's nodes: far from the
    origin of the coordinates, differences would lose digits. `force` (n, dim) and `free.offset` are
    for load factor 1. `meshed`: the volume cells before the cut, by type, and `volume_groups` which
    of them each named group holds.
    """

    case: Case
    points: np.ndarray
    origin: np.ndarray
    mesh: CutMesh
    blocks: list[Block]
    body: np.ndarray
    free: FreeMotion
    force: np.ndarray
    zones: list[ZoneScene]
    length: float
    meshed: dict[str, np.ndarray]
    volume_groups: dict[str, dict[str, np.ndarray]]

    @property
    def n_dofs(self) -> int:
        """Number of degrees of freedom, held ones included."""
        return self.points.size


def build_scene(
    case: Case, mesh: meshio.Mesh, swapped: bool, hexahedra: str | None, clock: Clock
) -> Scene:
    """The discrete problem of a case; raises InputError where case and mesh do not fit."""
    check_groups(case, mesh, swapped)
    origin = mesh.points.mean(axis=0)
    local = replace_points(mesh, mesh.points - origin)
    length = float(np.ptp(local.points, axis=0).max())
    zones = [_as_solved(zone, swapped, hexahedra) for zone in case.zones]
    with clock.stage("cut"):
        surfaces = _surfaces(case, local, zones, swapped)
        cut_mesh, sub_faces = _cut(local, zones, surfaces)
    points = cut_mesh.points
    noise = _GAP_ROUND_OFF * float(np.abs(mesh.points).max())
    scenes, first = [], 0
    with clock.stage("pairing"):
        for zone, (slave, master), faces in zip(zones, surfaces, sub_faces, strict=True):
            count = sum(len(block.nodes) for block in slave)
            operator = _operator(points, zone, faces, master, count, noise)
            scenes.append(ZoneScene(zone, first, count, slave, master, faces, operator))
            first += count
    groups = _Groups(case, local, cut_mesh, scenes, origin)
    with clock.stage("assembly"):
        blocks = groups.blocks()
        free = groups.supports()
        force = groups.forces()
    body = body_numbers(len(points), cut_mesh.cells)
    return Scene(
        case=case,
        points=points,
        origin=origin,
        mesh=cut_mesh,
        blocks=blocks,
        body=body,
        free=free,
        force=force,
        zones=scenes,
        length=length,
        meshed=volume_cells(mesh),
        volume_groups={g: groups.whole_cell_mask(g) for g in mesh.cell_sets},
    )


def replace_points(mesh: meshio.Mesh, points: np.ndarray) -> meshio.Mesh:
    """The same cells and groups on other points."""
    return meshio.Mesh(points, mesh.cells, point_sets=mesh.point_sets, cell_sets=mesh.cell_sets)


def _as_solved(zone: Zone, swapped: bool, hexahedra: str | None) -> Zone:
    if swapped:
        zone = replace(zone, slave=zone.master, master=zone.slave)
    return replace(zone, hexahedra=hexahedra or zone.hexahedra)


def _surfaces(
    case: Case, mesh: meshio.Mesh, zones: list[Zone], swapped: bool
) -> list[tuple[list[FaceBlock], list[FaceBlock]]]:
    """Slave and master faces of each zone; refuses slave nodes shared by two zones."""
    slave_key, master_key = ("master", "slave") if swapped else ("slave", "master")
    owner: dict[int, str] = {}
    surfaces = []
    for i, zone in enumerate(zones):
        slave = boundary_faces(mesh, zone.slave, case.path, f"contact[{i}].{slave_key}")
        master = boundary_faces(mesh, zone.master, case.path, f"contact[{i}].{master_key}")
        nodes = np.unique(np.concatenate([block.nodes.ravel() for block in slave])).tolist()
        shared = [n for n in nodes if n in owner]
        if shared:
            raise InputError(
                case.path,
                f"contact[{i}].{slave_key}",
                zone.slave,
                f"{len(shared)} of its nodes are slave nodes of zone {owner[shared[0]]} too; "
                "a node may be a slave in one zone only",
            )
        owner |= dict.fromkeys(nodes, zone.name)
        surfaces.append((slave, master))
    return surfaces


def _cut(
    mesh: meshio.Mesh,
    zones: list[Zone],
    surfaces: list[tuple[list[FaceBlock], list[FaceBlock]]],
) -> tuple[CutMesh, list[list[SubFaces]]]:
    """The cut mesh, and each zone's sub-faces with macro-elements counted within the zone."""
    faces, macro, into_hexahedra, uncut, first = [], [], [], [], [0]
    for zone, (slave, _) in zip(zones, surfaces, strict=True):
        for block in slave:
            faces.append(block)
            macro.append(first[-1] + block.number)
            into_hexahedra.append(zone.hexahedra == "hexahedra")
            uncut.append(zone.treatment == "uncut")
        first.append(first[-1] + sum(len(block.nodes) for block in slave))
    cut_mesh = cut(mesh.points, volume_cells(mesh), faces, macro, into_hexahedra, uncut)
    sub_faces = []
    for low, high in pairwise(first):
        mine = [(f, (f.macro >= low) & (f.macro < high)) for f in cut_mesh.sub_faces]
        sub_faces.append(
            [SubFaces(f.type, f.nodes[m], f.macro[m] - low) for f, m in mine if m.any()]
        )
    return cut_mesh, sub_faces


def _operator(
    points: np.ndarray,
    zone: Zone,
    sub_faces: list[SubFaces],
    master_faces: list[FaceBlock],
    count: int,
    noise: float,
) -> GapOperator:
    slaves = [facets(points, f.type, f.nodes, f.macro) for f in sub_faces]
    masters = _master_facets(points, master_faces)
    corners = np.concatenate([f.centre for f in [*slaves, *masters]])
    search = float(np.linalg.norm(np.ptp(corners, axis=0)))
    search += max(f.radius.max() for f in [*slaves, *masters])
    operator = gap_operator(slaves, masters, count, len(points), search)
    initial = np.where(np.abs(operator.initial) <= noise * operator.covered, 0.0, operator.initial)
    return replace(operator, initial=initial - zone.interference * operator.covered)


def _master_facets(points: np.ndarray, faces: list[FaceBlock]) -> list[Facets]:
    """Master faces, those of one type together whatever cell is behind them."""
    merged = []
    for name in dict.fromkeys(block.type.name for block in faces):
        nodes = np.concatenate([block.nodes for block in faces if block.type.name == name])
        merged.append(facets(points, BY_NAME[name], nodes, np.arange(len(nodes))))
    return merged


class _Groups:
    """The groups of the mesh file, carried over to the cut mesh."""

    def __init__(
        self,
        case: Case,
        mesh: meshio.Mesh,
        cut_mesh: CutMesh,
        zones: list[ZoneScene],
        origin: np.ndarray,
    ):
        self.case, self.mesh, self.cut = case, mesh, cut_mesh
        self.points, self.origin, self.zones = cut_mesh.points, origin, zones

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
        found: list[tuple[str, np.ndarray]] = []
        for block in boundary_faces(self.mesh, group, self.case.path, key):
            plain = np.ones(len(block.nodes), dtype=bool)
            for zone in self.zones:
                plain &= ~self._swap_sub_faces(block, zone, found)
            found.append((block.type.name, block.nodes[plain]))
        return [(name, nodes) for name, nodes in found if len(nodes)]

    @staticmethod
    def _swap_sub_faces(
        block: FaceBlock, zone: ZoneScene, found: list[tuple[str, np.ndarray]]
    ) -> np.ndarray:
        """Mark the faces that are cut slave faces of the zone; append their sub-faces."""
        hit = np.zeros(len(block.nodes), dtype=bool)
        if not needs_cut(block.type.name):
            return hit
        for slave in zone.slave_faces:
            if slave.owner_type is block.owner_type and slave.type is block.type:
                mine, theirs = (10 * b.owner + b.local for b in (block, slave))
                hit |= np.isin(mine, theirs)
                macro = slave.number[np.isin(theirs, mine)]
                found += [
                    (sub.type.name, sub.nodes[np.isin(sub.macro, macro)]) for sub in zone.sub_faces
                ]
        return hit

    def nodes(self, group: str, key: str) -> np.ndarray:
        """All nodes of a group: of its volume cells, faces, edges and points."""
        dim = self.points.shape[1]
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

    def field(self, values: Scalar | tuple[Scalar, ...]):  # type: ignore[no-untyped-def]
        """A case's number, expression or vector as a function of the local coordinates."""

        def value(local: np.ndarray) -> np.ndarray:
            place = local + self.origin
            if isinstance(values, tuple):
                return np.stack([evaluate(v, place) for v in values], axis=1)
            return evaluate(values, place)

        return value

    def blocks(self) -> list[Block]:
        """Cells with their materials; cells of rigid bodies, which need none, get a unit one."""
        materials = self.case.materials
        default = materials.get(ALL)
        young = {n: np.ones(len(c)) for n, c in self.cut.cells.items()}
        poisson = {n: np.zeros(len(c)) for n, c in self.cut.cells.items()}
        if default:
            for name in self.cut.cells:
                young[name][:], poisson[name][:] = default.young, default.poisson
        for group in (g for g in materials if g != ALL):
            for name, mask in self.cell_mask(group).items():
                young[name][mask] = materials[group].young
                poisson[name][mask] = materials[group].poisson
        return [
            Block(
                BY_NAME[name],
                cells,
                *lame_parameters(young[name], poisson[name]),
                bool(has_straight_edges(BY_NAME[name], self.points[cells]).all()),
            )
            for name, cells in self.cut.cells.items()
        ]

    def supports(self) -> FreeMotion:
        """What supports and rigid bodies leave free."""
        fixed = [
            self._fixed(i, support, direction)
            for i, support in enumerate(self.case.supports)
            for direction in support.fix
        ]
        dim = self.points.shape[1]
        for group in sorted(self.case.rigid):
            nodes = self.nodes(group, f"bodies.{group}")
            for axis in np.eye(dim):
                directions = np.tile(axis, (len(nodes), 1))
                fixed.append(Fixed(f"bodies.{group}", nodes, directions, np.zeros(len(nodes))))
        return free_motion(len(self.points), dim, fixed, self.case.path)

    def _fixed(self, i: int, support: Support, direction: str) -> Fixed:
        key = f"supports[{i}].fix.{direction}"
        nodes = self.nodes(support.group, f"supports[{i}].group")
        values = self.field(support.fix[direction])(self.points[nodes])
        if direction == "normal":
            return Fixed(key, nodes, self._normals(support.group, nodes, key), values)
        axis = np.eye(self.points.shape[1])["xyz".index(direction)]
        return Fixed(key, nodes, np.tile(axis, (len(nodes), 1)), values)

    def _normals(self, group: str, nodes: np.ndarray, key: str) -> np.ndarray:
        """Unit normals (n, dim) of a group's faces at its nodes, the mean over the faces there."""
        return nodal_normals(self.points, self.faces(group, key))[nodes]

    def forces(self) -> np.ndarray:
        """Nodal forces (n, dim) of all loads at load factor 1."""
        total = np.zeros_like(self.points)
        for i, load in enumerate(self.case.loads):
            total += self._force(load, f"loads[{i}].group")
        return total

    def _force(self, load: Load, key: str) -> np.ndarray:
        value, total = self.field(load.value), np.zeros_like(self.points)
        if load.kind == "body_force":
            for name, cells in self.cut.cells.items():
                mask = slice(None) if load.group == ALL else self.cell_mask(load.group)[name]
                total += body_forces(self.points, cells[mask], name, value)
            return total
        for name, nodes in self.faces(load.group, key):
            total += face_forces(self.points, nodes, name, value, load.kind == "pressure")
        return total


def _type_name(meshio_name: str) -> str:
    return BY_MESHIO[meshio_name].name
