"""The scaling family as data: `scaling.yaml`, and the case that each of its points is.

    title: Growth with size
    threads: 2                    # that every point may use, fewer where there are not as many
    limit: 600                    # seconds that a solve may take
    fit: [1.0e+5, 1.0e+6]         # exponents are fitted to the sizes from here to there
    series:
      - name: hexa8
        title: HEXA8
        case: templates/space.yaml     # a case file of the recipe `blocks`
        cells: HEXA8                   # of both blocks
        divisions: [5, 4]              # of slave and master: their proportion
        slab: false                    # blocks as thick as the finer one's cells are wide
        fit: [1.0e+4, 1.0e+5]          # of this series, where it is another
        sizes: [1.0e+4, 1.0e+5]        # unknowns that a mesh has at least
    goals:                        # numbers to reach, shown beside those measured
      - {title: …, series: hexa8, size: 1.0e+5, what: cpu, most: 12, unit: s, others: {…: 56}}
    quick:                        # a part of it: these series, no size above the largest
      {largest: 3.0e+4, series: [hexa8]}

A goal's `what` is `cpu` or `wall` (seconds of the whole process, from mesh file to result file),
`memory` (its peak, GB), `pressure` (the largest error), or the exponent of a stage: `growth of
solve`. A point is one series and size; its name is the path of its record: `hexa8/10000`.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from solver.case.descriptions import file_beside, refuse_twins, refuse_unknown
from solver.case.model import Case
from solver.case.reader import parse_case
from solver.case.schemas import SCALING_SCHEMA
from solver.case.yaml import read_mapping
from solver.mesh.catalogue import BY_NAME
from solver.mesh.size import Size, of_bodies, of_body
from solver.studies import FULL, QUICK
from solver.studies.points import PointStudy

GROWTH = "growth of "
_START = 5.0  # seconds: three interpreters, libraries loaded, small mesh


@dataclass(frozen=True)
class SizeSeries:
    """One mesh of two blocks at all sizes; `divisions` the proportion of slave and master."""

    name: str
    title: str
    case: Path
    cells: str
    divisions: tuple[int, int]
    slab: bool
    sizes: tuple[int, ...]
    fit: tuple[float, float]

    @cached_property
    def template(self) -> dict[str, Any]:
        """What the case file says."""
        return read_mapping(self.case)

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
    def seconds(self) -> float:
        """About how long the point takes."""
        return _START + self.mesh.seconds

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


@dataclass(frozen=True)
class Goal:
    """A number to reach; `others` has what other codes needed for the same work."""

    title: str
    series: str
    size: int | None
    what: str
    most: float
    unit: str
    others: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Scaling(PointStudy):
    """All of it."""

    series: tuple[SizeSeries, ...]
    goals: tuple[Goal, ...]

    @cached_property
    def points(self) -> tuple[ScalingPoint, ...]:
        """Every point, small ones of all series first: a run that is interrupted shows most."""
        every = [ScalingPoint(series, size) for series in self.series for size in series.sizes]
        return tuple(sorted(every, key=lambda point: point.size))


def read_scaling(path: Path, size: str = FULL) -> Scaling:
    """The family in a file, or its quick part; InputError says what is refused, what allowed."""
    content = read_mapping(path, SCALING_SCHEMA)
    series = tuple(
        _series(path, i, item, content["fit"]) for i, item in enumerate(content["series"])
    )
    names = [one.name for one in series]
    refuse_twins(path, "series", series)
    return Scaling(
        path=path,
        title=content["title"],
        size=size,
        threads=content["threads"],
        limit=float(content["limit"]),
        series=tuple(_quick(path, content["quick"], series)) if size == QUICK else series,
        goals=tuple(_goals(path, content.get("goals", ()), names)),
    )


def _series(path: Path, index: int, item: Mapping[str, Any], fit: Sequence[float]) -> SizeSeries:
    slave, master = item["divisions"]
    low, high = item.get("fit", fit)
    return SizeSeries(
        name=item["name"],
        title=item["title"],
        case=file_beside(path, f"series[{index}].case", item["case"]),
        cells=item["cells"],
        divisions=(slave, master),
        slab=item.get("slab", False),
        sizes=tuple(sorted(int(size) for size in item["sizes"])),
        fit=(float(low), float(high)),
    )


def _quick(
    path: Path, quick: Mapping[str, Any], series: Sequence[SizeSeries]
) -> Iterator[SizeSeries]:
    """The small sizes of some series."""
    known = {one.name: one for one in series}
    for i, name in enumerate(quick["series"]):
        refuse_unknown(path, f"quick.series[{i}]", name, "series", known)
        small = tuple(size for size in known[name].sizes if size <= quick["largest"])
        yield replace(known[name], sizes=small)


def _goals(path: Path, items: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Iterator[Goal]:
    for i, item in enumerate(items):
        refuse_unknown(path, f"goals[{i}].series", item["series"], "series", names)
        yield Goal(
            title=item["title"],
            series=item["series"],
            size=int(item["size"]) if "size" in item else None,
            what=item["what"],
            most=float(item["most"]),
            unit=item["unit"],
            others=item.get("others", {}),
        )
