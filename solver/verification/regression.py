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

from ..simulation.results.solution import Solution
from ..system.errors import InputError
from ..system.files import write_text
from .checks import Accepted
from .verdict import CheckResult

_KEYS = {"minimum", "maximum"}


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
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(path, "file", None, f"must be JSON ({error})") from None
    if not isinstance(content, dict):
        raise InputError(path, "file", content, "must map checks to accepted values")
    return {title: _accepted(path, title, value) for title, value in content.items()}


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


def _accepted(path: Path, title: str, value: object) -> Accepted:
    if (
        not isinstance(value, dict)
        or value.keys() != _KEYS
        or not all(map(_number, value.values()))
    ):
        raise InputError(path, title, value, "must be {minimum: number, maximum: number}")
    return Accepted(**value)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


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
