"""One point of the scaling family: meshed, then solved by the command line, and put on record.

The solve is what a user types: `python -m solver solve`, from a mesh file to a result file, in a
process of its own that is pinned to its cores; a process in which Numba compiled functions is not
measured, but the next one. Its verdict has the cost of each stage; the operating system reports
processor time and peak memory of the whole process. Beside the keys of `studies.points` the record
has:

    series cells size divisions            what it is of
    dofs macro_elements faces matrix_entries       faces: of both sides of the interface
    iterations linear_iterations linear_solver     contact status, linear system
    seconds stage_cpu_seconds              wall and processor time by stage
    process meshing                        {wall, cpu, peak_memory_mb} of the processes that solve
                                           and that make the mesh file
    errors verdict plan                    as in the verdict
    products                               of the largest 3D solve of a series: `studies.bandwidth`
    memory_free_gb                         when it began
"""

import json
import tempfile
from pathlib import Path
from typing import Any

from ...system.clock import now
from ...system.files import write_text
from ...system.memory import available
from ...system.package import COMMAND
from ...system.process import cores_for, run_in_subprocess
from ...verification.verdict import read_verdict
from ..bandwidth import measure
from ..points import (
    CRASHED,
    FAILED,
    REFUSED,
    SOLVED,
    Record,
    ended,
    measure_apart,
    run_compiled,
    surroundings,
)
from .description import Scaling, ScalingPoint

# The share of the machine's free memory that a point may take: the rest is for other programs.
_SHARE = 0.9
_FROM_VERDICT = (
    *("dofs", "macro_elements", "matrix_entries", "iterations", "linear_iterations"),
    *("linear_solver", "seconds", "stage_cpu_seconds", "errors", "plan"),
)


def measure_point(scaling: Scaling, point: ScalingPoint, output: Path) -> str:
    """Mesh and solve a point, write its record to `output`; the record in one line."""
    started, free, cores = now(), available(), cores_for(point.series.threads or scaling.threads)
    about = {
        "point": point.name,
        "series": point.series.name,
        "cells": point.series.cells,
        "size": point.size,
        "divisions": list(point.divisions),
        "memory_free_gb": round(free / 1e9, 1),
    }
    about |= surroundings(cores)
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{output.stem}.", dir=output.parent) as folder:
        found = _solve(point, Path(folder), cores, scaling.limit, _SHARE * free)
    record = about | found | {"whole": now() - started}
    write_text(output, json.dumps(record, indent=1) + "\n")
    return _line(record)


def _line(record: Record) -> str:
    if record["outcome"] != SOLVED:
        return f"{record['point']}: {record['outcome']}: {record['reason']}"
    process = record["process"]
    return (
        f"{record['point']}: {record['dofs']} unknowns, {process['cpu']:.1f} s of processor, "
        f"{process['wall']:.1f} s, {process['peak_memory_mb'] / 1000:.2f} GB"
    )


def _solve(
    point: ScalingPoint, folder: Path, cores: list[int], limit: float, memory: float
) -> dict[str, Any]:
    """Results and cost of the processes; their files are not kept."""
    case, mesh, verdict = folder / "case.yaml", folder / "mesh.vtkhdf", folder / "verdict.json"
    case.write_text(point.source(), encoding="utf-8")
    meshed = run_in_subprocess([*COMMAND, "mesh", str(case), "-o", str(mesh)], cores, limit, memory)
    found = {"meshing": meshed.used, "process": {}} | dict.fromkeys(_FROM_VERDICT)
    found |= {"verdict": None, "faces": None, "machine": {}}
    if meshed.status != 0:
        return found | ended(FAILED, f"no mesh: {meshed.reason}")
    command = [*COMMAND, "solve", str(case), "--mesh", str(mesh), "-o", str(folder / "r.vtkhdf")]
    command += ["--verdict", str(verdict)]
    done = run_compiled(lambda: command, cores, limit, memory)
    found["process"] = done.used
    if not verdict.is_file():
        return found | ended(FAILED if done.status is None else CRASHED, done.reason)
    content = read_verdict(verdict)
    found |= {key: getattr(content, key) for key in _FROM_VERDICT}
    found |= {"verdict": content.verdict, "machine": content.provenance}
    if content.dofs is None:
        word = content.verdict
        reason = content.reason.removeprefix(f"{case}: ")
        return found | ended(word if word in (REFUSED, CRASHED) else FAILED, reason)
    found["faces"] = sum(body.faces for body in content.bodies)
    if point.counts_bytes:
        job = {"case": str(case), "mesh": str(mesh)}
        found["products"] = measure_apart(measure, job, folder / "products.json", cores, limit)
    return found | ended(SOLVED, content.reason)
