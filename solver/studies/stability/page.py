"""The page of numerical stability, its table for machines, and which points do not hold."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...report import formats
from ...report.charts import write_script
from ...report.html import render
from ...report.tables import as_csv
from ...system.errors import InputError
from ...system.files import write_text
from ..infsup.page import sections
from ..infsup.records import InfSupRecord, failures
from ..points import Record
from .figure import COLORS, anchor, draw_map

PAGE, TABLE, FAILURES = ".html", ".csv", "-failures.txt"
MEASURES = {
    "pressure": "pressure",
    "stress": "stress",
    "floor_pressure": "floor, pressure",
    "floor_stress": "floor, stress",
    "attainable": "estimate",
    "gap": "gap",
    "force": "balance, forces",
    "moment": "balance, moments",
    "residual": "residual",
}


def read_records(paths: Sequence[Path]) -> list[Record]:
    """The records of sweeps, in the order of the page; `InputError` for another kind of file."""
    records = []
    for path in paths:
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
            records.append((record["order"], record["sweep"], record))
        except (OSError, ValueError, KeyError, TypeError) as error:
            problem = f"must be a record written by `sweep` ({type(error).__name__})"
            raise InputError(path, "file", None, problem) from None
    return [record for _, _, record in sorted(records, key=lambda item: item[:2])]


def write_stability(
    records: Sequence[Record],
    folder: Path,
    quick: bool,
    theory: InfSupRecord | None = None,
) -> str:
    """Write the page, the table and the failures of the sweeps into `folder`.

    They are called stability…, or stability-quick… for the quick version. `theory` adds the inf-sup
    test and the half-loaded block. Returns the failures and the outcome.
    """
    stem = "stability-quick" if quick else "stability"
    lines = [line for record in records for line in problems(record)]
    lines += failures(theory) if theory else []
    contents = {
        PAGE: _to_html(records, quick, lines, theory),
        TABLE: as_csv([row for record in records for row in _rows(record)]),
        FAILURES: "".join(f"{line}\n" for line in lines),
    }
    for name, content in contents.items():
        write_text(folder / f"{stem}{name}", content)
    write_script(folder)
    return contents[FAILURES] + f"{outcome(records)} Page: {folder / stem}{PAGE}"


def problems(record: Record) -> list[str]:
    """The points of a sweep that do not hold, one line each."""
    lines = []
    for point in record["points"]:
        if not point["holds"]:
            why = point["reason"] or (
                f"pressure {formats.error(point['pressure'])}, "
                f"floor {formats.error(point['floor_pressure'])}; "
                f"stress {formats.error(point['stress'])}, "
                f"floor {formats.error(point['floor_stress'])}"
            )
            lines.append(f"{record['sweep']}/{point['series']}/{point['label']}: {why}")
    return lines


def outcome(records: Sequence[Record]) -> str:
    """How many points hold."""
    points = [point for record in records for point in record["points"]]
    held = sum(point["holds"] for point in points)
    return f"{held} of {len(points)} points hold, in {len(records)} sweeps."


def _to_html(
    records: Sequence[Record], quick: bool, lines: Sequence[str], theory: InfSupRecord | None
) -> str:
    return render(
        Path(__file__).with_name("page.html.jinja"),
        charts=True,
        title="Numerical stability",
        records=records,
        quick=quick,
        outcome=outcome(records),
        good=bool(records) and not lines,
        problems=lines,
        theory=sections(theory) if theory else "",
        table=f"stability{'-quick' * quick}{TABLE}",
        maps=[draw_map(record) for record in records],
        shades=COLORS,
        anchor=anchor,
        measures=MEASURES,
        seconds=sum(record["cpu_seconds"] for record in records),
    )


def _rows(record: Record) -> list[dict[str, Any]]:
    """One row for each point, those without a result too."""
    return [
        {
            "sweep": record["sweep"],
            "series": point["series"],
            "value": point["label"],
            "verdict": point["word"],
            "holds": point["holds"],
            "beyond": point["beyond"],
            **{name: point.get(name) for name in MEASURES},
            "iterations": point.get("iterations"),
            "unknowns": point.get("unknowns"),
            "condition": point.get("condition"),
            "inertia": " ".join(map(str, point.get("inertia") or ())),
            "uncured": point["uncured"]["word"],
            "uncured_pressure": point["uncured"].get("pressure"),
            "uncured_stress": point["uncured"].get("stress"),
            "reason": point["reason"],
        }
        for point in record["points"]
    ]
