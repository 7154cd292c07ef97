"""The verdict of a solve: one JSON object with all that the report shows, whatever happened."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from solver.case import job_name
from solver.case.reader import Case
from solver.simulation.accuracy import Accuracy
from solver.simulation.solution import Solution
from solver.system.files import write_text
from solver.verification.checks import CheckResult

PASSED, FAILED, UNRELIABLE = "passed", "failed", "unreliable"
REFUSED, CRASHED = "refused", "crashed"
# What a verdict says of where the case's reference comes from.
_ORIGIN = ("reference_kind", "reference_uncertainty", "reference_code", "reference_remark")
# What a solve tells and a solve without an end cannot.
_UNKNOWN: dict[str, Any] = {
    "result": None,
    "dofs": None,
    "macro_elements": None,
    "iterations": None,
    "linear_solver": None,
    "linear_iterations": None,
    "matrix_entries": None,
    "length": None,
    "load_scale": None,
    "seconds": {},
    "stage_cpu_seconds": {},
    "cpu_seconds": None,
    "peak_memory_mb": None,
    "pressure": None,
    "stress": None,
    "gap": None,
    "status": None,
    "coverage": None,
    "worst": None,
    "bodies": [],
    "plan": [],
    "checks": [],
    "accuracy": {},
    "attainable": None,
    "errors": {},
    "provenance": {},
    "transient": False,
}


def of_solution(
    solution: Solution,
    checks: Sequence[CheckResult],
    result: str | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The verdict of a solve that came to its end: `passed` when every check holds.

    `unreliable` whatever the checks say, where rounding may have left less than four digits; then
    `attainable`, the relative error that rounding alone may cause, is the first reason.
    `result` is the name of the result file beside the verdict. Extremes are pairs of minimum and
    maximum over all zones; `worst` names the check nearest to its tolerance, or furthest past it.
    """
    accuracy = Accuracy(solution.accuracy)
    reasons = [accuracy.reason] if accuracy.reason else []
    reasons += [check.reason for check in checks if not check.passed]
    failed = UNRELIABLE if accuracy.reason else FAILED
    zones = solution.zones
    return _identity(solution.case, solution.swapped, solution.hexahedra) | {
        "verdict": failed if reasons else PASSED,
        "passed": not reasons,
        "reason": _first_of(reasons),
        "result": result,
        "dofs": solution.dofs,
        "macro_elements": solution.macro_elements,
        "iterations": solution.iterations,
        "linear_solver": solution.linear_solver,
        "linear_iterations": solution.linear_iterations,
        "matrix_entries": solution.matrix_entries,
        "length": solution.length,
        "load_scale": solution.load_scale,
        "seconds": _with_total(solution.seconds),
        "stage_cpu_seconds": dict(solution.stage_cpu_seconds),
        "cpu_seconds": solution.cpu_seconds,
        "peak_memory_mb": solution.peak_memory_mb,
        "pressure": _extremes(zone.multiplier for zone in zones),
        "stress": _extremes([solution.nodal_normal_stress[solution.body >= 0]]),
        "gap": _extremes(zone.gap for zone in zones),
        "status": _extremes(zone.closed.astype(int) for zone in zones),
        "coverage": _extremes(zone.coverage for zone in zones),
        "worst": _worst(checks),
        "bodies": _bodies(solution),
        "plan": [list(entry) for entry in solution.plan],
        "checks": [asdict(check) for check in checks],
        "accuracy": dict(solution.accuracy),
        "attainable": accuracy.estimate,
        "errors": dict(solution.errors),
        "provenance": dict(provenance or {}),
        "transient": False,
    }


def without_result(
    verdict: str,
    reason: str,
    case: Case | Path,
    swapped: bool = False,
    hexahedra: str | None = None,
    transient: bool = False,
) -> dict[str, Any]:
    """The verdict of a solve that was refused, failed or crashed, for the reason given.

    `case` is the path of the case file where the file itself could not be read. `transient`: the
    reason lies in the machine (memory, disk, a kill), so that the same solve may do another time.
    """
    ended = {"verdict": verdict, "passed": False, "reason": reason}
    return _identity(case, swapped, hexahedra) | _UNKNOWN | ended | {"transient": transient}


def write_verdict(path: str | Path, verdict: Mapping[str, Any]) -> None:
    """Write a verdict as strict JSON: whole or not at all."""
    write_text(path, to_json(verdict) + "\n")


def to_json(content: Any) -> str:
    """Strict JSON of plain values, arrays and numbers; what is no finite number becomes null."""
    return json.dumps(_strict(content), indent=1, ensure_ascii=False, allow_nan=False)


def _identity(case: Case | Path, swapped: bool, hexahedra: str | None) -> dict[str, Any]:
    if isinstance(case, Case):
        name, family, title = case.name, case.family, case.title
        zones, origin = _zones(case, swapped), {key: getattr(case, key) for key in _ORIGIN}
        exact = case.solution.name if case.solution else None
    else:
        name, family, title = case.stem, case.resolve().parent.name, ""
        zones, origin, exact = [], dict.fromkeys(_ORIGIN), None
    return {
        "case": name,
        "family": family,
        "title": title,
        "job": job_name(name, swapped, hexahedra),
        "swapped": swapped,
        "direction": "swapped" if swapped else "first",
        "variant": hexahedra or "",
        "zones": zones,
        **origin,
        "reference_solution": exact,
    }


def _zones(case: Case, swapped: bool) -> list[dict[str, str]]:
    """The zones as they were solved: slave and master exchanged where the solve was swapped."""
    pairs = [(z.name, z.slave, z.master) for z in case.zones]
    return [
        {"name": name, "slave": master, "master": slave}
        if swapped
        else {"name": name, "slave": slave, "master": master}
        for name, slave, master in pairs
    ]


def _bodies(solution: Solution) -> list[dict[str, Any]]:
    counts = solution.case.counts
    return [
        asdict(body)
        | {
            "reference_cells": counts.get(body.name, {}).get("cells"),
            "reference_faces": counts.get(body.name, {}).get("faces"),
        }
        for body in solution.bodies
    ]


def _first_of(reasons: Sequence[str]) -> str:
    if len(reasons) < 2:
        return "".join(reasons)
    return f"{reasons[0]} (and {len(reasons) - 1} more)"


def _with_total(seconds: Mapping[str, float]) -> dict[str, float]:
    return {**seconds, "total": seconds.get("total", sum(seconds.values()))}


def _extremes(arrays: Iterable[np.ndarray]) -> list[float] | None:
    values = [array for array in arrays if len(array)]
    if not values:
        return None
    joined = np.concatenate(values)
    return [joined.min().item(), joined.max().item()]


def _worst(checks: Iterable[CheckResult]) -> dict[str, Any] | None:
    """The check whose error is the largest part of its tolerance; one without a number first."""

    def share(check: CheckResult) -> float:
        if math.isnan(check.error):
            return math.inf
        if check.tolerance > 0:
            return check.error / check.tolerance
        return math.inf if check.error > 0 else 0.0

    worst = max(checks, key=share, default=None)
    if worst is None:
        return None
    return {"name": worst.name, "zone": worst.zone, "error": worst.error}


def _strict(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _strict(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _strict(value.tolist())
    if isinstance(value, list | tuple):
        return [_strict(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
