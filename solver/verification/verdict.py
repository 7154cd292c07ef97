"""The verdict of a solve: one typed record with all that the report shows, whatever happened.

`verdict.json` holds it as a JSON object with the same keys. It is bound to what it judges: `digest`
is the hash of all other keys, `result_sha256` that of the result file, and family and job are those
of its folder. `read_verdict` finds a file damaged or edited, `unbound` one that was moved.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from ..system.errors import InputError
from ..system.files import seal_of, write_text
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
T = TypeVar("T")
_DIGEST = "digest"


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
class Verdict:
    """The verdict of one solve; None and empty without a result.

    `judged` says how strictly a solve that passed was judged: `exact`, if the tolerances of all
    checks against the reference are at most 1e-10; `expected error`, if the others follow from
    expected errors; else `stated tolerance`. `worst` is the check with the largest relative error,
    `closest_to_tolerance` the one nearest to its tolerance or furthest past it. Pairs are minimum
    and maximum over all zones; `seconds` has wall times by stage and their `total`.
    `pressure_error_estimate` is relative and in L2: how far constant pressures are from a
    reconstruction; `pressure_within` has the change by facets too, and is None where the pressure
    is broken and nothing can be said. `units` names the units of length, stress, area, force,
    moment and energy where the case does. `strain` to `facet_depth`: see
    `solver.simulation.results.solution.Validity`.
    `transient`: the machine is the reason (memory, disk, a kill), so that the same solve may
    succeed another time.

    Of the result of another code: `code`, its version and `settings`; `printed_digits` are the
    significant ones of its values, where a file has fewer than a number; `not_given` are the checks
    that it has no values for; `only` the fields that were to be compared, where that is a part of
    what the case asks for on purpose, and `compared` at how many places each was; `recorded` has
    date and source of values that were not computed here.
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
    reference_kind: str | None = None
    reference_uncertainty: float | None = None
    reference_code: dict[str, str] | None = None
    reference_remark: str | None = None
    reference_solution: str | None = None
    verdict: str
    passed: bool = False
    judged: str = ""
    reason: str = ""
    result: str | None = None
    result_sha256: str | None = None
    dofs: int | None = None
    macro_elements: int | None = None
    iterations: int | None = None
    linear_solver: str | None = None
    linear_iterations: int | None = None
    matrix_entries: int | None = None
    units: dict[str, str] = field(default_factory=dict)
    length: float | None = None
    load_scale: float | None = None
    pressure_error_estimate: float | None = None
    strain: float | None = None
    rotation: float | None = None
    slip: float | None = None
    pushed_past: int | None = None
    partly_covered: int | None = None
    unpaired: float | None = None
    facets: float | None = None
    facet_depth: float | None = None
    pressure_within: float | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    stage_cpu_seconds: dict[str, float] = field(default_factory=dict)
    cpu_seconds: float | None = None
    peak_memory_mb: float | None = None
    pressure: list[float | None] | None = None
    stress: list[float | None] | None = None
    gap: list[float | None] | None = None
    status: list[int] | None = None
    coverage: list[float | None] | None = None
    worst: CheckError | None = None
    closest_to_tolerance: CheckError | None = None
    bodies: list[Body] = field(default_factory=list)
    plan: list[list[str]] = field(default_factory=list)
    checks: list[CheckResult] = field(default_factory=list)
    forces: list[Force] = field(default_factory=list)
    dissipation: list[float] = field(default_factory=list)
    probes: list[Probed] = field(default_factory=list)
    largest_displacement: float | None = None
    strain_energy: float | None = None
    accuracy: dict[str, float] = field(default_factory=dict)
    attainable: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    provenance: dict[str, str | int] = field(default_factory=dict)
    code: str | None = None
    code_version: str = ""
    settings: dict[str, str] = field(default_factory=dict)
    printed_digits: int | None = None
    not_given: list[str] = field(default_factory=list)
    only: list[str] = field(default_factory=list)
    compared: dict[str, str] = field(default_factory=dict)
    recorded: dict[str, str] = field(default_factory=dict)
    transient: bool = False

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
        line = f"{self.job}: {self.verdict}"
        line += f" ({', '.join(self.only)} only)" if self.only else ""
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
        missing = f", not given: {', '.join(self.not_given)}" if self.not_given else ""
        time = f", {self.seconds['total']:.2f} s" if "total" in self.seconds else ""
        return f"{line}{error}{missing}{time}"

    @property
    def estimate(self) -> str:
        """The estimated error of the pressure, for the end of a line; empty without a result."""
        if not self.pressure or not self.zones or self.code:
            return ""
        if self.pressure_within is None:
            return ", error of the pressure unknown"
        return f", pressure within {percent(self.pressure_within)} (estimated)"

    def plain(self) -> dict[str, Any]:
        """The verdict as plain values for strict JSON, with its digest."""
        content = msgspec.json.decode(_encoded(asdict(self)))
        return content | {_DIGEST: _digest(content)}


