"""Verdicts in files: `verdict.json` and the list in `summary.json`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec

from ..system.errors import InputError
from ..system.files import seal_of, write_text
from .flat import DIGEST, deep, digest, flat_key, to_json
from .verdict import WORDS, Verdict


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
    verdict = typed(content, path)
    if content.pop(DIGEST, None) != digest(content):
        raise _damaged(path, "it is not as it was written")
    if verdict.verdict not in WORDS:
        raise _damaged(path, f"no such verdict: {verdict.verdict}")
    return verdict


def unbound(verdict: Verdict, path: Path) -> str:
    """Why folder (in `results`) or result do not belong to the verdict; empty if they do.

    Reads the whole result.
    """
    *_, root, family, job = ("", "", *path.absolute().parts[:-1])
    if root == "results" and (family, job) != (verdict.problem.family, verdict.problem.job):
        return f"the verdict belongs to {verdict.problem.family}/{verdict.problem.job}"
    if verdict.files.result is not None:
        seal = seal_of(path.parent / verdict.files.result)
        if not seal:
            return f"the result {verdict.files.result} is missing or damaged"
        if seal != verdict.files.result_sha256:
            return f"the result {verdict.files.result} belongs to another solve"
    return ""


def typed(content: object, where: Path, at: str = "") -> Verdict:
    """Plain values, as `json.loads` returns them, as a verdict; `InputError` otherwise.

    Unknown keys are ignored. A key that is missing or null has its default, NaN for a number. `at`
    is the place of the values in the file.
    """
    given = _without_nulls(content)
    try:
        nested = deep(Verdict, given) if isinstance(given, dict) else given
        return msgspec.convert(nested, Verdict)
    except msgspec.ValidationError as error:
        said, _, place = str(error).partition(" - at ")
        key = flat_key(Verdict, place.strip("`").removeprefix("$").removeprefix("."))
        key = f"{at}.{key}".strip(".") or "file"
        raise InputError(where, key, None, f"not as in a verdict: {said}") from None


def typed_list(content: object, where: Path) -> list[Verdict]:
    """Verdicts in a list, as a summary has them; `InputError` where they are none."""
    if not isinstance(content, list):
        raise InputError(where, "file", None, "not as in a verdict: must be a list")
    return [typed(one, where, f"[{number}]") for number, one in enumerate(content)]


def _without_nulls(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nulls(item) for key, item in value.items() if item is not None}
    return [_without_nulls(item) for item in value] if isinstance(value, list) else value


def _damaged(path: Path, why: str) -> InputError:
    return InputError(path, "file", None, f"damaged verdict ({why})")
