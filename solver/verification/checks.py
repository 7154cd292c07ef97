"""The checks of a solve against its reference, row by row of the table (`case.checks`).

A check compares values with the reference at their own places: macro-element centres, nodes, or
load steps. `error` is the largest deviation over the check's scale: the largest magnitude of the
reference, or, where the reference is zero everywhere up to rounding, the quantity's own measure
(load for stresses, load / stiffness × size for displacements; `SCALES`). A gap is always measured
against the block size, status, coverage and balance against one. A value that is not a number
fails.

Accepted values are the last results that a person has reviewed, kept under version control beside
the case file, in `regression/JOB.json`, one line a check, apart from the reference: a reference is
the right value, an accepted value a computed one. Both extremes of a check may move by 1e-9 of its
scale; a value below 1e-12 of the scale is kept as zero, and digits past the twelfth are dropped, so
that round-off never shows as a difference.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ..case.checks import CHECKS, Check
from ..case.expressions import Exact
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from ..system.errors import InputError
from ..system.files import write_text
from . import friction, hooke, numbers, samples
from .inputs import accepted_file
from .verdict import CheckResult, Regression, extremes


def unit(_: Solution) -> float:
    """One."""
    return 1.0


def block_size(solution: Solution) -> float:
    """The extent of the smallest body."""
    bodies = [solution.mesh.points[solution.fields.body == b] for b in range(len(solution.bodies))]
    return min(float(np.ptp(points, axis=0).max()) for points in bodies if len(points))


def _softest(solution: Solution) -> float:
    """The smallest Young's modulus."""
    return min(material.young for material in solution.case.materials.values())


def load(solution: Solution) -> float:
    """The load; without loads the stress that the displacement would cause, if that is larger.

    If bodies only move, the stress itself is round-off.
    """
    if solution.case.loads:
        return float(solution.scalars.load_scale)
    moved = float(np.abs(solution.displacement).max(initial=0.0))
    caused = _softest(solution) * moved / solution.scalars.length
    return max(float(solution.scalars.load_scale), caused)


def elongation(solution: Solution) -> float:
    """Load / stiffness × size."""
    return float(solution.scalars.load_scale / _softest(solution) * block_size(solution))


def area(solution: Solution) -> float:
    """The whole area of all zones."""
    return float(sum(zone.area.sum() for zone in solution.zones))


def work(solution: Solution) -> float:
    """The work of the load along the elongation that it causes, on the smallest body."""
    dim = solution.mesh.points.shape[1]
    return float(load(solution) ** 2 / _softest(solution) * block_size(solution) ** dim)


def total_force(solution: Solution) -> float:
    """The largest reaction or contact force of any step; one where nothing acts."""
    forces = [one.force for step in solution.steps for one in step.reactions]
    forces += [one.force for step in solution.steps for one in step.resultants.values()]
    return max((float(np.abs(force).max()) for force in forces), default=0.0) or 1.0


def total_moment(solution: Solution) -> float:
    """The largest force times the extent of the smallest body."""
    return total_force(solution) * block_size(solution)


SCALES: dict[str, Callable[[Solution], float]] = {
    "unit": unit,
    "block_size": block_size,
    "load": load,
    "elongation": elongation,
    "area": area,
    "work": work,
    "total_force": total_force,
    "total_moment": total_moment,
}
"""What errors are relative to where the reference is zero."""


@dataclass(frozen=True)
class Accepted:
    """The last accepted extremes of a check, kept apart from its reference."""

    minimum: float
    maximum: float


def run_checks(
    solution: Solution,
    accepted: Mapping[str, Accepted] | None = None,
    samplers: Mapping[str, samples.Sampler] | None = None,
    allow: Callable[[Check, float], float] = lambda _, tolerance: tolerance,
) -> list[CheckResult]:
    """Run every check of the table whose reference the case gives, zone by zone.

    `accepted` maps check titles to the accepted extremes. `samplers`, by check, stand for those of
    the table, and other checks are left out; `allow` makes the tolerance of a check from the
    case's. Raises `InputError` when a reference expression has no finite value at one of the
    places.
    """
    accepted = accepted or {}
    exact = solution.case.reference.exact and ExactValues(solution, solution.case.reference.exact)
    results = []
    for check in CHECKS:
        reference: samples.Reference = (
            solution.case.reference.values.get(check.key) if check.key else 0.0
        )
        if reference is None or not check.concerns(solution.case):
            continue
        sampler = sampler_of(check) if samplers is None else samplers.get(check.name)
        if sampler is None:
            continue
        tolerance = allow(check, check.tolerance_in(solution.case.reference.tolerance))
        if isinstance(reference, Exact):
            reference = exact
        for zone in solution.zones if check.by_zone else [None]:
            sample = sampler(solution, zone, reference)
            if sample is not None:
                results.append(_judge(check, solution, zone, sample, accepted, tolerance))
    return results


