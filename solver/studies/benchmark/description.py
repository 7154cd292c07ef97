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
          - {title: no cures, cures: false}          # see `solver.simulation.cures`
          - {title: nothing left out, everything: true}   # see `solver.simulation.skips`
          - {title: CalculiX, program: calculix}     # another code
    growth: [{series: hexa8, sizes: [1.0e+5, 3.0e+5]}]
    batch: {title: …, most: 2, cases: [case.yaml]}   # in one warm process, and one by one
    quick: {size: 1000}           # of every mesh, for a first look; growth from half of it

`most` is the number of seconds that all cases of the batch together should not exceed.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, structs

from solver.case.typed import ONCE, FieldError, Section, Text, read_as
from solver.case.yaml import read_mapping
from solver.studies import QUICK
from solver.studies.keys import Count, Seconds, Unknowns
from solver.studies.scaling.description import Scaling, ScalingPoint, SizeSeries, read_scaling
from solver.system.errors import InputError, hint


class Way(Section, frozen=True):
    """One way to solve; see the module's text."""

    title: Text
    solver: Literal["auto", "multigrid", "pardiso", "rslab", "cholmod", "superlu"] = "auto"
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


class _Growth(Section, frozen=True):
    series: Text
    sizes: Annotated[tuple[Unknowns, ...], ONCE]

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.sizes) < 2:
            raise FieldError(("sizes",), "must be a list of two sizes or more")


class WarmBatch(Section, frozen=True):
    """Cases solved in one process and in one each; `most` seconds are the goal."""

    title: Text
    most: Seconds
    cases: Annotated[tuple[Path, ...], Meta(min_length=1)]


class _Quick(Section, frozen=True):
    size: Unknowns


class BenchmarkFile(Section, frozen=True):
    """The keys of `benchmark.yaml`."""

    title: Text
    threads: Count
    limit: Seconds
    scaling: Path
    comparisons: tuple[_Comparison, ...]
    growth: tuple[_Growth, ...]
    batch: WarmBatch
    quick: _Quick


@dataclass(frozen=True)
class WayComparison:
    """One mesh, solved in several ways."""

    title: str
    point: ScalingPoint
    repetitions: int
    ways: tuple[Way, ...]


@dataclass(frozen=True)
class Benchmark:
    """All of it. `growth`: series, their sizes those to be measured."""

    path: Path
    title: str
    threads: int
    limit: float
    scaling: Scaling
    comparisons: tuple[WayComparison, ...]
    growth: tuple[SizeSeries, ...]
    batch: WarmBatch


def read_benchmark(path: Path, size: str) -> Benchmark:
    """The benchmark in a file, or its quick version; InputError says what is refused."""
    content = read_as(BenchmarkFile, read_mapping(path), path)
    scaling = read_scaling(content.scaling)
    small = int(content.quick.size) if size == QUICK else None
    known = {series.name: series for series in scaling.series}

    def find(name: str, key: str, *sizes: float) -> SizeSeries:
        if name not in known:
            raise InputError(path, f"{key}.series", name, f"no such series; {hint(name, known)}")
        return structs.replace(known[name], sizes=tuple(sorted(map(int, sizes))))

    comparisons = []
    for i, item in enumerate(content.comparisons):
        unknowns = small or int(item.size)
        point = ScalingPoint(find(item.series, f"comparisons[{i}]", unknowns), unknowns)
        comparisons.append(WayComparison(item.title, point, item.repetitions, item.ways))
    growth = [
        find(item.series, f"growth[{i}]", *([small // 2, small] if small else item.sizes))
        for i, item in enumerate(content.growth)
    ]
    return Benchmark(
        path=path,
        title=content.title,
        threads=content.threads,
        limit=content.limit,
        scaling=replace(scaling, threads=content.threads, limit=content.limit),
        comparisons=tuple(comparisons),
        growth=tuple(growth),
        batch=content.batch,
    )
