"""The end of a solve: what it tells, its last remarks, and whether its fields are sound."""

import logging
import resource
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..case.acting import Step
from ..case.model import STATE
from ..lac.errors import SolveError
from ..system.process import peak_mb
from ..system.progress import OUTCOME, Clock
from .equilibrium.state import Equilibrium
from .judgement.consistency import inconsistency
from .judgement.plan import estimated, softness_notes
from .judgement.validity import remarks
from .results.solution import Solution

_LOG = logging.getLogger(__name__)
# Forces and pressures below this fraction of the largest of all steps are shown as zero.
_NOISE = 1e-10
# The factors of so many names are told.
_FEW = 6


def finished(solution: Solution, clock: Clock, ended: str) -> Solution:
    """The solution with its last remarks and its times; SolveError where it is not sound.

    `ended`: why the step after its last one has no solution; empty where all have one.
    """
    _log_forces(solution)
    solution.plan += [
        *estimated(solution),
        *remarks(solution.quality.validity),
        *softness_notes(solution),
    ]
    solution.cost.seconds, solution.cost.stage_cpu_seconds = clock.seconds, clock.cpu_seconds
    solution.ended = ended
    if fault := inconsistency(solution):
        raise SolveError(f"the solve came to no sound end: {fault}")
    solution.cost.peak_memory_mb = peak_mb(resource.getrusage(resource.RUSAGE_SELF))
    return solution


def tell(step: str, state: Equilibrium, n_multipliers: int) -> None:
    """Log how a step was solved."""
    closed = int(state.status.closed[:n_multipliers].sum())
    count = state.status.iterations
    values = step, count, "s" * (count != 1), closed, state.residual
    _LOG.log(OUTCOME, "%s: %d iteration%s, %d closed, residual %.1e", *values)


def _log_forces(solution: Solution) -> None:
    """Log the forces of each step, and the largest displacement and strain of the last."""
    if units := solution.case.about.units:
        _LOG.log(OUTCOME, "numbers in %s", " and ".join(units.values()))
    shown = partial(_without_noise, _sizes(solution))
    for step, given in zip(solution.steps, solution.case.steps, strict=True):
        of_step = f"{called(given, step.factor)}, " if len(solution.steps) > 1 else ""
        for name, contact in step.resultants.items():
            _LOG.log(OUTCOME, "%szone %s: %s", of_step, name, shown(contact))
        if solution.case.frictional:
            _LOG.log(OUTCOME, "%swork of friction %.6g", of_step, step.dissipation)
        for reaction in step.reactions:
            text = "%sreaction of %s: %s"
            _LOG.log(OUTCOME, text, of_step, reaction.group, shown(reaction))
        for body in step.rigid:
            text = "%scontact on rigid body %s: %s"
            _LOG.log(OUTCOME, text, of_step, body.body, shown(body))
    for name, probe in solution.places.probes.items():
        for line in probe.lines():
            _LOG.log(OUTCOME, "probe %s %s", name, line)
    largest, place = solution.largest_displacement
    at = ", ".join(f"{x:.5g}" for x in place)
    beside = " beside the motion" if solution.fields.motion is not None else ""
    values = beside, largest, at, solution.quality.validity.strain, solution.scalars.strain_energy
    text = "largest displacement%s %.6g at (%s), largest strain %.3g, strain energy %.6g"
    _LOG.log(OUTCOME, text, *values)


def _sizes(solution: Solution) -> dict[str, float]:
    """The largest size that each part of a resultant has, or can have, in any step."""
    resultants: list[Any] = [
        one
        for step in solution.steps
        for one in (*step.resultants.values(), *step.reactions, *step.rigid)
    ]
    most = max((float(np.abs(one.force).max()) for one in resultants), default=0.0)
    length = float(np.ptp(solution.mesh.points, axis=0).max())
    sizes = {"force": most, "friction": most, "moment": most * length}
    return sizes | {"pressure": solution.largest_pressure}


def _without_noise(sizes: dict[str, float], found: Any) -> Any:
    """A resultant without what is round-off beside the sizes of its parts."""
    parts = {name: getattr(found, name, None) for name in sizes}
    quiet = {
        name: np.where(np.abs(part) < _NOISE * sizes[name], 0.0, part)
        for name, part in parts.items()
        if part is not None
    }
    return replace(found, **quiet)


def called(step: Step, factor: float) -> str:
    """A step in words."""
    if not isinstance(step, dict):
        return f"load factor {factor:g}"
    if len(step) > _FEW or all(name.startswith(STATE) for name in step):
        return f"step {factor:g}"
    return f"step {factor:g} ({', '.join(f'{name} {value:g}' for name, value in step.items())})"
