"""The checks of a solve against its reference: one table, one small function per quantity.

A check compares values with the reference at their own places: macro-element centres, nodes, or
load steps. `error` is the largest deviation over the check's scale: the largest magnitude
of the reference, or, where the reference is zero everywhere, the quantity's own measure (load for
stresses, load / stiffness × size for displacements). A gap is always measured against the block
size, status, coverage and balance against one. A value that is not a number fails.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ..case.model import Exact
from ..case.rules import ERRORS
from ..simulation.exact import ExactValues
from ..simulation.solution import Solution, ZoneResult
from . import numbers, samples
from .verdict import CheckResult, Regression

RELATIVE = 1e-3
GAP = 2e-5
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Accepted:
    """The last accepted extremes of a check, kept apart from its reference."""

    minimum: float
    maximum: float


@dataclass(frozen=True)
class Check:
    """One row of the table.

    `alias` is the reference code's name, `key` the reference that feeds the check (None: always
    run), `tolerance` the default one (None: the relative one, which a case's single `tolerance`
    replaces), `scale` the measure of the quantity, `fixed` whether that measure holds even where
    the reference is not zero, `accepted` the tolerance against the accepted value, `like` the check
    whose tolerance holds where its own is not given.
    """

    name: str
    alias: str | None
    key: str | None
    sample: samples.Sampler
    scale: Callable[[Solution], float]
    tolerance: float | None = None
    fixed: bool = False
    by_zone: bool = True
    accepted: float = ROUND_OFF
    norm: str = "max"
    like: str = ""

    @property
    def verifies(self) -> bool:
        """Whether the check compares the solution with a reference."""
        return self.key is not None or self.norm == "error"

    def tolerance_in(self, overrides: Mapping[str, float]) -> float:
        """The tolerance under a case's overrides: by check, or `all`.

        `all` takes the place of the relative tolerance, and of smaller ones where it is smaller.
        """
        for name in (self.name, self.like):
            if name in overrides:
                return overrides[name]
        if self.tolerance is None:
            return overrides.get("all", RELATIVE)
        return min(self.tolerance, overrides.get("all", self.tolerance))

    def expected_in(self, expected: Mapping[str, float]) -> float | None:
        """The expected error by a case's; None where a tolerance is stated."""
        return expected.get(self.name, expected.get(self.like))


def block_size(solution: Solution) -> float:
    """The extent of the smallest body."""
    bodies = [solution.mesh.points[solution.body == b] for b in range(len(solution.bodies))]
    return min(float(np.ptp(points, axis=0).max()) for points in bodies if len(points))


def _load(solution: Solution) -> float:
    """The load; without loads the stress that the displacement would cause, if that is larger.

    If bodies only move, the stress itself is round-off.
    """
    if solution.case.loads:
        return float(solution.load_scale)
    stiffness = min(m.young for m in solution.case.materials.values())
    moved = float(np.abs(solution.displacement).max(initial=0.0))
    return max(float(solution.load_scale), stiffness * moved / solution.length)


def _elongation(solution: Solution) -> float:
    """Load / stiffness × size."""
    stiffness = min(m.young for m in solution.case.materials.values())
    return float(solution.load_scale / stiffness * block_size(solution))


def _total_force(solution: Solution) -> float:
    """The largest reaction or contact force of any step; one where nothing acts."""
    forces = [one.force for step in solution.steps for one in step.reactions]
    forces += [one.force for step in solution.steps for one in step.resultants.values()]
    return max((float(np.abs(force).max()) for force in forces), default=0.0) or 1.0


def _total_moment(solution: Solution) -> float:
    """The largest force times the extent of the smallest body."""
    return _total_force(solution) * block_size(solution)


def _unit(_: Solution) -> float:
    """One."""
    return 1.0


_PRESSURE, _STRESS = "contact_pressure", "normal_stress"
CHECKS: tuple[Check, ...] = (
    Check("multiplier", "LAGS_C", _PRESSURE, samples.pressure, _load),
    Check("nodal_stress", "SIEF_NOEU", _STRESS, samples.nodal_stress, _load, by_zone=False),
    Check("surface_stress_slave", None, _STRESS, samples.surface_stress("slave"), _load),
    Check("surface_stress_master", None, _STRESS, samples.surface_stress("master"), _load),
    Check("element_pressure", "CONT_ELEM/PRES", _PRESSURE, samples.pressure_of_forces, _load),
    Check("element_gap", "CONT_ELEM/JEU", "gap", samples.gap, block_size, GAP, fixed=True),
    Check("element_status", "CONT_ELEM/CONT", _PRESSURE, samples.status, _unit, 0.0, fixed=True),
    Check("coverage", "CONT_ELEM/COEFSURF", _PRESSURE, samples.coverage, _unit, 1e-6, fixed=True),
    Check(
        "covered_pressure",
        "CONT_ELEM/PRESCOOR",
        _PRESSURE,
        samples.covered_pressure,
        _load,
        accepted=1e-6,
    ),
    Check("displacement", "DEPL", "displacement", samples.displacement, _elongation, by_zone=False),
    Check("stress_components", None, "stress", samples.stress_components, _load, by_zone=False),
    Check(
        "integration_stress",
        None,
        "stress",
        samples.integration_stress,
        _load,
        by_zone=False,
        like="stress_components",
    ),
    Check("balance", None, None, samples.balance, _unit, 1e-10, fixed=True, by_zone=False),
    Check("force", None, "force", numbers.contact_force, _total_force),
    Check("contact_area", None, "contact_area", numbers.contact_area, _unit),
    Check("reaction", None, "reaction", numbers.reaction, _total_force, by_zone=False),
    Check("moment", None, "moment", numbers.moment, _total_moment, by_zone=False),
    Check(
        "displacement_at",
        None,
        "displacement_at",
        numbers.probed("displacement"),
        _elongation,
        by_zone=False,
    ),
    Check("stress_at", None, "stress_at", numbers.probed("stress"), _load, by_zone=False),
    Check("pressure_at", None, "pressure_at", numbers.probed("pressure"), _load, by_zone=False),
    Check("strain_energy", None, "strain_energy", numbers.strain_energy, _unit, by_zone=False),
    Check("counts", None, None, samples.counts, _unit, 0.0, fixed=True, by_zone=False),
    Check("observation", "OBSERVATION/PRES", _PRESSURE, samples.observed("pressure"), _load),
    Check(
        "observation_gap",
        "OBSERVATION/JEU",
        "gap",
        samples.observed("gap"),
        block_size,
        GAP,
        fixed=True,
    ),
    *(
        Check(name, None, None, samples.norm(name), _unit, fixed=True, by_zone=False, norm="error")
        for name in ERRORS
    ),
)


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
        sampler = check.sample if samplers is None else samplers.get(check.name)
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
    scale = check.scale(solution) if check.fixed or magnitude == 0 else magnitude
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
