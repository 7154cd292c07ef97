"""A case on its own mesh, uncut: what results of other codes are compared on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import meshio
import numpy as np

from ..case.expressions import evaluate
from ..case.model import Case
from ..case.solutions.base import ExactSolution
from ..lac.cells.catalogue import cell_type
from ..lac.cells.faces import FaceBlock, nodal_normals, surface_nodes, surface_points
from ..lac.cells.shape import shape_functions
from ..simulation.fit import refuse_unfit
from ..simulation.results.exact import ExactValues
from ..simulation.results.records import Cost, Fields, Scalars
from ..simulation.results.results import body_infos
from ..simulation.results.solution import Solution, ZoneResult, ZoneSurfaces
from ..simulation.scene.groups import nodes_of_volumes
from ..simulation.scene.scene import Scene, ZoneScene, build_scene


def extents_of(points: np.ndarray) -> np.ndarray:
    """The least and the largest coordinates (2, dim) of points (k, dim)."""
    return np.stack([points.min(axis=0), points.max(axis=0)])


@dataclass(frozen=True)
class Model:
    """The case, its mesh, and the scene that our solver would solve.

    Nodes are those of the mesh; the cut of slave cells only appends nodes to them.
    """

    case: Case
    mesh: meshio.Mesh
    scene: Scene = field(repr=False)

    @classmethod
    def of(cls, case: Case, mesh: meshio.Mesh) -> Model:
        """The model of a case; raises InputError where case and mesh do not fit."""
        scene = build_scene(case, mesh)
        refuse_unfit(scene)
        return cls(case, mesh, scene)

    @property
    def points(self) -> np.ndarray:
        """Nodes (n, dim)."""
        return self.mesh.points

    @property
    def dim(self) -> int:
        """2 or 3."""
        return int(self.points.shape[1])

    @cached_property
    def length(self) -> float:
        """The largest extent."""
        return float(np.ptp(self.points, axis=0).max())

    @cached_property
    def body(self) -> np.ndarray:
        """The body (n,) of each node."""
        return self.scene.body[: len(self.points)]

    @cached_property
    def extents(self) -> np.ndarray:
        """Those of each body (b, 2, dim), of its nodes in the mesh."""
        bodies = (self.body == number for number in range(int(self.body.max()) + 1))
        return np.stack([extents_of(self.points[mine]) for mine in bodies])

    @cached_property
    def direction(self) -> np.ndarray:
        """The direction (dim,) of contact: the mean normal of the first zone's slave surface."""
        if not self.scene.zones:
            return np.eye(self.dim)[-1]
        surface = self.scene.zones[0].operator.surface
        mean = surface.area @ surface.normal
        return mean / np.linalg.norm(mean)

    @cached_property
    def solution(self) -> Solution:
        """Empty solution on this mesh: geometry and scales only."""
        volumes = [i for i, block in enumerate(self.mesh.cells) if block.dim == self.dim]
        sets = {name: [of[i] for i in volumes] for name, of in self.mesh.cell_sets.items()}
        cells = [(self.mesh.cells[i].type, self.mesh.cells[i].data) for i in volumes]
        n = len(self.points)
        loads = [abs(load.value) for load in self.case.loads if isinstance(load.value, float)]
        return Solution(
            case=self.case,
            mesh=meshio.Mesh(self.points, cells, cell_sets=sets),
            displacement=np.full((n, self.dim), np.nan),
            stress=np.full((n, 6), np.nan),
            bodies=body_infos(self.scene),
            zones=[self._zone(zone) for zone in self.scene.zones],
            steps=[],
            plan=[],
            scalars=Scalars(self.length, max(loads, default=0.0) or self._largest_reference),
            fields=Fields(body=self.body, normal_stress=np.full(n, np.nan)),
            cost=Cost(macro_elements=sum(zone.count for zone in self.scene.zones)),
        )

    @property
    def _largest_reference(self) -> float:
        """The scale of stress without loads: the largest pressure of the reference, else 1."""
        values = [self.reference_pressure(zone) for zone in self.scene.zones]
        return max((float(v.max(initial=0.0)) for v in values if v is not None), default=0.0) or 1.0

    def reference_pressure(self, zone: ZoneScene) -> np.ndarray | None:
        """The reference's pressure (m,) at the centres of the slave faces; None without one."""
        centre = zone.operator.surface.centre + self.scene.coordinates.origin
        found = self.case.compared_with("contact_pressure")
        if isinstance(found, ExactSolution):
            return found.contact_pressure(centre)
        return None if found is None else evaluate(found, centre)

    def _zone(self, zone: ZoneScene) -> ZoneResult:
        surface, m = zone.operator.surface, zone.count
        # Cells of rigid surfaces are not in the mesh.
        n = len(self.points)
        meshed = [b.of(np.flatnonzero((b.nodes < n).all(axis=1))) for b in zone.master_faces]
        slave, master = surface_nodes(zone.slave_faces), surface_nodes(meshed)
        none = np.full(m, np.nan)
        return ZoneResult(
            name=zone.zone.name,
            faces=[(b.type.name, b.nodes, b.number) for b in zone.slave_faces],
            centre=surface.centre + self.scene.coordinates.origin,
            normal=surface.normal,
            area=surface.area,
            multiplier=none,
            gap=none,
            closed=np.zeros(m, dtype=bool),
            coverage=surface.covered / surface.area,
            surfaces=ZoneSurfaces(
                master_faces=[(b.type.name, b.nodes) for b in meshed],
                stress_slave=np.full(len(slave), np.nan),
                stress_master=np.full(len(master), np.nan),
                slave_nodes=slave,
                master_nodes=master,
            ),
        )

    def normals(self, zone: ZoneResult, side: str) -> np.ndarray:
        """Unit normals (n, dim) at the nodes of one side, zero elsewhere."""
        return nodal_normals(self.points, zone.faces_of(side))

    def middles(self, zone: ZoneResult) -> np.ndarray:
        """The middles (4, m, dim) of slave faces: of area, shapes, corners and all nodes."""
        found = np.stack([zone.centre] * 4)
        for name, nodes, macro in zone.faces:
            kind = cell_type(name)
            reference = kind.nodes[: kind.n_vertices].mean(axis=0)
            weights = shape_functions(name).values(reference[None])[0]
            found[1, macro] = weights @ self.points[nodes]
            found[2, macro] = self.points[nodes[:, : kind.n_vertices]].mean(axis=1)
            found[3, macro] = self.points[nodes].mean(axis=1)
        return found

    def face_size(self, zone: ZoneResult) -> np.ndarray:
        """How wide the slave faces (m,) of a zone are."""
        at = surface_points(self.points, zone.faces)
        return np.bincount(at.macro, at.weight) ** (1 / (self.dim - 1))

    def reach(self, zone: ZoneResult) -> np.ndarray:
        """How far the nodes of the slave faces (m,) of a zone are from their centres, at most."""
        found = np.zeros(len(zone.centre))
        for _, nodes, macro in zone.faces:
            away = np.linalg.norm(self.points[nodes] - zone.centre[macro, None], axis=2)
            found[macro] = away.max(axis=1)
        return found

    @cached_property
    def rigid(self) -> np.ndarray:
        """Which bodies are rigid; those without cells are."""
        found = np.ones(int(self.body.max()) + 1, dtype=bool)
        found[self.body[self.solution.deformable & nodes_of_volumes(self.mesh)]] = False
        return found

    @cached_property
    def part(self) -> np.ndarray:
        """The part of the exact solution that each body is."""
        exact = self.case.reference.exact
        if exact is None:
            return np.zeros(int(self.body.max()) + 1, dtype=int)
        values = ExactValues(self.solution, exact).part
        first = np.unique(self.body, return_index=True)[1]
        return values[first]

    def contact_force(self, zone: ZoneScene) -> tuple[np.ndarray, np.ndarray]:
        """The force (dim,) on the slave that the loads ask for, NaN along axes where supports act.

        Contact balances the loads on the slave's body, or on the master's, along each axis that no
        support holds there, where that body is in one zone only.
        """
        force = np.full(self.dim, np.nan)
        acting, _ = self.scene.acting(self.case.steps[-1])
        scale = np.abs(acting).sum(axis=0).max(initial=0.0)
        for blocks, sign in ((zone.slave_faces, -1.0), (zone.master_faces, 1.0)):
            body = self._alone(blocks, zone)
            if body is None:
                continue
            mine = self.scene.body == body
            basis = self.scene.free.basis
            # A ring does not move across its axis.
            axes = [1] if self.case.axisymmetric else range(self.dim)
            for axis in (axis for axis in axes if np.isnan(force[axis])):
                motion = np.zeros(self.scene.points.shape)
                motion[mine, axis] = 1.0
                left = motion.ravel() - basis @ (basis.T @ motion.ravel())
                sprung = (self.scene.resisting @ motion.ravel()).any()
                if np.abs(left).max() < 1e-9 and not sprung:
                    force[axis] = sign * acting[mine, axis].sum()
        return force, scale

    def _alone(self, blocks: Sequence[FaceBlock], zone: ZoneScene) -> int | None:
        """The one body of these faces, if it is in no other zone."""
        bodies = {int(b) for block in blocks for b in np.unique(self.scene.body[block.nodes])}
        others = {
            int(b)
            for other in self.scene.zones
            if other is not zone
            for block in (*other.slave_faces, *other.master_faces)
            for b in np.unique(self.scene.body[block.nodes])
        }
        return bodies.pop() if len(bodies) == 1 and not bodies & others else None
