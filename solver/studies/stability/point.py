"""The points of a sweep: each solved with all safeguards and with none, measured and recorded.

A point that is refused, or whose solve fails, is on record with its reason. Errors are relative to
the pressure, or, for the gap, to the size of the model. A point holds when its pressure and stress
are within 1e-10, or twenty times their floor where that is more. Beyond the end of a sweep it holds
as well when it is refused or fails with a reason, or when its own estimate of its accuracy bounds
its errors: there it must only know what it does not know.
"""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from scipy import sparse

from ...mechanics.linear.condensation import CondensedSystem
from ...mesh import generate, transform
from ...simulation.accuracy import Accuracy
from ...simulation.options import Options, Safeguards
from ...simulation.problem import ContactProblem
from ...simulation.scene import build_scene
from ...simulation.simulate import solve_problem
from ...system.clock import Clock
from ...system.errors import InputError, SolveError
from ...system.files import write_text
from ...verification.verdict import FAILED, PASSED, REFUSED, UNRELIABLE, to_json
from .description import Sweep, SweepSeries, Value
from .floor import floor, stress_error
from .states import State, exact_state

GOAL, FLOORS = 1e-10, 20.0
"""A point must reach the first, or this many times its floor."""
SMALL = 1500
"""Unknowns up to which all eigenvalues of the system are found."""


@lru_cache(maxsize=8)
def _generated(recipe: str, where: str) -> meshio.Mesh:
    """The mesh of a recipe (as JSON), made once."""
    return generate(json.loads(recipe), where)


@dataclass(frozen=True)
class _Point:
    sweep: Sweep
    series: SweepSeries
    value: Value
    label: str


def run_sweep(sweep: Sweep, output: Path) -> dict[str, Any]:
    """Solve all points of a sweep in this process and write the record, whole or not at all."""
    started = time.process_time()
    points = [_record(point) for point in _points(sweep)]
    record = {
        "sweep": sweep.name,
        "title": sweep.title,
        "breaks": sweep.breaks,
        "order": sweep.order,
        "values": list(sweep.labels),
        "points": points,
        "cpu_seconds": time.process_time() - started,
    }
    write_text(output, to_json(record) + "\n")
    return record


def _points(sweep: Sweep) -> Iterator[_Point]:
    for series in sweep.series:
        for value, label in zip(sweep.values, sweep.labels, strict=True):
            yield _Point(sweep, series, value, label)


def _record(point: _Point) -> dict[str, Any]:
    """One point: identity, floor, measures with all safeguards and with none, whether it holds."""
    cured = _attempt(point, Safeguards())
    beyond = point.value in point.sweep.beyond
    return {
        "series": point.series.name,
        "label": point.label,
        "value": point.value,
        "beyond": beyond,
        "holds": _within(cured) or (beyond and _known_to_itself(cured)),
        **cured,
        "uncured": _attempt(point, Safeguards.none()),
    }


def _within(measured: dict[str, Any]) -> bool:
    return measured["word"] in (PASSED, UNRELIABLE) and all(
        measured[name] <= max(GOAL, FLOORS * measured[f"floor_{name}"])
        for name in ("pressure", "stress")
    )


def _known_to_itself(measured: dict[str, Any]) -> bool:
    if measured["word"] in (REFUSED, FAILED):
        return True
    return max(measured["pressure"], measured["stress"]) <= measured["attainable"]


def _attempt(point: _Point, safeguards: Safeguards) -> dict[str, Any]:
    """The measures of the point, or the reason why they are missing."""
    try:
        return _measured(point, safeguards)
    except InputError as error:
        return {"word": REFUSED, "reason": f"{error.key}: {error.problem}"}
    except SolveError as error:
        return {"word": FAILED, "reason": str(error)}


def _measured(point: _Point, safeguards: Safeguards) -> dict[str, Any]:
    case = point.sweep.case(point.series.mesh, point.value).as_solved(point.series.swapped)
    raw = _generated(json.dumps(case.mesh), str(case.path))
    mesh = transform(raw, case.transform, str(case.path)) if case.transform else raw
    state = exact_state(case, point.sweep.state, raw)
    clock = Clock()
    scene = build_scene(case, mesh, Options(safeguards=safeguards), clock)
    problem = ContactProblem(scene)
    solution = solve_problem(problem, clock)
    zones = solution.zones
    balance = solution.balance
    # Of rounding alone: a sweep's points may have strains that no real body has.
    accuracy = Accuracy(solution.accuracy)
    measures: dict[str, Any] = {
        "word": UNRELIABLE if accuracy.reason else PASSED,
        "reason": accuracy.reason,
        "pressure": max(np.abs(z.multiplier / state.pressure - 1).max() for z in zones),
        "stress": stress_error(solution.stress, scene, state),
        "gap": max(np.abs(z.gap).max() for z in zones) / scene.length,
        "force": max(v for k, v in balance.items() if k.endswith("force")),
        "moment": max(v for k, v in balance.items() if k.endswith("moment")),
        "residual": solution.steps[-1].residual,
        "iterations": solution.iterations,
        "unknowns": solution.dofs,
        "attainable": accuracy.estimate,
    }
    if safeguards == Safeguards():
        measures |= _known(problem, raw, mesh, state)
    return measures


def _known(
    problem: ContactProblem, raw: meshio.Mesh, mesh: meshio.Mesh, state: State
) -> dict[str, Any]:
    """The floors of the exact answer, and properties of the system that is solved."""
    pressure, stress = floor(problem, raw, mesh, state)
    known: dict[str, Any] = {"floor_pressure": pressure, "floor_stress": stress}
    system = problem.system
    if isinstance(system, CondensedSystem) and problem.scene.points.shape[1] == 2:
        known |= _spectrum(system, problem.matrix)
    return known


def _spectrum(system: CondensedSystem, stiffness: sparse.csr_matrix) -> dict[str, Any]:
    """Condition number and inertia of the condensed system, scaled to a diagonal of one.

    By all its eigenvalues where it is small, in full precision; else the inertia alone, which is
    known from the factor: Cholesky's succeeds only where all eigenvalues are positive.
    """
    expansion = system.expansion
    matrix = (expansion.T @ stiffness @ expansion).tocsr()
    size = matrix.shape[0]
    if size > SMALL:
        return {"condition": None, "inertia": [size, 0, 0], "inertia_by": "factor"}
    scale = sparse.diags(1 / np.sqrt(matrix.diagonal()))
    values = np.linalg.eigvalsh((scale @ matrix @ scale).toarray())
    least = size * np.finfo(float).eps * np.abs(values).max()
    inertia = [int((values > least).sum()), int((values < -least).sum())]
    return {
        "condition": float(np.abs(values).max() / np.abs(values).min()),
        "inertia": [*inertia, size - sum(inertia)],
        "inertia_by": "eigenvalues",
    }
