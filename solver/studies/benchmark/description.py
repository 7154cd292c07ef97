"""The benchmark as data: `benchmark.yaml`.

    title: Benchmark
    threads: 2                    # that every process may use, fewer where there are not as many
    limit: 300                    # seconds that a process may take
    scaling: scaling.yaml         # whose series the meshes are
    comparisons:                  # the same mesh, solved in several ways; ratios to the first one
      - title: Linear solver in space
        series: hexa8
        size: 1.0e+5              # unknowns at least
        repetitions: 1            # after the first solve, in one process; 0: the first one counts
        ways:
          - {title: as chosen}
          - {title: rslab, solver: rslab}            # the linear solver
          - {title: without MKL, free: true}         # free software alone
          - {title: not cut, treatment: uncut}       # of the interface
          - {title: no cures, cures: false}          # see `solver.simulation.options`
          - {title: nothing left out, everything: true}   # see `solver.simulation.options`
          - {title: CalculiX, program: calculix}     # another code
    batch: {title: …, most: 2, cases: [case.yaml]}   # in one warm process, and one by one
    quick: {size: 1000}           # of every mesh, for a first look

`most` is the number of seconds that all cases of the batch together should not exceed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from solver.case.descriptions import file_beside, refuse_unknown
from solver.case.schemas import BENCHMARK_SCHEMA
from solver.case.yaml import read_mapping
from solver.studies import QUICK
from solver.studies.scaling.description import ScalingPoint, read_scaling


@dataclass(frozen=True)
class Way:
    """One way to solve; see the module's text."""

    title: str
    solver: str = "auto"
    free: bool = False
    treatment: str = "lac"
    cures: bool = True
    everything: bool = False
    program: str = ""


@dataclass(frozen=True)
class WayComparison:
    """One mesh, solved in several ways."""

    title: str
    point: ScalingPoint
    repetitions: int
    ways: tuple[Way, ...]


@dataclass(frozen=True)
class WarmBatch:
    """Cases solved in one process and in one each; `most` seconds are the goal."""

    title: str
    most: float
    cases: tuple[Path, ...]


@dataclass(frozen=True)
class Benchmark:
    """All of it."""

    path: Path
    title: str
    threads: int
    limit: float
    comparisons: tuple[WayComparison, ...]
    batch: WarmBatch


def read_benchmark(path: Path, size: str) -> Benchmark:
    """The benchmark in a file, or its quick version; InputError says what is refused."""
    content = read_mapping(path, BENCHMARK_SCHEMA)
    small = int(content["quick"]["size"]) if size == QUICK else None
    known = {
        series.name: series for series in read_scaling(path.parent / content["scaling"]).series
    }
    comparisons = []
    for i, item in enumerate(content["comparisons"]):
        refuse_unknown(path, f"comparisons[{i}].series", item["series"], "series", known)
        point = ScalingPoint(known[item["series"]], small or int(item["size"]))
        ways = tuple(Way(**way) for way in item["ways"])
        comparisons.append(WayComparison(item["title"], point, item["repetitions"], ways))
    return Benchmark(
        path=path,
        title=content["title"],
        threads=content["threads"],
        limit=float(content["limit"]),
        comparisons=tuple(comparisons),
        batch=_batch(path, content["batch"]),
    )


def _batch(path: Path, item: Mapping[str, Any]) -> WarmBatch:
    cases = tuple(
        file_beside(path, f"batch.cases[{i}]", case) for i, case in enumerate(item["cases"])
    )
    return WarmBatch(item["title"], float(item["most"]), cases)
