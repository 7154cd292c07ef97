"""The results of a solve from its states: fields, zones, steps, probes, what a case observes."""

from __future__ import annotations

from collections.abc import Sequence

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME
from ...lac.cells.faces import surface_nodes, surface_normals
from ...mechanics.fem.stress import nodal_stress, normal_stress
from ..equilibrium.problem import ContactProblem
from ..equilibrium.state import Equilibrium
from ..scene.bodies import body_names, meshed_cells
from ..scene.probing import cell_at, faces_at, places_of
from ..scene.scene import Scene, ZoneScene
from .balance import (
    imbalances,
    pressures_of_forces,
    reactions,
    resultants,
    rigid_bodies,
    strain_energy,
)
from .exact import pressure_on
from .forces import ProbeResult, Resultants
from .friction import with_friction, zone_friction
from .records import Cost, Fields, Places, Quality, Scalars, largest_of
from .recovered import recovered_pressure
from .solution import (
    BodyInfo,
    Line,
    NodalContact,
    Solution,
    StepResult,
    ZoneEstimates,
    ZoneResult,
    ZoneSurfaces,
)

# Half, up to round-off.
_HALF = 0.5 - 1e-9


def solution_of(problem: ContactProblem, states: list[Equilibrium], plan: list[Line]) -> Solution:
    """The solution by the states of all steps."""
    scene = problem.scene
    last = states[-1]
    stress = nodal_stress(
        scene.points, scene.blocks, last.iterate.deformation, last.iterate.extended
    )
    by_cell: dict[str, np.ndarray] = {}
    for term in last.iterate.terms:
        stress += term.stress(scene.blocks)
        by_cell |= term.by_cell(scene.mesh.cells)
    if scene.case.thin:
        stress[:, 2] = 0.0
    scale = stress_scale(scene, states, stress)
    steps, at_nodes = step_results(scene, states, scale)
    zones = [
        _zone_result(scene, zone, last, stress, forces, steps[-1])
        for zone, forces in zip(scene.zones, pressures_of_forces(scene, last), strict=True)
    ]
    return Solution(
        case=scene.case,
        mesh=_output_mesh(scene),
        displacement=last.displacement,
        stress=stress,
        bodies=body_infos(scene),
        zones=zones,
        steps=steps,
        plan=plan,
        scalars=Scalars(scene.coordinates.length, scale, strain_energy(last)),
        fields=Fields(
            body=scene.body,
            normal_stress=normal_stress(stress, _contact_direction(scene)),
            reaction=at_nodes,
            by_cell=by_cell,
        ),
        cost=Cost(
            dofs=scene.n_dofs,
            macro_elements=sum(zone.count for zone in scene.zones),
            iterations=sum(state.status.iterations for state in states),
            linear_solver=problem.linear_solver,
            linear_iterations=problem.linear_iterations,
            matrix_entries=problem.matrix.nnz,
        ),
        quality=Quality(
            balance=largest_of([imbalances(scene, state) for state in states]),
            accuracy=largest_of([state.accuracy.causes for state in states]),
        ),
        places=Places(
            probed(scene, zones, last.displacement, stress) if scene.case.probes else {},
            scene.named.acted,
        ),
    )


def body_infos(scene: Scene) -> list[BodyInfo]:
    """Each body as it was meshed: name, cells by type, faces on contact surfaces, role."""
    infos = []
    for number, name in enumerate(body_names(scene)):
        inside = meshed_cells(scene, number)
        cells = {t: int(mask.sum()) for t, mask in inside.items() if mask.any()}
        roles, faces = set(), 0
        for zone in scene.zones:
            for role, blocks in (("slave", zone.slave_faces), ("master", zone.master_faces)):
                count = sum(int((scene.body[b.nodes[:, 0]] == number).sum()) for b in blocks)
                faces += count
                roles |= {role} if count else set()
        role = "both" if len(roles) == 2 else next(iter(roles), "none")
        infos.append(BodyInfo(name, cells, faces, role))
    return infos


