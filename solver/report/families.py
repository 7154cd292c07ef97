"""What a family of cases tells about itself: `family.yaml` in the folder of its case files.

title: A block on a rigid parabola
description: What it shows, in a few sentences.
order: 2                       # its place in the report; families without one come last, by name
problem: |
  What is solved: bodies, materials, supports, loads.
reference: |
  Where the right answer comes from. A paragraph whose lines are all indented is a formula:

      p(x) = E (c + κ x²)
figures:                       # the solves whose pressure is drawn along the interface;
  - {job: block-quad8}         # left out: the first of each kind of reference and dimension
  - {job: block-hexa8, along: sqrt(x**2 + y**2), caption: what to look at}
reference_code:                # another code's own errors, drawn beside those of the solves
  - {name: code_aster, version: "14.6", error: 4.0e-13, remark: most cases}
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from solver.case.expressions import Expression
from solver.case.schemas import FAMILY_SCHEMA
from solver.case.yaml import read_mapping
from solver.system.errors import InputError

FILE_NAME = "family.yaml"
# Pages of the report that are no family's: a family of that name has its page under another.
_TAKEN = (
    "index",
    "summary",
    "compare",
    "orders",
    "workflow",
    "study",
    "stability",
    "scaling",
    "benchmark",
)


@dataclass(frozen=True)
class Figure:
    """A solve whose pressure is drawn along the interface, over `along` where that is given."""

    job: str
    along: Expression | None = None
    caption: str = ""


@dataclass(frozen=True)
class Family:
    """A family as its page shows it; `complaint` says what its file is refused for.

    `reference_code` holds another code's own errors: name, version, error, remark.
    """

    name: str
    title: str
    description: str = ""
    order: float = math.inf
    problem: str = ""
    reference: str = ""
    figures: tuple[Figure, ...] = ()
    reference_code: Sequence[Mapping[str, Any]] = ()
    complaint: str = ""


def read_family(file: Path) -> Family:
    """The family of a file; under its folder's name alone where the file is missing or refused."""
    name = file.resolve().parent.name
    if not file.is_file():
        return Family(name, name)
    try:
        content = read_mapping(file, FAMILY_SCHEMA)
        content["figures"] = tuple(
            _figure(file, i, item) for i, item in enumerate(content.get("figures", []))
        )
    except InputError as error:
        return Family(name, name, complaint=str(error))
    return Family(name, **content)


def _figure(file: Path, index: int, item: Mapping[str, str]) -> Figure:
    text, key = item.get("along"), f"figures[{index}].along"
    along = Expression(text, where=str(file), key=key) if text else None
    return Figure(item["job"], along, item.get("caption", ""))


def page_name(family: str) -> str:
    """The file name of a family's page."""
    plain = re.sub(r"[/\\\0]", "_", family)
    return f"{'family-' if plain in _TAKEN else ''}{plain}.html"


def paragraphs(text: str) -> list[tuple[bool, str]]:
    """The paragraphs of a text, each with whether it is a formula: all its lines indented."""
    found = []
    for part in re.split(r"\n[ \t]*\n", text):
        lines = [line for line in part.split("\n") if line.strip()]
        if lines:
            formula = all(line.startswith("    ") for line in lines)
            found.append((formula, "\n".join(line.strip() for line in lines)))
    return found
