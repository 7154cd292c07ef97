"""A point of a study: one case, with the values that it has on each axis put into its file."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import structs

from ..case.expressions import Expression
from ..case.model import Case
from ..case.reader import parse_case
from ..case.yaml import read_mapping

if TYPE_CHECKING:
    from .description import Choice, Run, Series, Study, StudyGroup


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
