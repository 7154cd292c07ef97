"""Runs the benchmark: each way in a process of its own, one after the other, nothing beside it."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import floor, log10
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from msgspec import structs

from ...case.model import Case
from ...codes.calculix import CalculiX
from ...codes.deck import deck_of
from ...codes.run import CrashError, Limits, run_code
from ...system.clock import Clock, now
from ...system.errors import SolveError
from ...system.package import COMMAND
from ...system.process import cores_for, run_in_subprocess, used_since
from ...system.progress import OUTCOME
from ..bandwidth import measure
from ..points import FAILED, MISSING, SOLVED, ended, measure_apart, surroundings
from ..scaling.description import ScalingPoint, read_scaling
from .description import Benchmark, WayComparison

Record = dict[str, Any]
_LOG = logging.getLogger(__name__)


def run_benchmark(path: Path, benchmark: Benchmark) -> Record:
    """Run all of a benchmark, read from `path`; the record (see `page`).

    Raises SolveError where a mesh cannot be made.
    """
    from ...system.provenance import gather

    started, cores = now(), cores_for(benchmark.threads)
    record: Record = {
        "title": benchmark.title,
        **surroundings(cores),
        "machine": gather(path, None),
        "calculix": CalculiX().version(),
        "comparisons": [],
    }
    series = {one.name: one for one in read_scaling(benchmark.scaling).series}
    space = None
    for comparison in benchmark.comparisons:
        _LOG.log(OUTCOME, "measuring: %s", comparison.title)
        point = ScalingPoint(series[comparison.series], int(comparison.size))
        space = space or (point if point.series.dim == 3 else None)
        with TemporaryDirectory(prefix="benchmark-") as folder:
            ways = _compare(point, comparison, Path(folder), cores, benchmark.limit)
        record["comparisons"].append(
            {
                "title": comparison.title,
                "series": point.series.title,
                "size": point.size,
                "divisions": list(point.divisions),
                "repetitions": comparison.repetitions,
                "ways": ways,
            }
        )
    with TemporaryDirectory(prefix="benchmark-") as folder:
        record["products"] = _products(space, Path(folder), cores, benchmark.limit) if space else []
    return record | {"whole": now() - started}


def _products(
    point: ScalingPoint, folder: Path, cores: Sequence[int], limit: float
) -> list[Record]:
    """Bytes and times of the products of a solve, on one core and on all."""
    _LOG.log(OUTCOME, "measuring: bandwidth")
    job, found = _files(point, folder, cores, limit), folder / "products.json"
    return [
        {"title": point.series.title} | measure_apart(measure, job, found, cores[:count], limit)
        for count in sorted({1, len(cores)})
    ]


def _files(point: ScalingPoint, folder: Path, cores: Sequence[int], limit: float) -> dict[str, str]:
    """The case and mesh files of a point."""
    case, mesh = folder / "case.yaml", folder / "mesh.vtkhdf"
    case.write_text(point.source(), encoding="utf-8")
    if run_in_subprocess([*COMMAND, "mesh", str(case), "-o", str(mesh)], cores, limit).status != 0:
        raise SolveError(f"{case}: no mesh")
    return {"case": str(case), "mesh": str(mesh)}


def _compare(
    point: ScalingPoint,
    comparison: WayComparison,
    folder: Path,
    cores: Sequence[int],
    limit: float,
) -> list[Record]:
    """All ways to solve one mesh."""
    files, found = _files(point, folder, cores, limit), []
    for way in comparison.ways:
        job = files | {"repetitions": comparison.repetitions} | structs.asdict(way)
        if way.program:
            case = point.parsed(Path(files["case"]))
            solved = _other(case, Path(files["mesh"]), folder, cores, limit)
        else:
            solved = measure_apart(solve_way, job, folder / "found.json", cores, limit)
        found.append({"way": way.title} | solved)
    return found


def _other(case: Case, mesh: Path, folder: Path, cores: Sequence[int], limit: float) -> Record:
    """The same problem on the same mesh by CalculiX, where it is installed."""
    from ...mesh import read_mesh

    code = CalculiX()
    if not code.version():
        return ended(MISSING, f"{code.name} is not installed")
    [pressure] = [load.value for load in case.loads if isinstance(load.value, float)]
    limits = Limits(seconds=limit, memory=float("inf"), cores=cores)
    deck = deck_of(case, read_mesh(mesh), code.layer)
    try:
        found = run_code(code, deck, folder, limits)
    except (SolveError, CrashError) as error:
        return ended(FAILED, f"CalculiX: {error}")
    if found.pressure is None or found.pressure.nodes is None:
        return ended(FAILED, "CalculiX: no contact pressure in its output")
    # The field covers all nodes, with zero where no contact is defined.
    slave = np.concatenate([b.nodes.ravel() for pair in deck.pairs for b in pair.slave])
    pressures = found.pressure.values[np.isin(found.pressure.nodes, slave)]
    return ended(SOLVED, "") | {
        "process": {
            "wall": found.seconds,
            "cpu": found.cpu_seconds,
            "peak_memory_mb": found.peak_memory_mb,
        },
        "times": {},
        "linear_solver": "its own",
        "pressure_max": float(np.abs(pressures / pressure - 1).max()),
        "resolved": resolution(pressure),
    }


def resolution(pressure: float) -> float:
    """The relative error of a pressure that CalculiX's output, of six digits, cannot show."""
    return 5e-6 * 10 ** floor(log10(pressure)) / pressure


def solve_way(job: Mapping[str, Any]) -> dict[str, Any]:
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
