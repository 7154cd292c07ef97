"""Solve a case on a mesh: from case and mesh to a Solution."""

import logging
import resource
from dataclasses import replace
from functools import partial
from typing import Any

import meshio
import numpy as np

from ..case.model import STATE, Case, Step
from ..lac.cells.catalogue import BY_NAME
from ..lac.cells.faces import nodal_normals
from ..lac.errors import SolveError
from ..mechanics.fem.nodal_stress import nodal_stress
from ..mechanics.fem.stress import normal_stress
from ..system.clock import Clock, processor_time
from ..system.memory import peak_mb
from ..system.progress import OUTCOME, stage
from .balance import (
    imbalances,
    pressures_of_forces,
    strain_energy,
)
from .consistency import inconsistency
from .equilibrium import Equilibrium
from .geometry import check_geometry
from .naming import body_infos
from .options import LEAN, Options
from .plan import decided, estimated, plan_notes, softness_notes
from .probes import probed
from .problem import ContactProblem
from .recovery import Recovered, RecoveredZone, recovered
from .scene import Scene, ZoneScene, build_scene
from .solution import (
    Line,
    NodalContact,
    RecoveredPressure,
    Solution,
    StepResult,
    ZoneResult,
)
from .step_results import closed_of, step_results, stress_scale, zone_friction
from .unloaded import without_unloaded
from .validity import remarks, validity

_LOG = logging.getLogger(__name__)
# Forces below this fraction of the largest one are shown as zero.
_NOISE = 1e-10
# Half, up to round-off.
_HALF = 0.5 - 1e-9


def simulate(
    case: Case,
    mesh: meshio.Mesh,
    options: Options = LEAN,
    clock: Clock | None = None,
) -> Solution:
    """Solve a case on its mesh; the case may be swapped (see `Case.as_solved`).

    The time of every stage is added to `clock`, where one is given. Raises InputError where the
    case and its mesh do not fit, SolveError where no solution is found.
    """
    started = processor_time()
    clock = clock or Clock()
    scene = build_scene(case, mesh, options, clock)
    check_geometry(scene)
    if options.shortcuts.unloaded:
        with stage(clock, "assembly"):
            scene = without_unloaded(scene)
    macro_elements = sum(zone.count for zone in scene.zones)
    _LOG.log(OUTCOME, "%d unknowns, %d macro-elements", scene.n_dofs, macro_elements)
    _log_gaps(scene)
    with stage(clock, "assembly"):
        problem = ContactProblem(scene)
    solution = solve_problem(problem, clock)
    solution.cpu_seconds = processor_time() - started
    solution.peak_memory_mb = peak_mb(resource.getrusage(resource.RUSAGE_SELF))
    return solution


def solve_problem(problem: ContactProblem, clock: Clock) -> Solution:
    """Solve an assembled problem at all load factors; how it was assembled goes on record."""
    plan = list(decided(problem))
    for line in plan:
        _LOG.info("plan: %s (%s)", line.what, line.why)
    with stage(clock, "solve"):
        states, fields = _walk(problem)
    plan += plan_notes(problem, states)
    with stage(clock, "recovery"):
        solution = _recover(problem, states, fields, plan)
    _log_forces(solution)
    solution.plan += [*estimated(solution), *remarks(solution.validity), *softness_notes(solution)]
    solution.seconds, solution.stage_cpu_seconds = clock.seconds, clock.cpu_seconds
    if fault := inconsistency(solution):
        raise SolveError(f"the solve came to no sound end: {fault}")
    return solution


def _log_gaps(scene: Scene) -> None:
    """Log the initial gaps of zones whose surfaces do not touch everywhere."""
    for zone in scene.zones:
        met = zone.operator.covered > 0
        gaps = zone.operator.initial[met] / zone.operator.covered[met]
        if gaps.any():
            text = "zone %s: initial gap %.4g to %.4g" + ", an overlap" * bool(gaps.min() < 0)
            _LOG.log(OUTCOME, text, zone.zone.name, gaps.min(), gaps.max())


