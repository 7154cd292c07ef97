"""Solve a case on a mesh: from case and mesh to a Solution."""

import logging
from collections.abc import Iterator
from dataclasses import replace

import meshio

from ..case.model import Case
from ..lac.errors import SolveError
from ..system.errors import InputError
from ..system.progress import OUTCOME, Clock, processor_time, stage
from .equilibrium.problem import ContactProblem
from .equilibrium.state import Equilibrium
from .equilibrium.step import solve_step
from .finished import called, finished, tell
from .fit import refusals, refuse_unfit
from .judgement.plan import decided, plan_notes
from .judgement.validity import validity
from .options import LEAN, Options
from .results.results import solution_of
from .results.solution import Solution
from .scene.bodies import without_unloaded
from .scene.scene import build_scene

_LOG = logging.getLogger(__name__)


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
    solution = solved(case, mesh, options, clock)
    if solution.ended:
        raise SolveError(solution.ended)
    solution.cost.cpu_seconds = processor_time() - started
    return solution


def solved(case: Case, mesh: meshio.Mesh, options: Options, clock: Clock) -> Solution:
    """Solve a case on its mesh: all steps on the mesh as given, or each where its bodies are.

    Raises as `simulate` does; where a later step has no solution, see `solve_problem`.
    """
    if case.moving:
        from .motion import solve_moving

        return solve_moving(case, mesh, options, clock)
    return solve_problem(assembled(case, mesh, options, clock), clock)


def solve_problem(problem: ContactProblem, clock: Clock) -> Solution:
    """Solve an assembled problem step by step, each from the status of the one before.

    How it was assembled goes on record. Where a later step has no solution, those before it are
    kept, and `ended` says why. Raises SolveError where the first step has none.
    """
    scene, case = problem.scene, problem.scene.case
    plan = list(decided(problem))
    for line in plan:
        _LOG.info("plan: %s (%s)", line.what, line.why)
    states, ended = list[Equilibrium](), ""
    with stage(clock, "solve"):
        for factor, step in zip(case.factors, case.steps, strict=True):
            try:
                last = states[-1] if states else None
                before = case.steps[len(states) - 1] if states else None
                start = last.status.closed if last else None
                state = solve_step(problem, step, last, start, before)
            except SolveError as error:
                ended = f"{called(step, factor)}: {error}" if len(case.steps) > 1 else str(error)
                if not states:
                    raise SolveError(ended) from None
                problem.scene = replace(scene, case=case.until(len(states)))
                break
            states.append(state)
            tell(called(step, factor), state, scene.n_multipliers)
    plan += plan_notes(problem, states)
    with stage(clock, "recovery"):
        solution = solution_of(problem, states, plan)
        solution.quality.validity = validity(problem, states)
    return finished(solution, clock, ended)


def refusals_on(case: Case, mesh: meshio.Mesh) -> Iterator[InputError]:
    """All refusals of a case on its mesh, from the first group that is missing on.

    Bodies that move are where the first step is expected to bring them.
    """
    try:
        if case.moving:
            from .motion import first_scene

            scene = first_scene(case, mesh, LEAN, Clock())
        else:
            scene = build_scene(case, mesh)
        found = list(refusals(scene))
        yield from found
        if not found:
            ContactProblem(without_unloaded(scene))
    except InputError as error:
        yield error


def assembled(case: Case, mesh: meshio.Mesh, options: Options, clock: Clock) -> ContactProblem:
    """The contact problem of a case; raises InputError where it does not fit its mesh."""
    scene = build_scene(case, mesh, options, clock)
    refuse_unfit(scene)
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
