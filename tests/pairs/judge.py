"""How far a solve is from the exact state, and what came of a row."""

import logging
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solver.lac.errors import SolveError
from solver.simulation.options import LEAN, Options
from solver.simulation.results.solution import Solution
from solver.simulation.simulate import solved
from solver.system.errors import InputError
from solver.system.progress import Clock
from solver.verification.checks import run_checks
from solver.verification.judge import judge
from solver.verification.results import read_result, write_result
from solver.verification.verdict import FAILED, UNRELIABLE
from tests.same import read_back

from .options import Row
from .problem import Problem, problem_of
from .state import GAP

# Exact is this; or this, where so many times the solve's own estimate of rounding explains it.
EXACT, ROUNDING, _MARGIN = 1e-11, 1e-9, 10.0
# Of a body 1e6 times stiffer, Young's modulus times a rounded displacement over a cell, over the
# pressure: 2e9 · 2.2e-16 · 0.02 / (25 / 3).
_STIFF = 1e-9
_NEARLY = 0.99
_WORK = {
    "lean": LEAN,
    "everything": Options.everything(),
    "multigrid": Options(solver="multigrid"),
}
COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


@dataclass(frozen=True)
class Outcome:
    """What came of a row: its largest error and where, or the line that ended it.

    `word`: exact, refused or wrong.
    """

    word: str
    error: float
    what: str


def tried(row: Row) -> Outcome:
    """Solve a row and compare it with its state."""
    clock = Clock()
    try:
        problem = problem_of(row)
        solution = solved(problem.case, problem.mesh, _WORK[row["work"]], clock)
    except InputError as error:
        return Outcome("refused", np.inf, str(error))
    except SolveError as error:
        return Outcome("wrong", np.inf, f"not solved: {error}")
    except Exception as error:  # noqa: BLE001
        return Outcome("wrong", np.inf, f"{type(error).__name__}: {error}")
    errors = errors_of(problem, solution)
    what, error = max(errors.items(), key=lambda pair: pair[1])
    estimate = max(solution.quality.accuracy.values(), default=0.0)
    allowed = min(ROUNDING, max(EXACT, _MARGIN * estimate))
    if row["materials"] == "stiff master":  # rounded displacements of its supports are stresses
        allowed = _MARGIN * _STIFF
    if error <= allowed and (amiss := _amiss(solution)):
        return Outcome("wrong", error, amiss)
    return Outcome("exact" if error <= allowed else "wrong", error, what)


def _amiss(solution: Solution) -> str:
    """What the program makes of an exact result: an alarm, or another one when read back."""
    checks = run_checks(solution)
    verdict = judge(solution, checks)
    if verdict.verdict in (UNRELIABLE, FAILED):
        return f"false alarm: {verdict.reason}"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "pairs.vtkhdf")
        write_result(file, solution, [], {})
        again = read_result(file).solution
    same = judge(again, checks).plain() == verdict.plain() and read_back(solution, again)
    return "" if same else "read back as another result"


def errors_of(problem: Problem, solution: Solution) -> dict[str, float]:
    """The largest error of each field, over the scale of the field."""
    placed, dim = problem.placed, len(problem.placed.origin)
    scale = max(float(np.abs(body.stress).max()) for body in problem.bodies)
    exact_of = {body.name: body for body in problem.bodies}
    found: dict[str, float] = {}
    moved, wanted = solution.displacement, np.zeros_like(solution.displacement)
    given = solution.mesh.points
    if solution.fields.motion is not None:
        moved, given = moved + solution.fields.motion, given - solution.fields.motion
    seen = np.zeros(len(moved), dtype=bool)
    for number, info in enumerate(solution.bodies):
        if (body := exact_of.get(info.name)) is None:
            continue
        mine = solution.fields.body == number
        places = (given[mine, :dim] - placed.origin) @ placed.turn / placed.scale
        local = (places @ body.gradient.T + body.shift) * problem.factor
        wanted[mine] = placed.scale * local @ placed.turn.T
        seen |= mine
        if not body.rigid:
            turn = np.eye(3)
            turn[:dim, :dim] = placed.turn
            stress = np.zeros((3, 3))
            stress[: len(body.stress), : len(body.stress)] = body.stress
            stress = problem.factor * turn @ stress @ turn.T
            checked = [k for k, (i, j) in enumerate(COMPONENTS) if max(i, j) < len(body.stress)]
            exact = np.array([stress[COMPONENTS[k]] for k in checked])
            error = np.abs(solution.stress[mine][:, checked] - exact).max() / scale
            found[f"stress of {body.name}"] = float(error)
    assert seen.any(), f"no body of the case among {solution.bodies}"
    strained = max(float(np.abs(b.stress).max()) / b.young for b in problem.bodies)
    size = max(float(np.abs(wanted).max()), placed.scale * strained)
    acts = problem.factor > 0
    found["displacement"] = float(np.abs(moved - wanted)[seen].max() / size)
    coefficient_of = {zone.name: zone.friction for zone in problem.case.zones}
    for zone in solution.zones:
        body = problem.bodies[0 if zone.name == "one" else -1]
        stress = placed.turn @ body.stress[:dim, :dim] @ placed.turn.T
        normal = zone.normal[:, :dim]
        opened = problem.open and zone.name == "one"
        traction = normal @ stress * (acts and not opened)
        pressed = np.einsum("md,md->m", traction, normal)
        found[f"pressure of {zone.name}"] = float(np.abs(zone.multiplier + pressed).max() / scale)
        gap = zone.gap - GAP * placed.scale * opened
        found[f"gap of {zone.name}"] = float(np.abs(gap).max() / placed.scale)
        along = traction - pressed[:, None] * normal
        bound = abs(coefficient_of[zone.name] * pressed)
        slips = (bound > 0) & (np.linalg.norm(along, axis=1) > _NEARLY * bound)
        status = np.zeros(len(slips)) if opened else 1 + slips
        if acts:  # surfaces that touch are either
            found[f"status of {zone.name}"] = float(np.abs(zone.shown_status - status).max())
        if zone.friction is not None:
            error = np.abs(zone.friction.friction_traction[:, :dim] - along).max() / scale
            found[f"friction of {zone.name}"] = float(error)
    return found


logging.getLogger("solver").setLevel(logging.ERROR)
