"""Results of codes that cannot run here, as their makers state them: `recorded/*.yaml`.

kind: recorded
code: code_aster
version: "14.6"
date: "2020"
source: where the figures are stated
remark: what they are
results:
  - {cases: [ssnp170-a, ssnp170-b], pressure: 4.0e-13, stress: 4.0e-13}
  - {cases: [ssnp170-z3], stress: 4.0e-3, remark: what is special}

A file is in `recorded/` beside the case files of its family. Errors are relative, and are bounds.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from ..case.checks import RELATIVE
from ..case.model import SolvedAs
from ..case.typed import ONCE, Positive, Section, Text, Version, read_as
from ..case.yaml import read_mapping
from ..simulation.results.records import Cost
from ..system.errors import InputError, hint
from ..verification.verdict import (
    SOLVED,
    CheckError,
    CheckResult,
    Foreign,
    Problem,
    Verdict,
)
from .files.map import CodeName

FOLDER = "recorded"

NOT_JUDGED = "recorded values: not judged here"


class RecordedResult(Section, frozen=True):
    """The figures of some solves.

    cases: names of solves, as in the report
    pressure: the largest relative error of the contact pressure
    stress: the largest relative error of the normal stress at nodes
    seconds: how long a solve took
    remark: what is special about these solves
    """

    cases: Annotated[tuple[Text, ...], ONCE]
    pressure: Positive | None = None
    stress: Positive | None = None
    seconds: Positive | None = None
    remark: str = ""


class RecordedFile(Section, frozen=True):
    """Results of a code, recorded.

    kind: recorded
    code: the name of the code; its version is part of the name of a column
    version: of the code
    date: when the results were computed or stated
    source: where they are stated
    remark: what they are
    results: by groups of solves
    """

    kind: Literal["recorded"]
    code: CodeName
    version: Version
    date: Version
    source: Text
    results: Annotated[tuple[RecordedResult, ...], Meta(min_length=1)]
    remark: str = ""


def recorded_verdicts(family: Path) -> list[Verdict]:
    """The verdicts of all files in `recorded/` of the family's folder.

    Raises InputError for a file that is not valid, or that names a solve which no case file of the
    folder describes.
    """
    found: list[Verdict] = []
    files = sorted((family / FOLDER).glob("*.yaml"))
    solves = _solves(family) if files else set()
    for path in files:
        file = read_as(RecordedFile, read_mapping(path), path)
        for i, result in enumerate(file.results):
            for case in result.cases:
                if case not in solves:
                    problem = f"not a solve of {family.name}; {hint(case, solves)}"
                    raise InputError(path, f"results[{i}].cases", case, problem)
            found += [_verdict(file, result, case, family.name) for case in result.cases]
    return found


def _solves(family: Path) -> set[str]:
    """The names of the solves of the case files in a folder, both directions."""
    contents = [read_mapping(path) for path in family.glob("*.yaml")]
    named = [content for content in contents if "name" in content and "mesh" in content]
    return {
        SolvedAs(swapped).job(str(content["name"]))
        for content in named
        for swapped in (False, True)
    }


def _verdict(file: RecordedFile, result: RecordedResult, case: str, family: str) -> Verdict:
    named = {"multiplier": result.pressure, "nodal_stress": result.stress}
    checks = [
        CheckResult(name=name, error=error, tolerance=RELATIVE, passed=error <= RELATIVE)
        for name, error in named.items()
        if error is not None
    ]
    worst = max(checks, key=lambda check: check.error, default=None)
    remarks = "; ".join(filter(None, (result.remark, file.remark)))
    return Verdict(
        problem=Problem(case=case, family=family, job=f"{case}@{file.code}-{file.version}"),
        verdict=SOLVED,
        reason=NOT_JUDGED,
        checks=checks,
        worst=CheckError(name=worst.name, error=worst.error) if worst else None,
        cost=Cost.in_all(result.seconds),
        foreign=Foreign(
            code=f"{file.code}-{file.version}",
            code_version=file.version,
            recorded={"date": file.date, "source": file.source, "remark": remarks},
        ),
    )
