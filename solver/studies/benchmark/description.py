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
- {title: not cut, treatment: uncut}       # of the interface
- {title: no cures, cures: false}          # see `solver.simulation.options`
- {title: nothing left out, everything: true}   # see `solver.simulation.options`
- {title: CalculiX, program: calculix}     # another code
quick: {size: 1000}           # of every mesh, for a first look
"""

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, structs

from ...case.typed import Section, Text, read_as
from ...case.yaml import read_mapping
from ...system.errors import InputError, hint
from .. import QUICK
from ..keys import Count, Seconds, Unknowns
from ..scaling.description import read_scaling


class Way(Section, frozen=True):
    """One way to solve; see the module's text."""

    title: Text
    solver: Literal["auto", "multigrid", "cholmod", "superlu"] = "auto"
    treatment: Text = "lac"
    cures: bool = True
    everything: bool = False
    program: Literal["", "calculix"] = ""


class WayComparison(Section, frozen=True):
    """One mesh of a series of the scaling family, solved in several ways."""

    title: Text
    series: Text
    size: Unknowns
    repetitions: Annotated[int, Meta(ge=0, le=100, description="a whole number, 0 to 100")]
    ways: Annotated[tuple[Way, ...], Meta(min_length=1)]


class _QuickBenchmark(Section, frozen=True):
    size: Unknowns


class Benchmark(Section, frozen=True):
    """The keys of `benchmark.yaml`."""

    title: Text
    threads: Count
    limit: Seconds
    scaling: Path
    comparisons: tuple[WayComparison, ...]
    quick: _QuickBenchmark


def read_benchmark(path: Path, size: str) -> Benchmark:
    """The benchmark in a file, or its quick version; InputError says what is refused."""
    content = read_as(Benchmark, read_mapping(path), path)
    known = {series.name for series in read_scaling(content.scaling).series}
    for i, item in enumerate(content.comparisons):
        if item.series not in known:
            problem = f"no such series; {hint(item.series, known)}"
            raise InputError(path, f"comparisons[{i}].series", item.series, problem)
    if size != QUICK:
        return content
    small = (structs.replace(each, size=content.quick.size) for each in content.comparisons)
    return structs.replace(content, comparisons=tuple(small))
