"""From a solution and its checks, or from what ended a solve, to its verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..case.model import AS_WRITTEN, SolvedAs
from ..simulation.equilibrium.accuracy import Accuracy
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
    Estimates,
    Files,
    Force,
    Origin,
    Probed,
    Problem,
    Sides,
    Values,
    Verdict,
)

if TYPE_CHECKING:
    from ..case.model import Case
    from ..simulation.results.solution import Solution, ZoneResult

NOT_VERIFIED = "not verified: compared with no reference"
NOT_JUDGED = "not verified: the tolerances belong to another recovery"
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
    what linear theory takes for granted, or where its mesh does not resolve the pressure; also
    where only checks of the solve by itself fail, by no more than `attainable`; `failed` where a
    step has no solution. `result` is the name of the result file beside the verdict and `sha256`
    its hash.
    """
    accuracy, scatters = Accuracy(solution.quality.accuracy), unresolved(solution)
    unreliable = [reason for reason in (accuracy.reason, scatters) if reason]
    unreliable += limits_passed(solution.case, solution.quality.validity)
    broken = [check for check in checks if not check.passed]
    reasons = unreliable + [_explained(check, accuracy) for check in broken]
    word = PASSED if any(check.verifies for check in checks) else SOLVED
    if reasons:
        rounded = all(_lost(check, accuracy) and not check.verifies for check in broken)
        word = UNRELIABLE if unreliable or rounded else FAILED
    if solution.ended:
        word, reasons = FAILED, [f"{solution.ended}; the steps before it are kept", *reasons]
    unverified = NOT_VERIFIED
    if solution.case.reference.kind and not solution.case.reference.values:
        unverified = NOT_JUDGED
    seconds = solution.cost.seconds
    total = seconds.get("total", sum(seconds.values()))
    problem, origin = _identity(solution.case, solution.case.solved_as)
    return Verdict(
        problem=replace(problem, bodies=_bodies(solution), units=_units(solution)),
        verdict=word,
        judged=_judged(checks) if word == PASSED else "",
        reason=_first_of(reasons) or (unverified if word == SOLVED else ""),
        worst=_worst(checks),
        closest_to_tolerance=_closest(checks),
        checks=list(checks),
        plan=[list(entry) for entry in solution.plan],
        values=_values(solution),
        estimates=Estimates(
            accuracy=solution.quality.accuracy,
            attainable=accuracy.estimate,
            pressure_error_estimate=solution.pressure_error_estimate,
            pressure_within=None if scatters else _pressure_within(solution),
            errors=solution.quality.errors,
            validity=solution.quality.validity,
        ),
        reference=origin,
        cost=replace(solution.cost, seconds={**seconds, "total": total}),
        files=Files(result=result, result_sha256=sha256, provenance=dict(provenance or {})),
    )


def _units(solution: Solution) -> dict[str, str]:
    """The units of the case and what follows. In 3D, and on the full circle, forces are whole."""
    spatial = solution.mesh.points.shape[1] == 3 or solution.case.axisymmetric
    return derived(solution.case.about.units, spatial)


def _values(solution: Solution) -> Values:
    zones = solution.zones
    return Values(
        **vars(solution.scalars),
        largest_displacement=solution.largest_displacement[0],
        pressure=_extremes(_where_covered(zone) for zone in zones),
        stress=_extremes([solution.fields.normal_stress[solution.fields.body >= 0]]),
        gap=_extremes(zone.gap for zone in zones),
        status=_extremes(zone.closed.astype(int) for zone in zones),
        coverage=_extremes(zone.coverage for zone in zones),
        forces=list(_forces(solution)),
        dissipation=[s.dissipation for s in solution.steps] if solution.case.frictional else [],
        probes=list(_probes(solution)) if solution.places.probes else [],
    )


def _pressure_within(solution: Solution) -> float | None:
    """The estimated relative error of the constant pressures, by the mesh and by its facets.

    None where facets break the pressure, and for multipliers at nodes, which have no estimate.
    """
    estimate, found = solution.pressure_error_estimate, solution.quality.validity
    if estimate is None or broken_by_facets(solution.case, found):
        return None
    return math.hypot(estimate, found.facets)


def without_result(
    word: str,
    reason: str,
    case: Case | Path,
    solved_as: SolvedAs = AS_WRITTEN,
    transient: bool = False,
    provenance: Mapping[str, str | int] | None = None,
) -> Verdict:
    """The verdict of a solve that was refused, failed or crashed, for the reason given.

    `case` is the path of the case file where the file itself could not be read; `solved_as` is
    known all the same, and `provenance` what is known of its inputs.
    """
    problem, origin = _identity(case, solved_as)
    return Verdict(
        problem=problem,
        verdict=word,
        reason=reason,
        transient=transient,
        reference=origin,
        files=Files(provenance=dict(provenance or {})),
    )


def _identity(case: Case | Path, solved_as: SolvedAs) -> tuple[Problem, Origin]:
    """What was solved, as far as that is known, and the origin of its reference."""
    read = None if isinstance(case, Path) else case
    name = case.stem if isinstance(case, Path) else case.name
    zones = read.zones if read else ()
    problem = Problem(
        case=name,
        family=case.parent.resolve().name if isinstance(case, Path) else case.family,
        title=read.about.title if read else "",
        job=solved_as.job(name),
        swapped=solved_as.swapped,
        direction="swapped" if solved_as.swapped else "first",
        variant=solved_as.hexahedra or "",
        recovery=solved_as.recovery or "",
        zones=[Sides(name=z.name, slave=z.slave, master=z.master) for z in zones],
    )
    if read is None:
        return problem, Origin()
    reference = read.reference
    return problem, Origin(
        kind=reference.kind,
        uncertainty=reference.uncertainty,
        code=reference.code,
        remark=reference.remark,
        solution=reference.exact.name if reference.exact else None,
    )


def _judged(checks: Iterable[CheckResult]) -> str:
    """How strict the tolerances of the checks against a reference are."""
    loose = [check for check in checks if check.verifies and check.tolerance > _ROUND_OFF]
    if not loose:
        return EXACT
    return STATED if any(check.expected is None for check in loose) else EXPECTED


def _bodies(solution: Solution) -> list[Body]:
    counts = solution.case.mesh.counts
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
    for name, probe in solution.places.probes.items():
        for place, *values in zip(*(array[:most] for array in vars(probe).values()), strict=True):
            keys = [key for key in vars(probe) if key != "place"]
            given = zip(keys, values, strict=True)
            known = {key: value.tolist() for key, value in given if np.isfinite(value).all()}
            yield Probed(name=name, place=place.tolist(), **known)


def _explained(check: CheckResult, accuracy: Accuracy) -> str:
    """Why a check fails; with what rounding may do, where its error is no larger than that."""
    return f"{check.reason}; {accuracy.words}" if _lost(check, accuracy) else check.reason


def _lost(check: CheckResult, accuracy: Accuracy) -> bool:
    """Whether a check misses its tolerance by no more than what rounding may do."""
    return check.tolerance < check.error <= accuracy.estimate


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
