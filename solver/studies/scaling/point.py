"""One point of the scaling family: meshed, then solved by the command line, and put on record.

The solve is what a user types: `python -m solver solve`, from a mesh file to a result file, in a
process of its own that is pinned to its cores. What it cost stage by stage is in its verdict; the
system tells processor time and peak memory of the whole process. The record is a JSON object:

    point series cells size divisions      what it is of
    outcome reason                         solved, refused, failed or crashed, and why
    dofs macro_elements faces matrix_entries       faces: of both sides of the interface
    iterations linear_iterations linear_solver     contact status, linear system
    seconds stage_cpu_seconds              wall and processor time by stage
    process meshing                        {wall, cpu, peak_memory_mb} of the processes that solve
                                           and that make the mesh file
    errors verdict plan                    as in the verdict
    threads cores load memory_free_gb machine      what it ran on, when it began
    whole                                  wall seconds of the point, meshing included
"""

import json
import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from solver.studies.scaling.description import Point, Scaling
from solver.system.clock import now
from solver.system.files import write_text
from solver.system.memory import available
from solver.system.process import cores_for, run_apart
from solver.verification.verdict import read_verdict

SOLVED = "solved"
# What of the machine's free memory a point may take: the rest is for who else is there.
_SHARE = 0.9
_FROM_VERDICT = (
    "dofs",
    "macro_elements",
    "matrix_entries",
    "iterations",
    "linear_iterations",
    "linear_solver",
    "seconds",
    "stage_cpu_seconds",
    "errors",
    "plan",
)
_OUTCOMES = {"refused": "refused", "crashed": "crashed"}


def measure_point(scaling: Scaling, point: Point, output: Path) -> str:
    """Mesh and solve a point, write its record to `output`; the record in one line."""
    started, free, cores = now(), available(), cores_for(scaling.threads)
    about = {
        "point": point.name,
        "series": point.series.name,
        "cells": point.series.cells,
        "size": point.size,
        "divisions": list(point.divisions),
        "threads": len(cores),
        "cores": cores,
        "load": round(os.getloadavg()[0], 2),
        "memory_free_gb": round(free / 1e9, 1),
    }
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{output.stem}.", dir=output.parent) as folder:
        found = _solve(point, Path(folder), cores, scaling.limit, _SHARE * free)
    record = about | found | {"whole": now() - started}
    write_text(output, json.dumps(record, indent=1) + "\n")
    return told(record)


def told(record: Mapping[str, Any]) -> str:
    """What came of a point, in one line."""
    if record["outcome"] != SOLVED:
        return f"{record['point']}: {record['outcome']}: {record['reason']}"
    process = record["process"]
    return (
        f"{record['point']}: {record['dofs']} unknowns, {process['cpu']:.1f} s of processor, "
        f"{process['wall']:.1f} s, {process['peak_memory_mb'] / 1000:.2f} GB"
    )


def _solve(
    point: Point, folder: Path, cores: list[int], limit: float, memory: float
) -> dict[str, Any]:
    """The part of the record that the processes tell; their files are not kept."""
    case, mesh, verdict = folder / "case.yaml", folder / "mesh.vtkhdf", folder / "verdict.json"
    case.write_text(point.source(), encoding="utf-8")
    solver = [sys.executable, "-m", "solver"]
    meshed = run_apart([*solver, "mesh", str(case), "-o", str(mesh)], cores, limit, memory)
    found = {"meshing": meshed.used, "process": {}} | dict.fromkeys(_FROM_VERDICT)
    found |= {"verdict": None, "faces": None, "machine": {}}
    if meshed.status != 0:
        return found | _ended("failed", f"no mesh: {meshed.reason}")
    command = [*solver, "solve", str(case), "--mesh", str(mesh), "-o", str(folder / "r.vtkhdf")]
    done = run_apart([*command, "--verdict", str(verdict)], cores, limit, memory)
    found["process"] = done.used
    if not verdict.is_file():
        return found | _ended("failed" if done.status is None else "crashed", done.reason)
    content = read_verdict(verdict)
    found |= {key: getattr(content, key) for key in _FROM_VERDICT}
    found |= {"verdict": content.verdict, "machine": content.provenance}
    if content.dofs is None:
        reason = content.reason.removeprefix(f"{case}: ")
        return found | _ended(_OUTCOMES.get(content.verdict, "failed"), reason)
    found["faces"] = sum(body.faces for body in content.bodies)
    return found | _ended(SOLVED, content.reason)


def _ended(outcome: str, reason: str) -> dict[str, Any]:
    return {"outcome": outcome, "reason": reason}
