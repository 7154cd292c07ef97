"""The study as data: `study.yaml`, and the case that each of its points is.

    title: Error against run time
    threads: 1                    # that every point may use
    repetitions: 5                # after a warm-up, in one process
    limit: 120                    # seconds that a point may take, start-up included
    treatments:                   # of the interface: what is set in the contact of a case
      - {name: lac, title: LAC, zone: {treatment: lac}}
      - name: lac-hexahedra       # only for these cell types on the slave side
        title: LAC into hexahedra
        zone: {treatment: lac, hexahedra: hexahedra}
        slaves: [HEXA8, HEXA20]
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
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from solver.case.descriptions import file_beside, refuse_twins, refuse_unknown
from solver.case.model import Case
from solver.case.reader import parse_case
from solver.case.schemas import STUDY_SCHEMA
from solver.case.yaml import read_mapping
from solver.mesh.catalogue import BY_NAME
from solver.mesh.size import Size, of_bodies, of_body
from solver.studies import FULL, QUICK
from solver.studies.points import PointStudy
from solver.system.errors import InputError

AUTO = "auto"
_START = 1.5  # seconds: libraries loaded, mesh made, record written


@dataclass(frozen=True)
class StudyTreatment:
    """A way to treat the interface; `slaves` are the only slave cells that it is for, if any."""

    name: str
    title: str
    zone: Mapping[str, Any]
    slaves: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reference:
    """The regular mesh that stands for an exact solution, and how far it may be off, by error."""

    cells: str
    divisions: tuple[int, int]
    uncertainty: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Problem:
    """A case file, the pairs (slave, master) of cell types put into it, and its levels."""

    name: str
    title: str
    description: str
    case: Path
    pairs: tuple[tuple[str, str], ...]
    levels: tuple[int, ...]
    reference: Reference | None = None

    @cached_property
    def template(self) -> dict[str, Any]:
        """What the case file says."""
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
    """What one measurement is of."""

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
    def seconds(self) -> float:
        """About how long the point takes."""
        return _START + (1 + self.repetitions) * self.mesh.seconds

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
        """The point as a case; InputError where there is no such treatment of these cells."""
        return self._case({"cells": self.slave}, {"cells": self.master}, self.level)

    def reference_case(self, reference: Reference) -> Case:
        """The problem on the mesh that stands for an exact solution."""
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
            if not treatment.slaves or slave in treatment.slaves
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
    content = read_mapping(path, STUDY_SCHEMA)
    treatments = tuple(
        StudyTreatment(t["name"], t["title"], t["zone"], tuple(t.get("slaves", ())))
        for t in content["treatments"]
    )
    problems = tuple(_problem(path, i, p) for i, p in enumerate(content["problems"]))
    refuse_twins(path, "treatments", treatments)
    refuse_twins(path, "problems", problems)
    study = Study(
        path=path,
        title=content["title"],
        size=size,
        threads=content["threads"],
        repetitions=content["repetitions"],
        limit=float(content["limit"]),
        treatments=treatments,
        problems=problems,
        varied=tuple(_varied(path, content, problems, treatments)),
    )
    return study if size == FULL else _quick(study, content)


def _problem(path: Path, index: int, item: Mapping[str, Any]) -> Problem:
    case = file_beside(path, f"problems[{index}].case", item["case"])
    pairs = tuple((slave, master) for slave, master in item["pairs"])
    for number, pair in enumerate(pairs):
        if BY_NAME[pair[0]].dim != BY_NAME[pair[1]].dim:
            key, allowed = f"problems[{index}].pairs[{number}]", "must be of one dimension"
            raise InputError(path, key, list(pair), allowed)
    reference = None
    if given := item.get("reference"):
        first, second = given["divisions"]
        reference = Reference(given["cells"], (first, second), given["uncertainty"])
    return Problem(
        name=item["name"],
        title=item["title"],
        description=item.get("description", ""),
        case=case,
        pairs=pairs,
        levels=tuple(sorted(item["levels"])),
        reference=reference,
    )


def _varied(
    path: Path,
    content: Mapping[str, Any],
    problems: Sequence[Problem],
    treatments: Sequence[StudyTreatment],
) -> Iterable[tuple[str, str, str, str, str]]:
    """The curves whose linear solver is chosen; refuses one whose problem or treatment is not."""
    known = {"problem": _by_name(problems), "treatment": _by_name(treatments)}
    for i, item in enumerate(content.get("linear_solvers", ())):
        for key, names in known.items():
            refuse_unknown(path, f"linear_solvers[{i}].{key}", item[key], key, names)
        for solver in item["solvers"]:
            yield item["problem"], *item["pair"], item["treatment"], solver


def _quick(study: Study, content: Mapping[str, Any]) -> Study:
    """The part under `quick`: a few pairs of some problems, the coarse levels alone."""
    if "quick" not in content:
        raise InputError(study.path, "quick", None, "this key is needed for the quick study")
    quick, problems = content["quick"], _by_name(study.problems)
    chosen = []
    for name, pairs in quick["pairs"].items():
        refuse_unknown(study.path, f"quick.pairs.{name}", name, "problem", problems, pairs)
        levels = problems[name].levels[: quick["levels"]]
        kept = tuple((slave, master) for slave, master in pairs)
        chosen.append(replace(problems[name], pairs=kept, levels=levels))
    return replace(
        study, repetitions=quick["repetitions"], problems=tuple(chosen), varied=(), size=QUICK
    )


def _by_name(items: Iterable[Any]) -> dict[str, Any]:
    return {item.name: item for item in items}
