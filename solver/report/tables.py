"""The report for machines and terminals: JSON, CSV, Markdown, the list of failures."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from ..verification.flat import to_json as strict_json
from . import formats
from .rows import Row, counted, families, ours

_HEAD = (
    "case",
    "verdict",
    "reference",
    "cell types",
    "slave",
    "cells / reference",
    "faces / reference",
    "unknowns",
    "macro-elements",
    "pressure",
    "normal stress",
    "gap",
    "contact",
    "coverage",
    "largest checked error",
    "time",
    "reason",
)


def to_json(rows: Sequence[Row]) -> str:
    """The verdicts as they are."""
    return strict_json([row.plain for row in rows]) + "\n"


def to_csv(rows: Sequence[Row]) -> str:
    """One line a solve, every digit kept; times by stage and errors by check in columns."""
    stages = list(dict.fromkeys(stage for row in rows for stage in row.stages))
    checks = list(dict.fromkeys(check.name for row in rows for check in row.verdict.checks))
    records = [_record(row, stages, checks) for row in rows]
    return as_csv(records) or "case\r\n"


def as_csv(records: Sequence[Mapping[str, Any]]) -> str:
    """Records that have the same keys, with a line of headings; empty without records."""
    text = io.StringIO()
    if records:
        writer = csv.DictWriter(text, fieldnames=list(records[0]))
        writer.writeheader()
        writer.writerows(records)
    return text.getvalue()


def _record(row: Row, stages: Sequence[str], checks: Sequence[str]) -> dict[str, Any]:
    record: dict[str, Any] = {
        "family": row.group,
        "job": row.name,
        "case": row.verdict.problem.case,
        "direction": row.verdict.problem.direction,
        "variant": row.verdict.problem.variant,
        "verdict": row.word,
        "judged": row.verdict.judged,
        "reason": row.why,
        "reference_kind": row.verdict.reference.kind,
        "slave": row.slave,
    }
    for key in ("cells", "reference_cells", "faces", "reference_faces"):
        for role in ("slave", "master"):
            bodies = [body for body in row.sides if body.role == role]
            record[f"{role}_{key}"] = "; ".join(_plain(getattr(body, key)) for body in bodies)
    record |= {"dofs": row.verdict.cost.dofs, "macro_elements": row.verdict.cost.macro_elements}
    for key in ("pressure", "stress", "gap", "status", "coverage"):
        pair = getattr(row.verdict.values, key) or (None, None)
        record |= {f"{key}_minimum": pair[0], f"{key}_maximum": pair[1]}
    worst = row.accuracy or (None, None)
    record |= {"worst_error": worst[0], "worst_check": worst[1]}
    for check in checks:
        record[f"error_{check}"] = next((e for e, _ in row.errors([check])), None)
    for stage in stages:
        record[f"seconds_{stage}"] = row.stages.get(stage)
    record |= {"seconds_total": row.total, "cpu_seconds": row.verdict.cost.cpu_seconds}
    return record | {
        "peak_memory_mb": row.verdict.cost.peak_memory_mb,
        "linear_solver": row.verdict.cost.linear_solver,
    }


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{kind} {count}" for kind, count in value.items())
    return "" if value is None else str(value)


def to_markdown(rows: Sequence[Row]) -> str:
    """The outcome, the failures with their reasons, and a table for each family."""
    parts = [f"# Verification of contact solves\n\n{outcome(rows)}\n"]
    bad = [row for row in ours(rows) if not row.sound]
    if bad:
        parts.append("\n## Not passed\n")
        parts += [f"- **{md(row.name)}** {row.word}: {md(row.why)}" for row in bad]
    for family, members in families(rows).items():
        parts.append(f"\n## {md(family)}\n\n{outcome(members)}\n")
        parts.append("| " + " | ".join(_HEAD) + " |")
        parts.append("|" + " --- |" * len(_HEAD))
        parts += ["| " + " | ".join(map(md, _cells(row))) + " |" for row in members]
    return "\n".join(parts) + "\n"


def _cells(row: Row) -> list[str]:
    sides = row.sides
    worst = row.accuracy
    return [
        row.name,
        row.word,
        row.verdict.reference.kind or formats.NOTHING,
        " on ".join(formats.types(body) for body in sides) or formats.NOTHING,
        row.slave or formats.NOTHING,
        ", ".join(
            formats.against(sum(body.cells.values()), body.reference_cells) for body in sides
        ),
        ", ".join(formats.against(body.faces, body.reference_faces) for body in sides),
        str(row.verdict.cost.dofs or formats.NOTHING),
        str(row.verdict.cost.macro_elements or formats.NOTHING),
        formats.extremes(row.verdict.values.pressure),
        formats.extremes(row.verdict.values.stress),
        formats.extremes(row.verdict.values.gap, row.verdict.values.length),
        formats.extremes(row.verdict.values.status),
        formats.extremes(row.verdict.values.coverage),
        f"{formats.error(worst[0])} ({worst[1]})" if worst else formats.NOTHING,
        formats.seconds(row.total),
        row.why,
    ]


def md(text: str) -> str:
    """Text that Markdown, and the HTML made of it, shows as it is."""
    text = " ".join(str(text).split()).replace("&", "&amp;").replace("<", "&lt;")
    return re.sub(r"([\\|`*_\[\]])", r"\\\1", text.replace(">", "&gt;"))


def to_failures(rows: Sequence[Row]) -> str:
    """One line for each solve that did not pass: name, verdict, reason; empty if all did.

    Other codes are shown in the tables; they do not fail the batch.
    """
    bad = (row for row in rows if not row.sound and not row.verdict.foreign.code)
    return "".join(f"{row.name}: {row.word}: {row.why}\n" for row in bad)


def outcome(rows: Sequence[Row]) -> str:
    """The batch in one line; results of other codes are counted apart."""
    mine = ours(rows)
    counts, others = counted(mine), len(rows) - len(mine)
    words = ", ".join(f"{n} {word}" for word, n in counts.items())
    said = f"{len(mine)} solve{'s' * (len(mine) != 1)}: {words or 'none at all'}."
    if set(counts) == {"passed"}:
        said = f"All {len(mine)} solves passed." if len(mine) > 1 else "The one solve passed."
    if not others:
        return said
    good = sum(row.sound for row in rows if row.verdict.foreign.code)
    return f"{said} Of {others} results of other codes {good} passed."


# The report as JUnit XML, which CI servers read.

_FAILURES = ("failed", "unreliable")
# The parts of the provenance that identify a run.
_PROPERTIES = ("revision", "cpu", "cores", "platform", "python", "numpy", "scipy", "scikit-fem")


def to_junit(rows: Sequence[Row]) -> str:
    """A suite for each family; refused and crashed solves are errors, others not sound failures."""
    suites = JUnitXml()
    for family, members in families(rows).items():
        suites.append(_suite(family, members))
    return suites.tostring().decode() + "\n"


def _suite(family: str, rows: Sequence[Row]) -> TestSuite:
    suite = TestSuite(_xml(family))
    suite.timestamp = _started(rows)
    suite.hostname = "localhost"  # not in a result
    for name, value in _properties(rows).items():
        suite.add_property(name, _xml(value))
    suite.add_testcases([_case(row) for row in rows])
    return suite


def _case(row: Row) -> TestCase:
    case = TestCase(_xml(row.name), _xml(row.group), round(row.total or 0, 3))
    if not row.sound:
        kind = Failure if row.word in _FAILURES else Error
        case.result = [kind(_xml(row.why), row.word)]
        case.result[0].text = _xml(_failed_checks(row))
    return case


def _started(rows: Sequence[Row]) -> str:
    """When the first of the solves ended, in UTC as the schema wants it; now if unknown."""
    times = [str(time) for row in rows if (time := row.verdict.files.provenance.get("time_utc"))]
    return min(times, default=datetime.now(UTC).isoformat())[:19]


def _properties(rows: Sequence[Row]) -> dict[str, str]:
    """Versions behind the solves; Jenkins' schema wants one property at least."""
    verdicts = ", ".join(f"{n} {word}" for word, n in counted(rows).items())
    found = {"verdicts": verdicts}
    for key in _PROPERTIES:
        values = sorted({str(v) for row in rows if (v := row.verdict.files.provenance.get(key))})
        if values:
            found[key] = ", ".join(values)
    return found


def _failed_checks(row: Row) -> str:
    return "\n".join(
        f"{check.title}: error {formats.error(check.error)}, tolerance "
        f"{formats.error(check.tolerance)}"
        for check in row.verdict.checks
        if not check.passed
    )


def _xml(text: str) -> str:
    """Text without the characters that XML does not allow at all."""
    return re.sub(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "�", text)
