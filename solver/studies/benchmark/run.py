"""Runs the benchmark: each way in a process of its own, one after the other, nothing beside it."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import floor, log10
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...codes.calculix import CalculiX
from ...codes.deck import deck_of
from ...codes.run import CrashError, Limits, run_code
from ...system.clock import now
from ...system.errors import SolveError
from ...system.package import COMMAND
from ...system.process import cores_for, run_apart
from ...system.progress import OUTCOME
from ..points import FAILED, MISSING, SOLVED, ended, measure_apart, surroundings
from ..scaling.description import ScalingPoint
from . import ways
from .description import Benchmark, WarmBatch, Way, WayComparison

Record = dict[str, Any]
_LOG = logging.getLogger(__name__)

_OFTEN = 5


@dataclass(frozen=True)
class Bench:
    """Where processes run: pinned to `cores`, for `limit` seconds at most, files in `folder`."""

    folder: Path
    cores: Sequence[int]
    limit: float

    def work(self, work: Callable[[Any], Record], **job: Any) -> Record:
        """What a function found in a process of its own; outcome and reason where it died."""
        return measure_apart(work, job, self.folder / "found.json", self.cores, self.limit)

    def often(self, *arguments: object) -> Record:
        """What a short command took: of a few times the one in the middle, by processor time."""
        times = [self.command(*arguments) for _ in range(_OFTEN)]
        return sorted(times, key=lambda took: took["cpu"])[_OFTEN // 2]

    def command(self, *arguments: object) -> Record:
        """What a command of the program took."""
        command = [*COMMAND, *map(str, arguments)]
        done = run_apart(command, self.cores, self.limit)
        return done.used | {"status": done.status}

    def mesh(self, case: Path, name: str) -> Path:
        """The mesh file of a case. Raises SolveError where it cannot be made."""
        mesh = self.folder / f"{name}.vtkhdf"
        if self.command("mesh", case, "-o", mesh)["status"] != 0:
            raise SolveError(f"{case}: no mesh")
        return mesh


@contextmanager
def bench(benchmark: Benchmark) -> Iterator[Bench]:
    """A place to run processes in, removed in the end."""
    with TemporaryDirectory(prefix="benchmark-") as folder:
        yield Bench(Path(folder), cores_for(benchmark.threads), benchmark.limit)


def run_benchmark(benchmark: Benchmark) -> Record:
    """Run all of it, logging what is about to be measured; the record (see `page`).

    Raises SolveError where a mesh cannot be made.
    """
    from ...system.provenance import gather

    started = now()
    with bench(benchmark) as place:
        about = surroundings(place.cores)
        record: Record = {
            "title": benchmark.title,
            **about,
            "machine": gather(benchmark.path, None),
            "calculix": CalculiX().version(),
            "comparisons": [],
        }
        for comparison in benchmark.comparisons:
            _LOG.log(OUTCOME, "measuring: %s", comparison.title)
            record["comparisons"].append(_compare(place, comparison))
        _LOG.log(OUTCOME, "measuring: %s", benchmark.batch.title)
        record["batch"] = _batch(place, benchmark.batch)
        _LOG.log(OUTCOME, "measuring: start of the program")
        record["start"] = _start(place, benchmark.batch.cases[0])
    return record | {"whole": now() - started}


def _compare(place: Bench, comparison: WayComparison) -> Record:
    """All ways to solve one mesh."""
    case = place.folder / "case.yaml"
    case.write_text(comparison.point.source(), encoding="utf-8")
    mesh = place.mesh(case, "mesh")
    found = [
        {"way": way.title} | _solve(place, comparison, way, case, mesh) for way in comparison.ways
    ]
    return {
        "title": comparison.title,
        "series": comparison.point.series.title,
        "size": comparison.point.size,
        "divisions": list(comparison.point.divisions),
        "repetitions": comparison.repetitions,
        "ways": found,
    }


def _solve(place: Bench, comparison: WayComparison, way: Way, case: Path, mesh: Path) -> Record:
    if way.program:
        return _other(place, comparison.point, mesh)
    return place.work(
        ways.solve,
        case=str(case),
        mesh=str(mesh),
        repetitions=comparison.repetitions,
        solver=way.solver,
        free=way.free,
        treatment=way.treatment,
        cures=way.cures,
        everything=way.everything,
    )


def _other(place: Bench, point: ScalingPoint, mesh: Path) -> Record:
    """The same problem on the same mesh by CalculiX, where it is installed."""
    from ...mesh import read_mesh

    code = CalculiX()
    if not code.version():
        return ended(MISSING, f"{code.name} is not installed")
    case = point.parsed(place.folder / "case.yaml")
    [pressure] = [load.value for load in case.loads if isinstance(load.value, float)]
    limits = Limits(seconds=place.limit, memory=float("inf"), cores=place.cores)
    try:
        found = run_code(code, deck_of(case, read_mesh(mesh)), place.folder, limits)
    except (SolveError, CrashError) as error:
        return ended(FAILED, f"CalculiX: {error}")
    if found.pressure is None:
        return ended(FAILED, "CalculiX: no contact pressure in its output")
    return ended(SOLVED, "") | {
        "process": {
            "wall": found.seconds,
            "cpu": found.cpu_seconds,
            "peak_memory_mb": found.peak_memory_mb,
        },
        "times": {},
        "linear_solver": "its own",
        "pressure_max": max(abs(float(value) / pressure - 1) for value in found.pressure.values),
        "resolved": resolution(pressure),
    }


def resolution(pressure: float) -> float:
    """The relative error of a pressure that CalculiX's output, of six digits, cannot show."""
    return 5e-6 * 10 ** floor(log10(pressure)) / pressure


def _batch(place: Bench, batch: WarmBatch) -> Record:
    """Cases in a process each, then in one process twice."""
    jobs = []
    for number, case in enumerate(batch.cases):
        jobs.append((str(case), str(place.mesh(case, f"batch-{number}"))))
    each = [
        {"case": case} | place.command("solve", case, "--mesh", mesh, "-o", f"{mesh}.r.vtkhdf")
        for case, mesh in jobs
    ]
    together = place.work(ways.batch, cases=jobs, folder=str(place.folder))
    return {"title": batch.title, "most": batch.most, "each": each, "together": together}


def _start(place: Bench, case: Path) -> Record:
    """The program's own start, and a case so small that it is most of its time."""
    mesh = place.mesh(case, "start")
    plane = place.often("solve", case, "--mesh", mesh, "-o", f"{mesh}.r.vtkhdf")
    return {"help": place.often("--help"), "plane": {"case": str(case)} | plane}
