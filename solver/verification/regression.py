"""Accepted values: the last results that a person has reviewed, kept under version control.

They are kept beside the case file, in `regression/JOB.json`, one line a check, apart from the
reference: a reference is the right value, an accepted value a computed one. Both extremes of a
check may move by 1e-9 of its scale; a value below 1e-12 of the scale is kept as zero, and digits
past the twelfth are dropped, so that round-off never shows as a difference.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from ..simulation.results.solution import Solution
from ..system.errors import InputError
from ..system.files import write_text
from .checks import Accepted
from .verdict import CheckResult


def regression_file(solution: Solution) -> Path:
    """The file of a solve's accepted values."""
    return solution.case.path.parent / "regression" / f"{solution.job}.json"


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
    return "none" if accepted is None else f"{accepted.minimum:.12g} … {accepted.maximum:.12g}"


def _write(path: Path, values: Mapping[str, Accepted]) -> None:
    lines = [
        f'  {json.dumps(title)}: {{"minimum": {value.minimum!r}, "maximum": {value.maximum!r}}}'
        for title, value in sorted(values.items())
    ]
    write_text(path, "{\n" + ",\n".join(lines) + "\n}\n")
