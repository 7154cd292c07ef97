"""The report as JUnit XML, which CI servers read.

It has no standard, but two schemas that most readers and checkers follow: the one of Ant's
task (strict: every attribute is required, and no other is allowed) and the one of Jenkins. What is
written here holds under both.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from datetime import UTC, datetime

from . import formats
from .rows import Row, counted, families

_FAILURES, _ERRORS = ("failed", "unreliable"), ("crashed", "refused")
# The parts of the provenance that identify a run.
_PROPERTIES = ("revision", "cpu", "cores", "platform", "python", "numpy", "scipy", "scikit-fem")


def to_junit(rows: Sequence[Row]) -> str:
    """A suite for each family; refused and crashed solves are errors, others not sound failures."""
    suites = ET.Element("testsuites")
    for number, (family, members) in enumerate(families(rows).items()):
        suites.append(_suite(number, family, members))
    ET.indent(suites)
    return ET.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _suite(number: int, family: str, rows: Sequence[Row]) -> ET.Element:
    counts = counted(rows)
    attributes = {
        "id": str(number),
        "package": _xml(family),
        "name": _xml(family),
        "timestamp": _started(rows),
        "hostname": "localhost",  # not in a result
        "tests": str(len(rows)),
        "failures": str(sum(counts.get(word, 0) for word in _FAILURES)),
        "errors": str(sum(counts.get(word, 0) for word in _ERRORS)),
        "time": f"{sum(row.total or 0 for row in rows):.3f}",
    }
    suite = ET.Element("testsuite", attributes)
    properties = ET.SubElement(suite, "properties")
    for name, value in _properties(rows).items():
        ET.SubElement(properties, "property", {"name": name, "value": _xml(value)})
    suite.extend(_case(row) for row in rows)
    ET.SubElement(suite, "system-out")
    ET.SubElement(suite, "system-err")
    return suite


def _case(row: Row) -> ET.Element:
    attributes = {"classname": _xml(row.group), "name": _xml(row.name)}
    case = ET.Element("testcase", attributes | {"time": f"{row.total or 0:.3f}"})
    if not row.sound:
        tag = "failure" if row.word in _FAILURES else "error"
        ending = ET.SubElement(case, tag, {"type": row.word, "message": _xml(row.why)})
        ending.text = _xml(_failed_checks(row))
    return case


def _started(rows: Sequence[Row]) -> str:
    """When the first of the solves ended, in UTC as the schema wants it; now if unknown."""
    times = [str(time) for row in rows if (time := row.verdict.provenance.get("time_utc"))]
    return min(times, default=datetime.now(UTC).isoformat())[:19]


def _properties(rows: Sequence[Row]) -> dict[str, str]:
    """Versions behind the solves; Jenkins' schema wants one property at least."""
    verdicts = ", ".join(f"{n} {word}" for word, n in counted(rows).items())
    found = {"verdicts": verdicts}
    for key in _PROPERTIES:
        values = sorted({str(v) for row in rows if (v := row.verdict.provenance.get(key))})
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