def _log_forces(solution: Solution) -> None:
    """Log the forces of each step, and the largest displacement and strain of the last."""
    if units := solution.case.units:
        _LOG.log(OUTCOME, "numbers in %s", " and ".join(units.values()))
    shown = partial(_without_noise, float(np.ptp(solution.mesh.points, axis=0).max()))
    for step, given in zip(solution.steps, solution.case.steps, strict=True):
        of_step = f"{_called(given, step.factor)}, " if len(solution.steps) > 1 else ""
        forces = [one.force for one in step.resultants.values()]
        forces += [one.force for one in step.reactions] + [one.force for one in step.rigid]
        most = max((float(np.abs(force).max()) for force in forces), default=0.0)
        for name, contact in step.resultants.items():
            _LOG.log(OUTCOME, "%szone %s: %s", of_step, name, shown(most, contact))
        if solution.case.frictional:
            _LOG.log(OUTCOME, "%swork of friction %.6g", of_step, step.dissipation)
        for reaction in step.reactions:
            text = "%sreaction of %s: %s"
            _LOG.log(OUTCOME, text, of_step, reaction.group, shown(most, reaction))
        for body in step.rigid:
            text = "%scontact on rigid body %s: %s"
            _LOG.log(OUTCOME, text, of_step, body.body, shown(most, body))
    for name, probe in solution.probes.items():
        for line in probe.lines():
            _LOG.log(OUTCOME, "probe %s %s", name, line)
    largest, place = solution.largest_displacement
    at = ", ".join(f"{x:.5g}" for x in place)
    values = largest, at, solution.validity.strain, solution.strain_energy
    text = "largest displacement %.6g at (%s), largest strain %.3g, strain energy %.6g"
    _LOG.log(OUTCOME, text, *values)


def _without_noise(length: float, most: float, found: Any) -> Any:
    """A resultant without the round-off beside `most`, the largest force, and its moments."""
    force, moment = found.force, found.moment
    return replace(
        found,
        force=np.where(np.abs(force) < _NOISE * most, 0.0, force),
        moment=np.where(np.abs(moment) < _NOISE * most * length, 0.0, moment),
    )


def _walk(problem: ContactProblem) -> tuple[list[Equilibrium], list[Recovered]]:
    """Solve the steps in turn, each from the status of the one before.

    With each state the pressure recovered in it.
    """
    states: list[Equilibrium] = []
    fields: list[Recovered] = []
    case = problem.scene.case
    for factor, step in zip(case.factors, case.steps, strict=True):
        start = states[-1].status.closed if states else None
        before = case.steps[len(states) - 1] if states else None
        if case.frictional:
            from .friction_recovery import solve_and_recover  # friction alone needs it

            state, field = solve_and_recover(problem, step, states[-1] if states else None)
        else:
            state = problem.solve(step, start, before=before)
            if (state.trial.violation(state.iterate.closed) > 1).any():
                what = f"{_called(step, factor)}: contact bears tension or surfaces overlap"
                raise SolveError(what)
            state, field = recovered(problem, state, step)
        states.append(state)
        fields.append(field)
        closed = int(state.status.closed[: problem.scene.n_multipliers].sum())
        count = state.status.iterations
        values = _called(step, factor), count, "" if count == 1 else "s", closed, state.residual
        _LOG.log(OUTCOME, "%s: %d iteration%s, %d closed, residual %.1e", *values)
    return states, fields


def _called(step: Step, factor: float) -> str:
    if not isinstance(step, dict):
        return f"load factor {factor:g}"
    if all(name.startswith(STATE) for name in step):
        return f"step {factor:g}"
    return f"step {factor:g} ({', '.join(f'{name} {value:g}' for name, value in step.items())})"