def _output_mesh(scene: Scene) -> meshio.Mesh:
    cells = [(BY_NAME[name].meshio, data) for name, data in scene.mesh.cells.items()]
    sets = {
        group: [np.flatnonzero(scene.mesh.members(name, mask)) for name in scene.mesh.cells]
        for group, mask in scene.given.groups.items()
        if any(m.any() for m in mask.values())
    }
    return meshio.Mesh(scene.points + scene.coordinates.origin, cells, cell_sets=sets)


def _contact_direction(scene: Scene) -> np.ndarray:
    """Unit mean normal of the first zone's slave surface; the last axis where there is no zone."""
    dim = scene.points.shape[1]
    if not scene.zones:
        return np.eye(dim)[-1]
    surface = scene.zones[0].operator.surface
    mean = surface.area @ surface.normal
    return mean / np.linalg.norm(mean)


def _zone_result(
    scene: Scene,
    zone: ZoneScene,
    state: Equilibrium,
    stress: np.ndarray,
    pressure_of_forces: np.ndarray | None,
    step: StepResult,
) -> ZoneResult:
    surface, field = zone.operator.surface, state.fields.get(zone.zone.name)
    slave_nodes, master_nodes = surface_nodes(zone.sub_faces), surface_nodes(zone.master_faces)
    slave_normal = surface_normals(scene.points, zone.sub_faces)[slave_nodes]
    master_normal = surface_normals(scene.points, zone.master_faces)[master_nodes]
    return ZoneResult(
        name=zone.zone.name,
        faces=[(f.type.name, f.nodes, f.macro) for f in zone.sub_faces],
        centre=surface.centre + scene.coordinates.origin,
        normal=surface.normal,
        area=surface.area,
        multiplier=zone.by_macro_element(state.pressure),
        gap=zone.by_macro_element(state.gap),
        closed=closed_of(zone, state),
        coverage=surface.covered / surface.area,
        surfaces=ZoneSurfaces(
            master_faces=[(b.type.name, b.nodes) for b in zone.master_faces],
            stress_slave=normal_stress(stress[slave_nodes], slave_normal),
            stress_master=normal_stress(stress[master_nodes], master_normal),
            slave_nodes=slave_nodes,
            master_nodes=master_nodes,
            meshed_gap=_meshed_gap(scene, zone),
        ),
        estimates=ZoneEstimates(pressure_of_forces, None if field is None else field.error),
        nodal=_nodal_contact(zone, state),
        recovered=recovered_pressure(scene, zone, state),
        resultants=step.resultants[zone.zone.name],
        friction=zone_friction(zone, state) if zone.slips and state.friction else None,
    )


def _meshed_gap(scene: Scene, zone: ZoneScene) -> np.ndarray:
    """The mean distance (m,) of the surfaces where they meet, along the normal; 0 where nowhere."""
    operator = zone.operator
    apart, none = operator.matrix @ scene.points.ravel(), np.zeros(len(operator.covered))
    apart = np.divide(apart, operator.covered, out=none, where=operator.covered > 0)
    return np.asarray(operator.mean @ apart)


def _nodal_contact(zone: ZoneScene, state: Equilibrium) -> NodalContact | None:
    nodes = zone.operator.nodes
    if nodes is None:
        return None
    closed = zone.at_nodes(state.status.closed.astype(float)) >= _HALF
    return NodalContact(nodes, zone.at_nodes(state.pressure), zone.at_nodes(state.gap), closed)


