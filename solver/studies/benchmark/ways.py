"""What the processes of the benchmark do, each started by `studies.points.measure_apart`."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...system.clock import Clock, now, processor_time
from ...system.process import used_since


def solve(job: Mapping[str, Any]) -> dict[str, Any]:
    """One mesh solved in one way: the process up to the first solve's end, and warm repetitions."""
    from ...case.reader import load_case
    from ...mechanics.linear.direct import force_solver
    from ...mesh import read_mesh
    from ...simulation.options import Options, Safeguards, Shortcuts
    from ...simulation.simulate import simulate
    from ...verification.norms import errors
    from ..timing import repeated

    case = load_case(Path(job["case"]))
    zones = tuple(replace(zone, treatment=job["treatment"]) for zone in case.zones)
    case, mesh = replace(case, zones=zones), read_mesh(job["mesh"])
    options = Options(
        Shortcuts.none() if job["everything"] else Shortcuts(),
        Safeguards() if job["cures"] else Safeguards.none(),
    )
    if job["free"]:
        _without_mkl()
    first = Clock()

    def run(clock: Clock) -> Any:
        return simulate(case, mesh, options=options, clock=clock)

    with force_solver(job["solver"]):
        solution = run(first)
        process = used_since(job["started"])
        times = repeated(run, job["repetitions"]) if job["repetitions"] else {}
    return {
        "process": process,
        "first": {"wall": first.seconds, "cpu": first.cpu_seconds},
        "times": times,
        "dofs": solution.dofs,
        "linear_solver": solution.linear_solver,
        "linear_iterations": solution.linear_iterations,
        "pressure_max": errors(solution)["pressure_max"],
    }


def batch(job: Mapping[str, Any]) -> dict[str, Any]:
    """Cases from mesh file to verdict one after the other, twice: the second time all is warm."""
    from ...verification.run import Job
    from ...verification.run import solve as solve_job

    folder, passes = Path(job["folder"]), []
    for _ in range(2):
        wall, cpu = now(), processor_time()
        for number, (case, mesh) in enumerate(job["cases"]):
            verdict = folder / f"{number}.json"
            solve_job(Job(Path(case), Path(mesh)), verdict.with_suffix(".vtkhdf"), verdict)
        passes.append({"wall": now() - wall, "cpu": processor_time() - cpu})
    return {"process": used_since(job["started"]), "passes": passes}


def _without_mkl() -> None:
    """As where MKL is not installed."""
    from ...mechanics.linear.backends import BACKENDS

    BACKENDS["pardiso"] = replace(BACKENDS["pardiso"], available=lambda: False)