def _recover(
    problem: ContactProblem, states: list[Equilibrium], fields: list[Recovered], plan: list[Line]
) -> Solution:
    scene = problem.scene
    last = states[-1]
    stress = nodal_stress(
        scene.points, scene.blocks, last.iterate.deformation, last.iterate.extended
    )
    stress += scene.mean.nodal_stress(last.iterate.mean_stress, scene.blocks)
    stress -= scene.straining(scene.case.steps[-1], scene.initial.stress)
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
        body=scene.body,
        bodies=body_infos(scene),
        zones=zones,
        nodal_normal_stress=normal_stress(stress, _contact_direction(scene)),
        balance=imbalances(scene, last),
        steps=steps,
        length=scene.length,
        load_scale=scale,
        dofs=scene.n_dofs,
        macro_elements=sum(zone.count for zone in scene.zones),
        iterations=sum(state.status.iterations for state in states),
        linear_solver=problem.linear_solver,
        linear_iterations=problem.linear_iterations,
        matrix_entries=problem.matrix.nnz,
        plan=plan,
        validity=validity(scene, states),
        strain_energy=strain_energy(scene, last),
        reaction=at_nodes,
        probes=probed(scene, zones, last.displacement, stress),
        acted=scene.acted,
        accuracy=last.accuracy.causes,
        mean_stress=scene.mean.by_cell(last.iterate.mean_stress, scene.mesh.cells),
    )


def _output_mesh(scene: Scene) -> meshio.Mesh:
    cells = [(_meshio_name(name), data) for name, data in scene.mesh.cells.items()]
    sets = {
        group: [np.flatnonzero(scene.mesh.members(name, mask)) for name in scene.mesh.cells]
        for group, mask in scene.given.groups.items()
        if any(m.any() for m in mask.values())
    }
    return meshio.Mesh(scene.points + scene.origin, cells, cell_sets=sets)


def _meshio_name(name: str) -> str:
    return BY_NAME[name].meshio


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
    slave_nodes, slave_normal = _nodal_normals(
        scene, [(f.type.name, f.nodes) for f in zone.sub_faces]
    )
    master = [(b.type.name, b.nodes) for b in zone.master_faces]
    master_nodes, master_normal = _nodal_normals(scene, master)
    return ZoneResult(
        name=zone.zone.name,
        faces=[(f.type.name, f.nodes, f.macro) for f in zone.sub_faces],
        master_faces=master,
        centre=surface.centre + scene.origin,
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
        pressure_error=None if field is None else field.error,
        recovered=_recovered_pressure(scene, zone, state, field),
        resultants=step.resultants[zone.zone.name],
        friction=zone_friction(zone, state, field),
    )


def _recovered_pressure(
    scene: Scene, zone: ZoneScene, state: Equilibrium, field: RecoveredZone | None
) -> RecoveredPressure | None:
    """The recovered pressure of a zone, and its mean at each node over the faces around."""
    if field is None or field.name == "none":
        return None
    local, pressure = field.recovery.moments.local, state.pressure[zone.numbers]
    nodes = np.unique(np.concatenate([f.nodes.ravel() for f in zone.sub_faces]))
    found = RecoveredPressure(
        form=field.name,
        coefficients=field.coefficients.reshape(len(pressure), -1),
        degree=field.degree,
        centre=local.centre + scene.origin,
        axes=local.axes,
        spread=local.spread,
        nodes=nodes,
        at_nodes=np.zeros(len(nodes)),
    )
    total, count = np.zeros((2, len(nodes)))
    for faces in zone.sub_faces:
        places = scene.points[faces.nodes] + scene.origin
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


def _nodal_normals(
    scene: Scene, faces: list[tuple[str, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """The nodes of a surface and its unit normals there, the mean over the faces around each."""
    total = nodal_normals(scene.points, faces)
    nodes = np.unique(np.concatenate([nodes.ravel() for _, nodes in faces]))
    return nodes, total[nodes]
