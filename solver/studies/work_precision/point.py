"""One point of the study: measured in a process of its own, and recorded whatever happens there.

The record is a JSON object:

    point problem slave master treatment level linear_solver     what it is of
    outcome reason           solved, refused, failed or crashed, and why
    dim dofs macro_elements iterations factor                    the solve's size; who solved it
    errors                   against the exact solution, by the names of solver.verification.norms
    times                    by stage and `total`: wall and cpu seconds of every repetition
    process                  wall and cpu seconds, peak memory in MB, of the process up to the end
                             of its first solve: start-up, meshing, one solve
    whole                    wall seconds that the point took, all repetitions included
    threads cores load machine     what it ran on; load: the machine's when it began, 1 minute
"""

import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from solver.studies.work_precision.description import Point, Study
from solver.system.clock import now
from solver.system.errors import InputError
from solver.system.files import replacing
from solver.system.process import cores_for, run_apart

SOLVED = "solved"
_UNKNOWN: dict[str, Any] = {
    "dim": None,
    "dofs": None,
    "macro_elements": None,
    "iterations": None,
    "factor": None,
    "errors": {},
    "times": {},
    "process": {},
    "machine": {},
}


def measure_apart(study: Study, point: Point, output: Path, reference: Path | None) -> str:
    """Measure a point in a new process, write its record to `output`; the record in one line.

    `reference` is the result that stands for an exact solution, where the problem has none. Raises
    InputError where the machine has not the cores that the study asks for.
    """
    cores = cores_for(study.threads)
    if len(cores) < study.threads:
        allowed = f"more than the {len(cores)} cores that may be used here"
        raise InputError(study.path, "threads", study.threads, allowed)
    about = _identity(point) | {
        "threads": study.threads,
        "cores": cores,
        "load": round(os.getloadavg()[0], 2),
    }
    started = now()
    with replacing(output) as temporary:
        job = {
            "study": str(study.path),
            "size": study.size,
            "point": point.name,
            "reference": str(reference) if reference else None,
            "output": str(temporary),
            "started": started,
        }
        found = _UNKNOWN | _in_process(job, study.limit, cores)
        record = about | found | {"whole": now() - started}
        temporary.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return told(record)


def told(record: Mapping[str, Any]) -> str:
    """What came of a point, in one line."""
    from solver.studies.timing import TOTAL, spread

    if record["outcome"] != SOLVED:
        return f"{record['point']}: {record['outcome']}: {record['reason']}"
    time = spread(record["times"][TOTAL]["wall"])
    return (
        f"{record['point']}: {record['dofs']} unknowns, {time.median:.3g} s "
        f"({time.low:.3g} … {time.high:.3g})"
    )


def _in_process(job: Mapping[str, Any], limit: float, cores: list[int]) -> dict[str, Any]:
    """What the measuring process found, or why it found nothing."""
    command = [sys.executable, "-m", "solver.studies.work_precision.measure", json.dumps(job)]
    done = run_apart(command, cores, limit)
    if done.status == 0:
        return json.loads(Path(job["output"]).read_text(encoding="utf-8"))
    return _ended("failed" if done.status is None else "crashed", done.reason)


def _ended(outcome: str, reason: str) -> dict[str, Any]:
    return {"outcome": outcome, "reason": reason}


def _identity(point: Point) -> dict[str, Any]:
    return {
        "point": point.name,
        "problem": point.problem.name,
        "slave": point.slave,
        "master": point.master,
        "treatment": point.treatment.name,
        "level": point.level,
        "linear_solver": point.linear_solver,
    }
