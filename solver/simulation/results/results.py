"""The results of a solve from its states: fields, zones, steps, probes, what a case observes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import meshio
import numpy as np

from ...lac.cells.catalogue import BY_NAME
from ...lac.cells.faces import surface_nodes, surface_normals
from ...lac.facets import tangents_of
from ...mechanics.fem.stress import nodal_stress, normal_stress
from ..equilibrium.problem import ContactProblem
from ..equilibrium.recovery import Recovered, RecoveredZone
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
from .forces import ProbeResult
from .records import Cost, Fields, Places, Quality, Scalars
from .solution import (
    BodyInfo,
    Line,
    NodalContact,
    RecoveredPressure,
    Solution,
    StepResult,
    ZoneFriction,
    ZoneResult,
)

# Half, up to round-off.
_HALF = 0.5 - 1e-9


def solution_of(
    problem: ContactProblem, states: list[Equilibrium], fields: list[Recovered], plan: list[Line]
) -> Solution:
    """The solution by the states of all steps, and the pressures recovered in them."""
    scene = problem.scene
    last = states[-1]
    stress = nodal_stress(
        scene.points, scene.blocks, last.iterate.deformation, last.iterate.extended
    )
    mean_stress: dict[str, np.ndarray] = {}
    for term in last.iterate.terms:
        stress += term.stress(scene.blocks)
        mean_stress |= term.by_cell(scene.mesh.cells)
    if scene.case.thin:
        stress[:, 2] = 0.0
    scale = stress_scale(scene, states, stress)
    steps, at_nodes = step_results(scene, states, fields, scale)
    zones = [
        _zone_result(scene, zone, last, stress, forces, fields[-1].get(zone.zone.name), steps[-1])
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
            mean_stress=mean_stress,
        ),
        cost=Cost(
            dofs=scene.n_dofs,
            macro_elements=sum(zone.count for zone in scene.zones),
            iterations=sum(state.status.iterations for state in states),
            linear_solver=problem.linear_solver,
            linear_iterations=problem.linear_iterations,
            matrix_entries=problem.matrix.nnz,
        ),
        quality=Quality(balance=imbalances(scene, last), accuracy=last.accuracy.causes),
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
    field: RecoveredZone | None,
    step: StepResult,
) -> ZoneResult:
    surface = zone.operator.surface
    slave_nodes, master_nodes = surface_nodes(zone.sub_faces), surface_nodes(zone.master_faces)
    slave_normal = surface_normals(scene.points, zone.sub_faces)[slave_nodes]
    master_normal = surface_normals(scene.points, zone.master_faces)[master_nodes]
    return ZoneResult(
        name=zone.zone.name,
        faces=[(f.type.name, f.nodes, f.macro) for f in zone.sub_faces],
        master_faces=[(b.type.name, b.nodes) for b in zone.master_faces],
        centre=surface.centre + scene.coordinates.origin,
        normal=surface.normal,
        area=surface.area,
        multiplier=zone.by_macro_element(state.pressure),
        gap=zone.by_macro_element(state.gap),
        closed=closed_of(zone, state),
        coverage=surface.covered / surface.area,
        stress_slave=normal_stress(stress[slave_nodes], slave_normal),
        stress_master=normal_stress(stress[master_nodes], master_normal),
        slave_nodes=slave_nodes,
        master_nodes=master_nodes,
        nodal=_nodal_contact(zone, state),
        pressure_of_forces=pressure_of_forces,
        meshed_gap=_meshed_gap(scene, zone),
        pressure_error=None if field is None else field.error,
        recovered=_recovered_pressure(scene, zone, state, field),
        resultants=step.resultants[zone.zone.name],
        friction=zone_friction(zone, state, field) if zone.slips and state.friction else None,
    )


def _meshed_gap(scene: Scene, zone: ZoneScene) -> np.ndarray:
    """The mean distance (m,) of the surfaces where they meet, along the normal; 0 where nowhere."""
    operator = zone.operator
    apart, none = operator.matrix @ scene.points.ravel(), np.zeros(len(operator.covered))
    apart = np.divide(apart, operator.covered, out=none, where=operator.covered > 0)
    return np.asarray(operator.mean @ apart)


def _recovered_pressure(
    scene: Scene, zone: ZoneScene, state: Equilibrium, field: RecoveredZone | None
) -> RecoveredPressure | None:
    """The recovered pressure of a zone, and its mean at each node over the faces around."""
    if field is None or field.name == "none":
        return None
    local, pressure = field.recovery.moments.local, state.pressure[zone.numbers]
    nodes = surface_nodes(zone.sub_faces)
    found = RecoveredPressure(
        form=field.name,
        coefficients=field.coefficients.reshape(len(pressure), -1),
        degree=field.degree,
        centre=local.centre + scene.coordinates.origin,
        axes=local.axes,
        spread=local.spread,
        nodes=nodes,
        at_nodes=np.zeros(len(nodes)),
    )
    total, count = np.zeros((2, len(nodes)))
    for faces in zone.sub_faces:
        places = scene.points[faces.nodes] + scene.coordinates.origin
        at = np.searchsorted(nodes, faces.nodes)
        np.add.at(total, at, found.values(pressure, faces.macro, places))
        np.add.at(count, at, 1.0)
    return replace(found, at_nodes=total / count)


def _nodal_contact(zone: ZoneScene, state: Equilibrium) -> NodalContact | None:
    nodes = zone.operator.nodes
    if nodes is None:
        return None
    closed = zone.at_nodes(state.status.closed.astype(float)) >= _HALF
    return NodalContact(nodes, zone.at_nodes(state.pressure), zone.at_nodes(state.gap), closed)


def step_results(
    scene: Scene, states: list[Equilibrium], fields: list[Recovered], scale: float
) -> tuple[list[StepResult], np.ndarray]:
    """The steps, and the reactions at nodes (n, dim) in the last one."""
    results, at_nodes = [], np.zeros(0)
    for factor, state, field in zip(scene.case.factors, states, fields, strict=True):
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
                resultants={
                    (name := zone.zone.name): resultants(
                        scene, zone, state, closed_of(zone, state), field.get(name)
                    )
                    for zone in scene.zones
                },
                reactions=held,
                rigid=rigid_bodies(scene, state) if scene.held.rigid else [],
                dissipation=state.friction.dissipation if state.friction else 0.0,
            )
        )
    return results, at_nodes


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


def zone_friction(zone: ZoneScene, state: Equilibrium, field: RecoveredZone | None) -> ZoneFriction:
    """Traction, slip and status of a zone."""
    assert state.friction is not None
    tangents = tangents_of(zone.operator.surface.normal)

    def in_space(values: np.ndarray) -> np.ndarray:
        return np.einsum("mkd,km->md", tangents, np.array([values[rows] for rows in zone.slips]))

    closed, recovered = state.status.closed[zone.numbers], None
    if field is not None and len(field.tractions):
        coefficients = -np.array(field.tractions).reshape(len(zone.slips), len(closed), -1)
        recovered = np.einsum("mtd,tmk->mkd", tangents, coefficients)
    return ZoneFriction(
        friction_traction=in_space(-state.pressure),
        slip=in_space(state.gap),
        slip_total=in_space(state.friction.total),
        status=closed.astype(int) + (closed & state.friction.slipping[zone.numbers]),
        recovered=recovered,
    )


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
            cell = cell_at(scene, name)
            moved, tensor = (cell.weights @ f[cell.nodes][None] for f in (displacement, stress))
        found[name] = ProbeResult(places + scene.coordinates.origin, moved, tensor, none)
    return found


def _on_surface(scene: Scene, zone: ZoneResult, name: str, places: np.ndarray) -> ProbeResult:
    """The contact pressure where a zone's slave surface is nearest to local places (k, dim)."""
    pressure, faces = np.empty(len(places)), [(kind, nodes) for kind, nodes, _ in zone.faces]
    for i, face in enumerate(faces_at(scene, name, faces)):
        owner = zone.faces[face.block][2][face.number]
        at = face.nodes[None], np.array([owner]), face.reference[None]
        pressure[i] = pressure_on(
            scene.points + scene.coordinates.origin, zone, face.type.name, *at
        )[0, 0]
    none = np.full((len(places), 6), np.nan)
    return ProbeResult(
        places + scene.coordinates.origin, none[:, : places.shape[1]], none, pressure
    )