def step_results(
    scene: Scene, states: list[Equilibrium], scale: float
) -> tuple[list[StepResult], np.ndarray]:
    """The steps, and the reactions at nodes (n, dim) in the last one."""
    results, at_nodes = [], np.zeros(0)
    for factor, state in zip(scene.case.factors, states, strict=True):
        seen = []
        for wanted in scene.case.observe:
            zone = next(z for z in scene.zones if z.zone.name == wanted.zone)
            surface = zone.operator.surface
            offset = surface.centre + scene.coordinates.origin - np.array(wanted.nearest)
            local = int(np.linalg.norm(offset, axis=1).argmin())
            seen.append(
                {
                    "zone": wanted.zone,
                    "macro_element": local,
                    "pressure": float(zone.by_macro_element(state.pressure)[local]),
                    "gap": float(zone.by_macro_element(state.gap)[local]),
                    "status": int(closed_of(zone, state)[local]),
                    "coverage": float(surface.covered[local] / surface.area[local]),
                }
            )
        held, at_nodes = reactions(scene, state)
        n = scene.n_multipliers
        product = float(np.abs(state.pressure * state.gap)[:n].max(initial=0.0))
        results.append(
            StepResult(
                factor=factor,
                iterations=state.status.iterations,
                status_changes=sum(state.status.changes),
                residual=state.residual,
                complementarity=product / (scale * scene.coordinates.length),
                observations=seen,
                resultants={z.zone.name: _resultants(scene, z, state) for z in scene.zones},
                reactions=held,
                rigid=rigid_bodies(scene, state) if scene.held.frames else [],
                dissipation=state.friction.dissipation if state.friction else 0.0,
            )
        )
    return results, at_nodes


def _resultants(scene: Scene, zone: ZoneScene, state: Equilibrium) -> Resultants:
    closed = closed_of(zone, state)
    found = resultants(scene, zone, state, closed)
    slides = zone.slips and state.friction
    return with_friction(found, scene, zone, state) if slides else found


def closed_of(zone: ZoneScene, state: Equilibrium) -> np.ndarray:
    """The macro-elements (m,) with at least half of their multipliers closed."""
    return zone.by_macro_element(state.status.closed.astype(float)) >= _HALF


def stress_scale(scene: Scene, states: list[Equilibrium], stress: np.ndarray) -> float:
    """The largest pressure of any step among the loads (as a number).

    Else the largest contact pressure of any step or `stress` (n, 6), else 1.
    """
    values = [
        abs(load.value * load.factor(step))
        for load in scene.case.loads
        for step in scene.case.steps
        if load.kind == "pressure" and isinstance(load.value, float)
    ]
    largest = [np.abs(field).max(initial=0.0) for field in (stress, *(s.pressure for s in states))]
    return max(values, default=0.0) or float(max(largest)) or 1.0


def probed(
    scene: Scene, zones: Sequence[ZoneResult], displacement: np.ndarray, stress: np.ndarray
) -> dict[str, ProbeResult]:
    """The values at each probe of the case; InputError where a point is in no body, or in two."""
    found = {}
    for name, probe in scene.case.probes.items():
        places = places_of(scene, name)
        none = np.full(len(places), np.nan)
        if probe.zone:
            zone = next(zone for zone in zones if zone.name == probe.zone)
            found[name] = _on_surface(scene, zone, name, places)
            continue
        if probe.group:
            nodes = scene.named.probed[name]
            moved, tensor = displacement[nodes], stress[nodes]
        else:
            nodes, shares = cell_at(scene, name)
            moved, tensor = (shares @ f[nodes][None] for f in (displacement, stress))
        found[name] = ProbeResult(places + scene.coordinates.origin, moved, tensor, none)
    return found


def _on_surface(scene: Scene, zone: ZoneResult, name: str, places: np.ndarray) -> ProbeResult:
    """The contact pressure where a zone's slave surface is nearest to local places (k, dim)."""
    pressure, points = np.empty(len(places)), scene.points + scene.coordinates.origin
    found = faces_at(scene, name, zone.faces_of("slave"))
    for block in np.unique(found.block):
        (kind, nodes, owner), here = zone.faces[block], found.block == block
        face, reference = found.number[here], found.reference[here][:, None]
        at = pressure_on(points, zone, kind, nodes[face], owner[face], reference)
        pressure[here] = at[:, 0]
    none = np.full((len(places), 6), np.nan)
    return ProbeResult(
        places + scene.coordinates.origin, none[:, : places.shape[1]], none, pressure
    )
