"""The description of a family of cases: `family.yaml` in the folder of its case files.

title: A block on a rigid parabola
description: What it shows, in a few sentences.
group: Patch tests             # families of a group are shown together
order: 2                       # its place in the report; families without one come last, by name
problem: |
  What is solved: bodies, materials, supports, loads.
reference: |
  Where the right answer comes from. A paragraph whose lines are all indented is a formula:

      p(x) = E (c + κ x²)
tolerance: What the tolerances of the cases are made of.
figures:                       # the solves whose pressure is drawn along the interface;
  - {job: block-quad8}         # left out: the first of each kind of reference and dimension
  - {job: block-hexa8, along: sqrt(x**2 + y**2), caption: what to look at}
paths:                         # solves whose largest pressures are drawn over the steps, together
  - {jobs: [block-slides, block-slides-nodal], caption: what to look at}
reference_code:                # another code's own errors, drawn beside the solves' errors
  - {name: code_aster, version: "14.6", error: 4.0e-13, remark: most cases}
  - {name: code_aster, version: "14.6", error: 2.4e-9, slave: [HEXA8],
     remark: on other cells}
"""

import math
import re
from pathlib import Path
from typing import Annotated

from msgspec import Meta, structs

from ..case.expressions import Expression
from ..case.typed import Positive, Section, Text, Version, read_as
from ..case.yaml import read_mapping
from ..system.errors import InputError

FILE_NAME = "family.yaml"
# Pages of the report that are no family's, also with a dash and more (`study-quick`): a family of
# such a name has its page under another.
_TAKEN = {"index", "summary", "bench", "compare", "workflow"} | {
    *("orders", "study", "stability", "infsup", "scaling", "benchmark"),
}


class Figure(Section, frozen=True):
    """A solve whose pressure is drawn along the interface, over `along` where it is given."""

    job: Annotated[str, Meta(description="the name of a solve, as in the report")]
    along: Annotated[str, Meta(min_length=1, description="an expression in x, y, z, r")] | None = (
        None
    )
    caption: str = ""

    @property
    def expression(self) -> Expression | None:
        """`along` as a function of position."""
        return Expression(self.along) if self.along else None


class Along(Section, frozen=True):
    """Solves whose largest pressures are drawn over the steps, in one chart."""

    jobs: Annotated[tuple[str, ...], Meta(min_length=1, description="names of solves")]
    caption: str = ""


class CodeError(Section, frozen=True):
    """Another code's own error.

    Of solves with `slave` cells of these types on other cells; of all others where none is named.
    """

    name: str
    version: Version
    error: Positive
    remark: str = ""
    slave: tuple[str, ...] = ()

    def applies(self, slave: set[str], master: set[str]) -> bool:
        """Whether it is the error of a solve with these cell types."""
        return not self.slave or (slave <= set(self.slave) and slave != master)


class FamilyFile(Section, frozen=True):
    """The keys of `family.yaml`."""

    title: Text
    description: str = ""
    group: Text = "Other families"
    order: Annotated[int, Meta(description="a whole number: the place in the report")] | None = None
    problem: str = ""
    reference: str = ""
    tolerance: str = ""
    figures: tuple[Figure, ...] = ()
    paths: tuple[Along, ...] = ()
    reference_code: tuple[CodeError, ...] = ()


class Family(FamilyFile, frozen=True, kw_only=True):
    """A family as its page shows it; `refusal` says why its file is refused."""

    name: str
    refusal: str = ""

    @property
    def place(self) -> float:
        """Its place in the report: after all others where none is given."""
        return math.inf if self.order is None else self.order


def read_family(file: Path) -> Family:
    """The family of a file; its folder's name alone where the file is missing or refused."""
    name = file.resolve().parent.name
    if not file.is_file():
        return Family(name, name=name)
    try:
        content = read_as(FamilyFile, read_mapping(file), file)
        for i, figure in enumerate(content.figures):
            if figure.along:
                Expression(figure.along, where=str(file), key=f"figures[{i}].along")
    except InputError as error:
        return Family(name, name=name, refusal=str(error))
    return Family(**structs.asdict(content), name=name)


def page_name(family: str) -> str:
    """The file name of a family's page."""
    plain = re.sub(r"[/\\\0]", "_", family)
    return f"{'family-' if plain.split('-')[0] in _TAKEN else ''}{plain}.html"


def paragraphs(text: str) -> list[tuple[bool, str]]:
    """The paragraphs of a text, each with whether it is a formula: all its lines indented."""
    found = []
    for part in re.split(r"\n[ \t]*\n", text):
        lines = [line for line in part.split("\n") if line.strip()]
        if lines:
            formula = all(line.startswith("    ") for line in lines)
            found.append((formula, "\n".join(line.strip() for line in lines)))
    return found
