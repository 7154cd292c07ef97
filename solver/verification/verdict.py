"""The verdict of a solve: one typed record with all that the report shows, whatever happened.

`verdict.json` holds it as a JSON object with the same keys. It is bound to what it judges: `digest`
is the hash of all other keys, `result_sha256` that of the result file, and family and job are those
of its folder (see `verification.stored`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from ..simulation.results.records import Cost, Validity
from .flat import DIGEST, digest, flat, joined, plain
from .units import percent

PASSED, SOLVED, FAILED, UNRELIABLE = "passed", "solved", "failed", "unreliable"
REFUSED, CRASHED, PARTIAL = "refused", "crashed", "partial"
# How strictly a solve that passed was judged.
EXACT, EXPECTED, STATED = "exact", "expected error", "stated tolerance"
# The worst first, as in every table.
WORDS = (CRASHED, REFUSED, FAILED, UNRELIABLE, PARTIAL, SOLVED, PASSED)
NUMBERS = (
    *("force", "reaction", "moment", "contact_area", "strain_energy"),
    *("stick_area", "dissipation"),
    *("displacement_at", "stress_at", "pressure_at"),
)
"""The checks of single numbers."""
VECTORS = ("force", "reaction", "moment", "displacement_at", "stress_at")
"""Those of them that have a number for each component."""


@dataclass(frozen=True, kw_only=True)
class Regression:
    """The distance of a check's extremes from the accepted ones, over the check's scale."""

    minimum: float = math.nan
    maximum: float = math.nan
    change: float = math.nan
    tolerance: float
    passed: bool


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """One check of one zone (None: of the whole solve).

    `value` and `reference` are those of the place `where` the deviation is largest; `regression` is
    None while no value has been accepted. `expected`: the discretisation error from which the
    tolerance follows; None where it is stated. `verifies`: the solution is compared with a
    reference rather than with itself. `passed` asks that the error be within the tolerance and that
    no accepted value has changed. Numbers are NaN where the solve has none.
    """

    name: str
    alias: str | None = None
    zone: str | None = None
    norm: str = "max"
    minimum: float = math.nan
    maximum: float = math.nan
    value: float = math.nan
    reference: float = math.nan
    where: str = ""
    scale: float = math.nan
    error: float = math.nan
    tolerance: float = math.nan
    expected: float | None = None
    regression: Regression | None = None
    passed: bool = False
    verifies: bool = True

    @property
    def title(self) -> str:
        """The check's name with its zone, the key of its accepted values."""
        return f"{self.name} {self.zone}" if self.zone else self.name

    @property
    def share(self) -> float:
        """The error as a part of its tolerance; infinite where it is not a number."""
        if self.error == 0:
            return 0.0
        return self.error / self.tolerance if self.error > 0 and self.tolerance else math.inf

    @property
    def reason(self) -> str:
        """Why the check failed, in one line; empty where it holds."""
        if not self.error <= self.tolerance:
            return (
                f"{self.title}: {self.value:.9g} ({self.where}), reference {self.reference:.9g}: "
                f"error {self.error:.2e}, tolerance {self.tolerance:.1e}"
            )
        if self.regression and not self.regression.passed:
            old = self.regression
            return (
                f"{self.title}: {extremes(self.minimum, self.maximum)}, accepted "
                f"{extremes(old.minimum, old.maximum)}: change {old.change:.2e}, tolerance "
                f"{old.tolerance:.1e}"
            )
        return ""


def extremes(least: float, most: float) -> str:
    """Both, or the one number that both show as."""
    return " … ".join(dict.fromkeys(f"{value:.12g}" for value in (least, most)))


@dataclass(frozen=True, kw_only=True)
class Force:
    """A force of a step: on the slave of a zone, of what holds a group, or on a rigid body.

    `moment` (3,) about the origin, or a rigid body's reference point; `area` (3,) of contact with
    its bounds, and `pressure` (2,), the smallest and the largest of the macro-elements, of zones;
    with friction its part `friction` (dim,) of the force, and the area that sticks `stick` (3,).
    """

    step: int
    factor: float
    name: str
    force: list[float]
    moment: list[float]
    area: list[float] | None = None
    pressure: list[float] | None = None
    friction: list[float] | None = None
    stick: list[float] | None = None


@dataclass(frozen=True, kw_only=True)
class Probed:
    """The values at one place of a probe: displacement and stress, or contact pressure."""

    name: str
    place: list[float]
    displacement: list[float] | None = None
    stress: list[float] | None = None
    pressure: float | None = None


@dataclass(frozen=True, kw_only=True)
class CheckError:
    """A check by name and zone, and its error."""

    name: str
    zone: str | None = None
    error: float = math.nan


@dataclass(frozen=True, kw_only=True)
class Sides:
    """A contact zone as it was solved: its slave and master groups."""

    name: str
    slave: str
    master: str


@dataclass(frozen=True, kw_only=True)
class Body:
    """A body as it was meshed: cells by type, contact faces, and what a reference has of both."""

    name: str
    role: str
    cells: dict[str, int]
    faces: int
    reference_cells: int | None = None
    reference_faces: int | None = None


