"""From a case and its mesh to arrays: cut mesh, materials, supports, loads, gap operators."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import meshio
import numpy as np
from scipy import sparse

from ...case.acting import Step, in_step
from ...case.file import Zone
from ...case.model import Case
from ...lac.cells.faces import FaceBlock
from ...lac.cells.neighbours import vertex_neighbours
from ...lac.cut import CutMesh, SubFaces, cut
from ...lac.operator import GapOperator
from ...mechanics.fem.block import Block
from ...mechanics.fem.faces import volume_cells
from ...mechanics.fem.supports import FreeMotion
from ...mechanics.mortar.treatments import TREATMENTS, Treatment, merge_fixed_multipliers
from ...system.progress import Clock, stage
from ..options import LEAN, Options
from .attributes import Attributes
from .contact_frames import with_contact_frames
from .cut_groups import CutZone, Surfaces, refuse_bent, surfaces_of
from .groups import ON_AXIS, check_groups, named_parts
from .operators import operator_of
from .parts import parts_of
from .parts.part import ModelPart
from .records import AtWork, Coordinates, GivenMesh, Held, Loads, Named, Unloaded
from .selections import with_groups

# An average initial gap below this many roundings of the coordinates is zero.
_GAP_ROUND_OFF = 8


@dataclass(frozen=True, kw_only=True)
class ZoneScene:
    """One zone: the zone as solved (swapped or not), its multipliers' numbers and its faces.

    `slave_faces`, `master_faces` as meshed, `sub_faces` after the cut (their `macro` counts from 0
    within the zone). `count` macro-elements; the zone's multipliers, of which a treatment may have
    others than one for each of these, start at `first` among all. `slips`: where its rows of slip
    are, by tangent, after the multipliers of all zones; none without friction.
    """

    zone: Zone
    first: int
    count: int
    slave_faces: list[FaceBlock]
    master_faces: list[FaceBlock]
    sub_faces: list[SubFaces]
    operator: GapOperator
    slips: tuple[slice, ...] = ()

    @property
    def treatment(self) -> Treatment:
        """How the interface is treated."""
        return TREATMENTS[self.zone.treatment]

    @property
    def numbers(self) -> slice:
        """The zone's multipliers among all."""
        return slice(self.first, self.first + len(self.operator.initial))

    @property
    def rows(self) -> tuple[slice, ...]:
        """The multipliers, then the rows of slip by tangent."""
        return self.numbers, *self.slips

    @property
    def measured(self) -> np.ndarray:
        """Where (k,) the initial gap has a part that is measured on the mesh."""
        given = -self.zone.interference * self.operator.covered
        measured = self.operator.initial != given
        return measured if self.zone.clearance is None else np.zeros_like(measured)

    @cached_property
    def near(self) -> sparse.csr_matrix:
        """Pairs (m, m) of macro-elements that share a vertex."""
        faces = [(b.number, b.nodes[:, : b.type.n_vertices]) for b in self.slave_faces]
        return vertex_neighbours(faces, self.count)

    def at_nodes(self, values: np.ndarray) -> np.ndarray:
        """Values (k,) of all multipliers at the nodes (n,) that the zone's ones belong to."""
        mine, nodes = values[self.numbers], self.operator.at_nodes
        return mine if nodes is None else nodes @ mine

    def forces(self, values: np.ndarray) -> np.ndarray:
        """The contact forces (n_dofs,) of all rows (k,), those of tractions included."""
        found = np.asarray(self.operator.matrix.T @ values[self.numbers])
        return found + self.tangential_forces(values) if self.slips else found

    def tangential_forces(self, values: np.ndarray) -> np.ndarray:
        """Those of the tractions alone."""
        found = np.zeros(self.operator.matrix.shape[1])
        for matrix, rows in zip(self.operator.slip, self.slips, strict=True):
            found += matrix.T @ values[rows]
        return found

    def couple(self, values: np.ndarray) -> np.ndarray:
        """The couple (3,) of tractions on surfaces that are meshed apart."""
        assert self.operator.levers is not None
        pairs = zip(self.operator.levers, self.slips, strict=True)
        return np.sum([values[rows] @ lever[:, 0] for lever, rows in pairs], axis=0)

    def by_macro_element(self, values: np.ndarray) -> np.ndarray:
        """Values (k,) of all multipliers averaged over each macro-element of the zone (m,)."""
        return np.asarray(self.operator.mean @ values[self.numbers])


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The discrete problem of a case as solved (see `Case.as_solved`).

    `points` (n, dim) are counted as `coordinates` says. `mesh` is the mesh after the cut, `body`
    (n,) the body of each node. `blocks` are the elastic cells, `parts` what there is beside them;
    `loads` are all but those of parts, and `free.offset` is for load factor 1.
    """

    case: Case
    options: Options
    given: GivenMesh
    coordinates: Coordinates
    points: np.ndarray
    mesh: CutMesh
    body: np.ndarray
    blocks: list[Block]
    parts: tuple[ModelPart, ...]
    held: Held
    free: FreeMotion
    loads: Loads
    named: Named
    zones: list[ZoneScene]
    rest: Unloaded

    def acting(self, step: Step) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n, dim) and imposed displacements (n_dofs,) of a step."""
        force, offset = self.given_loads(step)
        return sum((part.load(step) for part in self.parts), force), offset

    def given_loads(self, step: Step) -> tuple[np.ndarray, np.ndarray]:
        """The same without the forces of parts."""
        whole, by_name = (self.loads.force, self.free.offset), self.loads.histories

        def part(i: int) -> np.ndarray:
            def of(name: str | None) -> np.ndarray:
                return whole[i] if name is None else by_name[name][i]

            return np.asarray(in_step(step, by_name, of))

        return part(0), part(1)

    @property
    def resisting(self) -> sparse.csr_matrix:
        """Rows (k, n_dofs) of parts that resist the motions of bodies."""
        rows = [part.resisting for part in self.parts if part.resisting is not None]
        return sparse.vstack([sparse.csr_matrix((0, self.n_dofs)), *rows]).tocsr()

    @property
    def holders(self) -> set[str]:
        """The names of all that has a reaction."""
        fixed = {one.holder for one in self.held.fixed if len(one.nodes)}
        return (fixed | {self.held.joint} | {part.holder for part in self.parts}) - {""}

    @property
    def n_dofs(self) -> int:
        """Number of degrees of freedom, held ones included."""
        return self.points.size

    @property
    def space(self) -> int:
        """The dimensions of the bodies: 3 where the mesh is a section of axisymmetric ones."""
        return 3 if self.case.axisymmetric else self.points.shape[1]

    @property
    def n_bodies(self) -> int:
        """Number of bodies."""
        return len(self.rest.unloaded_bodies)

    @property
    def n_multipliers(self) -> int:
        """Number of multipliers of all zones, those of friction left out."""
        return len(self.rest.unloaded_multipliers)


