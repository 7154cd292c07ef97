"""One point of the study, measured in a process of its own.

Beside the keys of `studies.points` its record has:

problem slave master treatment level linear_solver     what it is of
dim dofs macro_elements iterations factor              the solve's size; its linear solver
errors                   against the exact solution, by the names of `verification.norms`
times                    by stage and `total`: wall and cpu seconds of every repetition
process                  wall and cpu seconds, peak memory in MB, of the process up to the end
of its first solve: start-up, meshing, one solve
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...system.clock import SOLVING, Clock, now
from ...system.errors import InputError
from ...system.files import replacing
from ...system.process import cores_for, used_since
from ..points import SOLVED, Record, measure_apart, surroundings
from ..timing import TOTAL, repeated, spread
from .description import Study, StudyPoint, read_study

_UNKNOWN: dict[str, Any] = dict.fromkeys(
    ("dim", "dofs", "macro_elements", "iterations", "factor")
) | {key: {} for key in ("errors", "times", "process", "machine")}


def measure_point(study: Study, point: StudyPoint, output: Path, reference: Path | None) -> str:
    """Measure a point in a new process, write its record to `output`; the record in one line.

    `reference` is the result that is taken for exact, where the problem has no exact solution.
    Raises InputError where the machine has not the cores that the study asks for.
    """
    started, cores = now(), cores_for(study.threads)
    if len(cores) < study.threads:
        problem = f"more than the {len(cores)} cores that may be used here"
        raise InputError(study.path, "threads", study.threads, problem)
    about = {
        "point": point.name,
        "problem": point.problem.name,
        "slave": point.slave,
        "master": point.master,
        "treatment": point.treatment.name,
        "level": point.level,
        "linear_solver": point.linear_solver,
    }
    about |= surroundings(cores)
    job = {"study": str(study.path), "size": study.size, "point": point.name}
    job["reference"] = str(reference or "")
    with replacing(output) as temporary:
        found = _UNKNOWN | measure_apart(measure, job, temporary, cores, study.limit)
        record = about | found | {"whole": now() - started}
        temporary.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return _line(record)


def _line(record: Record) -> str:
    if record["outcome"] != SOLVED:
        return f"{record['point']}: {record['outcome']}: {record['reason']}"
    time = spread(record["times"][TOTAL]["wall"])
    return (
        f"{record['point']}: {record['dofs']} unknowns, {time.median:.3g} s "
        f"({time.low:.3g} … {time.high:.3g})"
    )


def measure(job: Mapping[str, Any]) -> dict[str, Any]:
    """Measure a point in this process: a first solve as a warm-up, then the repetitions.

    Raises InputError and SolveError.
    """
    from ...mechanics.linear.direct import force_solver
    from ...simulation.simulate import simulate
    from ...system.provenance import gather
    from ...verification.norms import errors
    from ...verification.run import mesh_of
    from .reference import read_reference

    study = read_study(Path(job["study"]), job["size"])
    point = study.point(job["point"])
    case = point.case()
    mesh = mesh_of(case)

    def run(clock: Clock) -> Any:
        return simulate(case, mesh, clock=clock)

    with force_solver(point.linear_solver):
        solution = run(Clock())
        process = used_since(job["started"])
        times = repeated(run, study.repetitions)
    exact = read_reference(Path(job["reference"])) if job["reference"] else None
    order = dict.fromkeys([stage for stage in (*SOLVING, *times) if stage in times])
    return {
        "dim": solution.mesh.points.shape[1],
        "dofs": solution.dofs,
        "macro_elements": solution.macro_elements,
        "iterations": solution.iterations,
        "factor": solution.linear_solver,
        "errors": errors(solution, exact),
        "times": {stage: times[stage] for stage in order},
        "process": process,
        "machine": gather(case.path, None),
    }
