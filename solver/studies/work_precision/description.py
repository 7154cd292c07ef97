"""The study as data: `study.yaml`, and the case that each of its points is.

    title: Error against run time
    threads: 1                    # that every point may use
    repetitions: 5                # after a warm-up, in one process
    limit: 120                    # seconds that a point may take, start-up included
    treatments:                   # of the interface: what is set in the contact of a case
      - {name: lac, title: LAC, zone: {treatment: lac}}
      - name: lac-hexahedra       # only for these cell types on the slave side
        title: LAC cut into hexahedra
        zone: {treatment: lac, hexahedra: hexahedra}
        slaves: [HEXA8, HEXA20]
        problems: [patch-2d]      # and only in these problems
    problems:
      - name: patch-2d
        title: Patch test
        case: templates/patch-2d.yaml      # a case file; its cell types are replaced by the pair's
        pairs: [[TRIA3, QUAD4]]            # slave, master
        levels: [1, 2, 4]                  # what the divisions of the recipe are multiplied by
        reference:                         # where there is no exact solution
          {cells: QUAD9, divisions: [96, 96], uncertainty: {pressure_l2: 1.0e-4}}
    linear_solvers:               # varied here, and left to the program elsewhere
      - {problem: patch-2d, pair: [TRIA3, QUAD4], treatment: lac, solvers: [cholmod, superlu]}
    quick:                        # a part of it, for a first look
      {repetitions: 1, levels: 3, pairs: {patch-2d: [[TRIA3, QUAD4]]}}

A point is one problem, pair, treatment, level and linear solver. Its name is the path of its result
file: `patch-2d/tria3-quad4/lac/4`, `patch-2d/tria3-quad4/lac+cholmod/4`.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, structs

from ...case.model import Case
from ...case.reader import parse_case
from ...case.typed import (
    ONCE,
    FieldError,
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
from ...system.errors import InputError
from .. import FULL
from ..keys import Cell, Count, Counts, ErrorName, Name, Seconds
from ..points import PointStudy

AUTO = "auto"
_Division = Annotated[int, Meta(ge=2, le=1024, description="a whole number from 2 to 1024")]
Pair = Annotated[tuple[Cell, Cell], Meta(description="a list of two cell types: slave, master")]


class StudyTreatment(Section, frozen=True):
    """A way to treat the interface; `slaves`, `problems`: the only ones that it is for, if any."""

    name: Name
    title: Text
    zone: Annotated[dict[str, Any], Meta(description="what is set in the contact of a case")]
    slaves: Annotated[tuple[Cell, ...], ONCE] = ()
    problems: Annotated[tuple[Name, ...], ONCE] = ()

    def is_for(self, problem: str, slave: str) -> bool:
        """Whether it is measured in that problem on those slave cells."""
        return problem in (self.problems or [problem]) and slave in (self.slaves or [slave])


class Reference(Section, frozen=True):
    """The regular mesh that replaces an exact solution, and its possible error by norm."""

    cells: Literal["QUAD4", "QUAD8", "QUAD9"]
    divisions: Annotated[
        tuple[_Division, _Division], Meta(description="a list of two whole numbers, 2 at least")
    ]
    uncertainty: dict[ErrorName, Positive]


class Problem(Section, frozen=True, dict=True):
    """A case file, the pairs (slave, master) of cell types put into it, and its levels."""

    name: Name
    title: Text
    case: Path
    pairs: Annotated[tuple[Pair, ...], ONCE]
    levels: Counts
    description: str = ""
    reference: Reference | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for i, (slave, master) in enumerate(self.pairs):
            if BY_NAME[slave].dim != BY_NAME[master].dim:
                raise FieldError(("pairs", i), "must be of one dimension")

    @cached_property
    def template(self) -> dict[str, Any]:
        """The content of the case file."""
        return read_mapping(self.case)

    @property
    def sides(self) -> tuple[str, str]:
        """The sections of the mesh that are slave and master."""
        zone = self.template["contact"][0]
        slave, master = (zone[role].removesuffix("_contact") for role in ("slave", "master"))
        return slave, master

    @property
    def divisions(self) -> tuple[list[int], list[int]]:
        """The divisions of slave and master at level 1."""
        slave, master = (self.template["mesh"][side]["divisions"] for side in self.sides)
        return slave, master


@dataclass(frozen=True)
class StudyPoint:
    """One measurement."""

    problem: Problem
    slave: str
    master: str
    treatment: StudyTreatment
    level: int
    repetitions: int
    linear_solver: str = AUTO

    @property
    def mesh(self) -> Size:
        """About the size of its mesh."""
        pairs = zip((self.slave, self.master), self.problem.divisions, strict=True)
        return of_bodies([of_body(cells, divisions, self.level) for cells, divisions in pairs])

    @property
    def pair(self) -> str:
        """The cell types, slave first."""
        return f"{self.slave}–{self.master}"

    @property
    def name(self) -> str:
        """The path of the point's result file, without its suffix."""
        pair = f"{self.slave}-{self.master}".lower()
        solver = "" if self.linear_solver == AUTO else f"+{self.linear_solver}"
        return f"{self.problem.name}/{pair}/{self.treatment.name}{solver}/{self.level}"

    def case(self) -> Case:
        """The point as a case; InputError if the treatment does not support these cells."""
        return self._case({"cells": self.slave}, {"cells": self.master}, self.level)

    def reference_case(self, reference: Reference) -> Case:
        """The problem on the mesh that replaces an exact solution."""
        section = {"cells": reference.cells, "divisions": list(reference.divisions)}
        return self._case(section, section, 1)

    def _case(self, slave: Mapping[str, Any], master: Mapping[str, Any], level: int) -> Case:
        template = self.problem.template
        mesh = template["mesh"] | {"refine": level}
        for side, section in zip(self.problem.sides, (slave, master), strict=True):
            mesh[side] = mesh[side] | section
        content = template | {
            "name": f"{self.problem.name}-{self.treatment.name}",
            "mesh": mesh,
            "contact": [zone | self.treatment.zone for zone in template["contact"]],
        }
        return parse_case(json.dumps(content), self.problem.case)


