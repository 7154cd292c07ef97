"""The scaling family as data: `scaling.yaml`, and the case that each of its points is.

    title: Scaling
    threads: 2                    # that every point may use, fewer where there are not as many
    limit: 600                    # seconds that a solve may take
    fit: [1.0e+5, 1.0e+6]         # exponents are fitted to the sizes from here to there
    series:
      - name: hexa8
        title: HEXA8
        case: templates/space.yaml     # a case file of the recipe `blocks` or `hertz`
        cells: HEXA8                   # of both blocks
        divisions: [5, 4]              # of slave and master: their proportion
        slab: false                    # blocks as thick as the finer one's cells are wide
        fit: [1.0e+4, 1.0e+5]          # of this series, where it is another
        threads: 1                     # of this series, to compare with the same on more
        sizes: [1.0e+4, 1.0e+5]        # unknowns that a mesh has at least
    goals:                        # numbers to reach, shown beside those measured
      - {title: …, series: hexa8, size: 1.0e+5, what: cpu, most: 12, unit: s, others: {…: 56}}
      - {…, series: sphere, over: hexa8, …}  # times what the other series takes at the same size
    quick:                        # a part of it: these series, no size above the largest
      {largest: 3.0e+4, series: [hexa8]}
    large:                        # beyond it: these series at other sizes, with another limit
      {limit: 3600, sizes: [1.0e+7], series: [hexa8]}

A goal's `what` is `cpu` or `wall` (seconds of the whole process, from mesh file to result file),
`memory` (its peak, GB), `pressure` (the largest error), `statuses` (solves for the contact status),
or the exponent of a stage: `growth of solve`. A point is one series and size; its name is the path
of its record: `hexa8/10000`.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, field, structs

from ...case.model import Case
from ...case.reader import parse_case
from ...case.typed import (
    ONCE,
    Positive,
    Section,
    Text,
    read_as,
    refuse_duplicates,
    refuse_unknown,
)
from ...case.yaml import read_mapping
from ...mesh.catalogue import BY_NAME
from ...mesh.size import Size, of_bodies, of_body
from .. import FULL, LARGE, QUICK
from ..keys import Count, Name, Seconds, Unknowns
from ..points import PointStudy

GROWTH = "growth of "
_LARGEST_COUNTED = 2_000_000  # unknowns
Division = Annotated[int, Meta(ge=1, le=1000)]
SizeRange = Annotated[
    tuple[Unknowns, Unknowns], Meta(description="a list of two sizes, from and to")
]
_What = Annotated[
    str,
    Meta(
        pattern=r"^(cpu|wall|memory|pressure|statuses|growth of [a-z]+)$(?!\n)",
        description="cpu, wall, memory, pressure, statuses, or `growth of` and a stage",
    ),
]


class SizeSeries(Section, frozen=True, dict=True):
    """One mesh of two blocks at all sizes; `divisions` the proportion of slave and master."""

    name: Name
    title: Text
    case: Path
    cells: Literal["TRIA3", "TRIA6", "QUAD4", "QUAD8", "TETRA4", "TETRA10", "HEXA8", "HEXA20"]
    divisions: Annotated[
        tuple[Division, Division], Meta(description="a list of two whole numbers, 1 to 1000")
    ]
    sizes: Annotated[tuple[Unknowns, ...], ONCE]
    slab: bool = False
    fit: SizeRange = (0, 0)
    threads: Count | None = None

    @cached_property
    def template(self) -> dict[str, Any]:
        """The content of the case file."""
        return read_mapping(self.case)

    @property
    def problem(self) -> tuple[Any, ...]:
        """What its meshes are of: series of the same differ in sizes and threads."""
        return self.case, self.cells, self.divisions, self.slab

    @property
    def dim(self) -> int:
        """Dimension of the mesh."""
        return BY_NAME[self.cells].dim


@dataclass(frozen=True)
class ScalingPoint:
    """One series at one size (unknowns that the mesh has at least)."""

    series: SizeSeries
    size: int

    @property
    def name(self) -> str:
        """The path of the point's record, without its suffix."""
        return f"{self.series.name}/{self.size}"

    @cached_property
    def divisions(self) -> tuple[list[int], list[int]]:
        """The divisions of slave and master: the coarsest mesh that has the unknowns."""
        for finer in range(1, self.size + 1):
            found = self._divisions(finer)
            if self._mesh(found).unknowns >= self.size:
                return found
        raise AssertionError("every mesh has more unknowns than divisions")

    def _mesh(self, divisions: Sequence[Sequence[int]]) -> Size:
        return of_bodies([of_body(self.series.cells, block) for block in divisions])

    @property
    def mesh(self) -> Size:
        """The size of the point's mesh."""
        return self._mesh(self.divisions)

    @property
    def counts_bytes(self) -> bool:
        """Whether a further solve counts bytes: that of the largest mesh in 3D.

        Not where it would take minutes: of flat blocks and of ten million unknowns.
        """
        largest = self.size == max(self.series.sizes) and self.size <= _LARGEST_COUNTED
        return self.series.dim == 3 and largest and not self.series.slab

    def _divisions(self, finer: int) -> tuple[list[int], list[int]]:
        proportion, dim = self.series.divisions, self.series.dim
        counts = [max(1, round(finer * share / max(proportion))) for share in proportion]
        slave, master = ([n] * (dim - 1) + [1] if self.series.slab else [n] * dim for n in counts)
        return slave, master

    def source(self) -> str:
        """The point's case file."""
        template, (slave, master) = self.series.template, self.divisions
        mesh = dict(template["mesh"])
        for side, divisions in (("bottom", slave), ("top", master)):
            mesh[side] = {"cells": self.series.cells, "divisions": divisions}
        content = {**template, "name": self.name.replace("/", "-"), "mesh": mesh}
        if self.series.slab:
            width = float(mesh["size"])
            thickness = width / max(slave + master)
            mesh["size"] = [width] * (self.series.dim - 1) + [thickness]
            solution = {**template["reference"]["solution"], "base": -thickness}
            content["reference"] = {**template["reference"], "solution": solution}
        return json.dumps(content, indent=1)

    def parsed(self, path: Path) -> Case:
        """The point's case, as of a case file at `path`."""
        return parse_case(self.source(), path)