@dataclass(frozen=True, kw_only=True)
class CutModel:
    """A case on its mesh, cut but not paired: what is the same wherever its bodies are.

    `surfaces`: slave faces as meshed and master faces of each zone; `at_work`: of all steps, where
    the groups will have the loads of one; for the rest see `Scene`.
    """

    groups: Attributes
    options: Options
    given: GivenMesh
    surfaces: Surfaces
    length: float
    rounding: float
    at_work: AtWork | None = None

    @property
    def contact_faces(self) -> list[FaceBlock]:
        """The faces of all contact surfaces."""
        return [block for pair in self.surfaces for side in pair for block in side]


def build_scene(
    case: Case, mesh: meshio.Mesh, options: Options = LEAN, clock: Clock | None = None
) -> Scene:
    """The discrete problem of a case; raises InputError where case and mesh do not fit."""
    clock = clock or Clock()
    model = build_model(case, mesh, options, clock)
    return scene_of(model, model.groups, clock)


def build_model(case: Case, mesh: meshio.Mesh, options: Options, clock: Clock) -> CutModel:
    """The cut mesh of a case and its groups; raises InputError where case and mesh do not fit."""
    mesh = with_groups(case, mesh)
    check_groups(case, mesh)
    mesh, unnamed = named_parts(case, mesh)
    origin = mesh.points.mean(axis=0) * options.safeguards.local_coordinates
    if case.axisymmetric:
        mesh = replace_points(mesh, radial(mesh.points))
        origin[0] = 0.0
    local = replace_points(mesh, mesh.points - origin)
    with stage(clock, "cut"):
        surfaces = surfaces_of(case, local)
        refuse_bent(case, local.points, surfaces)
        cut_mesh, sub_faces = _cut(local, case.zones, surfaces)
    cut_zones = [
        CutZone(slave, faces) for (slave, _), faces in zip(surfaces, sub_faces, strict=True)
    ]
    groups = Attributes(case, local, cut_mesh, cut_zones, origin)
    return CutModel(
        groups=groups,
        options=options,
        given=GivenMesh(
            cells=volume_cells(mesh),
            groups={g: groups.whole_cell_mask(g) for g in mesh.cell_sets},
            unnamed=unnamed,
        ),
        # The master surface of a zone may be the slave surface of another, and cut.
        surfaces=[(slave, groups.as_cut(master)) for slave, master in surfaces],
        length=float(np.ptp(local.points, axis=0).max()),
        rounding=float(np.finfo(float).eps * np.abs(mesh.points).max()),
    )