class _SolverChoice(Section, frozen=True):
    problem: Name
    pair: Pair
    treatment: Name
    solvers: Annotated[tuple[Literal["cholmod", "superlu"], ...], ONCE]


class _QuickStudy(Section, frozen=True):
    repetitions: Count
    levels: Count
    pairs: Annotated[dict[str, Annotated[tuple[Pair, ...], ONCE]], Meta(min_length=1)]


class StudyFile(Section, frozen=True):
    """The keys of `study.yaml`."""

    title: Text
    threads: Count
    repetitions: Count
    limit: Seconds
    treatments: Annotated[tuple[StudyTreatment, ...], Meta(min_length=1)]
    problems: Annotated[tuple[Problem, ...], Meta(min_length=1)]
    linear_solvers: tuple[_SolverChoice, ...] = ()
    quick: _QuickStudy | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_duplicates("treatments", self.treatments)
        refuse_duplicates("problems", self.problems)
        problems, treatments = _by_name(self.problems), _by_name(self.treatments)
        for i, treatment in enumerate(self.treatments):
            for name in treatment.problems:
                refuse_unknown(("treatments", i, "problems"), name, "problem", problems)
        for i, item in enumerate(self.linear_solvers):
            key = ("linear_solvers", i)
            refuse_unknown((*key, "problem"), item.problem, "problem", problems)
            refuse_unknown((*key, "treatment"), item.treatment, "treatment", treatments)
        for name in self.quick.pairs if self.quick else ():
            refuse_unknown(("quick", "pairs", name), name, "problem", problems)


@dataclass(frozen=True, kw_only=True)
class Study(PointStudy):
    """All of it. `varied`: (problem, slave, master, treatment, linear solver) beside `auto`."""

    repetitions: int
    treatments: tuple[StudyTreatment, ...]
    problems: tuple[Problem, ...]
    varied: tuple[tuple[str, str, str, str, str], ...] = ()

    @cached_property
    def points(self) -> tuple[StudyPoint, ...]:
        """Every point, level by level within each curve."""
        curves = [
            (problem, slave, master, treatment, AUTO)
            for problem in self.problems
            for slave, master in problem.pairs
            for treatment in self.treatments
            if treatment.is_for(problem.name, slave)
        ]
        problems, treatments = _by_name(self.problems), _by_name(self.treatments)
        curves += [(problems[p], s, m, treatments[t], solver) for p, s, m, t, solver in self.varied]
        return tuple(
            StudyPoint(p, s, m, t, k, self.repetitions, solver)
            for p, s, m, t, solver in curves
            for k in p.levels
        )


def read_study(path: Path, size: str = FULL) -> Study:
    """The study in a file, or its quick part; InputError says what is refused, what allowed."""
    content = read_as(StudyFile, read_mapping(path), path)
    problems = tuple(
        structs.replace(problem, levels=tuple(sorted(problem.levels)))
        for problem in content.problems
    )
    study = Study(
        path=path,
        title=content.title,
        size=size,
        threads=content.threads,
        repetitions=content.repetitions,
        limit=content.limit,
        treatments=content.treatments,
        problems=problems,
        varied=tuple(
            (item.problem, *item.pair, item.treatment, solver)
            for item in content.linear_solvers
            for solver in item.solvers
        ),
    )
    if size == FULL:
        return study
    if content.quick is None:
        raise InputError(path, "quick", None, "this key is needed for the quick study")
    known, quick = _by_name(problems), content.quick
    chosen = tuple(
        structs.replace(known[name], pairs=pairs, levels=known[name].levels[: quick.levels])
        for name, pairs in quick.pairs.items()
    )
    return replace(study, repetitions=quick.repetitions, problems=chosen, varied=())


def _by_name(items: Iterable[Any]) -> dict[str, Any]:
    return {item.name: item for item in items}