def sampler_of(check: Check) -> samples.Sampler:
    """The function that gives the values of a check."""
    rooms = (samples, numbers, friction, hooke)
    found: Any = next(getattr(r, check.sample) for r in rooms if hasattr(r, check.sample))
    sampler: samples.Sampler = found(check.of) if check.of else found
    return sampler


def _judge(
    check: Check,
    solution: Solution,
    zone: ZoneResult | None,
    sample: samples.Sample,
    accepted: Mapping[str, Accepted],
    tolerance: float,
) -> CheckResult:
    name = zone.name if zone else None
    measure = SCALES[check.scale](solution)
    scale = measure if check.fixed else samples.magnitude(sample.reference, measure) or measure
    deviation = np.abs(sample.values - sample.reference)
    if deviation.size:
        worst = int(np.argmax(deviation))  # the first that is not a number, if any
        error = _over(deviation[worst], scale)
        extremes = float(sample.values.min()), float(sample.values.max())
        value, reference = float(sample.values[worst]), float(sample.reference[worst])
        where = sample.place(worst)
    else:
        error = value = reference = float("nan")
        extremes, where = (value, value), "no place at all"
    old = accepted.get(f"{check.name} {name}" if name else check.name)
    regression = None if old is None else _compare(extremes, old, scale, check.accepted)
    return CheckResult(
        name=check.name,
        alias=check.alias,
        zone=name,
        norm=check.norm,
        minimum=extremes[0],
        maximum=extremes[1],
        value=value,
        reference=reference,
        where=where,
        scale=scale,
        error=error,
        tolerance=tolerance,
        expected=check.expected_in(solution.case.reference.expected),
        regression=regression,
        passed=error <= tolerance and (regression is None or regression.passed),
        verifies=check.verifies,
    )


def _compare(
    extremes: tuple[float, float], old: Accepted, scale: float, tolerance: float
) -> Regression:
    changes = [
        _over(abs(new - was), scale)
        for new, was in zip(extremes, (old.minimum, old.maximum), strict=True)
    ]
    change = float(np.max(changes))
    return Regression(
        minimum=old.minimum,
        maximum=old.maximum,
        change=change,
        tolerance=tolerance,
        passed=change <= tolerance,
    )


def _over(deviation: float, scale: float) -> float:
    """The deviation over the scale; with a scale of zero, 0 only for no deviation."""
    if scale == 0:
        return 0.0 if deviation == 0 else float("inf") if deviation > 0 else float("nan")
    return float(deviation) / float(scale)


def regression_file(solution: Solution) -> Path:
    """The file of a solve's accepted values."""
    return accepted_file(solution.case.path, solution.job)


def accepted_values(solution: Solution) -> dict[str, Accepted]:
    """The accepted values by check title; empty where none were accepted.

    Raises `InputError` for a file that does not hold pairs of numbers.
    """
    path = regression_file(solution)
    if not path.is_file():
        return {}
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, Accepted])
    except (OSError, msgspec.DecodeError) as error:
        allowed = f"must map checks to {{minimum: number, maximum: number}} ({error})"
        raise InputError(path, "file", None, allowed) from None


def accept(solution: Solution, checks: Sequence[CheckResult]) -> list[str]:
    """Take the checks' extremes as accepted values; the differences, one line a check.

    `checks` must have been made with the values accepted so far. Nothing is written when nothing
    changed, and an entry that did not change keeps its digits. Raises `InputError` for a check that
    has no number to accept.
    """
    path, old = regression_file(solution), accepted_values(solution)
    gone = old.keys() - {check.title for check in checks}
    new = {title: value for title, value in old.items() if title not in gone}
    lines = [f"{title}: {_shown(old[title])} → none" for title in gone]
    for check in checks:
        if not all(map(math.isfinite, (check.minimum, check.maximum))):
            raise InputError(path, check.title, check.minimum, "not a number: cannot be accepted")
        if check.regression is None or not check.regression.passed:
            new[check.title] = Accepted(
                _rounded(check.minimum, check.scale), _rounded(check.maximum, check.scale)
            )
            lines.append(
                f"{check.title}: {_shown(old.get(check.title))} → {_shown(new[check.title])}"
            )
    if lines:
        _write(path, new)
    return sorted(lines)


def _rounded(value: float, scale: float) -> float:
    return 0.0 if abs(value) < 1e-12 * scale else float(f"{value:.12g}")


def _shown(accepted: Accepted | None) -> str:
    return extremes(accepted.minimum, accepted.maximum) if accepted else "none"


def _write(path: Path, values: Mapping[str, Accepted]) -> None:
    lines = [
        f'  {json.dumps(title)}: {{"minimum": {value.minimum!r}, "maximum": {value.maximum!r}}}'
        for title, value in sorted(values.items())
    ]
    write_text(path, "{\n" + ",\n".join(lines) + "\n}\n")
