"""Solve a case on a mesh: from case and mesh to a Solution."""

import logging
import resource
from dataclasses import replace
from functools import partial
from typing import Any

import meshio
import numpy as np

from ..case.acting import Step
from ..case.model import STATE, Case
from ..lac.errors import SolveError
from ..system.process import peak_mb
from ..system.progress import OUTCOME, Clock, processor_time, stage
from .equilibrium.problem import ContactProblem
from .equilibrium.recovery import Recovered, recovered
from .equilibrium.state import Equilibrium
from .judgement.consistency import inconsistency
from .judgement.plan import decided, estimated, plan_notes, softness_notes
from .judgement.validity import remarks, validity
from .options import LEAN, Options
from .results.results import solution_of
from .results.solution import Solution
from .scene.bodies import check_geometry, without_unloaded
from .scene.scene import build_scene

_LOG = logging.getLogger(__name__)
# Forces below this fraction of the largest one are shown as zero.
_NOISE = 1e-10


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
    started, clock = processor_time(), clock or Clock()
    solution = solve_problem(assembled(case, mesh, options, clock), clock)
    if solution.ended:
        raise SolveError(solution.ended)
    solution.cpu_seconds = processor_time() - started
    return solution


def solve_problem(problem: ContactProblem, clock: Clock) -> Solution:
    """Solve an assembled problem step by step, each from the status of the one before.

    How it was assembled goes on record. Where a later step has no solution, those before it are
    kept, and `ended` says why. Raises SolveError where the first step has none.
    """
    scene, case = problem.scene, problem.scene.case
    plan = list(decided(problem))
    for line in plan:
        _LOG.info("plan: %s (%s)", line.what, line.why)
    states, fields, ended = list[Equilibrium](), list[Recovered](), ""
    with stage(clock, "solve"):
        for factor, step in zip(case.factors, case.steps, strict=True):
            try:
                state, field = _solved(problem, step, states)
            except SolveError as error:
                ended = f"{_called(step, factor)}: {error}" if len(case.steps) > 1 else str(error)
                if not states:
                    raise SolveError(ended) from None
                problem.scene = replace(scene, case=case.until(len(states)))
                break
            states.append(state)
            fields.append(field)
            closed = int(state.status.closed[: scene.n_multipliers].sum())
            count = state.status.iterations
            values = _called(step, factor), count, "s" * (count != 1), closed, state.residual
            _LOG.log(OUTCOME, "%s: %d iteration%s, %d closed, residual %.1e", *values)
    plan += plan_notes(problem, states)
    with stage(clock, "recovery"):
        solution = solution_of(problem, states, fields, plan)
        solution.validity = validity(problem, states)
    _log_forces(solution)
    solution.plan += [*estimated(solution), *remarks(solution.validity), *softness_notes(solution)]
    solution.seconds, solution.stage_cpu_seconds = clock.seconds, clock.cpu_seconds
    solution.ended = ended
    if fault := inconsistency(solution):
        raise SolveError(f"the solve came to no sound end: {fault}")
    solution.peak_memory_mb = peak_mb(resource.getrusage(resource.RUSAGE_SELF))
    return solution


def _solved(
    problem: ContactProblem, step: Step, states: list[Equilibrium]
) -> tuple[Equilibrium, Recovered]:
    """A step after those solved, and its recovered pressure."""
    case, last = problem.scene.case, states[-1] if states else None
    if case.frictional:
        from .equilibrium.friction_recovery import solve_and_recover  # friction alone

        return solve_and_recover(problem, step, last)
    before = case.steps[len(states) - 1] if states else None
    state = problem.solve(step, last.status.closed if last else None, before=before)
    if (state.trial.violation(state.iterate.closed) > 1).any():
        raise SolveError("contact bears tension or surfaces overlap")
    return recovered(problem, state, step)


def assembled(case: Case, mesh: meshio.Mesh, options: Options, clock: Clock) -> ContactProblem:
    """The contact problem of a case; raises InputError where it does not fit its mesh."""
    scene = build_scene(case, mesh, options, clock)
    check_geometry(scene)
    if options.shortcuts.unloaded:
        with stage(clock, "assembly"):
            scene = without_unloaded(scene)
    macro_elements = sum(zone.count for zone in scene.zones)
    _LOG.log(OUTCOME, "%d unknowns, %d macro-elements", scene.n_dofs, macro_elements)
    for zone in scene.zones:  # those whose surfaces do not touch everywhere
        met = zone.operator.covered > 0
        gaps = zone.operator.initial[met] / zone.operator.covered[met]
        if gaps.any():
            text = "zone %s: initial gap %.4g to %.4g" + ", an overlap" * bool(gaps.min() < 0)
            _LOG.log(OUTCOME, text, zone.zone.name, gaps.min(), gaps.max())
    with stage(clock, "assembly"):
        return ContactProblem(scene)


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


def _called(step: Step, factor: float) -> str:
    if not isinstance(step, dict):
        return f"load factor {factor:g}"
    if all(name.startswith(STATE) for name in step):
        return f"step {factor:g}"
    return f"step {factor:g} ({', '.join(f'{name} {value:g}' for name, value in step.items())})"
