"""A point of a study: one case, with the values that it has on each axis put into its file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from msgspec import structs

from ..case.expressions import Expression
from ..case.model import Case
from ..case.reader import parse_case
from ..case.yaml import read_mapping
from .description import Choice, Run, Series, Study, StudyGroup, Value, Values


@dataclass(frozen=True)
class Point:
    """One measurement: `labels` by axis, and of each the number or the named choice behind it."""

    study: Study
    group: StudyGroup
    series: Series
    swapped: bool
    labels: Mapping[str, str]
    numbers: Mapping[str, float | tuple[float, ...]]
    choices: Mapping[str, Choice]

    @property
    def name(self) -> str:
        """Its name within the group."""
        return "/".join([self.line, *(self.labels[axis] for axis in self.numbers)])

    @property
    def line(self) -> str:
        """The series, its direction, and the titles of its choices, where the group has several."""
        several = (
            c.title for axis, c in self.choices.items() if len(self.group.vary.get(axis, ())) != 1
        )
        titles = list(several)
        return ", ".join([self.series.name, *["swapped"] * self.swapped, *titles])

    @property
    def run(self) -> Run:
        """How it is solved: what any of its choices asks for."""
        asked = structs.asdict(self.series.run)
        for choice in self.choices.values():
            other = structs.asdict(choice.run).items()
            asked |= {key: value for key, value in other if value != asked[key]}
        return type(self.series.run)(**asked)

    @property
    def is_beyond(self) -> bool:
        """Whether its value is past the end."""
        return any(value in self.group.beyond for value in self.numbers.values())

    @cached_property
    def source(self) -> str:
        """The text of its case file."""
        content: Any = read_mapping(self.series.case)
        changes = [self.study.change, self.group.change, self.series.change]
        for change in [*changes, *(choice.change for choice in self.choices.values())]:
            content = merged(content, self._at(change, "set"))
        return json.dumps(content, indent=1)

    @cached_property
    def case(self) -> Case:
        """Its case; raises InputError where a value makes it invalid."""
        return parse_case(self.source, self.series.case).as_solved(self.swapped)

    def _at(self, item: Any, key: str) -> Any:
        """The item with every expression replaced by its number."""
        if isinstance(item, Mapping):
            return {name: self._at(part, f"{key}.{name}") for name, part in item.items()}
        if isinstance(item, list):
            return [self._at(part, f"{key}[{i}]") for i, part in enumerate(item)]
        if not (isinstance(item, str) and item.startswith("=")):
            return item
        text = item[1:]
        for axis, value in self.numbers.items():
            names = (
                dict(zip("xyz", value, strict=False)) if isinstance(value, tuple) else {axis: value}
            )
            for name, number in names.items():
                text = re.sub(rf"\b{name}\b", f"({float(number)!r})", text)
        found = float(Expression(text, str(self.series.case), key)(np.zeros((1, 3)))[0])
        # A division or a seed is a whole number.
        return int(found) if found.is_integer() and abs(found) < 1e9 else found


def merged(base: Any, change: Any) -> Any:
    """Mappings merged key by key, a mapping into each item of a list; anything else is replaced."""
    if isinstance(base, list) and isinstance(change, Mapping):
        return [merged(item, change) for item in base]
    if not (isinstance(base, Mapping) and isinstance(change, Mapping)):
        return change
    return {**base, **{key: merged(base.get(key), item) for key, item in change.items()}}


def points_of(study: Study, group: StudyGroup) -> list[Point]:
    """The points of a group, series by series."""
    return [point for series in group.series for point in _of_series(study, group, series)]


def _of_series(study: Study, group: StudyGroup, series: Series) -> Iterator[Point]:
    vary = {axis: _labelled(values) for axis, values in (group.vary | series.vary).items()}
    for swapped in _directions(series):
        for values in product(*(vary[axis].items() for axis in vary)):
            labels = dict(zip(vary, (label for label, _ in values), strict=True))
            chosen = {a: study.axes[a][k] for a, k in labels.items() if k in study.axes.get(a, {})}
            if all(choice.is_for(group, series) for choice in chosen.values()):
                numbers = {a: v for a, (_, v) in zip(vary, values, strict=True) if a not in chosen}
                yield Point(study, group, series, swapped, labels, numbers, chosen)


def _directions(series: Series) -> tuple[bool, ...]:
    """The directions in which a series is solved: whether slave and master are exchanged."""
    which = series.directions or str(read_mapping(series.case).get("directions", "first"))
    return {"first": (False,), "swapped": (True,), "both": (False, True)}.get(which, (False,))


def _labelled(values: Values) -> dict[str, Any]:
    """The values of an axis by what they are called."""
    return dict(values) if isinstance(values, dict) else {_shown(value): value for value in values}


def _shown(value: Value) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return " × ".join(f"{v:g}" for v in value)
    if value != 0 and not 1e-3 <= abs(value) < 1e4:
        mantissa, exponent = f"{value:.9e}".split("e")
        return f"{float(mantissa):g}e{int(exponent)}"
    return f"{value:.10g}"
