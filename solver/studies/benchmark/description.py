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
          - {title: CHOLMOD, solver: cholmod}        # the linear solver
          - {title: without MKL, free: true}         # free software alone
          - {title: not cut, treatment: uncut}       # of the interface
          - {title: no cures, cures: false}          # see `solver.simulation.options`
          - {title: nothing left out, everything: true}   # see `solver.simulation.options`
          - {title: CalculiX, program: calculix}     # another code
    batch: {title: …, most: 2, cases: [case.yaml]}   # in one warm process, and one by one
    quick: {size: 1000}           # of every mesh, for a first look

`most` is the number of seconds that all cases of the batch together should not exceed.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from ...case.typed import Section, Text, read_as
from ...case.yaml import read_mapping
from ...system.errors import InputError, hint
from .. import QUICK
from ..keys import Count, Seconds, Unknowns
from ..scaling.description import ScalingPoint, read_scaling


class Way(Section, frozen=True):
    """One way to solve; see the module's text."""

    title: Text
    solver: Literal["auto", "multigrid", "pardiso", "cholmod", "superlu"] = "auto"
    free: bool = False
    treatment: Text = "lac"
    cures: bool = True
    everything: bool = False
    program: Literal["", "calculix"] = ""


class _Comparison(Section, frozen=True):
    title: Text
    series: Text
    size: Unknowns
    repetitions: Annotated[int, Meta(ge=0, le=100, description="a whole number, 0 to 100")]
    ways: Annotated[tuple[Way, ...], Meta(min_length=1)]


class WarmBatch(Section, frozen=True):
    """Cases solved in one process and in one each; `most` seconds are the goal."""

    title: Text
    most: Seconds
    cases: Annotated[tuple[Path, ...], Meta(min_length=1)]


class _QuickBenchmark(Section, frozen=True):
    size: Unknowns


class BenchmarkFile(Section, frozen=True):
    """The keys of `benchmark.yaml`."""

    title: Text
    threads: Count
    limit: Seconds
    scaling: Path
    comparisons: tuple[_Comparison, ...]
    batch: WarmBatch
    quick: _QuickBenchmark


@dataclass(frozen=True)
class WayComparison:
    """One mesh, solved in several ways."""

    title: str
    point: ScalingPoint
    repetitions: int
    ways: tuple[Way, ...]


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
    content = read_as(BenchmarkFile, read_mapping(path), path)
    small = int(content.quick.size) if size == QUICK else None
    known = {series.name: series for series in read_scaling(content.scaling).series}
    comparisons = []
    for i, item in enumerate(content.comparisons):
        if item.series not in known:
            problem = f"no such series; {hint(item.series, known)}"
            raise InputError(path, f"comparisons[{i}].series", item.series, problem)
        point = ScalingPoint(known[item.series], small or int(item.size))
        comparisons.append(WayComparison(item.title, point, item.repetitions, item.ways))
    return Benchmark(
        path=path,
        title=content.title,
        threads=content.threads,
        limit=content.limit,
        comparisons=tuple(comparisons),
        batch=content.batch,
    )
