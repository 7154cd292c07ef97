"""Refinement ladders as data: `orders.yaml` in the folder of a family of cases.

    title: Contact on a parabola
    levels: [1, 2, 4, 8, 16]      # what the divisions of the case's recipe are multiplied by
    least:                        # slopes that must be reached, by degree of the slave's cells
      linear: {displacement_l2: 1.9, pressure_l2: 0.95}
    theory:                       # where the family's own differs: [guaranteed, best]
      quadratic: {pressure_max: [0.5, 1.0]}
    reference_code: {name: code_aster, version: …, remark: …}
    shortfalls: why some slopes stay below theory, where they do
    ladders:
      - {case: tria3.yaml, reference_code: {displacement_l2: 1.998, pressure_l2: 1.041}}
      - {case: press-fit.yaml, problem: press fit}    # has plots of its own
      - {case: lying.yaml, label: PENTA6 on its side}  # else the slave's cells, and their cut
      - {case: hexa20.yaml, hexahedra: hexahedra, levels: [1, 2, 3, 4]}
      - {case: sphere.yaml, finest: {peak: 0.01}}     # largest error allowed at the finest level

A ladder is solved in every direction of its case.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from solver.case import job_name
from solver.case.descriptions import file_beside
from solver.case.schemas import LADDERS_SCHEMA
from solver.case.yaml import read_mapping

FILE_NAME = "orders.yaml"


@dataclass(frozen=True)
class Ladder:
    """One case file, and what the divisions of its recipe are multiplied by, level by level.

    Ladders of the same `problem` share their plots; `label` tells those of the same cells apart.
    `observed` holds the reference code's own
    slopes by error, `finest` the largest errors allowed at the finest level.
    """

    case: Path
    levels: tuple[int, ...]
    problem: str = ""
    label: str = ""
    hexahedra: str | None = None
    observed: Mapping[str, float] = field(default_factory=dict)
    finest: Mapping[str, float] = field(default_factory=dict)

    def folder(self, swapped: bool) -> str:
        """The name of the folder in which the results of one direction lie."""
        return job_name(self.case.stem, swapped, self.hexahedra)


@dataclass(frozen=True)
class ReferenceCode:
    """The code whose slopes are shown beside ours."""

    name: str = "reference code"
    version: str = ""
    remark: str = ""


@dataclass(frozen=True)
class Family:
    """The ladders of a family.

    `least` and `theory` go by degree ("linear", "quadratic") and error; `theory` holds only what
    differs from `orders.THEORY`. `shortfalls` says why slopes stay below theory. Where `title` or
    `description` is empty, `family.yaml` has it.
    """

    folder: Path
    title: str
    description: str
    ladders: tuple[Ladder, ...]
    least: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    theory: Mapping[str, Mapping[str, list[float | None]]] = field(default_factory=dict)
    reference_code: ReferenceCode = field(default_factory=ReferenceCode)
    shortfalls: str = ""

    @property
    def name(self) -> str:
        """The family's name: that of its folder."""
        return self.folder.name


def read_ladders(path: Path) -> Family:
    """The ladders in a file; `InputError` says what is refused, and what is allowed."""
    content = read_mapping(path, LADDERS_SCHEMA)
    return Family(
        folder=path.resolve().parent,
        title=content.get("title", ""),
        description=content.get("description", ""),
        ladders=tuple(_ladder(path, content, i) for i in range(len(content["ladders"]))),
        least=content.get("least", {}),
        theory=content.get("theory", {}),
        reference_code=ReferenceCode(**content.get("reference_code", {})),
        shortfalls=content.get("shortfalls", ""),
    )


def _ladder(path: Path, content: Mapping[str, Any], index: int) -> Ladder:
    item = content["ladders"][index]
    return Ladder(
        case=file_beside(path, f"ladders[{index}].case", item["case"]),
        levels=tuple(item.get("levels", content["levels"])),
        problem=item.get("problem", ""),
        label=item.get("label", ""),
        hexahedra=item.get("hexahedra"),
        observed=item.get("reference_code", {}),
        finest=item.get("finest", {}),
    )
