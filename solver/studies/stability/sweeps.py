"""Sweeps as data: one quantity of a case pushed through its values.

    title: Stiffness ratio across the interface
    breaks: where the answer breaks, and why
    order: 10                               # its place on the page
    state: compression                      # the exact answer: compression or hydrostatic
    values: [1e-8, 1e-4, 1e-2, 1e2, 1e4, 1e8]
    labels: [...]                           # how the values are shown, where not as they are
    quick: [1e-8, 1e8]                      # those of the quick version
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
from typing import Any

import numpy as np

from solver.case.descriptions import file_beside
from solver.case.expressions import Expression
from solver.case.model import Case
from solver.case.reader import parse_case
from solver.case.schemas import SWEEP_SCHEMA
from solver.case.yaml import read_mapping
from solver.system.errors import InputError

COMPRESSION, HYDROSTATIC = "compression", "hydrostatic"
Value = float | list[float]


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
    content = read_mapping(path, SWEEP_SCHEMA)
    values, labels = content["values"], content.get("labels")
    if labels is not None and len(labels) != len(values):
        raise InputError(path, "labels", len(labels), f"must be as many as values: {len(values)}")
    shown = dict(zip(map(str, values), labels or map(_shown, values), strict=True))
    for key in ("quick", "beyond"):
        for value in content.get(key, []):
            if value not in values:
                raise InputError(path, key, value, "is none of the values")
    chosen = content["quick"] if quick else values
    directions = {"first": [False], "swapped": [True], "both": [False, True]}
    return Sweep(
        name=path.stem,
        path=path,
        title=content["title"],
        breaks=" ".join(content["breaks"].split()),
        order=content.get("order", 0),
        state=content.get("state", COMPRESSION),
        values=tuple(chosen),
        labels=tuple(shown[str(value)] for value in chosen),
        beyond=tuple(content.get("beyond", [])),
        series=tuple(
            SweepSeries(mesh, swapped)
            for mesh in content["meshes"]
            for swapped in directions[content.get("directions", "first")]
        ),
        cases={name: _base(path, name, item) for name, item in content["meshes"].items()},
        changes={name: item["set"] for name, item in content["meshes"].items()},
    )


def _base(path: Path, name: str, item: Mapping[str, Any]) -> dict[str, Any]:
    return read_mapping(file_beside(path, f"meshes.{name}.case", item["case"]))


def _shown(value: Value) -> str:
    if isinstance(value, list):
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
    numbers = value if isinstance(value, list) else [value]
    place[0, : len(numbers)] = numbers
    found = float(Expression(item[1:], str(where), key)(place)[0])
    # A division or a seed is a whole number.
    return int(found) if found.is_integer() and abs(found) < 1e9 else found