def scene_of(model: CutModel, groups: Attributes, clock: Clock) -> Scene:
    """The discrete problem of a model with its `groups` where they are."""
    case, options, surfaces = groups.case, model.options, model.surfaces
    safeguards = options.safeguards
    with stage(clock, "pairing"):
        noise = _GAP_ROUND_OFF * model.rounding * safeguards.gap_threshold
        operators = [
            operator_of(groups, zone, faces, master, noise, options)
            for zone, faces, (_, master) in zip(case.zones, groups.zones, surfaces, strict=True)
        ]
    with stage(clock, "assembly"):
        blocks = groups.elasticity(options.shortcuts.quadrature)
        blocks, parts = parts_of(groups, blocks, safeguards)
        free, force = groups.supports(), groups.forces()
        zones = _zones(case, groups.zones, surfaces, operators, free)
        if case.frictional:
            free = with_contact_frames(free, operators, groups.zones)
    n_bodies = int(groups.body.max()) + 1
    n_multipliers = sum(len(z.operator.initial) for z in zones)
    return Scene(
        case=case,
        options=options,
        given=model.given,
        coordinates=Coordinates(groups.origin, model.length, model.rounding),
        points=groups.points,
        mesh=groups.cut,
        body=groups.body,
        blocks=blocks,
        parts=parts,
        held=Held(list(groups.fixed().values()), groups.frames(), groups.joint),
        free=free,
        loads=Loads(force, groups.histories(), model.at_work or AtWork.of(force, free.offset)),
        named=Named(
            probed={n: groups.nodes(p.group, "probes") for n, p in case.probes.items() if p.group},
            acted={key: groups.nodes(group, key) for key, group in case.acting.items()},
        ),
        zones=zones,
        rest=Unloaded(
            unloaded_bodies=np.zeros(n_bodies, dtype=bool),
            fixed_bodies=np.zeros(n_bodies, dtype=bool),
            unloaded_multipliers=np.zeros(n_multipliers, dtype=bool),
        ),
    )


def _zones(
    case: Case,
    cut_zones: Sequence[CutZone],
    surfaces: Surfaces,
    operators: Sequence[GapOperator],
    free: FreeMotion,
) -> list[ZoneScene]:
    """The zones; multipliers of nodes that are fixed, or have one of another zone, are merged."""
    found: list[ZoneScene] = []
    first, taken = 0, None
    if sum(operator.nodes is not None for operator in operators) > 1:
        dim = operators[0].surface.centre.shape[1]
        taken = np.zeros((free.basis.shape[0] // dim, dim, dim))
    for i, zone in enumerate(case.zones):
        operator, (slave, master) = operators[i], surfaces[i]
        joins = TREATMENTS[zone.treatment].joins
        if joins or (taken is not None and operator.nodes is not None):
            basis = free.basis if joins else sparse.identity(free.basis.shape[0], format="csr")
            operator = merge_fixed_multipliers(operator, basis, taken)
        found.append(
            ZoneScene(
                zone=zone,
                first=first,
                count=cut_zones[i].count,
                slave_faces=slave,
                master_faces=master,
                sub_faces=cut_zones[i].sub_faces,
                operator=operator,
            )
        )
        first += len(operator.initial)
    return _with_slips(found, first) if any(o.slip for o in operators) else found


def _with_slips(zones: list[ZoneScene], first: int) -> list[ZoneScene]:
    """The zones with their rows of slip, counted from `first` on."""
    found = []
    for zone in zones:
        count = len(zone.operator.initial)
        ends = [first + count * k for k in range(len(zone.operator.slip) + 1)]
        found.append(replace(zone, slips=tuple(slice(*pair) for pair in pairwise(ends))))
        first = ends[-1]
    return found


def carried_over(scene: Scene, mesh: meshio.Mesh, values: np.ndarray) -> np.ndarray:
    """Values (n, dim) at the mesh's nodes, interpolated at the nodes of the scene's cut mesh."""
    surfaces = [(zone.slave_faces, zone.master_faces) for zone in scene.zones]
    return _cut(replace_points(mesh, values), scene.case.zones, surfaces)[0].points


def radial(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of a meridian plane; points on the axis up to rounding are put on it."""
    found = points.copy()
    found[np.abs(points[:, 0]) <= ON_AXIS * np.abs(points).max(), 0] = 0.0
    return found


def replace_points(mesh: meshio.Mesh, points: np.ndarray) -> meshio.Mesh:
    """The same cells and groups on other points."""
    return meshio.Mesh(points, mesh.cells, point_sets=mesh.point_sets, cell_sets=mesh.cell_sets)


def _cut(
    mesh: meshio.Mesh, zones: Sequence[Zone], surfaces: Surfaces
) -> tuple[CutMesh, list[list[SubFaces]]]:
    """The cut mesh, and each zone's sub-faces with macro-elements counted within the zone."""
    faces, macro, into_hexahedra, uncut, first = [], [], [], [], [0]
    for zone, (slave, _) in zip(zones, surfaces, strict=True):
        for block in slave:
            faces.append(block)
            macro.append(first[-1] + block.number)
            into_hexahedra.append(zone.hexahedra == "hexahedra")
            uncut.append(not TREATMENTS[zone.treatment].cut)
        first.append(first[-1] + sum(len(block.nodes) for block in slave))
    cells = volume_cells(mesh)
    cut_mesh = cut(mesh.points, cells, faces, macro, into_hexahedra, uncut)
    sub_faces = []
    for low, high in pairwise(first):
        mine = [(f, (f.macro >= low) & (f.macro < high)) for f in cut_mesh.sub_faces]
        sub_faces.append(
            [SubFaces(f.type, f.nodes[m], f.macro[m] - low) for f, m in mine if m.any()]
        )
    return cut_mesh, sub_faces
