"""The checks of a solve against its reference, row by row of the table (`case.checks`).

A check compares values with the reference at their own places: macro-element centres, nodes, or
load steps. `error` is the largest deviation over the check's scale: the largest magnitude
of the reference, or, where the reference is zero everywhere, the quantity's own measure (load for
stresses, load / stiffness × size for displacements). A gap is always measured against the block
size, status, coverage and balance against one. A value that is not a number fails.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..case.checks import CHECKS, Check
from ..case.model import Exact
from ..simulation.results.exact import ExactValues
from ..simulation.results.solution import Solution, ZoneResult
from . import numbers, samples, scales
from .verdict import CheckResult, Regression


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
    exact = solution.case.solution and ExactValues(solution, solution.case.solution)
    results = []
    for check in CHECKS:
        reference: samples.Reference = solution.case.reference.get(check.key) if check.key else 0.0
        sampler = sampler_of(check) if samplers is None else samplers.get(check.name)
        if reference is None or sampler is None:
            continue
        tolerance = allow(check, check.tolerance_in(solution.case.tolerance))
        if isinstance(reference, Exact):
            reference = exact
        for zone in solution.zones if check.by_zone else [None]:
            sample = sampler(solution, zone, reference)
            if sample is not None:
                results.append(_judge(check, solution, zone, sample, accepted, tolerance))
    return results


def sampler_of(check: Check) -> samples.Sampler:
    """The function that gives the values of a check."""
    rooms = (samples, numbers)
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
    magnitude = float(np.abs(sample.reference).max(initial=0.0))
    measure = getattr(scales, check.scale)
    scale = measure(solution) if check.fixed or magnitude == 0 else magnitude
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
        expected=check.expected_in(solution.case.expected),
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
    return float(deviation / scale)
