"""Sweeps as data: one quantity of a case pushed through its values.

    title: Stiffness ratio across the interface
    breaks: where the answer breaks, and why
    order: 10                               # its place on the page
    state: compression                      # the exact answer: compression or hydrostatic
    values: [1e-8, 1e-4, 1e-2, 1e2, 1e4, 1e8]
    labels: [...]                           # how the values are shown, where not as they are
    quick: [1e-8, 1e8]                      # of the quick version
    beyond: []                              # those past the end, where a clear refusal will do
    directions: first                       # first, swapped or both
    meshes:
      2D: {case: ../base/plane.yaml, set: {materials: {bottom: {young: "=2000*x"}}}}
      3D: {case: ../base/space.yaml, set: {materials: {bottom: {young: "=2000*x"}}}}

`set` is merged into the case file's mapping. A text that starts with `=` is an expression of x, the
value, or of x, y and z where a value is a list.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, field

from ...case.expressions import Expression
from ...case.model import Case
from ...case.reader import parse_case
from ...case.typed import ONCE, FieldError, Section, Text, read_as
from ...case.yaml import read_mapping

HYDROSTATIC = "hydrostatic"
Value = Annotated[
    float | Annotated[tuple[float, ...], Meta(min_length=1, max_length=3)],
    Meta(description="a number, or a list of up to three"),
]
_SWAPS = {"first": (False,), "swapped": (True,), "both": (False, True)}


class _Mesh(Section, frozen=True):
    case: Path
    change: dict[str, Any] = field(name="set")


class SweepFile(Section, frozen=True):
    """The keys of a sweep."""

    title: Text
    breaks: Text
    values: Annotated[
        tuple[Value, ...],
        Meta(
            min_length=6,
            description="a list of at least six numbers, or lists of up to three",
            extra_json_schema={"uniqueItems": True},
        ),
    ]
    quick: Annotated[tuple[Value, ...], ONCE]
    meshes: Annotated[dict[str, _Mesh], Meta(min_length=1)]
    order: Annotated[int, Meta(ge=0, description="a whole number, not negative")] = 0
    state: Literal["compression", "hydrostatic"] = "compression"
    labels: tuple[Text, ...] = ()
    beyond: tuple[Value, ...] = ()
    directions: Literal["first", "swapped", "both"] = "first"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.labels and len(self.labels) != len(self.values):
            raise FieldError(("labels",), f"must be as many as values: {len(self.values)}")
        for key in ("quick", "beyond"):
            for i, value in enumerate(getattr(self, key)):
                if value not in self.values:
                    raise FieldError((key, i), "is not one of the values")


@dataclass(frozen=True)
class SweepSeries:
    """The points of a sweep on one mesh in one direction."""

    mesh: str
    swapped: bool

    @property
    def name(self) -> str:
        """As shown."""
        return f"{self.mesh}, swapped" if self.swapped else self.mesh


@dataclass(frozen=True)
class Sweep:
    """One quantity and the values it takes; `cases` are the mappings of the base cases by mesh."""

    name: str
    path: Path
    title: str
    breaks: str
    order: int
    state: str
    values: tuple[Value, ...]
    labels: tuple[str, ...]
    beyond: tuple[Value, ...]
    series: tuple[SweepSeries, ...]
    cases: Mapping[str, Mapping[str, Any]]
    changes: Mapping[str, Mapping[str, Any]]

    def case(self, mesh: str, value: Value) -> Case:
        """The case at one value; raises InputError where the value makes it invalid."""
        change = _at(self.changes[mesh], value, self.path, f"meshes.{mesh}.set")
        text = json.dumps(_merged(self.cases[mesh], change))
        return parse_case(text, self.path)


def read_sweep(path: Path, quick: bool = False) -> Sweep:
    """The sweep in a file, with all its values or those of the quick version.

    `InputError` says what is refused, and what is allowed.
    """
    content = read_as(SweepFile, read_mapping(path), path)
    labels = content.labels or tuple(map(_shown, content.values))
    shown = dict(zip(content.values, labels, strict=True))
    chosen = content.quick if quick else content.values
    return Sweep(
        name=path.stem,
        path=path,
        title=content.title,
        breaks=" ".join(content.breaks.split()),
        order=content.order,
        state=content.state,
        values=chosen,
        labels=tuple(shown[value] for value in chosen),
        beyond=content.beyond,
        series=tuple(
            SweepSeries(mesh, swapped)
            for mesh in content.meshes
            for swapped in _SWAPS[content.directions]
        ),
        cases={name: read_mapping(item.case) for name, item in content.meshes.items()},
        changes={name: item.change for name, item in content.meshes.items()},
    )


def _shown(value: Value) -> str:
    if isinstance(value, tuple):
        return " × ".join(f"{v:g}" for v in value)
    if value != 0 and not 1e-3 <= abs(value) < 1e4:
        mantissa, exponent = f"{value:.9e}".split("e")
        return f"{float(mantissa):g}e{int(exponent)}"
    return f"{value:.10g}"


def _merged(base: Any, change: Any) -> Any:
    """Mappings merged key by key; anything else is replaced."""
    if not (isinstance(base, Mapping) and isinstance(change, Mapping)):
        return change
    return {**base, **{key: _merged(base.get(key), item) for key, item in change.items()}}


def _at(item: Any, value: Value, where: Path, key: str) -> Any:
    """The item with every expression replaced by its number at the value."""
    if isinstance(item, Mapping):
        return {name: _at(part, value, where, f"{key}.{name}") for name, part in item.items()}
    if isinstance(item, list):
        return [_at(part, value, where, f"{key}[{i}]") for i, part in enumerate(item)]
    if not (isinstance(item, str) and item.startswith("=")):
        return item
    place = np.zeros((1, 3))
    numbers = value if isinstance(value, tuple) else (value,)
    place[0, : len(numbers)] = numbers
    found = float(Expression(item[1:], str(where), key)(place)[0])
    # A division or a seed is a whole number.
    return int(found) if found.is_integer() and abs(found) < 1e9 else found