@dataclass(frozen=True, kw_only=True)
class Problem:
    """What was solved. `units` names those of length, stress, area, force, moment and energy.

    `zones` have slave and master as solved; `bodies` are empty without a result.
    """

    case: str = ""
    family: str
    title: str = ""
    job: str
    swapped: bool = False
    direction: str = ""
    variant: str = ""
    recovery: str = ""
    zones: list[Sides] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    bodies: list[Body] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Where a reference comes from. Keys of the file begin with `reference_`."""

    kind: str | None = None
    uncertainty: float | None = None
    code: dict[str, str] | None = None
    remark: str | None = None
    solution: str | None = None


@dataclass(frozen=True, kw_only=True)
class Values:
    """What was found. Pairs are minimum and maximum over all zones."""

    length: float | None = None
    load_scale: float | None = None
    largest_displacement: float | None = None
    strain_energy: float | None = None
    pressure: list[float | None] | None = None
    stress: list[float | None] | None = None
    gap: list[float | None] | None = None
    status: list[int] | None = None
    coverage: list[float | None] | None = None
    forces: list[Force] = field(default_factory=list)
    dissipation: list[float] = field(default_factory=list)
    probes: list[Probed] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Estimates:
    """How far the values can be relied on.

    `accuracy`: what rounding alone may change, relative, by cause, `attainable` the largest of
    these. `pressure_error_estimate` is relative and in L2: how far constant pressures are from a
    reconstruction; `pressure_within` has the change by facets too, and is None where the pressure
    is broken and nothing can be said. `errors` are norms against an exact solution. `validity`, of
    which the file has the single keys: see `solver.simulation.results.records.Validity`.
    """

    accuracy: dict[str, float] = field(default_factory=dict)
    attainable: float | None = None
    pressure_error_estimate: float | None = None
    pressure_within: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    validity: Validity | None = field(default=None, metadata=joined(Validity))

    @property
    def strain(self) -> float | None:
        """The largest principal strain."""
        return self.validity.strain if self.validity else None


@dataclass(frozen=True, kw_only=True)
class Files:
    """The result file beside the verdict and its hash; versions, revision, inputs, machine."""

    result: str | None = None
    result_sha256: str | None = None
    provenance: dict[str, str | int] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Foreign:
    """What is known of the result of another code: `code`, its version and `settings`.

    `printed_digits` are the significant ones of its values, where a file has fewer than a number;
    `not_given` are the checks that it has no values for; `only` the fields that were to be
    compared, where that is a part of what the case asks for on purpose, and `compared` at how many
    places each was; `recorded` has date and source of values that were not computed here.
    """

    code: str | None = None
    code_version: str = ""
    settings: dict[str, str] = field(default_factory=dict)
    printed_digits: int | None = None
    not_given: list[str] = field(default_factory=list)
    only: list[str] = field(default_factory=list)
    compared: dict[str, str] = field(default_factory=dict)
    recorded: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The verdict of one solve; None and empty without a result.

    `judged` says how strictly a solve that passed was judged: `exact`, if the tolerances of all
    checks against the reference are at most 1e-10; `expected error`, if the others follow from
    expected errors; else `stated tolerance`. `worst` is the check with the largest relative error,
    `closest_to_tolerance` the one nearest to its tolerance or furthest past it. `transient`: the
    machine is the reason (memory, disk, a kill), so that the same solve may succeed another time.

    Of the records in it the file has the single keys, beside one another.
    """

    problem: Problem = field(metadata=joined(Problem))
    verdict: str
    judged: str = ""
    reason: str = ""
    transient: bool = False
    worst: CheckError | None = None
    closest_to_tolerance: CheckError | None = None
    checks: list[CheckResult] = field(default_factory=list)
    plan: list[list[str]] = field(default_factory=list)
    values: Values = field(default_factory=Values, metadata=joined(Values))
    estimates: Estimates = field(default_factory=Estimates, metadata=joined(Estimates))
    reference: Origin = field(default_factory=Origin, metadata=joined(Origin, "reference_"))
    cost: Cost = field(default_factory=Cost, metadata=joined(Cost))
    files: Files = field(default_factory=Files, metadata=joined(Files))
    foreign: Foreign = field(default_factory=Foreign, metadata=joined(Foreign))

    @property
    def passed(self) -> bool:
        """Whether all checks hold, one of them against a reference, with digits enough."""
        return self.verdict == PASSED

    @property
    def sound(self) -> bool:
        """Whether nothing is wrong with the solve: exit status 0."""
        return self.verdict in (PASSED, SOLVED)

    @property
    def switches(self) -> set[str]:
        """The switches of the work that the solve left out."""
        return {switch for line in self.plan for switch in line[2:] if switch}

    @property
    def summary(self) -> str:
        """One line: job, word, reason or largest checked error, time."""
        line = f"{self.problem.job}: {self.verdict}"
        line += f" ({', '.join(self.foreign.only)} only)" if self.foreign.only else ""
        if self.reason:
            return f"{line}: {self.reason}{self.estimate}"
        error = (
            f", largest checked error {self.worst.error:.1e} ({self.worst.name})"
            if self.worst
            else ""
        )
        error += ", exact" if self.judged == EXACT else ""
        worst = next((c for c in self.checks if self.worst and c.name == self.worst.name), None)
        if worst and worst.expected:
            error += f", expected {worst.expected:.1e}"
        error += self.estimate
        missing = (
            f", not given: {', '.join(self.foreign.not_given)}" if self.foreign.not_given else ""
        )
        time = f", {self.cost.seconds['total']:.2f} s" if "total" in self.cost.seconds else ""
        return f"{line}{error}{missing}{time}"

    @property
    def estimate(self) -> str:
        """The estimated error of the pressure, for the end of a line; empty without a result."""
        if not self.values.pressure or not self.problem.zones or self.foreign.code:
            return ""
        if self.estimates.pressure_within is None:
            return ", error of the pressure not estimated"
        return f", pressure within {percent(self.estimates.pressure_within)} (estimated)"

    def plain(self) -> dict[str, Any]:
        """The verdict as plain values for strict JSON, with its digest."""
        content = plain(flat(self) | {"passed": self.passed})
        return content | {DIGEST: digest(content)}
