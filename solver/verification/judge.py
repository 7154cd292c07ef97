"""From a solution and its checks, or from what ended a solve, to its verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..case.model import job_name
from ..simulation.equilibrium.state import Accuracy
from ..simulation.judgement.validity import broken_by_facets, limits_passed
from .scatter import unresolved
from .units import derived
from .verdict import (
    EXACT,
    EXPECTED,
    FAILED,
    NUMBERS,
    PASSED,
    SOLVED,
    STATED,
    UNRELIABLE,
    Body,
    CheckError,
    CheckResult,
    Force,
    Probed,
    Sides,
    Verdict,
)

if TYPE_CHECKING:
    from ..case.model import Case
    from ..simulation.results.solution import Solution, ZoneResult

NOT_VERIFIED = "not verified: compared with no reference"
NOT_JUDGED = "not verified: the tolerances belong to another recovery"
# The arguments of `Case.as_solved`.
SolvedAs = tuple[bool, str | None, str | None]
# The checks of accuracy: their errors are relative to the reference.
ACCURACY = (
    *NUMBERS,
    "multiplier",
    "element_pressure",
    "nodal_stress",
    "surface_stress_slave",
    "surface_stress_master",
    "displacement",
    "friction_traction",
    "slip",
    "stress_components",
    "integration_stress",
    "covered_pressure",
)
_ROUND_OFF = 1e-10
# Fields that a verdict copies from a solution.
_OF_SOLUTION = (
    *("dofs", "macro_elements", "iterations", "linear_solver", "linear_iterations"),
    *(
        "matrix_entries",
        "length",
        "load_scale",
        "strain_energy",
        "stage_cpu_seconds",
        "cpu_seconds",
    ),
    *("peak_memory_mb", "accuracy", "errors", "pressure_error_estimate"),
)


def judge(
    solution: Solution,
    checks: Sequence[CheckResult],
    result: str | None = None,
    provenance: Mapping[str, Any] | None = None,
    sha256: str | None = None,
) -> Verdict:
    """The verdict of a solve with a result: `passed` when every check holds.

    `solved` where they hold but none compares the solution with a reference; `unreliable` whatever
    the checks say, where rounding may have left less than four digits (then `attainable`, the
    relative error that rounding alone may cause, is the first reason), where the solve is beyond
    what linear theory takes for granted, or where its mesh does not resolve the pressure; `failed`
    where a step has no solution. `result`
    is the name of the result file beside the verdict and `sha256` its hash.
    """
    accuracy, scatters = Accuracy(solution.accuracy), unresolved(solution)
    unreliable = [reason for reason in (accuracy.reason, scatters) if reason]
    unreliable += limits_passed(solution.case, solution.validity)
    reasons = unreliable + [_explained(check, accuracy) for check in checks if not check.passed]
    word = PASSED if any(check.verifies for check in checks) else SOLVED
    if reasons:
        word = UNRELIABLE if unreliable else FAILED
    if solution.ended:
        word, reasons = FAILED, [f"{solution.ended}; the steps before it are kept", *reasons]
    seconds, zones, case = solution.seconds, solution.zones, solution.case
    # In 3D, and on the full circle, forces are whole ones.
    spatial = solution.mesh.points.shape[1] == 3 or case.axisymmetric
    unverified = NOT_JUDGED if case.reference_kind and not case.reference else NOT_VERIFIED
    return Verdict(
        **_identity(solution.case, (solution.swapped, solution.hexahedra, solution.case.recovery)),
        verdict=word,
        passed=word == PASSED,
        judged=_judged(checks) if word == PASSED else "",
        reason=_first_of(reasons) or (unverified if word == SOLVED else ""),
        result=result,
        result_sha256=sha256,
        **{name: getattr(solution, name) for name in _OF_SOLUTION},
        **asdict(solution.validity),
        pressure_within=None if scatters else _pressure_within(solution),
        seconds={**seconds, "total": seconds.get("total", sum(seconds.values()))},
        pressure=_extremes(_where_covered(zone) for zone in zones),
        stress=_extremes([solution.nodal_normal_stress[solution.body >= 0]]),
        gap=_extremes(zone.gap for zone in zones),
        status=_extremes(zone.closed.astype(int) for zone in zones),
        coverage=_extremes(zone.coverage for zone in zones),
        worst=_worst(checks),
        closest_to_tolerance=_closest(checks),
        bodies=_bodies(solution),
        plan=[list(entry) for entry in solution.plan],
        checks=list(checks),
        units=derived(solution.case.units, spatial),
        forces=list(_forces(solution)),
        dissipation=[step.dissipation for step in solution.steps] if case.frictional else [],
        probes=list(_probes(solution)) if solution.probes else [],
        largest_displacement=solution.largest_displacement[0],
        attainable=accuracy.estimate,
        provenance=dict(provenance or {}),
    )


def _pressure_within(solution: Solution) -> float | None:
    """The estimated relative error of the constant pressures, by the mesh and by its facets.

    None where facets break the pressure, and for multipliers at nodes, which have no estimate.
    """
    estimate, found = solution.pressure_error_estimate, solution.validity
    if estimate is None or broken_by_facets(solution.case, found):
        return None
    return math.hypot(estimate, found.facets)


def without_result(
    word: str,
    reason: str,
    case: Case | Path,
    solved_as: SolvedAs = (False, None, None),
    transient: bool = False,
    provenance: Mapping[str, str | int] | None = None,
) -> Verdict:
    """The verdict of a solve that was refused, failed or crashed, for the reason given.

    `case` is the path of the case file where the file itself could not be read; `solved_as` are the
    arguments of `Case.as_solved`, `provenance` what is known of its inputs.
    """
    about = _identity(case, solved_as)
    given = dict(provenance or {})
    return Verdict(**about, verdict=word, reason=reason, transient=transient, provenance=given)


def _identity(case: Case | Path, solved_as: SolvedAs) -> dict[str, Any]:
    """The identity of a solve, and the origin of its reference."""
    swapped, hexahedra, recovery = solved_as
    found: dict[str, Any] = {
        "swapped": swapped,
        "direction": "swapped" if swapped else "first",
        "variant": hexahedra or "",
        "recovery": recovery or "",
    }
    if isinstance(case, Path):
        name, family = case.stem, case.parent.resolve().name
    else:
        name, family = case.name, case.family
        found |= {
            "title": case.title,
            "zones": [Sides(name=z.name, slave=z.slave, master=z.master) for z in case.zones],
            "reference_kind": case.reference_kind,
            "reference_uncertainty": case.reference_uncertainty,
            "reference_code": case.reference_code,
            "reference_remark": case.reference_remark,
            "reference_solution": case.solution.name if case.solution else None,
        }
    return found | {"case": name, "family": family, "job": job_name(name, *solved_as)}


def _judged(checks: Iterable[CheckResult]) -> str:
    """How strict the tolerances of the checks against a reference are."""
    loose = [check for check in checks if check.verifies and check.tolerance > _ROUND_OFF]
    if not loose:
        return EXACT
    return STATED if any(check.expected is None for check in loose) else EXPECTED


def _bodies(solution: Solution) -> list[Body]:
    counts = solution.case.counts
    return [
        Body(
            **asdict(body),
            reference_cells=counts.get(body.name, {}).get("cells"),
            reference_faces=counts.get(body.name, {}).get("faces"),
        )
        for body in solution.bodies
    ]


def _forces(solution: Solution) -> Iterator[Force]:
    """The forces of all steps: of each zone, of what holds each group, on each rigid body."""
    for number, step in enumerate(solution.steps, start=1):
        named: list[tuple[str, Any]]
        named = [(f"zone {name}", one) for name, one in step.resultants.items()]
        named += [(held.group, held) for held in step.reactions]
        named += [(f"{one.body}, about its reference point", one) for one in step.rigid]
        for name, one in named:
            keys = ("force", "moment", "area", "pressure", "friction", "stick")
            given = ((key, getattr(one, key, None)) for key in keys)
            lists = {key: value.tolist() for key, value in given if value is not None}
            yield Force(step=number, factor=step.factor, name=name, **lists)


def _probes(solution: Solution, most: int = 10) -> Iterator[Probed]:
    """The values at each probe, at `most` places of each."""
    for name, probe in solution.probes.items():
        for place, *values in zip(*(array[:most] for array in vars(probe).values()), strict=True):
            keys = [key for key in vars(probe) if key != "place"]
            given = zip(keys, values, strict=True)
            known = {key: value.tolist() for key, value in given if np.isfinite(value).all()}
            yield Probed(name=name, place=place.tolist(), **known)


def _explained(check: CheckResult, accuracy: Accuracy) -> str:
    """Why a check fails; with what rounding may do, where its error is no larger than that."""
    lost = check.tolerance < check.error <= accuracy.estimate
    return f"{check.reason}; {accuracy.words}" if lost else check.reason


def _first_of(reasons: Sequence[str]) -> str:
    if len(reasons) < 2:
        return "".join(reasons)
    return f"{reasons[0]} (and {len(reasons) - 1} more)"


def _extremes(arrays: Iterable[np.ndarray]) -> list[Any] | None:
    values = [array for array in arrays if len(array)]
    if not values:
        return None
    joined = np.concatenate(values)
    return [joined.min().item(), joined.max().item()]


def _where_covered(zone: ZoneResult) -> np.ndarray:
    """The pressures of macro-elements that have a master, or of all where none has one."""
    there = zone.coverage > 0
    return zone.multiplier[there] if there.any() else zone.multiplier


def _worst(checks: Sequence[CheckResult]) -> CheckError | None:
    """The check with the largest error, of those whose errors are relative to the reference."""
    relative = [check for check in checks if check.name in ACCURACY or check.norm == "error"]
    found = [CheckError(name=c.name, zone=c.zone, error=c.error) for c in relative]
    return max(found, key=_size, default=None)


def _size(check: CheckError) -> float:
    """The error, infinite where it is not a number: NaN counts as the largest error."""
    return math.inf if math.isnan(check.error) else check.error


def _closest(checks: Iterable[CheckResult]) -> CheckError | None:
    nearest = max(checks, key=lambda check: check.share, default=None)
    if nearest is None:
        return None
    return CheckError(name=nearest.name, zone=nearest.zone, error=nearest.error)
