"""Refinement ladders as data: `orders.yaml` in the folder of a family of cases.

    title: Contact on a parabola
    levels: [1, 2, 4, 8, 16]      # what the divisions of the case's recipe are multiplied by
    least:                        # slopes that must be reached, by degree of the slave's cells
      linear: {displacement_l2: 1.9, pressure_l2: 0.95}
    theory:                       # where the family's own differs: [guaranteed, best]
      quadratic: {pressure_max: [0.5, 1.0]}
    reference_code: {name: code_aster, version: …, remark: …}
    shortfalls: why some slopes stay below theory, where they do
    smooth: true                  # a smooth pressure: goals of recovery are shown (`gains.GOALS`)
    ladders:
      - {case: tria3.yaml, reference_code: {displacement_l2: 1.998, pressure_l2: 1.041}}
      - {case: press-fit.yaml, problem: press fit}    # has plots of its own
      - {case: lying.yaml, label: PENTA6 on its side}  # else the slave's cells, and their cut
      - {case: hexa20.yaml, hexahedra: hexahedra, levels: [1, 2, 3, 4]}
      - {case: tria6.yaml, recovery: quadratic, least: {pressure_l2: 2.8}}   # the ladder's own
      - {case: sphere.yaml, finest: {peak: 0.01}}     # largest error allowed at the finest level

A ladder is solved in every direction of its case.
"""

from pathlib import Path
from typing import Annotated

from msgspec import Meta, field, structs

from ...case import job_name
from ...case.typed import Number, Positive, Section, read_as
from ...case.yaml import read_mapping
from ..keys import Counts, Cut, Degree, ErrorName, Recovered

Slopes = dict[ErrorName, Number]
_Orders = Annotated[
    tuple[float | None, float | None],
    Meta(description="[guaranteed, best], null where not known"),
]


class Ladder(Section, frozen=True):
    """One case file, and what the divisions of its recipe are multiplied by, level by level.

    Ladders of the same `problem` share their plots; `label` distinguishes those of the same cells.
    `observed` are the reference code's own slopes by error, `finest` the largest errors allowed at
    the finest level; `least` takes the place of the family's own.
    """

    case: Path
    levels: Counts = ()
    problem: str = ""
    label: str = ""
    hexahedra: Cut | None = None
    recovery: Recovered | None = None
    observed: Slopes = field(name="reference_code", default_factory=dict)
    finest: dict[ErrorName, Positive] = field(default_factory=dict)
    least: Slopes = field(default_factory=dict)

    def folder(self, swapped: bool) -> str:
        """The name of the folder in which the results of one direction lie."""
        return job_name(self.case.stem, swapped, self.hexahedra, self.recovery)


class ReferenceCode(Section, frozen=True):
    """The code whose slopes are shown beside ours."""

    name: str = "reference code"
    version: str = ""
    remark: str = ""


class LaddersFile(Section, frozen=True):
    """The keys of `orders.yaml`.

    `least` and `theory` go by degree and error; `theory` holds only what differs from
    `theory.THEORY`. `shortfalls` says why slopes stay below theory; `smooth`: the pressure is, so
    that the goals of recovery apply. Where `title` or `description` is empty, `family.yaml` has it.
    """

    levels: Counts
    ladders: Annotated[tuple[Ladder, ...], Meta(min_length=1)]
    title: str = ""
    description: str = ""
    shortfalls: str = ""
    smooth: bool = False
    least: dict[Degree, Slopes] = field(default_factory=dict)
    theory: dict[Degree, dict[ErrorName, _Orders]] = field(default_factory=dict)
    reference_code: ReferenceCode = ReferenceCode()


class LadderFamily(LaddersFile, frozen=True, kw_only=True):
    """The ladders of a family, each with its levels."""

    folder: Path

    @property
    def name(self) -> str:
        """The family's name, from its folder."""
        return self.folder.name


def read_ladders(path: Path) -> LadderFamily:
    """The ladders in a file; `InputError` says what is refused, and what is allowed."""
    content = structs.asdict(read_as(LaddersFile, read_mapping(path), path))
    levels, ladders = content["levels"], content.pop("ladders")
    ladders = tuple(structs.replace(one, levels=one.levels or levels) for one in ladders)
    return LadderFamily(**content, ladders=ladders, folder=path.resolve().parent)