def write_verdict(path: str | Path, verdict: Verdict) -> None:
    """Write a verdict as strict JSON: whole or not at all."""
    write_text(path, to_json(verdict.plain()) + "\n")


def read_verdict(path: str | Path) -> Verdict:
    """The verdict in a file; `InputError` where it is not, to the last digit, what was written."""
    path = Path(path)
    try:
        content = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise InputError(path, "file", None, "there is no verdict: the job was ended") from None
    except (OSError, ValueError, RecursionError) as error:
        raise _damaged(path, " ".join(str(error).split())) from None
    verdict = typed(Verdict, content, path)
    if content.pop(_DIGEST, None) != _digest(content):
        raise _damaged(path, "it is not as it was written")
    if verdict.verdict not in WORDS:
        raise _damaged(path, f"no such verdict: {verdict.verdict}")
    return verdict


def unbound(verdict: Verdict, path: Path) -> str:
    """Why folder (in `results`) or result do not belong to the verdict; empty if they do.

    Reads the whole result.
    """
    *_, root, family, job = ("", "", *path.absolute().parts[:-1])
    if root == "results" and (family, job) != (verdict.family, verdict.job):
        return f"the verdict belongs to {verdict.family}/{verdict.job}"
    if verdict.result is not None:
        seal = seal_of(path.parent / verdict.result)
        if not seal:
            return f"the result {verdict.result} is missing or damaged"
        if seal != verdict.result_sha256:
            return f"the result {verdict.result} belongs to another solve"
    return ""


def typed(kind: type[T], content: object, where: Path) -> T:
    """Plain values, as `json.loads` returns them, as typed verdicts; `InputError` otherwise.

    Unknown keys are ignored. A key that is missing or null has its default, NaN for a number.
    """
    try:
        return msgspec.convert(_without_nulls(content), kind)
    except msgspec.ValidationError as error:
        said, _, place = str(error).partition(" - at ")
        key = place.strip("`").removeprefix("$").removeprefix(".")
        raise InputError(where, key or "file", None, f"not as in a verdict: {said}") from None


def _without_nulls(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nulls(item) for key, item in value.items() if item is not None}
    return [_without_nulls(item) for item in value] if isinstance(value, list) else value


def to_json(content: Any) -> str:
    """Strict JSON of plain values, arrays and numbers; numbers that are not finite become null."""
    return msgspec.json.format(_encoded(content), indent=1).decode()


def _encoded(content: Any) -> bytes:
    return msgspec.json.encode(content, enc_hook=_of_numpy)


def _of_numpy(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in JSON")


def _damaged(path: Path, why: str) -> InputError:
    return InputError(path, "file", None, f"damaged verdict ({why})")


def _digest(content: Mapping[str, Any]) -> str:
    """The hash of plain values, whatever the order of their keys."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