class Goal(Section, frozen=True):
    """A number to reach; `others` has what other codes needed for the same work.

    `over`: it is a ratio to that of another series at the same size.
    """

    title: Text
    series: Name
    what: _What
    most: Positive
    unit: str
    size: Unknowns | None = None
    over: Name | None = None
    others: dict[str, float] = field(default_factory=dict)


class _QuickScaling(Section, frozen=True):
    largest: Unknowns
    series: Annotated[tuple[Name, ...], ONCE]


class _LargeScaling(Section, frozen=True):
    limit: Seconds
    sizes: Annotated[tuple[Unknowns, ...], ONCE]
    series: Annotated[tuple[Name, ...], ONCE]


class ScalingFile(Section, frozen=True):
    """The keys of `scaling.yaml`."""

    title: Text
    threads: Count
    limit: Seconds
    fit: SizeRange
    series: Annotated[tuple[SizeSeries, ...], Meta(min_length=1)]
    quick: _QuickScaling
    large: _LargeScaling
    goals: tuple[Goal, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_duplicates("series", self.series)
        names = {series.name for series in self.series}
        for i, goal in enumerate(self.goals):
            refuse_unknown(("goals", i, "series"), goal.series, "series", names)
            refuse_unknown(("goals", i, "over"), goal.over or goal.series, "series", names)
        for key, part in (("quick", self.quick), ("large", self.large)):
            for i, name in enumerate(part.series):
                refuse_unknown((key, "series", i), name, "series", names)


@dataclass(frozen=True, kw_only=True)
class Scaling(PointStudy):
    """All of it."""

    series: tuple[SizeSeries, ...]
    goals: tuple[Goal, ...]

    @cached_property
    def points(self) -> tuple[ScalingPoint, ...]:
        """Every point, small ones of all series first: a run that is interrupted shows most."""
        every = [ScalingPoint(series, int(size)) for series in self.series for size in series.sizes]
        return tuple(sorted(every, key=lambda point: point.size))


def read_scaling(path: Path, size: str = FULL) -> Scaling:
    """The family in a file, its quick or its large part; InputError says what is refused."""
    content = read_as(ScalingFile, read_mapping(path), path)
    large = content.large if size == LARGE else None
    largest = content.quick.largest if size == QUICK else math.inf
    part = content.quick if size == QUICK else large
    series = [
        structs.replace(
            one,
            sizes=tuple(sorted(int(n) for n in (large or one).sizes if n <= largest)),
            fit=one.fit if any(one.fit) else content.fit,
        )
        for one in content.series
        if part is None or one.name in part.series
    ]
    return Scaling(
        path=path,
        title=content.title,
        size=size,
        threads=content.threads,
        limit=(large or content).limit,
        series=tuple(series),
        goals=content.goals,
    )
