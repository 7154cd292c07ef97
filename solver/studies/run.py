"""Runs the points of a group and writes their records, whole or not at all.

A record has `name`, `line` (the series it is drawn with), `labels` by axis, `series`, `choices`,
`swapped`, then `outcome` (solved, refused, failed, crashed or missing), `reason`, and what its
measure found. Timed points also have `threads`, `load` (the machine's when it began) and `whole`
(wall seconds that it took).
"""

import json
import logging
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..system.errors import InputError
from ..system.files import write_text
from ..system.process import cores_for
from ..system.progress import OUTCOME, now
from . import measures
from .description import FULL, Study, StudyGroup, read_study
from .points import Point, points_of
from .timing import measure_apart, surroundings

_LOG = logging.getLogger(__name__)
Record = dict[str, Any]
APART = ("timed", "process")
"""Measures that need the machine for themselves."""


def run_group(
    study: Study, group: StudyGroup, file: Path | None = None, level: str = FULL
) -> Record:
    """The record of a group: its points, one after the other, and the machine.

    `file` and `level`: where the study was read, for points that are measured apart.
    """
    from ..verification.provenance import gather

    started, points = now(), []
    for point in points_of(study, group):
        record = identity(point) | _measure(study, group, point, file, level)
        points.append(record)
        _LOG.log(OUTCOME, "%s/%s: %s", group.name, point.name, _short(record))
    machine = gather(Path(points[0]["case"]), None) if points else {}
    return {"group": group.name, "points": points, "machine": machine, "whole": now() - started}


def identity(point: Point) -> Record:
    """What a point is of."""
    return {
        "name": point.name,
        "line": point.line,
        "series": point.series.name,
        "case": str(point.series.case),
        "choices": {axis: point.labels[axis] for axis in point.choices},
        "labels": {axis: point.labels[axis] for axis in point.numbers},
        "numbers": dict(point.numbers),
        "swapped": point.swapped,
    }


def _measure(
    study: Study, group: StudyGroup, point: Point, file: Path | None, level: str
) -> Record:
    measure = group.measure or study.measure
    if measure not in APART:
        return measures.attempt(lambda: measures.IN_PROCESS[measure](point))
    started, threads = now(), point.series.threads or study.threads
    cores = cores_for(threads)
    if measure == "process":
        record = measures.attempt(lambda: measures.process(point, cores, study.limit))
    elif len(cores) < threads:
        problem = f"more than the {len(cores)} cores that may be used here"
        raise InputError(file, "threads", threads, problem)
    else:
        job = {"study": str(file), "level": level, "group": group.name, "point": point.name}
        record = measure_apart(job, cores, study.limit)
    return surroundings(cores) | record | {"whole": now() - started}


def measure_here(job: Mapping[str, Any]) -> None:
    """Measure a timed point in this process, and write its record."""
    study = read_study(Path(job["study"]), job["level"])
    group = study.group(job["group"])
    point = next(point for point in points_of(study, group) if point.name == job["point"])
    repetitions = study.repetitions if group.repetitions is None else group.repetitions
    record = measures.attempt(lambda: measures.timed(point, repetitions, job["started"]))
    write_text(job["output"], json.dumps(record))


def write_group(study: Study, name: str, output: Path, file: Path, level: str) -> str:
    """Run a group and write its record to `output`; what was measured, in one line."""
    record = run_group(study, study.group(name), file, level)
    write_text(output, json.dumps(record, indent=1) + "\n")
    solved = sum(point["outcome"] == "solved" for point in record["points"])
    return f"{name}: {solved} of {len(record['points'])} points, {record['whole']:.1f} s"


def _short(record: Record) -> str:
    if record["outcome"] != "solved":
        return f"{record['outcome']}: {record['reason']}"
    return f"{record['dofs']} unknowns" if record.get("dofs") else "solved"


if __name__ == "__main__":
    measure_here(json.loads(sys.argv[1]))
