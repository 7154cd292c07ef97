"""The process that measures one point, given as a JSON object.

    python -m solver.studies.work_precision.measure JOB

Its numerical libraries read the number of threads when they are loaded, and peak memory is the
process's own: hence a process for each point.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from solver.studies.timing import repeated
from solver.studies.work_precision.description import Point, Study, read_study
from solver.studies.work_precision.point import SOLVED
from solver.system.clock import SOLVING, Clock
from solver.system.errors import InputError, SolveError
from solver.system.process import used_since


def main(job: Mapping[str, Any]) -> None:
    """Measure the point, write what was found: also where the solve is refused or fails."""
    from solver.verification.verdict import to_json

    study = read_study(Path(job["study"]), job["size"])
    point = study.point(job["point"])
    reference = Path(job["reference"]) if job["reference"] else None
    try:
        found = measure(study, point, reference, job["started"])
    except InputError as error:
        found = {"outcome": "refused", "reason": error.told}
    except SolveError as error:
        found = {"outcome": "failed", "reason": str(error)}
    Path(job["output"]).write_text(to_json(found), encoding="utf-8")


def measure(study: Study, point: Point, reference: Path | None, started: float) -> dict[str, Any]:
    """The outcome of a point: a first solve as a warm-up, then the repetitions.

    `started` is when the process was, by `clock.now`. Raises InputError and SolveError.
    """
    from solver.mechanics.linear.direct import force_solver
    from solver.simulation.simulate import simulate
    from solver.studies.work_precision.reference import read_reference
    from solver.system.provenance import gather
    from solver.verification.norms import errors
    from solver.verification.run import mesh_of

    case = point.case()
    mesh = mesh_of(case)

    def run(clock: Clock) -> Any:
        return simulate(case, mesh, clock=clock)

    with force_solver(point.linear_solver):
        solution = run(Clock())
        process = used_since(started)
        times = repeated(run, study.repetitions)
    exact = read_reference(reference) if reference else None
    order = [stage for stage in SOLVING if stage in times]
    order += [stage for stage in times if stage not in order]
    return {
        "outcome": SOLVED,
        "reason": "",
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


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
